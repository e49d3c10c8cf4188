/// Map and calibration as tables, for programs that read nothing else. Metres, base; the first line names the columns.
#pragma once

#include <span>
#include <string>

#include "algorithms/mapping/byte_sink.hpp"
#include "algorithms/mapping/map_planes.hpp"
#include "algorithms/mapping/objects.hpp"
#include "app/dataset/hand_eye_file.hpp"

namespace firstlook {

/// A row for each known voxel: centre, class (free, occupied), log-odds as OctoMap has them; of the planes that there
/// are red, green and blue, object and shape, sensor, each empty where nothing is known.
void write_voxels_csv(const VoxelMap& map, ByteSink sink, const MapPlanes& planes = {});

/// A row for each box: its corners.
[[nodiscard]] std::string boxes_csv(std::span<const AxisBox> boxes);

/// A row for each object: id, shape, bounds_room (0 or 1), voxels, its box.
[[nodiscard]] std::string objects_csv(const MapObjects& objects);

/// One row: pose of the camera in the flange with its sigmas along and about the flange's axes.
[[nodiscard]] std::string hand_eye_csv(const StoredCalibration& calibration);

}  // namespace firstlook
