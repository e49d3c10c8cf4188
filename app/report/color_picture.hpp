/// The map in the colours that the colour camera saw.
#pragma once

#include "algorithms/mapping/map_planes.hpp"
#include "app/report/run_record.hpp"

namespace firstlook {

/// The map in parallel projection, each occupied voxel in its mean colour and grey where the colour camera did not see
/// it. Walls seen from behind are left out, so that the picture looks into the room.
[[nodiscard]] MapPicture color_picture(const VoxelMap& map, const ColorPlane& colors, const MapObjects& objects,
                                       double azimuth_rad, std::string caption);

/// From behind and from the front, as the report's other pictures.
[[nodiscard]] std::vector<MapPicture> color_pictures(const VoxelMap& map, const ColorPlane& colors,
                                                     const MapObjects& objects);

}  // namespace firstlook
