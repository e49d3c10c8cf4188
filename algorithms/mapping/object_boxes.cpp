#include "algorithms/mapping/object_boxes.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "platform/core/ensure.hpp"

namespace firstlook {
namespace {

// How much smaller a turned or tilted box must be to be worth it.
constexpr double kTurnedWorth = 0.85, kTiltedWorth = 0.7;
constexpr double kSurface_m = 0.04;     // scatter of a surface in the map, or one and a half voxels where that is more
constexpr double kFlatSide = 2.5;       // a plane's second edge over its thickness, at least
constexpr double kFlatCover = 0.4;      // of a plane's rectangle
constexpr double kFaceCover = 0.6;      // of a box's closed face
constexpr double kNearFaces = 0.9;      // of a box's voxels
constexpr double kFreeInsideMax = 0.2;  // of a box's inside

double surface_m(double resolution_m) { return std::max(kSurface_m, 1.5 * resolution_m); }

/// The box along the columns of a rotation that holds every voxel.
OrientedBox box_along(const Eigen::Matrix3d& axes, std::span<const Eigen::Vector3d> centers_m, double resolution_m) {
  Eigen::Vector3d low = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (const Eigen::Vector3d& center : centers_m) {
    const Eigen::Vector3d p = axes.transpose() * center;
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  // A cube's extent along each axis.
  const Eigen::Vector3d voxel_m = resolution_m * axes.transpose().cwiseAbs().rowwise().sum();
  return {axes * (low + high) / 2, high - low + voxel_m, Eigen::Quaterniond(axes)};
}

/// Turns about the third axis to the smallest rectangle, in steps of a degree.
Eigen::Matrix3d turned(const Eigen::Matrix3d& axes, std::span<const Eigen::Vector3d> centers_m, double resolution_m) {
  std::vector<Eigen::Vector2d> flat;
  flat.reserve(centers_m.size());
  for (const Eigen::Vector3d& center : centers_m) flat.push_back((axes.transpose() * center).head<2>());
  double best_m2 = std::numeric_limits<double>::infinity();
  int best_degrees = 0;
  for (int degrees = 0; degrees < 90; ++degrees) {
    const Eigen::Rotation2Dd back(-degrees * std::numbers::pi / 180);
    Eigen::Vector2d low = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity()), high = -low;
    const Eigen::Matrix2d m = back.toRotationMatrix();
    for (const Eigen::Vector2d& p : flat) {
      const Eigen::Vector2d q = m * p;
      low = low.cwiseMin(q);
      high = high.cwiseMax(q);
    }
    const Eigen::Vector2d size = (high - low).array() + resolution_m;
    if (size.prod() < best_m2 - 1e-12) best_m2 = size.prod(), best_degrees = degrees;
  }
  return axes * Eigen::AngleAxisd(best_degrees * std::numbers::pi / 180, Eigen::Vector3d::UnitZ()).toRotationMatrix();
}

/// Principal axes, the flattest direction last and upwards.
Eigen::Matrix3d principal_axes(std::span<const Eigen::Vector3d> centers_m) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : centers_m) mean += p;
  mean /= static_cast<double>(centers_m.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& p : centers_m) spread += (p - mean) * (p - mean).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(spread);
  Eigen::Matrix3d axes;
  axes.col(2) = solver.eigenvectors().col(0);
  if (axes.col(2).z() < 0) axes.col(2) = -axes.col(2);
  axes.col(0) = solver.eigenvectors().col(2);
  axes.col(1) = axes.col(2).cross(axes.col(0));
  return axes;
}

/// Which share of a face of the box is covered by voxels near it, in cells of one and a half voxels (turned rows leave
/// gaps in smaller ones).
double face_cover(std::span<const Eigen::Vector3d> in_box_m, const Eigen::Vector3d& size_m, int axis, int side,
                  double near_m, double resolution_m) {
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  const auto cells = [&](int along) {
    return std::max(1, static_cast<int>(std::floor(size_m[along] / (1.5 * resolution_m))));
  };
  const int nu = cells(u), nv = cells(v);
  std::vector<std::uint8_t> covered(static_cast<std::size_t>(nu) * static_cast<std::size_t>(nv), 0);
  for (const Eigen::Vector3d& p : in_box_m) {
    if (size_m[axis] / 2 - side * p[axis] > near_m) continue;
    const int i = std::clamp(static_cast<int>((p[u] / size_m[u] + 0.5) * nu), 0, nu - 1);
    const int j = std::clamp(static_cast<int>((p[v] / size_m[v] + 0.5) * nv), 0, nv - 1);
    covered[static_cast<std::size_t>(j) * static_cast<std::size_t>(nu) + static_cast<std::size_t>(i)] = 1;
  }
  return static_cast<double>(std::ranges::count(covered, 1)) / static_cast<double>(covered.size());
}

/// Share of the voxels whose centres lie deeper inside the box than its surface that are free.
double free_inside(const OrientedBox& box, const VoxelMap& map, double near_m) {
  OrientedBox inner = box;
  inner.size_m = (box.size_m.array() - 2 * near_m).matrix();
  if (inner.size_m.minCoeff() <= 0) return 0;
  const GridGeometry& g = map.geometry();
  const Eigen::Vector3d reach = box.rotation.toRotationMatrix().cwiseAbs() * inner.size_m / 2;
  const Eigen::Vector3i low = g.voxel(box.center_m - reach).cwiseMax(0);
  const Eigen::Vector3i high = g.voxel(box.center_m + reach).cwiseMin(g.size - Eigen::Vector3i::Ones());
  std::size_t inside = 0, free = 0;
  for (int z = low.z(); z <= high.z(); ++z) {
    for (int y = low.y(); y <= high.y(); ++y) {
      for (int x = low.x(); x <= high.x(); ++x) {
        if (!inner.contains(g.center_m({x, y, z}))) continue;
        ++inside;
        free += map.voxel_class(g.index({x, y, z})) == VoxelClass::kFree;
      }
    }
  }
  return inside == 0 ? 0 : static_cast<double>(free) / static_cast<double>(inside);
}

bool is_plane(std::span<const Eigen::Vector3d> in_box_m, const OrientedBox& box, double resolution_m) {
  std::array<int, 3> by_size = {0, 1, 2};
  std::ranges::sort(by_size, [&](int a, int b) { return box.size_m[a] > box.size_m[b]; });
  const int thin = by_size[2];
  double thickness_m = 0;  // of the voxels' centres
  for (const Eigen::Vector3d& p : in_box_m) thickness_m = std::max(thickness_m, 2 * std::abs(p[thin]));
  if (thickness_m > std::max(2 * resolution_m, 2 * kSurface_m) + 1e-9) return false;
  if (box.size_m[by_size[1]] < kFlatSide * (thickness_m + resolution_m)) return false;
  return face_cover(in_box_m, box.size_m, thin, 1, box.size_m[thin], resolution_m) >= kFlatCover;
}

bool is_box(std::span<const Eigen::Vector3d> in_box_m, const OrientedBox& box, const VoxelMap& map) {
  const double resolution_m = map.geometry().resolution_m, near_m = surface_m(resolution_m) + resolution_m / 2;
  if (box.size_m.minCoeff() < 3 * resolution_m - 1e-9) return false;  // smaller ones have no inside
  std::size_t near_faces = 0;
  for (const Eigen::Vector3d& p : in_box_m) near_faces += (box.size_m / 2 - p.cwiseAbs()).minCoeff() <= near_m;
  const double voxels = static_cast<double>(in_box_m.size());
  const bool solid = voxels * std::pow(resolution_m, 3) >= 0.7 * box.volume_m3();
  if (!solid && static_cast<double>(near_faces) < kNearFaces * voxels) return false;
  int axes_closed = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double cover = std::max(face_cover(in_box_m, box.size_m, axis, 1, near_m, resolution_m),
                                  face_cover(in_box_m, box.size_m, axis, -1, near_m, resolution_m));
    axes_closed += cover >= kFaceCover;
  }
  return axes_closed >= 2 && free_inside(box, map, near_m) <= kFreeInsideMax;
}

}  // namespace

OrientedBox fit_box(std::span<const Eigen::Vector3d> centers_m, double resolution_m) {
  ENSURE(3091, !centers_m.empty());
  OrientedBox best = box_along(Eigen::Matrix3d::Identity(), centers_m, resolution_m);
  const OrientedBox about_z =
      box_along(turned(Eigen::Matrix3d::Identity(), centers_m, resolution_m), centers_m, resolution_m);
  if (about_z.volume_m3() < kTurnedWorth * best.volume_m3()) best = about_z;
  const OrientedBox tilted =
      box_along(turned(principal_axes(centers_m), centers_m, resolution_m), centers_m, resolution_m);
  if (tilted.volume_m3() < kTiltedWorth * best.volume_m3()) best = tilted;
  return best;
}

ObjectShape shape_of(std::span<const Eigen::Vector3d> centers_m, const OrientedBox& box, const VoxelMap& map) {
  std::vector<Eigen::Vector3d> in_box_m;
  in_box_m.reserve(centers_m.size());
  const Eigen::Matrix3d to_box = box.rotation.toRotationMatrix().transpose();
  for (const Eigen::Vector3d& center : centers_m) in_box_m.emplace_back(to_box * (center - box.center_m));
  if (is_plane(in_box_m, box, map.geometry().resolution_m)) return ObjectShape::kPlane;
  return is_box(in_box_m, box, map) ? ObjectShape::kBox : ObjectShape::kOther;
}

}  // namespace firstlook
