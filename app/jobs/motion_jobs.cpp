/// Jobs that plan motion: certified paths, the sweep, the next best view.
#include <algorithm>

#include "algorithms/view_planning/thesis_views.hpp"
#include "app/jobs/workbench.hpp"

namespace firstlook {

Route Workbench::route_of(const Path& path, const Body& body, const SpeedLimits& limits) const {
  Route route;
  for (std::size_t i = 1; i < path.waypoints.size(); ++i) {
    const SegmentTiming t = time_segment(arm_, body.capsules, path.waypoints[i - 1], path.waypoints[i], limits);
    if (t.duration_s > 0) route.push_back({path.waypoints[i], t.leading_speed_rad_s, t.leading_acceleration_rad_s2});
  }
  return route;
}

bool Workbench::route_is_certified(const JointVector& from, const Route& route, double* margin_m) const {
  return route_is_certified(camera_body_, mapping_space_, clearance_in_force_, from, route, margin_m);
}

bool Workbench::route_is_certified(const Body& body, const FreeSpace& space, const Clearance& clearance,
                                   const JointVector& from, const Route& route, double* margin_m) const {
  JointVector at = from;
  for (const Leg& leg : route) {
    const Certificate certificate = certify(arm_, body, space, clearance, at, leg.target_rad);
    if (!certificate.certified()) return false;
    if (margin_m != nullptr) *margin_m = std::min(*margin_m, certificate.margin_m);
    at = leg.target_rad;
  }
  return true;
}

PlanResult Workbench::plan(const PlanArguments& arguments) {
  PlanResult result;
  const bool mapping = arguments.phase == MotionPhase::kMapping;
  PlannerOptions options;
  options.seed = mix64(static_cast<std::uint64_t>(config_.seed)) + arguments.step;
  options.limits = limits_;
  if (mapping) options.trail = trail_;
  const auto plan_at = [&](const FreeSpace& space, const Pace& pace) {
    const Body& body = body_of(arguments.phase);
    options.limits = pace.limits;
    const auto path = planner_.plan(arm_, body, space, pace.plan, arguments.from_rad, arguments.to_rad, options);
    if (!path) {
      result.fault = path.error().fault;
      note_blocked(path.error());
      return;
    }
    result.found = true;
    result.path = route_of(*path, body, pace.limits);
    result.margin_m = path->margin_m;
    clearance_in_force_ = pace.in_force;
    if (mapping) note_trail(*path);
  };
  if (!mapping) {
    const Clearance blind = blind_terms_.clearance();
    publish_blind(arguments.now_s, arguments.phase);
    plan_at(space_of(arguments.phase), {blind, blind, limits_});
    return result;
  }
  rebuild_free_space(arguments.now_s);
  for (const Pace& pace : mapping_paces()) {
    plan_at(mapping_space_, pace);
    if (result.found) break;
  }
  return result;
}

PlanResult Workbench::certify_path(const PlanArguments& arguments) {
  PlanResult result;
  result.margin_m = 1;
  result.path = arguments.path;
  if (arguments.phase != MotionPhase::kMapping) {
    publish_blind(arguments.now_s, arguments.phase);
    result.found = route_is_certified(body_of(arguments.phase), space_of(arguments.phase), blind_terms_.clearance(),
                                      arguments.from_rad, arguments.path, &result.margin_m);
    return result;
  }
  rebuild_free_space(arguments.now_s);
  if (arguments.foreseen) {
    if (!foreseen_) return result;  // nothing says which clearance its speed needs
    clearance_in_force_ = foreseen_->pace.in_force;
  }
  result.found = route_is_certified(arguments.from_rad, arguments.path, &result.margin_m);
  if (arguments.foreseen && result.found) {
    take_choice(foreseen_->path, foreseen_->gain.unknown, foreseen_->pace);
    chooser_.adopt(foreseen_->gain, unknown_before_, gain_min());
  }
  foreseen_.reset();
  return result;
}

void Workbench::note_blocked(const Error& error) {
  if (error.fault == Fault::kStartBlocked) blocked_ = error;
}

/// The waypoints of paths that the arm was sent along, the latest last; whoever uses them certifies them again.
void Workbench::note_trail(const Path& path) {
  if (trail_.size() + path.waypoints.size() > trail_.capacity()) {
    const auto middle = trail_.begin() + static_cast<std::ptrdiff_t>(trail_.size() / 2);
    trail_.resize(static_cast<std::size_t>(std::copy(middle, trail_.end(), trail_.begin()) - trail_.begin()));
  }
  for (const JointVector& q : path.waypoints) trail_.push_back(q);
}

void Workbench::take_choice(const Path& path, double gain, const Pace& pace) {
  note_trail(path);
  expected_gain_ = gain;
  clearance_in_force_ = pace.in_force;
}

NextViewResult Workbench::found_view(const Path& path, double gain, const Pace& pace) const {
  NextViewResult result;
  result.found = true;
  result.path = route_of(path, camera_body_, pace.limits);
  result.gain_expected = gain;
  return result;
}

NextViewResult Workbench::sweep_at(const Pace& pace, const FromHere& here) {
  NextViewResult result;
  SweepOptions options;
  options.seed = static_cast<std::uint64_t>(config_.seed) + here.step;
  options.limits = pace.limits;
  if (!sweep_) {
    const CameraIntrinsics& depth = depth_.intrinsics();
    sweep_ = plan_sweep(arm_, facts_.start_rad, 2 * std::atan(depth.width / (2 * depth.fx)), options);
  }
  const ViewContext view_context = context(pace.plan);
  chooser_.gain().prepare(view_context);
  const auto step =
      next_sweep_step(*sweep_, view_context, chooser_.gain(), chooser_.first_worker(), planner_, here.at_rad, options);
  if (!step) {
    result.blocked = step.error().fault == Fault::kStartBlocked;
    result.fault = step.error().fault;
    note_blocked(step.error());
  } else if (!step->done && !exploring_is_faster(view_context, *step, pace, here)) {
    result = found_view(step->path, step->gain.unknown, pace);
    take_choice(step->path, step->gain.unknown, pace);
  }
  return result;
}

/// Whether the best view that exploration finds from here tells more a second than a step of the sweep. The thesis's
/// sweep goes on to its end: its views are few and start badly without.
bool Workbench::exploring_is_faster(const ViewContext& view_context, const SweepStep& step, const Pace& pace,
                                    const FromHere& here) {
  if (config_.explore.views == "thesis2014") return false;
  const Result<ViewChoice> best = choose_view(view_context, pace, here);
  const ViewTiming timing = view_timing(pace);
  const double step_s = step.path.duration_s + timing.settle_s + timing.look_s;
  return best && best->outcome == ViewChoice::Outcome::kChosen && best->utility_per_s > step.gain.weight() / step_s;
}

NextViewResult Workbench::next_sweep_view(const FromHere& here) {
  rebuild_free_space(here.now_s);
  expected_gain_ = 0;  // what an earlier choice expected says nothing about the next look
  NextViewResult result;
  for (const Pace& pace : mapping_paces()) {
    result = sweep_at(pace, here);
    if (!result.blocked) break;
  }
  sweeping_ = result.found || result.blocked;
  if (!sweeping_) std::copy(map_.log_odds().begin(), map_.log_odds().end(), swept_log_odds_.begin());
  return result;
}

ViewTiming Workbench::view_timing(const Pace& pace) const {
  return {.limits = pace.limits, .settle_s = config_.calibration.settle_time_s};
}

Result<ViewChoice> Workbench::choose_view(const ViewContext& view_context, const Pace& pace, const FromHere& here) {
  if (config_.explore.views == "thesis2014") {
    ThesisOptions options;
    options.seed = static_cast<std::uint64_t>(config_.seed);
    options.step = here.step;
    options.limits = pace.limits;
    options.trail = trail_;
    return choose_as_thesis(view_context, here.at_rad, planner_, options);
  }
  ExploreOptions options;
  options.seed = static_cast<std::uint64_t>(config_.seed);
  options.step = here.step;
  options.after_look = here.after_look;
  options.gain_min = gain_min();
  options.certificate_samples = config_.explore.certificate_samples;
  options.timing = view_timing(pace);
  options.trail = trail_;
  return chooser_.choose(view_context, here.at_rad, options,
                         [this](int n, IndexedBody body) { spread_over_workers(n, body); });
}

NextViewResult Workbench::explore_at(const Pace& pace, const FromHere& here) {
  NextViewResult result;
  const auto choice = choose_view(context(pace.plan), pace, here);
  if (!choice) {
    result.blocked = choice.error().fault == Fault::kStartBlocked;
    result.fault = choice.error().fault;
    if (!here.after_look) note_blocked(choice.error());
    return result;
  }
  if (choice->outcome == ViewChoice::Outcome::kChosen) {
    result = found_view(choice->path, choice->gain.unknown, pace);
    if (here.after_look) {
      foreseen_ = ForeseenView{choice->path, choice->gain, pace};
    } else {
      take_choice(choice->path, choice->gain.unknown, pace);
    }
  }
  result.candidates = static_cast<std::uint32_t>(choice->free);
  result.blocked = choice->outcome == ViewChoice::Outcome::kNothingReachable;
  return result;
}

NextViewResult Workbench::next_view(const FromHere& here) {
  rebuild_free_space(here.now_s);
  sweeping_ = false;
  foreseen_.reset();
  NextViewResult result;
  if (here.after_look && config_.explore.views == "thesis2014") return result;  // nothing was chosen on the way there
  if (!here.after_look) expected_gain_ = 0;
  const auto paces = mapping_paces();
  for (std::size_t i = 0; i < paces.size(); ++i) {
    result = explore_at(paces[i], here);
    // Nothing more to see with room to spare may still be seen with the clearance that is required; slower only when
    // the arm could not move otherwise.
    if (result.found || (i >= 1 && !result.blocked)) break;
  }
  return result;
}

}  // namespace firstlook
