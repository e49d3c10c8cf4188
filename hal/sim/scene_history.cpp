#include "hal/sim/scene_history.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "algorithms/kinematics/arm_model.hpp"

namespace firstlook::sim {
namespace {

constexpr double kBoardSlide_m = 0.03;
constexpr double kBoardTurn_rad = 0.052;        // 3 degrees
constexpr double kFixedCameraDistance_m = 0.8;  // in front of the board
constexpr double kBuried_m = -50;               // below the floor: where no camera looks
constexpr double kObstacleHalf_m = 0.10;
constexpr double kObstacleRadius_m = 0.65;  // outside the safe zone, within reach
constexpr double kObstacleHeight_m = 0.4;
constexpr double kObstacleTurn_rad = 1.0;

void hide_boards(Scene& scene) {
  for (std::size_t k = 0; k < scene.boards.size(); ++k) {
    Pose buried = scene.boards[k].base_T_board.pose();
    buried.translation().z() += kBuried_m;
    move_board(scene, Transform<Base, Board>(buried), k);
  }
}

/// The camera stands on a tripod and looks squarely at the first board.
void fix_camera(Scene& scene) {
  const BoardPlacement& board = scene.boards.front();
  const Eigen::Vector3d middle = board.spec.center() - Eigen::Vector3d(0, 0, kFixedCameraDistance_m);
  scene.mount.link = 0;
  scene.mount.link_T_camera = board.base_T_board.pose() * Eigen::Translation3d(middle);
}

void shift_board(Scene& scene, const Faults& faults) {
  const Pose shift =
      Eigen::Translation3d(kBoardSlide_m, 0, 0) * Pose(Eigen::AngleAxisd(kBoardTurn_rad, Eigen::Vector3d::UnitZ()));
  const std::size_t which = std::min(static_cast<std::size_t>(faults.board_number), scene.boards.size()) - 1;
  move_board(scene, Transform<Base, Board>(scene.boards[which].base_T_board.pose() * shift), which);
}

/// A box in reach, one radian to the left of where the hand stood at first, as high as the upper arm.
void add_obstacle(Scene& scene, const Faults& /*faults*/) {
  const Eigen::Vector3d hand = forward(scene.arm, scene.start_rad).flange().translation();
  const double azimuth_rad = std::atan2(hand.y(), hand.x()) + kObstacleTurn_rad;
  Solid box;
  box.name = "obstacle";
  box.base_T_solid.translation() = Eigen::Vector3d(kObstacleRadius_m * std::cos(azimuth_rad),
                                                   kObstacleRadius_m * std::sin(azimuth_rad), kObstacleHeight_m);
  box.shape = Box{Eigen::Vector3d::Constant(kObstacleHalf_m)};
  scene.solids.push_back(box);
}

Eigen::AlignedBox3d around(const Capsule& capsule) {
  const Eigen::Vector3d r = Eigen::Vector3d::Constant(capsule.radius_m);
  return {capsule.a.cwiseMin(capsule.b) - r, capsule.a.cwiseMax(capsule.b) + r};
}

}  // namespace

SceneWorld::SceneWorld(const Renderer& renderer) : renderer_(renderer) {
  for (const Solid& solid : renderer_.scene().solids) bounds_.push_back(bounds(solid));
}

double SceneWorld::ray_m(const Eigen::Vector3d& origin_m, const Eigen::Vector3d& direction) const {
  return renderer_.ray_m(origin_m, direction);
}

void SceneWorld::trace(const Eigen::Vector3d& origin_m, RayRow& row) const { renderer_.trace(origin_m, row); }

bool SceneWorld::touches(const Capsule& capsule) const {
  const Eigen::AlignedBox3d box = around(capsule);
  for (std::size_t i = 0; i < bounds_.size(); ++i) {
    if (!box.intersects(bounds_[i])) continue;
    if (distance_m(renderer_.scene().solids[i], capsule.a, capsule.b) <= capsule.radius_m) return true;
  }
  return false;
}

bool SceneWorld::inside(const Eigen::Vector3d& point_m) const { return sim::inside(renderer_.scene(), point_m); }

void SceneWorld::matter(const GridGeometry& geometry, std::vector<std::uint8_t>& out) const {
  out = occupied_voxels(renderer_.scene(), geometry);
}

SceneHistory::SceneHistory(const Scene& scene, const DepthSensorModel& sensor, const Faults& faults,
                           WorkerPool* workers) {
  Scene now = scene;
  if (faults.camera_fixed) fix_camera(now);
  if (faults.board_absent) hide_boards(now);
  spans_.push_back(std::make_unique<SceneSpan>(Instant{}, now, sensor, workers));
  struct Change {
    double at_s;
    void (*apply)(Scene&, const Faults&);
  };
  std::array changes = {Change{faults.board_move_s, shift_board}, Change{faults.obstacle_s, add_obstacle}};
  std::ranges::stable_sort(changes, {}, &Change::at_s);
  for (const Change& change : changes) {
    if (!std::isfinite(change.at_s)) continue;
    change.apply(now, faults);
    spans_.push_back(std::make_unique<SceneSpan>(Instant{seconds(change.at_s).ns}, now, sensor, workers));
  }
}

const SceneSpan& SceneHistory::at(Instant stamp) const {
  const SceneSpan* found = spans_.front().get();
  for (const auto& span : spans_) {
    if (span->from <= stamp) found = span.get();
  }
  return *found;
}

}  // namespace firstlook::sim
