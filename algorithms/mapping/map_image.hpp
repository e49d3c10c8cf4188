/// Pictures of the map for the report.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "algorithms/mapping/voxel_map.hpp"
#include "platform/core/function_ref.hpp"

namespace firstlook {

/// Row-major RGB pixels of the caller, three bytes each.
struct RgbImage {
  std::uint8_t* data = nullptr;
  int width = 0;
  int height = 0;
};

/// A rectangle of base, seen from above: x to the right, y up.
struct SliceWindow {
  Eigen::Vector2d low_m = Eigen::Vector2d::Zero();
  Eigen::Vector2d high_m = Eigen::Vector2d::Zero();

  /// The whole of a grid.
  [[nodiscard]] static SliceWindow of(const GridGeometry& geometry);
  /// Where a point of base lies in a picture of the window, px; (0, 0) is the centre of the upper left pixel.
  [[nodiscard]] Eigen::Vector2d pixel(const Eigen::Vector2d& point_m, int width, int height) const;
};

/// One horizontal layer seen from above: occupied dark, free light, unknown in the reach of the arm in the colour of
/// draw_map's veil, other unknown grey.
/// @param z_m   height of the layer; outside the grid everything is unknown
/// @param zone  one byte for each voxel, not 0 inside the reach of the arm; empty: everywhere
void draw_slice(const VoxelMap& map, double z_m, const SliceWindow& window, std::span<const std::uint8_t> zone,
                RgbImage image);

/// Where the picture is taken from (parallel projection): it looks at `target_m`.
struct Viewpoint {
  double azimuth_rad = -2.2;  ///< of the eye about z, seen from the target
  double elevation_rad = 0.6;
  Eigen::Vector3d target_m = Eigen::Vector3d::Zero();
  double width_m = 1;  ///< how much of the scene the picture's width spans

  /// Shows the box from `low_m` to `high_m` whole, in a picture of width by height px, with `border_px` around it.
  [[nodiscard]] static Viewpoint seeing(const Eigen::Vector3d& low_m, const Eigen::Vector3d& high_m, double azimuth_rad,
                                        double elevation_rad, int width, int height, double border_px);
};

/// Which point belongs to a pixel and which pixel to a point of base. (0, 0) is the centre of the upper left pixel.
class MapProjection {
 public:
  MapProjection(const Viewpoint& viewpoint, int width, int height);
  [[nodiscard]] Eigen::Vector2d pixel(const Eigen::Vector3d& point_m) const;
  /// The point of the plane through the target that a pixel shows.
  [[nodiscard]] Eigen::Vector3d through(int column, int row) const;
  /// Direction of sight, away from the eye.
  [[nodiscard]] const Eigen::Vector3d& into() const { return into_; }
  [[nodiscard]] double m_per_px() const { return m_per_px_; }

 private:
  Eigen::Vector3d right_, up_, into_;
  Eigen::Vector3d target_m_;
  double m_per_px_;
  double center_column_, center_row_;
};

inline constexpr double kFloorLines_m = 0.5;  ///< distance of the lines on the floor of draw_map

/// The map in parallel projection, on a floor with lines every kFloorLines_m: occupied voxels coloured by height and
/// shaded by face, and where `zone` is not empty the unknown ones inside it as a translucent veil.
void draw_map(const VoxelMap& map, const Viewpoint& viewpoint, std::span<const std::uint8_t> zone, RgbImage image);

/// The colour of an occupied voxel before its faces are shaded; empty: it is looked through.
using VoxelColor = FunctionRef<std::optional<std::array<std::uint8_t, 3>>(std::size_t index)>;
void draw_map(const VoxelMap& map, const Viewpoint& viewpoint, std::span<const std::uint8_t> zone, VoxelColor color_of,
              RgbImage image);

}  // namespace firstlook
