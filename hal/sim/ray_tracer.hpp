/// Rays against the solids of a scene, a row of them at a time.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "hal/sim/scene.hpp"

namespace firstlook::sim {

/// Rays from one origin, in base coordinates; directions need not have unit length. What they meet is written beside
/// them.
struct RayRow {
  explicit RayRow(std::size_t rays) : x(rays), y(rays), z(rays), t(rays), nx(rays), ny(rays), nz(rays), solid(rays) {}
  [[nodiscard]] std::size_t size() const { return x.size(); }

  std::vector<float> x, y, z;       ///< direction
  std::vector<float> t;             ///< of the first surface, in lengths of the direction; infinity: none
  std::vector<float> nx, ny, nz;    ///< unit normal there, towards the origin
  std::vector<std::int32_t> solid;  ///< index in Scene::solids; -1: none
};

/// Immutable after construction; const calls are thread-safe.
class RayTracer {
 public:
  explicit RayTracer(const Scene& scene);
  ~RayTracer();
  RayTracer(const RayTracer&) = delete;
  RayTracer& operator=(const RayTracer&) = delete;

  /// Finds the first surface along the first `count` rays of the row.
  void trace(const Eigen::Vector3d& origin_m, RayRow& row, std::size_t count) const;
  /// blocked[i] = 1 where something stands between the origin and t[i] along ray i; rays with t[i] <= 0 are not looked
  /// at.
  void find_blocked(const Eigen::Vector3d& origin_m, const RayRow& row, std::size_t count,
                    std::vector<std::uint8_t>& blocked) const;
  /// Distance along a unit direction to the first surface; infinity when there is none.
  [[nodiscard]] double distance_m(const Eigen::Vector3d& origin_m, const Eigen::Vector3d& direction) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace firstlook::sim
