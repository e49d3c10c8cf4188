/// Pictures of the map for the report.
#pragma once

#include <cstdint>
#include <span>

#include "algorithms/mapping/voxel_map.hpp"

namespace firstlook {

/// Row-major RGB pixels of the caller, three bytes each.
struct RgbImage {
  std::uint8_t* data = nullptr;
  int width = 0;
  int height = 0;
};

/// One horizontal layer seen from above, x to the right, y up, scaled to fit: occupied dark, free light, unknown grey.
/// @param z_m  height of the layer; outside the grid everything is unknown
void draw_slice(const VoxelMap& map, double z_m, RgbImage image);

/// Where the picture is taken from: it looks at `target_m`.
struct Viewpoint {
  double azimuth_rad = -2.2;  ///< of the eye about z, seen from the target
  double elevation_rad = 0.6;
  Eigen::Vector3d target_m = {0, 0, 0.4};
  double width_m = 3.6;  ///< how much of the scene the picture's width spans (parallel projection)
};

/// The map in parallel projection: occupied voxels coloured by height and shaded by face, and where `zone` is not empty
/// the unknown ones inside it as a translucent veil; `views_m` (positions of the camera in base, in order) as dots on a
/// path.
void draw_map(const VoxelMap& map, const Viewpoint& viewpoint, std::span<const std::uint8_t> zone,
              std::span<const Eigen::Vector3d> views_m, RgbImage image);

}  // namespace firstlook
