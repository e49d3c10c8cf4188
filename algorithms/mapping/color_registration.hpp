/// Which pixel of a colour picture shows the point that a depth pixel sees, and its colour for the voxel it hit.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "algorithms/mapping/depth_rays.hpp"
#include "algorithms/mapping/map_planes.hpp"

namespace firstlook {

/// A colour camera beside a depth camera.
struct ColorSensor {
  CameraIntrinsics intrinsics;
  Transform<Camera, Depth> camera_T_depth;
};

/// A colour picture, row by row. Its size is that of the colour camera, whatever the depth camera's is.
using ColorImage = ImageView<const Rgb>;

/// Colours the voxels that frames of one depth sensor hit. All memory is taken at construction.
class ColorRegistration {
 public:
  /// @param intrinsics  of the colour camera, for its size; a calibration may refine the rest
  ColorRegistration(const GridGeometry& geometry, const DepthSensor& sensor, const CameraIntrinsics& intrinsics);
  [[nodiscard]] static std::size_t required_bytes(const DepthSensor& sensor, const CameraIntrinsics& intrinsics);

  /// Adds the colour of each point that hit a voxel, at the pixel nearest to its image. Points outside the picture give
  /// none, nor do those that the colour camera cannot see because the depth camera saw something clearly nearer in its
  /// line of sight, the arm's own body included.
  /// @param depth, base_T_depth, self_depth_m  as Inserter::insert() has taken them
  /// @param camera  where the colour camera was when it took the picture, seen from where the depth camera was
  /// @param colors  the picture; has the size of the intrinsics
  /// @param hit     the voxels that the frame hit, Inserter::hit(): points elsewhere (of a ground plane) give none
  /// @return how many points gave their colour
  std::uint32_t add(ColorPlane& plane, const DepthImage& depth, const Transform<Base, Depth>& base_T_depth,
                    std::span<const float> self_depth_m, const ColorSensor& camera, const ColorImage& colors,
                    std::span<const std::uint64_t> hit);

 private:
  /// A point as the colour camera sees it; column -1: not in the picture.
  struct Seen {
    int column = -1, row = -1;
    float depth_m = 0;
  };
  [[nodiscard]] Seen see(const ColorSensor& camera, int u, int v, double depth_m) const;
  [[nodiscard]] float& nearest(const Seen& seen);
  void find_nearest(const DepthImage& depth, const ColorSensor& camera);

  GridGeometry geometry_;
  int width_, height_;  ///< of the picture
  DepthRays rays_;
  int cell_px_ = 1;             ///< side of a cell of the picture, wide enough that no cell falls between depth pixels
  int columns_ = 0;             ///< cells in a row
  std::vector<float> nearest_;  ///< what the depth camera sees nearest to the colour camera, for each cell
};

}  // namespace firstlook
