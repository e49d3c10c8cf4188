/// How long the choice of the next view takes, in the workshop after the sweep and while exploration goes on.
#include <fmt/format.h>

#include <cmath>
#include <cstdlib>

#include "algorithms/mapping/reach_zone.hpp"
#include "algorithms/mapping/self_filter.hpp"
#include "algorithms/motion/clearance.hpp"
#include "algorithms/view_planning/explore.hpp"
#include "algorithms/view_planning/sweep.hpp"
#include "hal/sim/cell_file.hpp"
#include "hal/sim/contacts.hpp"
#include "hal/sim/renderer.hpp"
#include "platform/loop/worker_pool.hpp"
#include "tests/bench/bench.hpp"

namespace firstlook::bench {
namespace {

constexpr int kWorkers = 2;
constexpr int kCandidates = 720;  // about 570 of them are found free; the goal says 500
constexpr int kCandidatesMin = 500;
constexpr double kResolution_m = 0.05;
constexpr double kFreeMaxAge_s = 3600;

/// What a job has after its calibration: the arm in the cell, the map, and where it may move.
class MappedWorkshop {
 public:
  MappedWorkshop()
      : scene_(load()),
        renderer_(scene_),
        arm_(scene_.arm),
        body_(body_with_camera(arm_, scene_.mount.flange_T_camera())),
        clearance_(required_clearance({.voxel_m = kResolution_m}).clearance()),
        geometry_(GridGeometry::covering({-1.5, -1.5, -0.3}, {1.5, 1.5, 1.5}, kResolution_m)),
        map_(geometry_),
        field_(geometry_, 0.6),
        free_(geometry_.count(), 0),
        zone_(geometry_.count(), 0),
        inserter_(geometry_, sensor()),
        q_(scene_.start_rad) {
    map_.set_safe_zone(scene_.safe_zone);
    mark_reach_zone(geometry_, arm_, body_.capsules, 0.1, -0.3, zone_);
    space_.zone = scene_.safe_zone;
    look();
  }
  MappedWorkshop(const MappedWorkshop&) = delete;
  MappedWorkshop& operator=(const MappedWorkshop&) = delete;

  [[nodiscard]] DepthSensor sensor() const {
    DepthSensor sensor;
    sensor.intrinsics = renderer_.depth_intrinsics(sim::DepthDetail::kFast);
    return sensor;
  }
  [[nodiscard]] ViewContext context() const { return {arm_, body_, space_, clearance_, map_, zone_, mount(), 0, 600}; }
  [[nodiscard]] const GridGeometry& geometry() const { return geometry_; }
  [[nodiscard]] const JointVector& joints() const { return q_; }

  /// Looks at the middle and the end of each segment, as frames on the way do.
  void follow(const Path& path) {
    for (std::size_t i = 1; i < path.waypoints.size(); ++i) {
      for (const double t : {0.5, 1.0}) {
        q_ = interpolate(path.waypoints[i - 1], path.waypoints[i], t);
        look();
      }
    }
    q_ = path.waypoints.back();
    look();
  }
  [[nodiscard]] SweepProgress sweep_plan() const {
    const CameraIntrinsics& c = scene_.mount.depth;
    return plan_sweep(arm_, q_, 2 * std::atan(c.width / (2 * c.fx)));
  }

 private:
  static sim::Scene load() {
    auto scene = sim::load_cell("workshop", 1);
    if (scene) return std::move(*scene);
    fmt::print(stderr, "firstlook_bench: {}\n", describe(scene.error()));
    std::exit(3);
  }
  [[nodiscard]] Transform<Flange, Depth> mount() const {
    return scene_.mount.flange_T_camera() * scene_.mount.camera_T_depth;
  }
  void look() {
    now_s_ += 1;
    const LinkFrames frames = forward(arm_, q_);
    const auto base_T_depth = frames.flange() * mount();
    const CameraIntrinsics& c = renderer_.depth_intrinsics(sim::DepthDetail::kFast);
    std::vector<std::uint16_t> values(static_cast<std::size_t>(c.width) * static_cast<std::size_t>(c.height));
    const Capsules body = place(sim::true_capsules(arm_, scene_.mount.link, scene_.mount.link_T_camera), frames);
    renderer_.render_depth(base_T_depth, {.body = body, .seed = 1, .frame = static_cast<std::uint64_t>(now_s_)},
                           sim::DepthDetail::kFast, {values.data(), c.width, c.height});
    std::vector<float> self_m(values.size());
    const Capsules padded = place(body_.capsules, frames);
    render_self_depth({padded.data(), padded.size()}, 0.02, base_T_depth, c, self_m);
    if (!inserter_.insert(map_, {{values.data(), c.width, c.height}, 1000}, base_T_depth, self_m, now_s_)) std::abort();
    map_.free_mask(now_s_, kFreeMaxAge_s, free_);
    field_.update(free_);
    space_.field = &field_;
  }

  sim::Scene scene_;
  sim::Renderer renderer_;
  ArmModel arm_;
  Body body_;
  Clearance clearance_;
  GridGeometry geometry_;
  VoxelMap map_;
  DistanceField field_;
  std::vector<std::uint8_t> free_, zone_;
  Inserter inserter_;
  FreeSpace space_;
  JointVector q_;
  double now_s_ = 0;
};

void sweep(MappedWorkshop& world, ViewChooser& chooser) {
  SweepProgress progress = world.sweep_plan();
  for (;;) {
    const ViewContext context = world.context();
    chooser.gain().prepare(context);
    const auto step =
        next_sweep_step(progress, context, chooser.gain(), chooser.first_worker(), chooser.planner(), world.joints());
    if (!step || step->done) return;
    world.follow(step->path);
    chooser.remember_look(world.context(), world.joints());
  }
}

}  // namespace

void bench_views(const Options& options, Report& report) {
  MappedWorkshop world;
  ViewChooser chooser(world.geometry(), world.sensor(), kCandidates, kWorkers);
  WorkerPool workers(kWorkers);
  sweep(world, chooser);
  std::vector<double> choices_s, computing_s;
  int free_least = kCandidates;
  ExploreOptions explore;
  const int choices = options.amount(2, 12, 40);
  for (explore.step = 0; static_cast<int>(explore.step) < choices; ++explore.step) {
    const double start = wall_seconds(), computed = process_seconds();
    const auto choice = chooser.choose(world.context(), world.joints(), explore, [&workers](int n, IndexedBody body) {
      workers.parallel_for(n, [&body](int index, int worker) { body(index, worker); });
    });
    const double seconds = wall_seconds() - start, computing = process_seconds() - computed;
    // The last one is the certificate that ends exploration, many times as dear; it is no choice.
    if (!choice || choice->outcome != ViewChoice::Outcome::kChosen) break;
    choices_s.push_back(seconds);
    computing_s.push_back(computing);
    free_least = std::min(free_least, choice->free);
    world.follow(choice->path);
    chooser.remember_look(world.context(), world.joints());
  }
  Row row = timed("views/choose/5cm", 1e3 * median(choices_s), "ms", "", std::nullopt, Goal::ours_at_most(100));
  if (choices_s.empty() || free_least < kCandidatesMin) row.void_because = fmt::format("{} free", free_least);
  report.add(row);
  // Both threads together, whatever else the machine does: half of it is what an idle one would take at best.
  report.add(timed("views/choose/5cm/computing", 1e3 * median(computing_s), "ms", "", std::nullopt, Goal::none()));
  report.add(timed("views/choose/5cm/longest", 1e3 * quantile(choices_s, 1), "ms", "", std::nullopt, Goal::none()));
}

}  // namespace firstlook::bench
