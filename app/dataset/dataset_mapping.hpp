/// A map from recorded depth frames: what can be used goes in, the rest is named and counted.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "algorithms/mapping/insertion.hpp"
#include "app/dataset/mapping_dataset.hpp"
#include "platform/core/function_ref.hpp"

namespace firstlook {

/// Log-odds and two bit planes of an offline map: 320 MiB at most. Insertion counts eighths of voxels in 31 bits.
inline constexpr std::size_t kOfflineVoxelsMax = (std::size_t{1} << 28) - 1;

/// Beyond these a whole frame's median says that the depth scale is wrong (by 1000, or another sensor's), not that a
/// wall is that near or far.
inline constexpr double kMedianDepthMin_m = 0.02, kMedianDepthMax_m = 100;

struct DatasetMappingOptions {
  double resolution_m = 0.05;
  double range_max_m = 5.0;                ///< rays are cut here
  std::optional<Eigen::Vector3d> place_m;  ///< a place whose voxel is watched
};

/// What became of one line of depth.txt.
struct FrameOutcome {
  int line = 0;
  double stamp_s = 0;
  std::string image;
  std::string refused;  ///< the reason; empty when it went in
  InsertionResult inserted;
  std::uint32_t pixels_saturated = 0;  ///< of 65535: taken as no return
  VoxelCounts voxels;                  ///< of the whole map, after it
};

/// When the voxel of a place was seen.
struct PlaceSeen {
  std::size_t frames = 0;  ///< that passed or hit it
  std::size_t frames_hit = 0;
  std::optional<double> last_seen_s, last_hit_s;  ///< stamps of depth.txt
};

struct DatasetMap {
  VoxelMap map;
  std::vector<FrameOutcome> frames;  ///< every line of depth.txt, in the order in which they were taken
  PlaceSeen place;
  [[nodiscard]] std::size_t refused() const;
};

/// Maps a dataset into a grid that is fitted to its rays. Refused and counted are frames of another size than
/// camera_info.yaml's, without a return or with a median depth that cannot be, unreadable pictures, poses out of the
/// keys' reach, and what the dataset itself refused.
/// @param report  is called after each frame
/// @return kMapTooLarge with the numbers; kDataMalformed with the first reason when no frame is left
[[nodiscard]] Result<DatasetMap> map_dataset(const MappingDataset& dataset, const DatasetMappingOptions& options,
                                             FunctionRef<void(const FrameOutcome&)> report);

}  // namespace firstlook
