#include "algorithms/view_planning/explore.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "algorithms/motion/configuration_batch.hpp"
#include "algorithms/view_planning/aim.hpp"
#include "algorithms/view_planning/ray_walk.hpp"

namespace firstlook {
namespace {

constexpr std::uint64_t kStream = 4500;  // of random numbers; + one for each candidate of each step
// Targets keep this beside the clearance: the next frame may take a little away from where the arm stands (FACTS 3:
// states with less than 1 mm trap the arm).
constexpr double kTargetMargin_m = 0.005;
constexpr std::uint64_t kRefineStream = 4600ULL << 40;
constexpr std::uint64_t kEyesStream = 4700ULL << 40;
constexpr int kEyesDrawn = 8192, kEyesAtOnce = 256;
constexpr double kRefinedMargin_m = 0.015;  // steps lead towards what hides the rest, and a look there finds more of it
constexpr double kAside_rad = 0.12;         // standard deviation of each joint in a step of refinement
constexpr double kBackMax = 0.4;            // of the way to where the arm is, in every other step
constexpr double kNearby_rad = 0.35;        // standard deviation of each joint around an earlier view
constexpr double kHereShare = 0.25;         // of those: around where the arm is, which has just seen something new
constexpr std::size_t kDrawnAtOnce = 8;
constexpr int kAimedTries = 10;  // for one of another source: most are given up before they cost anything
constexpr int kInVainMax = 2;    // views in a row that make room for motion, and nothing comes of it
constexpr double kStandOffMin_m = 0.6;
constexpr double kStandOffMax_m = 1.5;
constexpr double kAimCone_rad = 1.2;  // about the direction from unknown to free: 70 degrees, beyond it is grazing

/// From an unknown voxel towards the free ones beside it; zero when they cancel out.
Eigen::Vector3d outward(const VoxelMap& map, std::uint32_t voxel) {
  const GridGeometry& geometry = map.geometry();
  const Eigen::Vector3i v = geometry.voxel_at(voxel);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int dz = -1; dz <= 1; ++dz) {
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const Eigen::Vector3i d(dx, dy, dz);
        const Eigen::Vector3i n = v + d;
        if (geometry.contains(n) && map.voxel_class(geometry.index(n)) == VoxelClass::kFree) sum += d.cast<double>();
      }
    }
  }
  return sum;
}

/// Whether nothing but free voxels lies between a point and the middle of a voxel.
bool is_seen_from(const VoxelMap& map, const Eigen::Vector3d& eye, std::uint32_t voxel) {
  const GridGeometry& geometry = map.geometry();
  bool seen = true;
  walk_ray(geometry, eye, geometry.center_m(geometry.voxel_at(voxel)), [&](std::size_t i, double) {
    if (i == voxel) return false;
    seen = map.voxel_class(i) == VoxelClass::kFree && !map.holds_surface(i);
    return seen;
  });
  return seen;
}

/// Of random streams: each choice has one, and its certificate another.
std::uint64_t block_of(std::uint32_t step, bool certificate) {
  return (std::uint64_t{step} << 1) | (certificate ? 1U : 0U);
}

double largest_joint_distance(const JointVector& a, const JointVector& b) { return (a - b).max_abs(); }

}  // namespace

ViewChooser::ViewChooser(const GridGeometry& geometry, const DepthSensor& sensor, int candidates_max, int workers_max,
                         int certificate_samples_max, const GainSampling& sampling)
    : gain_(geometry, sensor, sampling), candidates_max_(candidates_max) {
  ENSURE(4531, candidates_max > 0 && workers_max > 0 && certificate_samples_max > 0);
  for (int i = 0; i < workers_max; ++i) workers_.push_back(gain_.worker());
  const auto room = static_cast<std::size_t>(std::max(candidates_max, kSources * certificate_samples_max)) + kKeptMax;
  kept_.reserve(kKeptMax);
  kept_ahead_.reserve(kKeptMax);
  eyes_m_.reserve(kEyesDrawn);
  candidates_.resize(room);
  order_.reserve(room);
  best_.reserve(room);
  unreached_.reserve(room);
}

std::size_t ViewChooser::required_bytes(const GridGeometry& geometry, const DepthSensor& sensor, int candidates_max,
                                        int workers_max, int certificate_samples_max, const GainSampling& sampling) {
  const auto rays = static_cast<std::size_t>(sampling.columns) * static_cast<std::size_t>(sampling.rows);
  const auto room = static_cast<std::size_t>(std::max(candidates_max, kSources * certificate_samples_max)) + kKeptMax;
  const std::size_t worker = geometry.count() + 2 * rays * sizeof(Eigen::Vector3d);
  return GainModel::required_bytes(geometry, sensor, sampling) + static_cast<std::size_t>(workers_max) * worker +
         room * (sizeof(Candidate) + 3 * sizeof(int)) + 2 * kKeptMax * sizeof(JointVector) +
         kEyesDrawn * sizeof(Eigen::Vector3d);
}

JointVector ViewChooser::draw_random(const Task& task, Random& random) const {
  const ArmModel& arm = task.context.arm;
  JointVector q = JointVector::zero(arm.joints);
  for (int j = 0; j < arm.joints; ++j) {
    // Half a turn to either side holds every posture once, and nothing winds up.
    const auto i = static_cast<std::size_t>(j);
    const double low = std::max(arm.lower_rad[i], task.current[j] - std::numbers::pi);
    const double high = std::min(arm.upper_rad[i], task.current[j] + std::numbers::pi);
    q[j] = random.uniform(low, high);
  }
  return q;
}

JointVector ViewChooser::draw_nearby(const Task& task, Random& random) const {
  const ArmModel& arm = task.context.arm;
  const bool here = visited_.empty() || random.uniform() < kHereShare;
  JointVector q =
      here ? task.current : visited_[static_cast<std::size_t>(random.below(static_cast<int>(visited_.size())))];
  for (int j = 0; j < arm.joints; ++j) {
    const auto i = static_cast<std::size_t>(j);
    q[j] = std::clamp(q[j] + kNearby_rad * random.normal(), arm.lower_rad[i] + kLimitMargin_rad,
                      arm.upper_rad[i] - kLimitMargin_rad);
  }
  return q;
}

/// Where the sensor can be: its places in random configurations, those in known free space.
void ViewChooser::find_eyes(const Task& task, RunParallel run_parallel) {
  const ViewContext& c = task.context;
  eyes_m_.resize(kEyesDrawn);
  const std::uint64_t block = block_of(task.options.step, task.certificate);
  run_parallel(kEyesDrawn / kEyesAtOnce, [&](int part, int) {
    Random random(task.options.seed, kEyesStream + (block << 10) + static_cast<std::uint64_t>(part));
    for (int i = 0; i < kEyesAtOnce; ++i) {
      const LinkFrames frames = forward(c.arm, draw_random(task, random));
      Eigen::Vector3d& eye_m = eyes_m_[static_cast<std::size_t>(part * kEyesAtOnce + i)];
      eye_m = (frames.flange() * c.flange_T_depth).translation();
      if (c.space.margin_m(eye_m, c.clearance) < 0) eye_m.setConstant(std::numeric_limits<double>::quiet_NaN());
    }
  });
  std::erase_if(eyes_m_, [](const Eigen::Vector3d& eye_m) { return eye_m.hasNaN(); });
}

bool ViewChooser::draw_aimed(const Task& task, int index, Random& random, JointVector& q_rad) const {
  const ViewContext& c = task.context;
  const std::span<const std::uint32_t> frontier = gain_.frontier();
  if (frontier.empty() || eyes_m_.empty()) return false;
  // The certificate goes through the frontier evenly; an ordinary choice picks at random.
  const auto n = static_cast<int>(frontier.size());
  const int pick =
      task.certificate ? static_cast<int>(static_cast<std::int64_t>(index) * n / task.samples) : random.below(n);
  const std::uint32_t voxel = frontier[static_cast<std::size_t>(pick)];
  const Eigen::Vector3d out = outward(c.map, voxel);
  const Eigen::Vector3d axis = out.norm() > 1e-9 ? Eigen::Vector3d(out.normalized()) : random.direction();
  const Eigen::Vector3d target = c.map.geometry().center_m(c.map.geometry().voxel_at(voxel));
  // From a place that the sensor has in a random configuration: of places drawn around the target few can be reached.
  const Eigen::Vector3d& eye = eyes_m_[static_cast<std::size_t>(random.below(static_cast<int>(eyes_m_.size())))];
  const Eigen::Vector3d to_eye = eye - target;
  const double distance_m = to_eye.norm();
  const double near_m = std::max(kStandOffMin_m, gain_.sensor().range_min_m + 0.05);
  if (distance_m < near_m || distance_m > std::max(near_m, kStandOffMax_m)) return false;
  if (to_eye.dot(axis) < std::cos(kAimCone_rad) * distance_m) return false;
  if (!is_seen_from(c.map, eye, voxel)) return false;
  if (gain_.needs_backing(voxel) && !gain_.is_backed(c.map, eye, -to_eye / distance_m)) return false;
  const auto base_T_depth =
      look_at<Depth>(target, to_eye / distance_m, distance_m, random.uniform(0, 2 * std::numbers::pi));
  double nearest_rad = 1e9;
  for (const JointVector& q : postures_looking(c.arm, base_T_depth, task.depth_T_flange, distance_m, task.current)) {
    const double distance_rad = largest_joint_distance(q, task.current);
    if (distance_rad >= nearest_rad) continue;
    if (!configuration_is_free(c.arm, c.body, c.space, c.clearance, q, kTargetMargin_m)) continue;
    nearest_rad = distance_rad;
    q_rad = q;
  }
  return nearest_rad < 1e9;
}

void ViewChooser::find_candidate(const Task& task, int index, Candidate& out) const {
  const ViewContext& c = task.context;
  const std::uint64_t block = block_of(task.options.step, task.certificate);
  Random random(task.options.seed, kStream + (block << 20) + static_cast<std::uint64_t>(index));
  // They take turns: random, nearby, aimed.
  const int source = index % kSources;
  out = Candidate{};
  if (index >= task.drawn()) {
    out.tries = 1;
    out.q = kept_[static_cast<std::size_t>(index - task.drawn())];
    out.free = configuration_is_free(c.arm, c.body, c.space, c.clearance, out.q, kRefinedMargin_m);
    return;
  }
  if (source == 2) {
    while (!out.free && out.tries < task.options.tries_per_candidate * kAimedTries) {
      ++out.tries;
      out.free = draw_aimed(task, index / kSources, random, out.q);
    }
    return;
  }
  while (!out.free && out.tries < task.options.tries_per_candidate) {
    std::array<JointVector, kDrawnAtOnce> drawn;
    std::array<std::uint8_t, kDrawnAtOnce> free{};
    for (JointVector& q : drawn) q = source == 0 ? draw_random(task, random) : draw_nearby(task, random);
    configurations_are_free(c.arm, c.body, c.space, c.clearance, drawn, kTargetMargin_m, free);
    for (std::size_t i = 0; i < drawn.size() && !out.free && out.tries < task.options.tries_per_candidate; ++i) {
      ++out.tries;
      out.q = drawn[i];
      out.free = free[i] != 0;
    }
  }
}

/// A view that only makes room for motion pays when a later one looks into something unknown from there.
void ViewChooser::note_progress(std::size_t unknown, std::uint32_t gain_min) {
  if (unknown + gain_min <= unknown_) {
    in_vain_ = 0;
  } else if (made_room_only_) {
    ++in_vain_;
  }
  unknown_ = unknown;
  made_room_only_ = false;
}

bool ViewChooser::worthwhile(const Task& task, const Candidate& candidate) {
  const ViewGain& gain = candidate.gain;
  return candidate.free &&
         (gain.unknown - gain.doubtful >= task.options.gain_min || gain.again - gain.doubtful_again >= task.again_min);
}

/// Gain for each second; 0 when the view is not worth its time.
double ViewChooser::utility_per_s(const Task& task, const ViewGain& gain, double move_s) {
  const ViewTiming& timing = task.options.timing;
  const double all_s = move_s + timing.settle_s + timing.look_s;
  const bool tells = gain.unknown - gain.doubtful >= task.options.gain_min;
  const double again_min = task.options.again_per_m * timing.limits.body_speed_m_s * all_s;
  if (!tells && gain.again - gain.doubtful_again < again_min) return 0;
  return gain.weight() / all_s;
}

/// What a free candidate promises at most: its gain, and for one that may be worth a view its utility.
void ViewChooser::estimate(const Task& task, Candidate& candidate, GainWorker& worker) const {
  const ViewTiming& timing = task.options.timing;
  candidate.gain = gain_.count_at_most(task.context, candidate.q, worker);
  candidate.exact = !worthwhile(task, candidate);
  if (candidate.exact) return;
  const double move_s =
      least_duration_s(task.context.arm, task.context.body.capsules, task.current, candidate.q, timing.limits);
  candidate.utility_per_s = utility_per_s(task, candidate.gain, move_s);
}

void ViewChooser::make_exact(const Task& task, Candidate& candidate, GainWorker& worker) const {
  if (candidate.exact) return;
  const ViewTiming& timing = task.options.timing;
  gain_.find_doubtful(task.context, candidate.q, worker, candidate.gain);
  candidate.exact = true;
  candidate.utility_per_s = 0;
  if (!worthwhile(task, candidate)) return;
  const double move_s =
      time_segment(task.context.arm, task.context.body.capsules, task.current, candidate.q, timing.limits).duration_s;
  candidate.utility_per_s = utility_per_s(task, candidate.gain, move_s);
}

void ViewChooser::score(const Task& task, RunParallel run_parallel) {
  const auto score_one = [&](int index, int worker) {
    Candidate& candidate = candidates_[static_cast<std::size_t>(index)];
    GainWorker& own = workers_[static_cast<std::size_t>(worker)];
    find_candidate(task, index, candidate);
    if (!candidate.free) return;
    estimate(task, candidate, own);
    if (task.certificate) make_exact(task, candidate, own);  // it says how many there are
  };
  run_parallel(task.candidates(), score_one);
}

/// Improves the best candidates by steps to the side and back towards where the arm is: what they see from there costs
/// less of a move, or more is seen. Each keeps the best that its steps found.
void ViewChooser::refine(const Task& task, RunParallel run_parallel) {
  const ViewContext& c = task.context;
  const auto refine_one = [&](int index, int worker) {
    Candidate& best = candidates_[static_cast<std::size_t>(best_[static_cast<std::size_t>(index)])];
    GainWorker& own = workers_[static_cast<std::size_t>(worker)];
    Random random(task.options.seed, kRefineStream + (static_cast<std::uint64_t>(task.options.step) << 10) +
                                         static_cast<std::uint64_t>(index));
    for (int step = 0; step < task.options.refine_steps; ++step) {
      Candidate tried;
      tried.tries = best.tries + 1;
      const double back = std::max(0.0, random.uniform(-kBackMax, kBackMax));
      tried.q = best.q;
      for (int j = 0; j < c.arm.joints; ++j) {
        const auto i = static_cast<std::size_t>(j);
        const double q_rad = best.q[j] + back * (task.current[j] - best.q[j]) + kAside_rad * random.normal();
        tried.q[j] = std::clamp(q_rad, c.arm.lower_rad[i] + kLimitMargin_rad, c.arm.upper_rad[i] - kLimitMargin_rad);
      }
      tried.free = configuration_is_free(c.arm, c.body, c.space, c.clearance, tried.q, kRefinedMargin_m);
      if (tried.free) estimate(task, tried, own);
      if (tried.utility_per_s > best.utility_per_s) make_exact(task, tried, own);
      best.tries = tried.tries;
      if (tried.exact && tried.utility_per_s > best.utility_per_s) best = tried;
    }
  };
  rank(task);
  best_.clear();
  while (static_cast<int>(best_.size()) < task.options.refined) {
    const Candidate* best = next_best(task);
    if (best == nullptr) break;
    best_.push_back(static_cast<int>(best - candidates_.data()));
  }
  run_parallel(static_cast<int>(best_.size()), refine_one);
}

bool ViewChooser::is_worse(int a, int b) const {
  const double ua = candidates_[static_cast<std::size_t>(a)].utility_per_s;
  const double ub = candidates_[static_cast<std::size_t>(b)].utility_per_s;
  return ua < ub || (ua == ub && a > b);
}

/// Makes the heap of all that may be worth a view.
void ViewChooser::rank(const Task& task) {
  order_.clear();
  for (int i = 0; i < task.candidates(); ++i) {
    if (candidates_[static_cast<std::size_t>(i)].utility_per_s > 0) order_.push_back(i);
  }
  std::ranges::make_heap(order_, [this](int a, int b) { return is_worse(a, b); });
}

/// Takes the best off the heap, exact; null when none is left. Most of the others need never be made so.
const ViewChooser::Candidate* ViewChooser::next_best(const Task& task) {
  const auto worse = [this](int a, int b) { return is_worse(a, b); };
  while (!order_.empty()) {
    std::ranges::pop_heap(order_, worse);
    Candidate& candidate = candidates_[static_cast<std::size_t>(order_.back())];
    if (candidate.exact) {
      order_.pop_back();
      return &candidate;
    }
    make_exact(task, candidate, workers_.front());
    if (candidate.utility_per_s > 0) {
      std::ranges::push_heap(order_, worse);
    } else {
      order_.pop_back();
    }
  }
  return nullptr;
}

bool ViewChooser::beside_unreached(const Task& task, const JointVector& q_rad) const {
  const ViewContext& c = task.context;
  return std::any_of(unreached_.begin(), unreached_.end(), [&](int i) {
    const JointVector& other = candidates_[static_cast<std::size_t>(i)].q;
    return certify(c.arm, c.body, c.space, c.clearance, other, q_rad).certified();
  });
}

Status ViewChooser::plan_best(const Task& task, ViewChoice& choice) {
  const ViewTiming& timing = task.options.timing;
  PlannerOptions planning;
  planning.seed = task.options.seed + task.options.step;
  planning.iterations_max = task.options.plan_iterations_max;
  planning.limits = timing.limits;
  planning.trail = task.options.trail;
  const ViewContext& c = task.context;
  if (Status begun = planner_.begin(c.arm, c.body, c.space, c.clearance, task.current, planning); !begun) return begun;
  const int plans_max = task.options.plans_max * (task.certificate ? 2 : 1);
  int plans = 0;
  unreached_.clear();
  rank(task);
  choice.certificate.unreached += task.certificate ? static_cast<int>(order_.size()) : 0;
  while (plans < plans_max) {
    const Candidate* candidate = next_best(task);
    // Utilities of straight moves bound what paths can give: from here on nothing is better.
    if (candidate == nullptr || candidate->utility_per_s <= choice.utility_per_s) break;
    ++choice.worthwhile;
    if (beside_unreached(task, candidate->q)) continue;
    ++plans;
    const Result<Path> path = planner_.plan_to(candidate->q);
    if (!path) {
      unreached_.push_back(static_cast<int>(candidate - candidates_.data()));
      continue;
    }
    const double utility = utility_per_s(task, candidate->gain, path->duration_s);
    if (utility <= choice.utility_per_s) continue;
    choice.outcome = ViewChoice::Outcome::kChosen;
    choice.target = candidate->q;
    choice.path = *path;
    choice.gain = candidate->gain;
    choice.utility_per_s = utility;
  }
  choice.planned += plans;
  return {};
}

/// Those that would tell most of what is left, but for the one that was chosen and those that no path was found to.
void ViewChooser::keep_good(const Task& task, const ViewChoice& choice, std::vector<JointVector>& kept) {
  std::vector<int>& good = order_;
  good.clear();
  for (int i = 0; i < task.candidates(); ++i) {
    const Candidate& candidate = candidates_[static_cast<std::size_t>(i)];
    if (candidate.utility_per_s > 0 && !(candidate.q == choice.target) &&
        std::ranges::find(unreached_, i) == unreached_.end())
      good.push_back(i);
  }
  const auto tells_more = [this](int a, int b) {
    const double wa = candidates_[static_cast<std::size_t>(a)].gain.weight();
    const double wb = candidates_[static_cast<std::size_t>(b)].gain.weight();
    return wa > wb || (wa == wb && a < b);
  };
  const std::size_t count = std::min(good.size(), kKeptMax);
  kept.clear();
  std::ranges::partial_sort(good, good.begin() + static_cast<std::ptrdiff_t>(count), tells_more);
  for (std::size_t i = 0; i < count; ++i) kept.push_back(candidates_[static_cast<std::size_t>(good[i])].q);
}

bool ViewChooser::can_move(const Task& task) const {
  const ViewContext& c = task.context;
  const auto last = candidates_.begin() + task.drawn();
  return std::any_of(candidates_.begin(), last, [&](const Candidate& candidate) {
    return candidate.free && certify(c.arm, c.body, c.space, c.clearance, task.current, candidate.q).certified();
  });
}

void ViewChooser::certify_end(const Task& task, ViewChoice& choice) const {
  TerminationCertificate& certificate = choice.certificate;
  certificate.gain_min = task.options.gain_min;
  for (int i = 0; i < task.drawn(); ++i) {
    const Candidate& candidate = candidates_[static_cast<std::size_t>(i)];
    if (!candidate.free) continue;
    ++(i % kSources == 0   ? certificate.random_samples
       : i % kSources == 1 ? certificate.nearby_samples
                           : certificate.aimed_samples);
    if (!worthwhile(task, candidate)) {
      certificate.gain_best = std::max(certificate.gain_best, candidate.gain.unknown - candidate.gain.doubtful);
    }
  }
  certificate.clusters =
      static_cast<int>(find_remaining(task.context.map, task.context.zone, task.options.gain_min).size());
  choice.outcome = can_move(task) ? ViewChoice::Outcome::kComplete : ViewChoice::Outcome::kNothingReachable;
}

Result<ViewChoice> ViewChooser::choose(const ViewContext& context, const JointVector& current,
                                       const ExploreOptions& options, RunParallel run_parallel) {
  ENSURE(4532, kSources * static_cast<std::size_t>(options.certificate_samples) <= candidates_.size());
  gain_.prepare(context);
  if (!options.after_look) {
    note_progress(gain_.unknown(), options.gain_min);
    auto choice = search(context, current, options, run_parallel);
    if (choice && choice->outcome == ViewChoice::Outcome::kChosen)
      made_room_only_ = choice->gain.unknown < options.gain_min;
    return choice;
  }
  if (!gain_.assume_look(context, current, workers_.front())) return ViewChoice{};
  auto choice = search(context, current, options, run_parallel);
  gain_.prepare(context);  // the look is judged by what it was chosen for
  return choice;
}

void ViewChooser::adopt(const ViewGain& gain, std::size_t unknown, std::uint32_t gain_min) {
  kept_.swap(kept_ahead_);
  note_progress(unknown, gain_min);
  made_room_only_ = gain.unknown < gain_min;
}

Result<ViewChoice> ViewChooser::search(const ViewContext& context, const JointVector& current,
                                       const ExploreOptions& options, RunParallel run_parallel) {
  ViewChoice choice;
  Task task{.context = context,
            .current = current,
            .options = options,
            .depth_T_flange = context.flange_T_depth.inverse(),
            .again_min = in_vain_ < kInVainMax ? options.again_few : options.again_min,
            .certificate = false,
            .samples = candidates_max_,
            .kept = static_cast<int>(kept_.size())};
  for (const bool certificate : {false, true}) {
    task.certificate = certificate;
    if (certificate) task.samples = options.certificate_samples, task.kept = 0;
    find_eyes(task, run_parallel);
    score(task, run_parallel);
    refine(task, run_parallel);
    for (int i = 0; i < task.candidates(); ++i) {
      choice.considered += candidates_[static_cast<std::size_t>(i)].tries;
      choice.free += candidates_[static_cast<std::size_t>(i)].free ? 1 : 0;
    }
    if (Status planned = plan_best(task, choice); !planned) return std::unexpected(planned.error());
    if (choice.outcome == ViewChoice::Outcome::kChosen) {
      keep_good(task, choice, options.after_look ? kept_ahead_ : kept_);
      return choice;
    }
  }
  certify_end(task, choice);
  return choice;
}

void ViewChooser::remember_look(const ViewContext& context, const JointVector& q_rad) {
  gain_.remember_look(context, q_rad, workers_.front());
  if (visited_.full()) {
    std::rotate(visited_.begin(), visited_.begin() + 1, visited_.end());
    visited_.pop_back();
  }
  visited_.push_back(q_rad);
}

}  // namespace firstlook
