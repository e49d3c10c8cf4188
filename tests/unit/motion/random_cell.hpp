/// Random cells of voxels for the tests of motion, and brute force over them: other code than what it judges.
#pragma once

#include <algorithm>
#include <numbers>
#include <vector>

#include "algorithms/motion/body.hpp"
#include "algorithms/motion/free_space.hpp"
#include "platform/core/random.hpp"

namespace firstlook::test {

/// Free space with a floor and random boxes in it, clear around the base.
struct RandomCell {
  GridGeometry grid;
  std::vector<std::uint8_t> free;
  DistanceField field;

  RandomCell(std::uint64_t seed, int boxes)
      : grid(GridGeometry::covering({-1.3, -1.3, -0.3}, {1.3, 1.3, 1.5}, 0.05)),
        free(grid.count(), 1),
        field(grid, 0.6) {
    Random random(seed, 77);
    for (std::size_t i = 0; i < free.size(); ++i) {
      if (grid.center_m(grid.voxel_at(i)).z() < -0.05) free[i] = 0;
    }
    for (int b = 0; b < boxes; ++b) {
      const Eigen::Vector3d half(random.uniform(0.05, 0.25), random.uniform(0.05, 0.25), random.uniform(0.05, 0.4));
      const double angle = random.uniform(0, 2 * std::numbers::pi);
      const double away = random.uniform(0.6, 1.2);
      add_box(Eigen::Vector3d(away * std::cos(angle), away * std::sin(angle), random.uniform(-0.1, 1.3)), half);
    }
    field.update(free);
  }

  void add_box(const Eigen::Vector3d& centre, const Eigen::Vector3d& half) {
    for (std::size_t i = 0; i < free.size(); ++i) {
      if (((grid.center_m(grid.voxel_at(i)) - centre).cwiseAbs() - half).maxCoeff() <= 0) free[i] = 0;
    }
  }

  /// Exact distance from p to the nearest centre of a voxel that is not free (outside the grid nothing is), when it is
  /// below `reach_m`, else reach_m.
  [[nodiscard]] double exact_distance_m(const Eigen::Vector3d& p, double reach_m) const {
    const Eigen::Vector3d reach = Eigen::Vector3d::Constant(reach_m);
    const Eigen::Vector3i low = grid.voxel(p - reach);
    const Eigen::Vector3i high = grid.voxel(p + reach);
    double best2 = reach_m * reach_m;
    for (int z = low.z(); z <= high.z(); ++z) {
      for (int y = low.y(); y <= high.y(); ++y) {
        for (int x = low.x(); x <= high.x(); ++x) {
          const Eigen::Vector3i v(x, y, z);
          if (grid.contains(v) && free[grid.index(v)] != 0) continue;
          best2 = std::min(best2, (grid.center_m(v) - p).squaredNorm());
        }
      }
    }
    return std::sqrt(best2);
  }
};

/// Takes single voxels away in the safe zone, as hits do: from `cell`, and from what remains, which is returned.
inline RandomCell take_from_zone(RandomCell& cell, std::uint64_t seed, int voxels) {
  RandomCell left(seed, 0);
  Random random(seed, 78);
  for (int i = 0; i < voxels; ++i) {
    const double angle = random.uniform(0, 2 * std::numbers::pi);
    const double away = random.uniform(0.3, 0.48);
    const Eigen::Vector3d p(away * std::cos(angle), away * std::sin(angle), random.uniform(0.0, 1.1));
    cell.free[cell.grid.index(cell.grid.voxel(p))] = left.free[left.grid.index(left.grid.voxel(p))] = 0;
  }
  cell.field.update(cell.free);
  left.field.update(left.free);
  return left;
}

inline JointVector random_joints(Random& random, double range_rad) {
  JointVector q = JointVector::zero(6);
  for (int j = 0; j < 6; ++j) q[j] = random.uniform(-range_rad, range_rad);
  return q;
}

/// Margins beyond this are not told apart by sampled_margin_m.
inline constexpr double kSampledMax_m = 0.06;

/// Margin of a configuration from first principles: points along each capsule's axis, exact distances to voxels, zone
/// and keep-outs; pairs of capsules by points too. `zone_left`, when given, is what hits left of the zone. An upper
/// bound of the true margin, because it samples.
inline double sampled_margin_m(const ArmModel& arm, const Body& body, const RandomCell& cell, const FreeSpace& space,
                               const Clearance& need, const JointVector& q, double spacing_m,
                               const RandomCell* zone_left = nullptr) {
  const LinkFrames frames = forward(arm, q);
  double margin = kSampledMax_m;
  std::vector<std::vector<Eigen::Vector3d>> points;
  for (std::size_t i = 0; i < body.capsules.size(); ++i) {
    const Capsule& c = body.capsules[i];
    const Pose& base_T_link = frames.base_T_link[static_cast<std::size_t>(c.link)];
    const int n = 1 + static_cast<int>((c.b - c.a).norm() / spacing_m);
    auto& line = points.emplace_back();
    for (int k = 0; k <= n; ++k) {
      const Eigen::Vector3d p = base_T_link * Eigen::Vector3d(c.a + (c.b - c.a) * (static_cast<double>(k) / n));
      line.push_back(p);
      if (body.exempt[i] != 0) continue;
      double here = -1;
      if (space.zone_intact) {
        here = std::min({space.zone.radius_m - std::hypot(p.x(), p.y()), p.z() - space.zone.floor_m,
                         space.zone.floor_m + space.zone.height_m - p.z()}) -
               need.surface_m;
      }
      if (zone_left != nullptr) {
        here =
            std::min(here, zone_left->exact_distance_m(p, c.radius_m + need.voxels_m + kSampledMax_m) - need.voxels_m);
      }
      if (here < c.radius_m + kSampledMax_m && space.field != nullptr) {
        here = std::max(here, cell.exact_distance_m(p, c.radius_m + need.voxels_m + kSampledMax_m) - need.voxels_m);
      }
      for (const KeepOutBox& box : space.keep_out_boxes) {
        const Eigen::Vector3d nearest = p.cwiseMax(box.low_m).cwiseMin(box.high_m);
        here = std::min(here, (p - nearest).norm() - need.surface_m);
      }
      for (const KeepOutPlane& plane : space.keep_out_planes) {
        here = std::min(here, plane.normal.dot(p) - plane.offset_m - need.surface_m);
      }
      margin = std::min(margin, here - c.radius_m);
    }
  }
  for (const SelfPair& pair : body.self_pairs) {
    for (const Eigen::Vector3d& p : points[static_cast<std::size_t>(pair.near)]) {
      for (const Eigen::Vector3d& f : points[static_cast<std::size_t>(pair.far)]) {
        margin = std::min(margin, (p - f).norm() - pair.axes_apart_m);
      }
    }
  }
  return margin;
}

}  // namespace firstlook::test
