/// The true scene as grading asks it.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "algorithms/kinematics/arm_model.hpp"
#include "algorithms/mapping/grid_geometry.hpp"
#include "hal/sim/ray_tracer.hpp"

namespace firstlook::sim {

/// Everything solid but the arm itself, in base coordinates. All calls are thread-safe and do not change anything.
class TrueWorld {
 public:
  virtual ~TrueWorld() = default;
  /// Distance from a point to the first surface in a unit direction; infinity when there is none.
  [[nodiscard]] virtual double ray_m(const Eigen::Vector3d& origin_m, const Eigen::Vector3d& direction) const = 0;
  /// The same for all rays of a row, in lengths of their directions (RayRow::t); the rest of the row is scratch.
  virtual void trace(const Eigen::Vector3d& origin_m, RayRow& row) const {
    for (std::size_t i = 0; i < row.size(); ++i) {
      const Eigen::Vector3d d(row.x[i], row.y[i], row.z[i]);
      row.t[i] = static_cast<float>(ray_m(origin_m, d.normalized()) / d.norm());
    }
  }
  /// Does the capsule touch or overlap anything solid?
  [[nodiscard]] virtual bool touches(const Capsule& capsule) const = 0;
  /// Does the point lie in matter?
  [[nodiscard]] virtual bool inside(const Eigen::Vector3d& point_m) const = 0;
  /// One byte for each voxel of a grid: 1 where matter is in it.
  virtual void matter(const GridGeometry& geometry, std::vector<std::uint8_t>& out) const = 0;
};

}  // namespace firstlook::sim
