#include "algorithms/view_planning/calibration_views.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numbers>
#include <vector>

#include "algorithms/kinematics/self_collision.hpp"
#include "algorithms/view_planning/aim.hpp"

namespace firstlook {
namespace {

constexpr std::uint64_t kStream = 4400;    // of random numbers; one for each choice
constexpr std::size_t kBestMax = 64;       // candidates kept for the planner to try
constexpr double kNearby_rad = 0.3;        // standard deviation of each joint around an earlier view
constexpr double kTargetMargin_m = 0.005;  // states with less trap the arm (FACTS 3)
constexpr double kDegree_rad = std::numbers::pi / 180;

struct Candidate {
  JointVector q;
  std::uint32_t shown = 0;
  double cost = 0;   ///< expected
  double worth = 0;  ///< what it is expected to lower the cost by, for each second
};

/// Everything that one choice collects.
struct Search {
  const CalibrationViewInputs& inputs;
  const JointVector& current;
  const CalibrationViewOptions& options;
  Random random;
  double cost_now = 0;
  FixedVector<Candidate, kBestMax> best;  ///< of most worth first; of equal ones the earlier
  int considered = 0;
  int feasible = 0;
};

double cost_of(const Matrix6d& covariance, const CalibrationViewOptions& options) {
  return options.criterion == DesignCriterion::kVolume ? design_volume(covariance)
                                                       : design_cost(covariance, options.cost_lever_m);
}

/// What a view is chosen by: the transform's cost, or the sum of those of the poses of the targets that are wanted.
double cost_of(const Eigen::MatrixXd& information, const CalibrationViewOptions& options) {
  if (options.wanted == 0) return cost_of(predicted_hand_eye(information), options);
  const Eigen::MatrixXd covariance = predicted_joint(information);
  double cost = 0;
  for (Eigen::Index at = 6, k = 0; at < covariance.rows(); at += 6, ++k) {
    const bool wanted = (options.wanted >> k & 1U) != 0;
    if (wanted) cost += design_cost(covariance.block<6, 6>(at, at), options.cost_lever_m);
  }
  return cost;
}

/// Bit mask of the targets that pass.
template <typename Passes>
std::uint32_t targets_that(std::span<const ViewDesignModel> models, Passes passes) {
  std::uint32_t mask = 0;
  for (std::size_t k = 0; k < models.size(); ++k) {
    if (passes(k, models[k])) mask |= 1U << k;
  }
  return mask;
}

bool is_new(const Search& s, const JointVector& q) {
  return std::all_of(s.inputs.taken.begin(), s.inputs.taken.end(), [&](const JointVector& other) {
    return joint_distance_rad(q, other) >= s.options.different_min_rad;
  });
}

void keep_when_good(Search& s, const Candidate& candidate) {
  if (s.best.full()) {
    if (candidate.worth <= s.best.back().worth) return;
    s.best.pop_back();
  }
  const auto place = std::upper_bound(s.best.begin(), s.best.end(), candidate,
                                      [](const Candidate& a, const Candidate& b) { return a.worth > b.worth; });
  const auto at = place - s.best.begin();
  s.best.push_back(candidate);
  std::rotate(s.best.begin() + at, s.best.end() - 1, s.best.end());
}

/// Of a view that shows these targets, one as good as the other.
double likelihood(const CalibrationViewInputs& in, std::uint32_t shown, const Transform<Base, Flange>& base_T_flange) {
  double sum = 0;
  for (std::size_t k = 0; k < in.models.size(); ++k) {
    if ((shown >> k & 1U) != 0) sum += sight_likelihood(in.models[k], k, base_T_flange, in.looks);
  }
  return sum / std::popcount(shown);
}

/// What a view there is expected to lower the cost by, for each second of move and stop. Only what may be kept is timed
/// in full.
double worth(const Search& s, const JointVector& q, double drop) {
  if (s.options.stop_s <= 0) return drop;
  const CalibrationViewInputs& in = s.inputs;
  const double least_s = least_duration_s(in.arm, in.body.capsules, s.current, q, s.options.speed);
  const double at_most = drop / (least_s + s.options.stop_s);
  if (s.best.full() && at_most <= s.best.back().worth) return at_most;
  return drop / (time_segment(in.arm, in.body.capsules, s.current, q, s.options.speed).duration_s + s.options.stop_s);
}

/// Keeps q when it is new, sees a whole board that serves, is free and does not hide it: from cheap to dear.
void consider(Search& s, const JointVector& q) {
  ++s.considered;
  if (!is_new(s, q)) return;
  const CalibrationViewInputs& in = s.inputs;
  const LinkFrames frames = forward(in.arm, q);
  const std::uint32_t useful = s.options.wanted == 0 ? ~0U : s.options.wanted;
  const auto in_view = targets_that(in.models, [&](std::size_t, const ViewDesignModel& model) {
    return check_view(model, frames.flange(), s.options.limits) == ViewFault::kNone;
  });
  if ((in_view & useful) == 0) return;
  if (!configuration_is_free(in.arm, in.body, in.space, in.clearance, q, kTargetMargin_m)) return;
  const Capsules body = place(in.body.capsules, frames);
  const auto shown = targets_that(in.models, [&](std::size_t k, const ViewDesignModel& model) {
    return (in_view >> k & 1U) != 0 && !hides_board(model, body, frames.flange());
  });
  if ((shown & useful) == 0) return;
  const Eigen::MatrixXd information = in.information + joint_view_information(in.models, shown, frames.flange());
  ++s.feasible;
  const double likely = likelihood(in, shown & useful, frames.flange());
  const double cost = likely * cost_of(information, s.options) + (1 - likely) * s.cost_now;
  keep_when_good(s, {q, shown, cost, worth(s, q, s.cost_now - cost)});
}

void draw_aimed(Search& s) {
  const CalibrationViewInputs& in = s.inputs;
  std::vector<const ViewDesignModel*> aims;
  for (std::size_t k = 0; k < in.models.size(); ++k) {
    if (s.options.wanted == 0 || (s.options.wanted >> k & 1U) != 0) aims.push_back(&in.models[k]);
  }
  for (int i = 0; i < s.options.aimed_draws; ++i) {
    const ViewDesignModel& model = *aims[static_cast<std::size_t>(i) % aims.size()];
    const Transform<Camera, Flange> camera_T_flange = model.flange_T_camera.inverse();
    const Eigen::Vector3d center = model.base_T_board * model.board.center();
    const Eigen::Vector3d front = -model.base_T_board.rotation().col(2);  // its z points away from who sees it
    const Eigen::Vector3d direction = direction_within(front, s.options.tilt_max_rad, s.random);
    const double distance_m = s.random.uniform(s.options.distance_min_m, s.options.distance_max_m);
    const double roll_rad = s.random.uniform(0, 2 * std::numbers::pi);
    const Eigen::Vector3d target = center + 0.03 * s.random.normal3();  // the board need not be in the middle
    const auto base_T_camera = look_at<Camera>(target, direction, distance_m, roll_rad);
    // The camera stands in known free space: cheaper to ask than how the arm gets it there.
    if (in.space.margin_m(base_T_camera.translation(), in.clearance) < 0) continue;
    for (const JointVector& q : postures_looking(in.arm, base_T_camera, camera_T_flange, distance_m, s.current)) {
      consider(s, q);
    }
  }
}

void draw_random(Search& s) {
  const ArmModel& arm = s.inputs.arm;
  for (int i = 0; i < s.options.random_draws; ++i) {
    JointVector q = JointVector::zero(arm.joints);
    for (int j = 0; j < arm.joints; ++j) {
      const auto at = static_cast<std::size_t>(j);
      q[j] = s.random.uniform(std::max(arm.lower_rad[at], s.current[j] - std::numbers::pi),
                              std::min(arm.upper_rad[at], s.current[j] + std::numbers::pi));
    }
    consider(s, q);
  }
}

void draw_nearby(Search& s) {
  const ArmModel& arm = s.inputs.arm;
  for (int i = 0; i < s.options.nearby_draws; ++i) {
    const int pick = s.random.below(static_cast<int>(s.inputs.taken.size()) + 1);
    JointVector q = pick == 0 ? s.current : s.inputs.taken[static_cast<std::size_t>(pick) - 1];
    for (int j = 0; j < arm.joints; ++j) {
      const auto at = static_cast<std::size_t>(j);
      q[j] = std::clamp(q[j] + kNearby_rad * s.random.normal(), arm.lower_rad[at] + kLimitMargin_rad,
                        arm.upper_rad[at] - kLimitMargin_rad);
    }
    consider(s, q);
  }
}

PlannerOptions planning(const CalibrationViewOptions& options) {
  PlannerOptions planner_options;
  planner_options.seed = options.seed + options.step;
  planner_options.iterations_max = options.plan_iterations_max;
  planner_options.limits = options.speed;
  return planner_options;
}

}  // namespace

PredictedSigma predicted_sigma(const Matrix6d& covariance) {
  return {.translation_m = std::sqrt(covariance.topLeftCorner<3, 3>().trace()),
          .rotation_rad = std::sqrt(covariance.bottomRightCorner<3, 3>().trace())};
}

bool hides_board(const ViewDesignModel& model, const Capsules& body_in_base,
                 const Transform<Base, Flange>& base_T_flange) {
  const Eigen::Vector3d eye = (base_T_flange * model.flange_T_camera).translation();
  for (const int corner : model.board.outer_corners()) {
    const Eigen::Vector3d point = model.base_T_board * model.board.corner(corner);
    for (const Capsule& c : body_in_base) {
      if (segment_distance_m(eye, eye, c.a, c.b) <= c.radius_m) continue;
      if (segment_distance_m(eye, point, c.a, c.b) <= c.radius_m) return true;
    }
  }
  return false;
}

Result<CalibrationViewChoice> next_calibration_view(const CalibrationViewInputs& inputs, Planner& planner,
                                                    const JointVector& current, const CalibrationViewOptions& options) {
  const Status begun =
      planner.begin(inputs.arm, inputs.body, inputs.space, inputs.clearance, current, planning(options));
  if (!begun) return std::unexpected(begun.error());
  Search s{.inputs = inputs,
           .current = current,
           .options = options,
           .random = Random(options.seed, kStream + (std::uint64_t{options.step} << 20)),
           .cost_now = cost_of(inputs.information, options),
           .best = {},
           .considered = 0,
           .feasible = 0};
  draw_nearby(s);
  draw_random(s);
  draw_aimed(s);

  CalibrationViewChoice choice;
  choice.considered = s.considered;
  choice.feasible = s.feasible;
  choice.before = predicted_hand_eye(inputs.information);
  choice.after = choice.before;
  const double cost_max = s.cost_now * (1 - options.cost_drop_min);
  int plans = 0;
  for (const Candidate& candidate : s.best) {
    if (candidate.cost > cost_max) {
      choice.outcome = CalibrationViewChoice::Outcome::kNoneHelps;
      continue;
    }
    if (++plans > options.plans_max) break;
    const Result<Path> path = planner.plan_to(candidate.q);
    if (!path) continue;
    const Eigen::MatrixXd added =
        joint_view_information(inputs.models, candidate.shown, forward(inputs.arm, candidate.q).flange());
    choice.outcome = CalibrationViewChoice::Outcome::kChosen;
    choice.target = candidate.q;
    choice.shown = candidate.shown;
    choice.path = *path;
    choice.after = predicted_hand_eye(inputs.information + added);
    break;
  }
  return choice;
}

Result<Turns> bootstrap_views(const ArmModel& arm, const Body& body, const FreeSpace& space, const Clearance& clearance,
                              const JointVector& at) {
  const double margin_m = configuration_margin(arm, body, space, clearance, at);
  if (margin_m < kMarginMin_m) {
    return failure(Fault::kStartBlocked, "the arm lacks {:.0f} mm of clearance", (kMarginMin_m - margin_m) * 1e3);
  }
  // Degrees of the last, last but one and last but two joint. The last rolls the image and hardly moves the board in
  // it; the others pan and tilt, so they stay small. Consecutive turns differ in axis: that is what a hand-eye solution
  // needs.
  constexpr std::array<std::array<double, 3>, 10> kTurns{{{25, 0, 0},
                                                          {0, 10, 0},
                                                          {0, 0, 10},
                                                          {-25, -10, 0},
                                                          {20, 0, -10},
                                                          {-20, 8, 8},
                                                          {20, -8, -8},
                                                          {12, 6, -6},
                                                          {-12, -6, 6},
                                                          {-12, 5, 0}}};
  Turns views;
  for (const auto& turn : kTurns) {
    JointVector q = at;
    for (int i = 0; i < 3 && i < arm.joints; ++i)
      q[arm.joints - 1 - i] += turn[static_cast<std::size_t>(i)] * kDegree_rad;
    if (certify(arm, body, space, clearance, at, q).certified()) views.push_back(q);
  }
  return views;
}

}  // namespace firstlook
