/// Jobs that plan motion: certified paths, the sweep, the next best view.
#include "app/jobs/workbench.hpp"

namespace firstlook {

Route Workbench::route_of(const Path& path, const Body& body) const {
  Route route;
  for (std::size_t i = 1; i < path.waypoints.size(); ++i) {
    const SegmentTiming t = time_segment(arm_, body.capsules, path.waypoints[i - 1], path.waypoints[i], limits_);
    if (t.duration_s > 0) route.push_back({path.waypoints[i], t.leading_speed_rad_s, t.leading_acceleration_rad_s2});
  }
  return route;
}

bool Workbench::route_is_certified(const JointVector& from, const Route& route, MotionPhase phase,
                                   double* margin_m) const {
  const FreeSpace space = space_of(phase);
  const Clearance clearance = clearance_of(phase);
  JointVector at = from;
  for (const Leg& leg : route) {
    const Certificate certificate = certify(arm_, body_of(phase), space, clearance, at, leg.target_rad);
    if (!certificate.certified()) return false;
    if (margin_m != nullptr) *margin_m = std::min(*margin_m, certificate.margin_m);
    at = leg.target_rad;
  }
  return true;
}

PlanResult Workbench::plan(const PlanArguments& arguments) {
  PlanResult result;
  const Body& body = body_of(arguments.phase);
  if (arguments.phase == MotionPhase::kMapping) rebuild_free_space(arguments.now_s);
  PlannerOptions options;
  options.seed = mix64(static_cast<std::uint64_t>(config_.seed)) + arguments.step;
  options.limits = limits_;
  const auto path = planner_.plan(arm_, body, space_of(arguments.phase), clearance_of(arguments.phase),
                                  arguments.from_rad, arguments.to_rad, options);
  if (!path) {
    result.fault = path.error().fault;
    return result;
  }
  result.found = true;
  result.path = route_of(*path, body);
  result.margin_m = path->margin_m;
  return result;
}

PlanResult Workbench::certify_path(const PlanArguments& arguments) {
  PlanResult result;
  rebuild_free_space(arguments.now_s);
  result.margin_m = 1;
  result.found = route_is_certified(arguments.from_rad, arguments.path, arguments.phase, &result.margin_m);
  result.path = arguments.path;
  return result;
}

void Workbench::take_choice(NextViewResult& result, const Path& path, double gain) {
  result.found = true;
  result.path = route_of(path, camera_body_);
  result.gain_expected = gain;
  expected_gain_ = gain;
}

NextViewResult Workbench::next_sweep_view(const FromHere& here) {
  NextViewResult result;
  rebuild_free_space(here.now_s);
  const CameraIntrinsics& depth = depth_.intrinsics();
  SweepOptions options;
  options.seed = static_cast<std::uint64_t>(config_.seed) + here.step;
  options.limits = limits_;
  if (!sweep_) {
    sweep_ = plan_sweep(arm_, facts_.start_rad, 2 * std::atan(depth.width / (2 * depth.fx)), options);
  }
  const ViewContext view_context = context();
  chooser_.gain().prepare(view_context);
  const auto step = next_sweep_step(*sweep_, view_context, chooser_.gain(), chooser_.first_worker(), planner_,
                                    here.at_rad, options);
  if (!step) {
    result.blocked = step.error().fault == Fault::kStartBlocked;
    result.fault = step.error().fault;
  } else if (!step->done) {
    take_choice(result, step->path, step->gain.unknown);
  } else {
    sweeping_ = false;
  }
  return result;
}

NextViewResult Workbench::next_view(const FromHere& here) {
  NextViewResult result;
  sweeping_ = false;
  rebuild_free_space(here.now_s);
  ExploreOptions options;
  options.seed = static_cast<std::uint64_t>(config_.seed);
  options.step = here.step;
  options.gain_min = static_cast<std::uint32_t>(config_.explore.cluster_voxels_min);
  options.certificate_samples = config_.explore.certificate_samples;
  options.timing = timing();
  const ViewContext view_context = context();
  const auto choice = chooser_.choose(view_context, here.at_rad, options, [this](int n, IndexedBody body) {
    workers_.parallel_for(n, [&body](int index, int worker) { body(index, worker); });
  });
  if (!choice) {
    result.blocked = choice.error().fault == Fault::kStartBlocked;
    result.fault = choice.error().fault;
    return result;
  }
  result.candidates = static_cast<std::uint32_t>(choice->free);
  if (choice->outcome == ViewChoice::Outcome::kChosen) take_choice(result, choice->path, choice->gain.unknown);
  return result;
}

}  // namespace firstlook
