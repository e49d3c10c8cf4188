/// The scene over time: what it is at first, and after faults have moved the board or put an obstacle into it.
#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <vector>

#include "hal/sim/faults.hpp"
#include "hal/sim/renderer.hpp"
#include "hal/sim/scene.hpp"
#include "hal/sim/true_world.hpp"
#include "platform/core/time.hpp"

namespace firstlook::sim {

/// A scene as grading asks it. The renderer must outlive it.
class SceneWorld final : public TrueWorld {
 public:
  explicit SceneWorld(const Renderer& renderer);

  [[nodiscard]] double ray_m(const Eigen::Vector3d& origin_m, const Eigen::Vector3d& direction) const override;
  void trace(const Eigen::Vector3d& origin_m, RayRow& row) const override;
  [[nodiscard]] bool touches(const Capsule& capsule) const override;
  [[nodiscard]] bool inside(const Eigen::Vector3d& point_m) const override;
  void matter(const GridGeometry& geometry, std::vector<std::uint8_t>& out) const override;

 private:
  const Renderer& renderer_;
  std::vector<Eigen::AlignedBox3d> bounds_;  ///< of each solid: most are far from the body
};

/// What holds from one instant to the next.
struct SceneSpan {
  Instant from{};
  Renderer renderer;
  SceneWorld world;

  SceneSpan(Instant begin, const Scene& scene, const DepthSensorModel& sensor, WorkerPool* workers)
      : from(begin), renderer(scene, sensor, workers), world(renderer) {}
};

class SceneHistory {
 public:
  /// The scene with the faults that change it: board absent, camera beside the arm, board moved, obstacle.
  SceneHistory(const Scene& scene, const DepthSensorModel& sensor, const Faults& faults, WorkerPool* workers = nullptr);
  /// The scene at an instant. Thread-safe.
  [[nodiscard]] const SceneSpan& at(Instant stamp) const;

 private:
  std::vector<std::unique_ptr<SceneSpan>> spans_;  ///< by time, at least one
};

}  // namespace firstlook::sim
