/// A world of axis-aligned boxes whose answers can be worked out by hand.
#pragma once

#include <algorithm>
#include <limits>
#include <vector>

#include "hal/sim/ray_geometry.hpp"
#include "hal/sim/true_world.hpp"

namespace firstlook::test {

struct SolidBox {
  Eigen::Vector3d low_m;
  Eigen::Vector3d high_m;
};

class BoxWorld final : public sim::TrueWorld {
 public:
  std::vector<SolidBox> boxes;

  /// Six slabs around an empty room.
  void add_room(const Eigen::Vector3d& low, const Eigen::Vector3d& high, double wall_m = 0.2) {
    const Eigen::Vector3d out = Eigen::Vector3d::Constant(wall_m);
    for (int axis = 0; axis < 3; ++axis) {
      SolidBox below{low - out, high + out}, above{low - out, high + out};
      below.high_m[axis] = low[axis];
      above.low_m[axis] = high[axis];
      boxes.push_back(below);
      boxes.push_back(above);
    }
  }

  [[nodiscard]] double ray_m(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const override {
    double nearest = std::numeric_limits<double>::infinity();
    for (const SolidBox& box : boxes) {
      double enter = 0, leave = std::numeric_limits<double>::infinity();
      for (int axis = 0; axis < 3; ++axis) {
        double t0 = (box.low_m[axis] - origin[axis]) / direction[axis];
        double t1 = (box.high_m[axis] - origin[axis]) / direction[axis];
        if (t0 > t1) std::swap(t0, t1);
        enter = std::max(enter, t0);
        leave = std::min(leave, t1);
      }
      if (enter < leave) nearest = std::min(nearest, enter);
    }
    return nearest;
  }
  [[nodiscard]] bool touches(const Capsule& c) const override {
    return std::ranges::any_of(boxes, [&](const SolidBox& box) {
      return sim::segment_to_box_m(c.a, c.b, box.low_m, box.high_m) <= c.radius_m;
    });
  }
  [[nodiscard]] bool inside(const Eigen::Vector3d& p) const override {
    return std::ranges::any_of(boxes, [&](const SolidBox& box) {
      return (p.array() > box.low_m.array()).all() && (p.array() < box.high_m.array()).all();
    });
  }
  void matter(const GridGeometry& g, std::vector<std::uint8_t>& out) const override {
    out.assign(g.count(), 0);
    const Eigen::Vector3d half = Eigen::Vector3d::Constant(0.5 * g.resolution_m - 1e-9);
    for (std::size_t i = 0; i < out.size(); ++i) {
      const Eigen::Vector3d center = g.center_m(g.voxel_at(i));
      out[i] = std::ranges::any_of(boxes, [&](const SolidBox& box) {
        return ((center + half).array() > box.low_m.array()).all() &&
               ((center - half).array() < box.high_m.array()).all();
      });
    }
  }
};

}  // namespace firstlook::test
