/// A map as files, streamed: what a run and `firstlook map` leave behind.
#pragma once

#include <span>
#include <string>

#include "algorithms/mapping/byte_sink.hpp"
#include "algorithms/mapping/map_planes.hpp"
#include "algorithms/mapping/voxel_map.hpp"
#include "app/dataset/dataset_mapping.hpp"
#include "platform/core/function_ref.hpp"
#include "platform/core/result.hpp"

namespace firstlook {

/// A file that a writer streams into, whole or not at all. Error: kDiskWrite.
[[nodiscard]] Status write_streamed(const std::string& path, FunctionRef<void(ByteSink)> write);

/// collision_map.bt, map.ot (cut at `depth`, 1..16) and map.ply with the planes in a folder, which is made; with
/// colours color_map.ot, too, a ColorOcTree. Error: kDiskWrite.
[[nodiscard]] Status write_map_files(const std::string& folder, const VoxelMap& map, int depth,
                                     const MapPlanes& planes = {});

/// frames.csv: a row for each line of depth.txt with the counts of the whole map after it (`unknown,free,occupied`),
/// the points that went in, and why it was refused (empty when it was not).
[[nodiscard]] std::string frames_csv(std::span<const FrameOutcome> frames);

}  // namespace firstlook
