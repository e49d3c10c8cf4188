// Which voxels of a grid hold matter: separating axes of each voxel's box and each solid.
#include <algorithm>
#include <cmath>

#include "hal/sim/scene.hpp"

namespace firstlook::sim {
namespace {

using Eigen::Vector3d;

constexpr double kTouching_m = 1e-9;  // voxels that a solid only touches are not occupied

/// True when the projections of a box around the origin (half size `half`) and of `points` on `axis` do not overlap.
template <typename Points>
bool separates(const Vector3d& axis, double half, const Points& points) {
  const double reach = half * axis.cwiseAbs().sum();
  double low = axis.dot(points[0]), high = low;
  for (const Vector3d& p : points) {
    const double at = axis.dot(p);
    low = std::min(low, at), high = std::max(high, at);
  }
  return low >= reach || high <= -reach;
}

/// Gottschalk, Lin and Manocha 1996: 15 axes.
bool box_overlaps(const Box& box, const Pose& base_T_box, const Vector3d& center, double half) {
  std::array<Vector3d, 8> corners;
  for (std::size_t i = 0; i < 8; ++i) {
    const Vector3d sign(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1);
    corners[i] = base_T_box * sign.cwiseProduct(box.half_m) - center;
  }
  for (int i = 0; i < 3; ++i) {
    if (separates(Vector3d::Unit(i), half, corners)) return false;
    if (separates(base_T_box.linear().col(i), half, corners)) return false;
  }
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const Vector3d axis = Vector3d::Unit(i).cross(base_T_box.linear().col(j));
      if (axis.squaredNorm() > 1e-12 && separates(axis, half, corners)) return false;
    }
  }
  return true;
}

bool triangle_overlaps(const std::array<Vector3d, 3>& corners, double half) {
  const std::array<Vector3d, 3> edges{corners[1] - corners[0], corners[2] - corners[1], corners[0] - corners[2]};
  const Vector3d normal = edges[0].cross(edges[1]);
  if (normal.squaredNorm() > 0 && separates(normal.normalized(), half, corners)) return false;
  for (int i = 0; i < 3; ++i) {
    if (separates(Vector3d::Unit(i), half, corners)) return false;
    for (const Vector3d& edge : edges) {
      const Vector3d axis = Vector3d::Unit(i).cross(edge);
      if (axis.squaredNorm() > 1e-18 && separates(axis.normalized(), half, corners)) return false;
    }
  }
  return true;
}

bool overlaps(const Box& box, const Solid& solid, const Vector3d& center, double half) {
  return box_overlaps(box, solid.base_T_solid, center, half);
}

bool overlaps(const Cylinder& cylinder, const Solid& solid, const Vector3d& center, double half) {
  const Vector3d axis = solid.base_T_solid.linear().col(2);
  if (std::hypot(axis.x(), axis.y()) > 1e-9) return distance_m(solid, center, center) < std::sqrt(3.0) * half;
  const Vector3d gap = ((center - solid.base_T_solid.translation()).cwiseAbs().array() - half).cwiseMax(0.0);
  return std::hypot(gap.x(), gap.y()) < cylinder.radius_m && gap.z() < cylinder.half_height_m;
}

bool overlaps(const Mesh& mesh, const Solid& solid, const Vector3d& center, double half) {
  for (const auto& t : mesh.triangles) {
    const std::array<Vector3d, 3> corners{solid.base_T_solid * mesh.vertices_m[t[0]] - center,
                                          solid.base_T_solid * mesh.vertices_m[t[1]] - center,
                                          solid.base_T_solid * mesh.vertices_m[t[2]] - center};
    if (triangle_overlaps(corners, half)) return true;
  }
  return distance_m(solid, center, center) == 0;
}

void mark(const Solid& solid, const GridGeometry& grid, std::vector<std::uint8_t>& out) {
  const Eigen::AlignedBox3d box = bounds(solid);
  const Vector3d low_m = grid.first.cast<double>() * grid.resolution_m;
  const Vector3d high_m = (grid.first + grid.size).cast<double>() * grid.resolution_m;
  if ((box.min().array() >= high_m.array()).any() || (box.max().array() <= low_m.array()).any()) return;
  const Eigen::Vector3i last = (grid.size.array() - 1).matrix();
  const Eigen::Vector3i from = grid.voxel(box.min().cwiseMax(low_m)).cwiseMax(Eigen::Vector3i::Zero());
  const Eigen::Vector3i to = grid.voxel(box.max().cwiseMin(high_m)).cwiseMin(last);
  const double half = 0.5 * grid.resolution_m - kTouching_m;
  Eigen::Vector3i v;
  for (v.z() = from.z(); v.z() <= to.z(); ++v.z()) {
    for (v.y() = from.y(); v.y() <= to.y(); ++v.y()) {
      for (v.x() = from.x(); v.x() <= to.x(); ++v.x()) {
        std::uint8_t& voxel = out[grid.index(v)];
        if (voxel != 0) continue;
        const Vector3d center = grid.center_m(v);
        voxel =
            std::visit([&](const auto& shape) { return overlaps(shape, solid, center, half); }, solid.shape) ? 1 : 0;
      }
    }
  }
}

}  // namespace

std::vector<std::uint8_t> occupied_voxels(const Scene& scene, const GridGeometry& geometry) {
  std::vector<std::uint8_t> out(geometry.count(), 0);
  for (const Solid& solid : scene.solids) mark(solid, geometry, out);
  return out;
}

}  // namespace firstlook::sim
