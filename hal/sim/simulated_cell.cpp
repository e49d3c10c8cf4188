#include "hal/sim/simulated_cell.hpp"

#include <algorithm>

#include "algorithms/kinematics/arm_model.hpp"
#include "hal/sim/cell_file.hpp"
#include "hal/sim/faults.hpp"
#include "hal/sim/followed_arm.hpp"
#include "hal/sim/random_streams.hpp"
#include "hal/sim/scene_history.hpp"
#include "hal/sim/simulated_arm.hpp"
#include "hal/sim/simulated_cameras.hpp"
#include "hal/sim/simulated_operator.hpp"
#include "hal/sim/truth_grader.hpp"
#include "platform/memory/allocation_guard.hpp"

namespace firstlook::sim {
namespace {

constexpr Duration kColorPeriod{1'000'000'000 / 15};
constexpr Duration kDepthPeriod{1'000'000'000 / 30};
constexpr Instant kColorFirst{milliseconds(10).ns};
constexpr Instant kDepthFirst{milliseconds(5).ns};

/// Hands the body's motion to the grader together with the world of that moment.
class GraderInTime final : public BodyWatcher {
 public:
  GraderInTime(TruthGrader& grader, const SceneHistory& scenes) : grader_(grader), scenes_(scenes) {}
  bool body_moved(Instant stamp, const JointVector& from_rad, const JointVector& to_rad) override {
    grader_.known_times().note(stamp);
    grader_.monitor().set_world(scenes_.at(stamp).world);
    return grader_.monitor().body_moved(stamp, from_rad, to_rad);
  }
  void body_led() override { grader_.monitor().body_led(); }

 private:
  TruthGrader& grader_;
  const SceneHistory& scenes_;
};

FrameTiming color_timing(const Faults& faults, std::uint64_t seed) {
  FrameTiming timing;
  timing.period = kColorPeriod;
  timing.first = kColorFirst;
  timing.drop_share = faults.color_drop;
  timing.stall_s = faults.color_stall_s;
  timing.freeze_s = faults.color_freeze_s;
  timing.clock_offset_s = faults.color_clock_offset_s;
  timing.seed = seed;
  timing.drop_stream = kColorDropStream;
  return timing;
}

FrameTiming depth_timing(const Faults& faults, std::uint64_t seed) {
  FrameTiming timing;
  timing.period = kDepthPeriod;
  timing.first = kDepthFirst;
  timing.drop_share = faults.depth_drop;
  timing.stall_s = faults.depth_stall_s;
  timing.freeze_s = faults.depth_freeze_s;
  timing.clock_offset_s = faults.depth_clock_offset_s;
  timing.seed = seed;
  timing.drop_stream = kDepthDropStream;
  return timing;
}

/// What the colour camera says of itself.
CameraIntrinsics stated_intrinsics(CameraIntrinsics camera, const Faults& faults) {
  camera.fx *= 1 + faults.color_focal_error;
  camera.fy *= 1 + faults.color_focal_error;
  camera.cx += faults.color_center_error_px;
  camera.cy += faults.color_center_error_px;
  return camera;
}

/// What its maker says of the depth camera's place: off by a shift along (1, -1, 1) and a turn about (1, 1, -1).
Transform<Camera, Depth> stated_mount(const Transform<Camera, Depth>& mount, const Faults& faults) {
  const Eigen::Vector3d shift = 1e-3 * faults.depth_shift_mm * Eigen::Vector3d(1, -1, 1).normalized();
  const Eigen::AngleAxisd turn(1e-3 * faults.depth_tilt_mrad, Eigen::Vector3d(1, 1, -1).normalized());
  return {Eigen::Quaterniond(turn) * mount.quaternion(), mount.translation() + shift};
}

DepthDetail detail(const SimulationOptions& options) {
  return options.fast_sensor ? DepthDetail::kFast : DepthDetail::kFull;
}

/// Where somebody measured the tip to be.
Eigen::Vector3d measured_tip(const Scene& scene, std::uint64_t seed) {
  constexpr double kMeasured_m = 5e-4;
  Random random(seed, kTipStream);
  return scene.flange_p_tip_m + kMeasured_m * random.normal3();
}

CellDescription describe_cell(const Scene& scene, const Renderer& renderer, const Faults& faults,
                              const SimulationOptions& options) {
  CellDescription d;
  d.name = scene.name;
  d.arm = scene.arm;
  d.arm_file = scene.arm_file;
  d.start_rad = scene.start_rad;
  d.color = stated_intrinsics(scene.mount.color, faults);
  d.depth = renderer.depth_intrinsics(detail(options));
  d.camera_T_depth = stated_mount(scene.mount.camera_T_depth, faults);
  // What the job looks for stands first among the scene's boards (hang_boards).
  const std::size_t sought = options.boards.empty() ? scene.boards.size() : options.boards.size();
  for (std::size_t k = 0; k < sought; ++k) d.boards.push_back({scene.boards[k].name, scene.boards[k].spec});
  d.flange_p_tip_m = measured_tip(scene, options.seed);
  d.cart_top_m = scene.safe_zone.floor_m;
  d.safe_zone = scene.safe_zone;
  for (const Region& region : scene.keep_out) d.keep_out.push_back({region.low_m, region.high_m});
  d.camera_envelope_m = scene.camera_envelope_m;
  if (scene.map) d.map = KeepOut{scene.map->low_m, scene.map->high_m};
  return d;
}

Truth truth_of(const Scene& scene, const ArmModel& model, const SceneSpan& span, const Faults& faults,
               const SimulationOptions& options) {
  Truth truth;
  truth.arm = model;
  truth.world = &span.world;
  truth.link = scene.mount.link;
  truth.link_T_camera = scene.mount.link_T_camera;
  truth.camera_T_depth = scene.mount.camera_T_depth;
  truth.depth = scene.mount.depth;
  truth.space.zone = scene.safe_zone;
  for (const Region& region : scene.keep_out) truth.space.keep_out_boxes.push_back({region.low_m, region.high_m});
  truth.start_rad = scene.start_rad;
  for (const Region& region : scene.regions) truth.regions.push_back({region.name, region.low_m, region.high_m});
  truth.color_clock_s = faults.color_clock_offset_s;
  truth.depth_clock_s = faults.depth_clock_offset_s;
  truth.seed = options.seed;
  return truth;
}

SimulatedArmOptions arm_options(const Scene& scene, const ArmModel& model, const Faults& faults, std::uint64_t seed) {
  SimulatedArmOptions options;
  options.model = model;
  options.start_rad = scene.start_rad;
  options.seed = seed;
  options.script = controller_script(faults);
  return options;
}

std::optional<FollowedArm> follow(const SimulationOptions& options, const ArmModel& model, BodyWatcher& watcher) {
  if (options.feed == nullptr) return std::nullopt;
  return std::optional<FollowedArm>(std::in_place, *options.feed, model, options.seed, DeviationSigmas{}, &watcher);
}

/// Hangs the boards that are looked for in place of the cell's, and puts them first.
Status hang_boards(std::span<const NamedTarget> boards, Scene& scene) {
  for (std::size_t k = 0; k < boards.size(); ++k) {
    const NamedTarget& board = boards[k];
    const bool only = board.name.empty() && scene.boards.size() == 1;
    const auto place = only ? scene.boards.begin() : std::ranges::find(scene.boards, board.name, &BoardPlacement::name);
    if (place == scene.boards.end()) {
      std::vector<std::string> names;
      for (const BoardPlacement& placed : scene.boards) names.push_back(placed.name);
      return failure(Fault::kConfigBadValue,
                     "{}: no place for {}; list yours under 'boards', by the names of the cell's: {}", scene.name,
                     board.name.empty() ? "one board without a name" : "a board '" + board.name + "'",
                     fmt::join(names, ", "));
    }
    exchange_board(scene, board.board, static_cast<std::size_t>(place - scene.boards.begin()));
    const auto front = scene.boards.begin() + static_cast<std::ptrdiff_t>(k);
    std::rotate(front, place, place + 1);
  }
  std::vector<NamedTarget> all;
  for (const BoardPlacement& placed : scene.boards) all.push_back({placed.name, placed.spec});
  return check_distinct(all);
}

class Cell final : public SimulatedCell {
 public:
  Cell(const Scene& loaded, const DepthSensorModel& sensor, const ArmModel& model, const Faults& faults,
       const SimulationOptions& options)
      : workers_(options.workers),
        scenes_(loaded, sensor, faults, &workers_),
        first_(scenes_.at(Instant{})),
        scene_(first_.renderer.scene()),
        description_(describe_cell(scene_, first_.renderer, faults, options)),
        grader_(truth_of(scene_, model, first_, faults, options), workers_),
        watcher_(grader_, scenes_),
        arm_(arm_options(scene_, model, faults, options.seed), options.feed == nullptr ? &watcher_ : nullptr),
        followed_(follow(options, model, watcher_)),
        motion_(followed_ ? static_cast<TrueMotion&>(*followed_) : arm_),
        rig_(model, scene_.mount, motion_),
        color_(color_timing(faults, options.seed), motion_, rig_, scenes_, description_.color, options.fast_sensor),
        depth_(depth_timing(faults, options.seed), motion_, rig_, scenes_, detail(options)),
        hand_(scene_, model, faults, options.seed, motion_),
        pendant_(options.feed == nullptr ? pendant_script(faults) : OperatorScript{}, &hand_),
        panel_(panel_script(faults)) {}

  [[nodiscard]] const CellDescription& description() const override { return description_; }
  [[nodiscard]] hal::RobotArm& arm() override { return arm_; }
  [[nodiscard]] hal::ColorCamera& color() override { return color_; }
  [[nodiscard]] hal::DepthCamera& depth() override { return depth_; }
  [[nodiscard]] hal::Pendant& pendant() override { return pendant_; }
  [[nodiscard]] hal::Panel& panel() override { return panel_; }
  [[nodiscard]] Grader& grader() override { return grader_; }

 private:
  WorkerPool workers_;
  SceneHistory scenes_;
  const SceneSpan& first_;
  const Scene& scene_;
  CellDescription description_;
  TruthGrader grader_;
  GraderInTime watcher_;
  SimulatedArm arm_;
  std::optional<FollowedArm> followed_;
  TrueMotion& motion_;
  CameraRig rig_;
  SimulatedColorCamera color_;
  SimulatedDepthCamera depth_;
  TouchingHand hand_;
  SimulatedPendant pendant_;
  SimulatedPanel panel_;
};

}  // namespace

Result<std::unique_ptr<SimulatedCell>> make_simulated_cell(const SimulationOptions& options) {
  const memory::SimulationScope simulation;
  auto scene = load_cell(options.cell, options.seed, options.arm);
  if (!scene) return std::unexpected(scene.error());
  return make_simulated_cell(options, std::move(*scene));
}

Result<std::unique_ptr<SimulatedCell>> make_simulated_cell(const SimulationOptions& options, Scene scene) {
  const memory::SimulationScope simulation;
  const Result<Faults> faults = parse_faults(options.faults);
  if (!faults) return std::unexpected(faults.error());
  if (const Status hung = hang_boards(options.boards, scene); !hung) return std::unexpected(hung.error());
  if (scene.start_rad.size() != scene.arm.joints) {
    return failure(Fault::kCellInvalid, "{}: start needs {} joint angles", scene.name, scene.arm.joints);
  }
  ArmModel model = scene.arm;
  if (options.feed != nullptr) model.dh = options.feed->true_dh();
  const std::optional<SensorPreset> sensor = find_sensor_preset(options.sensor);
  if (!sensor) return failure(Fault::kUsage, "no depth sensor '{}'", options.sensor);
  if (!scene.mount.depth_is_given) scene.mount.depth = sensor->intrinsics;
  return std::make_unique<Cell>(scene, depth_sensor_model(*sensor), model, *faults, options);
}

}  // namespace firstlook::sim
