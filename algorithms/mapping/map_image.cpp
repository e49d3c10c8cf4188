#include "algorithms/mapping/map_image.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "algorithms/mapping/height_color.hpp"
#include "platform/core/ensure.hpp"

namespace firstlook {
namespace {

using Color = std::array<double, 3>;

constexpr Color kBackground = {255, 255, 255};
constexpr Color kFloor = {243, 245, 247};
constexpr Color kFloorLine = {214, 219, 225};
constexpr Color kSliceUnknown = {188, 192, 199};
constexpr Color kSliceFree = {247, 249, 244};
constexpr Color kSliceOccupied = {36, 40, 48};
constexpr Color kVeil = {141, 106, 186};  // unknown in the reach of the arm, in every kind of picture
constexpr double kVeilOpacity = 0.03;     // of one unknown voxel: 20 of them hide half

void put(RgbImage image, int column, int row, const Color& color) {
  if (column < 0 || row < 0 || column >= image.width || row >= image.height) return;
  const std::size_t at =
      3 * (static_cast<std::size_t>(row) * static_cast<std::size_t>(image.width) + static_cast<std::size_t>(column));
  for (std::size_t i = 0; i < 3; ++i) image.data[at + i] = static_cast<std::uint8_t>(std::clamp(color[i], 0.0, 255.0));
}

/// What a line of sight meets below all voxels: the floor of the grid with its lines, or nothing.
Color ground(const GridGeometry& g, const Eigen::Vector3d& point_m, const Eigen::Vector3d& direction, double m_per_px) {
  if (direction.z() > -1e-9) return kBackground;
  const Eigen::Vector3d low = g.first.cast<double>() * g.resolution_m;
  const Eigen::Vector3d high = (g.first + g.size).cast<double>() * g.resolution_m;
  const Eigen::Vector3d at = point_m + (low.z() - point_m.z()) / direction.z() * direction;
  double line = 0;
  for (int axis = 0; axis < 2; ++axis) {
    if (at[axis] < low[axis] || at[axis] > high[axis]) return kBackground;
    const double off_m = std::abs(at[axis] - std::round(at[axis] / kFloorLines_m) * kFloorLines_m);
    line = std::max(line, std::clamp(1.2 - off_m / m_per_px, 0.0, 1.0));
  }
  Color color;
  for (std::size_t i = 0; i < 3; ++i) color[i] = kFloor[i] + line * (kFloorLine[i] - kFloor[i]);
  return color;
}

// Light from above and from the side: top faces bright, faces across y darkest.
double face_brightness(int axis) { return axis == 2 ? 1.0 : axis == 0 ? 0.82 : 0.66; }

// Follows one line of sight through the grid: veil of unknown voxels in front of the first occupied one or the floor.
Color look(const VoxelMap& map, std::span<const std::uint8_t> zone, VoxelColor color_of, const Eigen::Vector3d& point_m,
           const Eigen::Vector3d& direction, double m_per_px) {
  const GridGeometry& g = map.geometry();
  const Eigen::Vector3d origin = point_m / g.resolution_m - g.first.cast<double>();
  double enter = -std::numeric_limits<double>::infinity(), leave = -enter;
  int face = 2;
  for (int axis = 0; axis < 3; ++axis) {
    const double d = direction[axis];
    if (std::abs(d) < 1e-12) {
      if (origin[axis] < 0 || origin[axis] >= g.size[axis]) return kBackground;
      continue;
    }
    const double a = -origin[axis] / d, b = (g.size[axis] - origin[axis]) / d;
    if (std::min(a, b) > enter) face = axis;
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  Color color{};
  double transparency = 1;
  const auto over = [&](const Color& behind, double opacity) {
    for (std::size_t i = 0; i < 3; ++i) color[i] += transparency * opacity * behind[i];
    transparency *= 1 - opacity;
  };
  if (enter < leave) {
    const Eigen::Vector3d entry = origin + enter * direction;
    Eigen::Vector3i v;
    Eigen::Vector3d next, delta;
    for (int axis = 0; axis < 3; ++axis) {
      v[axis] = std::clamp(static_cast<int>(std::floor(entry[axis])), 0, g.size[axis] - 1);
      const double d = direction[axis];
      const bool flat = std::abs(d) < 1e-12;
      next[axis] =
          flat ? std::numeric_limits<double>::infinity() : ((d > 0 ? v[axis] + 1 : v[axis]) - origin[axis]) / d;
      delta[axis] = flat ? std::numeric_limits<double>::infinity() : 1 / std::abs(d);
    }
    const std::ptrdiff_t strides[3] = {1, g.size.x(), std::ptrdiff_t{g.size.x()} * g.size.y()};
    auto at = static_cast<std::ptrdiff_t>(g.index(v));
    for (bool inside = true; inside;) {
      const auto index = static_cast<std::size_t>(at);
      const VoxelClass voxel_class = map.voxel_class(index);
      const auto base = voxel_class == VoxelClass::kOccupied ? color_of(index) : std::nullopt;
      if (base) {
        const double light = face_brightness(face);
        over({(*base)[0] * light, (*base)[1] * light, (*base)[2] * light}, 1);
        return color;
      }
      if (voxel_class == VoxelClass::kUnknown && !zone.empty() && zone[index] != 0) over(kVeil, kVeilOpacity);
      face = next[0] <= next[1] && next[0] <= next[2] ? 0 : next[1] <= next[2] ? 1 : 2;
      const int step = direction[face] > 0 ? 1 : -1;
      v[face] += step;
      at += step * strides[face];
      next[face] += delta[face];
      inside = v[face] >= 0 && v[face] < g.size[face];
    }
  }
  over(ground(g, point_m, direction, m_per_px), 1);
  return color;
}

}  // namespace

SliceWindow SliceWindow::of(const GridGeometry& g) {
  return {(g.first.cast<double>() * g.resolution_m).head<2>(),
          ((g.first + g.size).cast<double>() * g.resolution_m).head<2>()};
}

Eigen::Vector2d SliceWindow::pixel(const Eigen::Vector2d& point_m, int width, int height) const {
  return {(point_m.x() - low_m.x()) / (high_m.x() - low_m.x()) * width - 0.5,
          (high_m.y() - point_m.y()) / (high_m.y() - low_m.y()) * height - 0.5};
}

void draw_slice(const VoxelMap& map, double z_m, const SliceWindow& window, std::span<const std::uint8_t> zone,
                RgbImage image) {
  ENSURE(3081, image.data != nullptr && image.width > 0 && image.height > 0);
  ENSURE(3084, zone.empty() || zone.size() == map.size());
  const GridGeometry& g = map.geometry();
  const Eigen::Vector2d px_m = (window.high_m - window.low_m).array() / Eigen::Array2d(image.width, image.height);
  for (int row = 0; row < image.height; ++row) {
    for (int column = 0; column < image.width; ++column) {
      const Eigen::Vector3i v =
          g.voxel({window.low_m.x() + (column + 0.5) * px_m.x(), window.high_m.y() - (row + 0.5) * px_m.y(), z_m});
      Color color = kSliceUnknown;
      if (g.contains(v)) {
        const std::size_t index = g.index(v);
        const VoxelClass c = map.voxel_class(index);
        color = c == VoxelClass::kFree             ? kSliceFree
                : c == VoxelClass::kOccupied       ? kSliceOccupied
                : zone.empty() || zone[index] != 0 ? kVeil
                                                   : kSliceUnknown;
      }
      put(image, column, row, color);
    }
  }
}

Viewpoint Viewpoint::seeing(const Eigen::Vector3d& low_m, const Eigen::Vector3d& high_m, double azimuth_rad,
                            double elevation_rad, int width, int height, double border_px) {
  ENSURE(3085, width > 2 * border_px && height > 2 * border_px);
  Viewpoint viewpoint{azimuth_rad, elevation_rad, (low_m + high_m) / 2, 1};
  // How far the corners spread in the picture, in m to either side of the target: the box is symmetric about it.
  const MapProjection unit(viewpoint, 1, 1);
  Eigen::Vector2d spread_m = Eigen::Vector2d::Zero();
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d p((corner & 1) != 0 ? low_m.x() : high_m.x(), (corner & 2) != 0 ? low_m.y() : high_m.y(),
                            (corner & 4) != 0 ? low_m.z() : high_m.z());
    spread_m = spread_m.cwiseMax(unit.pixel(p).cwiseAbs() * unit.m_per_px());
  }
  const double m_per_px =
      std::max(2 * spread_m.x() / (width - 2 * border_px), 2 * spread_m.y() / (height - 2 * border_px));
  viewpoint.width_m = m_per_px * width;
  return viewpoint;
}

MapProjection::MapProjection(const Viewpoint& view, int width, int height) : target_m_(view.target_m) {
  const double ca = std::cos(view.azimuth_rad), sa = std::sin(view.azimuth_rad);
  const double ce = std::cos(view.elevation_rad), se = std::sin(view.elevation_rad);
  into_ = Eigen::Vector3d(-ca * ce, -sa * ce, -se);
  right_ = Eigen::Vector3d(-sa, ca, 0);
  up_ = right_.cross(into_);
  m_per_px_ = view.width_m / width;
  center_column_ = (width - 1) / 2.0;
  center_row_ = (height - 1) / 2.0;
}

Eigen::Vector3d MapProjection::through(int column, int row) const {
  return target_m_ + m_per_px_ * ((column - center_column_) * right_ - (row - center_row_) * up_);
}

Eigen::Vector2d MapProjection::pixel(const Eigen::Vector3d& point_m) const {
  const Eigen::Vector3d d = point_m - target_m_;
  return {center_column_ + d.dot(right_) / m_per_px_, center_row_ - d.dot(up_) / m_per_px_};
}

void draw_map(const VoxelMap& map, const Viewpoint& viewpoint, std::span<const std::uint8_t> zone, RgbImage image) {
  const GridGeometry& g = map.geometry();
  const auto by_height = [&g](std::size_t index) {
    return std::optional(height_color((g.voxel_at(index).z() + 0.5) / g.size.z()));
  };
  draw_map(map, viewpoint, zone, by_height, image);
}

void draw_map(const VoxelMap& map, const Viewpoint& viewpoint, std::span<const std::uint8_t> zone, VoxelColor color_of,
              RgbImage image) {
  ENSURE(3082, image.data != nullptr && image.width > 0 && image.height > 0);
  ENSURE(3083, zone.empty() || zone.size() == map.size());
  const MapProjection projection(viewpoint, image.width, image.height);
  for (int row = 0; row < image.height; ++row) {
    for (int column = 0; column < image.width; ++column) {
      put(image, column, row,
          look(map, zone, color_of, projection.through(column, row), projection.into(), projection.m_per_px()));
    }
  }
}

}  // namespace firstlook
