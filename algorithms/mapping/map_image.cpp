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

constexpr Color kBackground = {250, 250, 252};
constexpr Color kSliceUnknown = {168, 174, 184};
constexpr Color kSliceFree = {244, 247, 240};
constexpr Color kSliceOccupied = {36, 40, 48};
constexpr Color kVeil = {120, 130, 160};
constexpr Color kPathLine = {40, 40, 40};
constexpr Color kViewDot = {214, 39, 40};
constexpr double kVeilOpacity = 0.03;  // of one unknown voxel: 20 of them hide half

void put(RgbImage image, int column, int row, const Color& color) {
  if (column < 0 || row < 0 || column >= image.width || row >= image.height) return;
  const std::size_t at =
      3 * (static_cast<std::size_t>(row) * static_cast<std::size_t>(image.width) + static_cast<std::size_t>(column));
  for (std::size_t i = 0; i < 3; ++i) image.data[at + i] = static_cast<std::uint8_t>(std::clamp(color[i], 0.0, 255.0));
}

void draw_dot(RgbImage image, const Eigen::Vector2d& at, double radius_px, const Color& color) {
  const int reach = static_cast<int>(std::ceil(radius_px));
  const int column = static_cast<int>(std::lround(at.x())), row = static_cast<int>(std::lround(at.y()));
  for (int dy = -reach; dy <= reach; ++dy)
    for (int dx = -reach; dx <= reach; ++dx)
      if (std::hypot(dx, dy) <= radius_px) put(image, column + dx, row + dy, color);
}

void draw_line(RgbImage image, const Eigen::Vector2d& from, const Eigen::Vector2d& to, const Color& color) {
  const int steps = std::max(1, static_cast<int>(std::ceil((to - from).norm())));
  for (int i = 0; i <= steps; ++i) {
    const Eigen::Vector2d at = from + (to - from) * (static_cast<double>(i) / steps);
    put(image, static_cast<int>(std::lround(at.x())), static_cast<int>(std::lround(at.y())), color);
  }
}

// Parallel projection: which point and direction belongs to a pixel, and which pixel to a point.
struct Projection {
  Eigen::Vector3d right, up, into;  // unit axes of the picture; `into` points away from the eye
  Eigen::Vector3d target_m;
  double m_per_px = 1;
  double center_column = 0, center_row = 0;

  Projection(const Viewpoint& view, RgbImage image) : target_m(view.target_m) {
    const double ca = std::cos(view.azimuth_rad), sa = std::sin(view.azimuth_rad);
    const double ce = std::cos(view.elevation_rad), se = std::sin(view.elevation_rad);
    into = Eigen::Vector3d(-ca * ce, -sa * ce, -se);
    right = Eigen::Vector3d(-sa, ca, 0);
    up = right.cross(into);
    m_per_px = view.width_m / image.width;
    center_column = (image.width - 1) / 2.0;
    center_row = (image.height - 1) / 2.0;
  }
  [[nodiscard]] Eigen::Vector3d through(int column, int row) const {
    return target_m + m_per_px * ((column - center_column) * right - (row - center_row) * up);
  }
  [[nodiscard]] Eigen::Vector2d pixel(const Eigen::Vector3d& point_m) const {
    const Eigen::Vector3d d = point_m - target_m;
    return {center_column + d.dot(right) / m_per_px, center_row - d.dot(up) / m_per_px};
  }
};

// Light from above and from the side: top faces bright, faces across y darkest.
double face_brightness(int axis) { return axis == 2 ? 1.0 : axis == 0 ? 0.82 : 0.66; }

// Follows one line of sight through the grid: veil of unknown voxels in front of the first occupied one.
Color look(const VoxelMap& map, std::span<const std::uint8_t> zone, const Eigen::Vector3d& point_m,
           const Eigen::Vector3d& direction) {
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
    while (g.contains(v)) {
      const std::size_t index = g.index(v);
      const VoxelClass voxel_class = map.voxel_class(index);
      if (voxel_class == VoxelClass::kOccupied) {
        const std::array<std::uint8_t, 3> base = height_color((v.z() + 0.5) / g.size.z());
        const double light = face_brightness(face);
        over({base[0] * light, base[1] * light, base[2] * light}, 1);
        return color;
      }
      if (voxel_class == VoxelClass::kUnknown && !zone.empty() && zone[index] != 0) over(kVeil, kVeilOpacity);
      next.minCoeff(&face);
      v[face] += direction[face] > 0 ? 1 : -1;
      next[face] += delta[face];
    }
  }
  over(kBackground, 1);
  return color;
}

}  // namespace

void draw_slice(const VoxelMap& map, double z_m, RgbImage image) {
  ENSURE(3081, image.data != nullptr && image.width > 0 && image.height > 0);
  const GridGeometry& g = map.geometry();
  const double px_per_voxel =
      std::min(static_cast<double>(image.width) / g.size.x(), static_cast<double>(image.height) / g.size.y());
  const double left = (image.width - px_per_voxel * g.size.x()) / 2;
  const double bottom = (image.height + px_per_voxel * g.size.y()) / 2;
  const double k = std::floor(z_m / g.resolution_m) - g.first.z();
  const bool layer_exists = k >= 0 && k < g.size.z();
  for (int row = 0; row < image.height; ++row) {
    for (int column = 0; column < image.width; ++column) {
      const Eigen::Vector3i v(static_cast<int>(std::floor((column + 0.5 - left) / px_per_voxel)),
                              static_cast<int>(std::floor((bottom - row - 0.5) / px_per_voxel)),
                              layer_exists ? static_cast<int>(k) : 0);
      Color color = kBackground;
      if (g.contains(v)) {
        const VoxelClass c = layer_exists ? map.voxel_class(g.index(v)) : VoxelClass::kUnknown;
        color = c == VoxelClass::kFree ? kSliceFree : c == VoxelClass::kOccupied ? kSliceOccupied : kSliceUnknown;
      }
      put(image, column, row, color);
    }
  }
}

void draw_map(const VoxelMap& map, const Viewpoint& viewpoint, std::span<const std::uint8_t> zone,
              std::span<const Eigen::Vector3d> views_m, RgbImage image) {
  ENSURE(3082, image.data != nullptr && image.width > 0 && image.height > 0);
  ENSURE(3083, zone.empty() || zone.size() == map.size());
  const Projection projection(viewpoint, image);
  for (int row = 0; row < image.height; ++row)
    for (int column = 0; column < image.width; ++column)
      put(image, column, row, look(map, zone, projection.through(column, row), projection.into));
  for (std::size_t i = 1; i < views_m.size(); ++i)
    draw_line(image, projection.pixel(views_m[i - 1]), projection.pixel(views_m[i]), kPathLine);
  const double radius_px = std::max(2.0, image.width / 200.0);
  for (const Eigen::Vector3d& view_m : views_m) draw_dot(image, projection.pixel(view_m), radius_px, kViewDot);
}

}  // namespace firstlook
