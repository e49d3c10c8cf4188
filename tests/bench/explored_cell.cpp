#include "tests/bench/explored_cell.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>

#include "algorithms/mapping/reach_zone.hpp"
#include "algorithms/mapping/self_filter.hpp"
#include "algorithms/motion/clearance.hpp"
#include "hal/sim/cell_file.hpp"
#include "hal/sim/contacts.hpp"

namespace firstlook::bench {
namespace {

constexpr double kResolution_m = 0.05;
constexpr double kFreeMaxAge_s = 3600;
constexpr double kOnTheWay_s = 0.5;
constexpr double kRoomToSpare_m = 0.015, kSlowSpeed_m_s = 0.05;  // as the job's
constexpr double kZoneMargin_m = 0.1, kZoneFloor_m = -0.3;

sim::Scene load(const std::string& cell, std::uint64_t seed) {
  auto scene = sim::load_cell(cell, seed);
  if (scene) return std::move(*scene);
  fmt::print(stderr, "firstlook_bench: {}\n", describe(scene.error()));
  std::exit(3);
}

DepthSensor sensor_of(const sim::Renderer& renderer) {
  DepthSensor sensor;
  sensor.intrinsics = renderer.depth_intrinsics(sim::DepthDetail::kFast);
  return sensor;
}

}  // namespace

ExploredCell::ExploredCell(const std::string& cell, std::uint64_t seed, int candidates_max, int workers_max)
    : scene_(load(cell, seed)),
      renderer_(scene_),
      world_(renderer_),
      arm_(scene_.arm),
      body_(body_with_camera(arm_, scene_.mount.flange_T_camera())),
      normal_(required_clearance({.voxel_m = kResolution_m}).clearance()),
      slow_(required_clearance({.voxel_m = kResolution_m, .speed_m_s = kSlowSpeed_m_s}).clearance()),
      clearance_(normal_),
      map_(GridGeometry::covering({-1.5, -1.5, -0.3}, {1.5, 1.5, 1.5}, kResolution_m)),
      field_(geometry(), 0.6),
      free_(geometry().count(), 0),
      zone_(geometry().count(), 0),
      inserter_(geometry(), sensor_of(renderer_)),
      chooser_(geometry(), sensor(), candidates_max, workers_max, 1000,
               GainSampling{.cluster_voxels_min = kWorthVoxels}),
      start_(scene_.start_rad),
      q_(scene_.start_rad) {
  map_.set_safe_zone(scene_.safe_zone);
  mark_reach_zone(geometry(), arm_, body_.capsules, kZoneMargin_m, kZoneFloor_m, zone_);
  space_.zone = scene_.safe_zone;
  look();
}

Transform<Flange, Depth> ExploredCell::mount() const {
  return scene_.mount.flange_T_camera() * scene_.mount.camera_T_depth;
}

ViewContext ExploredCell::context_of(const VoxelMap& map, const std::vector<std::uint8_t>& zone) const {
  return {arm_, body_, space_, clearance_, map, zone, mount(), 0, kFreeMaxAge_s};
}

void ExploredCell::look() {
  now_s_ += 1;  // a stamp: the age of what is known plays no part here
  const LinkFrames frames = forward(arm_, q_);
  const auto base_T_depth = frames.flange() * mount();
  const CameraIntrinsics& c = sensor().intrinsics;
  std::vector<std::uint16_t> values(static_cast<std::size_t>(c.width) * static_cast<std::size_t>(c.height));
  const Capsules body = place(sim::true_capsules(arm_, scene_.mount.link, scene_.mount.link_T_camera), frames);
  renderer_.render_depth(base_T_depth, {.body = body, .seed = 1, .frame = static_cast<std::uint64_t>(now_s_)},
                         sim::DepthDetail::kFast, {values.data(), c.width, c.height});
  std::vector<float> self_m(values.size());
  const Capsules padded = place(body_.capsules, frames);
  render_self_depth({padded.data(), padded.size()}, 0.02, base_T_depth, c, self_m);
  const DepthImage depth{{values.data(), c.width, c.height}, 1000};
  const auto inserted = inserter_.insert(map_, depth, base_T_depth, self_m, now_s_);
  if (!inserted) std::abort();
  chooser_.gain().learn_returns(depth, base_T_depth, self_m);
  if (inserted->change.zone_revoked > 0) space_.zone_intact = false;
  map_.free_mask(now_s_, kFreeMaxAge_s, free_);
  field_.update(free_);
  space_.field = &field_;
  note_coverage();
}

void ExploredCell::follow(const Path& path, bool looks_on_the_way) {
  for (std::size_t i = 1; i < path.waypoints.size(); ++i) {
    const SegmentTiming move =
        time_segment(arm_, body_.capsules, path.waypoints[i - 1], path.waypoints[i], timing_.limits);
    double passed_s = 0;
    for (int frame = 1; looks_on_the_way && frame * kOnTheWay_s < move.duration_s; ++frame) {
      q_ = move.position_at(frame * kOnTheWay_s);
      way_.end.time_s += frame * kOnTheWay_s - passed_s;
      passed_s = frame * kOnTheWay_s;
      look();
    }
    way_.end.time_s += move.duration_s - passed_s;
    q_ = path.waypoints[i];
  }
  ++way_.end.stops;
  way_.end.time_s += timing_.settle_s + timing_.look_s;
  look();
}

void ExploredCell::set_pace(Pace pace) {
  clearance_ = pace == Pace::kSlow ? slow_ : normal_;
  if (pace == Pace::kRoomy) clearance_.voxels_m += kRoomToSpare_m;
  timing_.limits.body_speed_m_s = pace == Pace::kSlow ? kSlowSpeed_m_s : SpeedLimits().body_speed_m_s;
}

void ExploredCell::sweep(bool looks_on_the_way) {
  const CameraIntrinsics& c = scene_.mount.depth;
  SweepProgress progress = plan_sweep(arm_, q_, 2 * std::atan(c.width / (2 * c.fx)));
  for (;;) {
    const ViewContext now = context();
    chooser_.gain().prepare(now);
    const auto step = next_sweep_step(progress, now, chooser_.gain(), chooser_.first_worker(), chooser_.planner(), q_);
    if (!step || step->done) return;
    follow(step->path, looks_on_the_way);
    chooser_.remember_look(context(), q_);
  }
}

sim::ObservableProblem ExploredCell::observable_problem() const {
  sim::ObservableProblem problem;
  problem.arm = &arm_;
  problem.world = &world_;
  problem.geometry = geometry();
  problem.body = body_;
  problem.true_capsules = sim::true_capsules(arm_, scene_.mount.link, scene_.mount.link_T_camera);
  problem.flange_T_depth = mount();
  problem.sensor = scene_.mount.depth;
  problem.space.zone = scene_.safe_zone;
  problem.start_rad = start_;
  problem.options.clearance = normal_;
  problem.options.sensor_range_min_m = sensor().range_min_m;
  problem.options.sensor_range_max_m = sensor().range_max_m;
  problem.options.sensor_range_trusted_m = sensor().range_trusted_m;
  problem.options.zone_margin_m = kZoneMargin_m;
  problem.options.zone_floor_m = kZoneFloor_m;
  return problem;
}

void ExploredCell::find_truth(WorkerPool& workers, std::optional<sim::ObservableSet>& observable) {
  world_.matter(geometry(), matter_);
  if (!observable) observable = sim::observable_set(observable_problem(), workers);
  observable_ = *observable;
  inside_.resize(matter_.size());
  for (std::size_t i = 0; i < matter_.size(); ++i) inside_[i] = matter_[i] != 0 && observable_.seen[i] == 0 ? 1 : 0;
  note_coverage();
}

bool ExploredCell::touches_inside(std::size_t index) const {
  const Eigen::Vector3i v = geometry().voxel_at(index);
  for (int side = 0; side < 6; ++side) {
    Eigen::Vector3i n = v;
    n[side / 2] += side % 2 == 0 ? 1 : -1;
    if (geometry().contains(n) && inside_[geometry().index(n)] != 0) return true;
  }
  return false;
}

void ExploredCell::note_coverage() {
  if (observable_.voxels == 0) return;
  std::size_t known = 0;
  for (std::size_t i = 0; i < observable_.seen.size(); ++i)
    known += observable_.seen[i] != 0 && map_.voxel_class(i) != VoxelClass::kUnknown ? 1 : 0;
  way_.coverage = static_cast<double>(known) / static_cast<double>(observable_.voxels);
  if (way_.coverage >= 0.95 && !way_.to_95) way_.to_95 = way_.end;
  if (way_.coverage >= 0.99 && !way_.to_99) way_.to_99 = way_.end;
}

ViewContext ExploredCell::omniscient_context(bool surfaces_count) {
  foreseen_ = map_;
  for (std::size_t i = 0; i < matter_.size(); ++i) {
    if (matter_[i] == 0 || map_.voxel_class(i) != VoxelClass::kUnknown) continue;
    if (inside_[i] != 0 || (!surfaces_count && !touches_inside(i))) foreseen_->set(i, VoxelClass::kOccupied, now_s_);
  }
  return context_of(*foreseen_, observable_.seen);
}

}  // namespace firstlook::bench
