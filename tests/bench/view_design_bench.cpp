/// What it is worth to choose the views of the board: the error that no estimator can beat, for designed views, random
/// ones and the fixed list, all of them reachable inside the safe zone.
#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <optional>

#include "algorithms/kinematics/inverse_kinematics.hpp"
#include "algorithms/kinematics/self_collision.hpp"
#include "algorithms/motion/clearance.hpp"
#include "algorithms/view_planning/aim.hpp"
#include "algorithms/view_planning/fixed_views.hpp"
#include "algorithms/vision/rotation.hpp"
#include "tests/bench/bench.hpp"

namespace firstlook::bench {
namespace {

constexpr int kViews = 15;
constexpr int kDraws = 40;  // sets of random views in each cell
constexpr double kGain = 1.6;
// How wrong the belief is that views are designed with: what four first views tell.
constexpr double kBelief_m = 0.005, kBelief_rad = 0.01;

/// An arm, a camera somewhere on its flange, and a board somewhere around it.
struct Cell {
  ArmModel arm = *find_arm_model("ur5");
  Body body = body_with_envelope(arm);
  FreeSpace space;
  Clearance clearance = required_clearance({}).clearance();
  ViewDesignModel truth;
  std::vector<JointVector> seen_from;  ///< random configurations that see the board, free and not hidden
};

bool sees_board(const Cell& cell, const JointVector& q) {
  const LinkFrames frames = forward(cell.arm, q);
  return check_view(cell.truth, frames.flange()) == ViewFault::kNone &&
         configuration_is_free(cell.arm, cell.body, cell.space, cell.clearance, q, 0) &&
         !hides_board(cell.truth, place(cell.body.capsules, frames), frames.flange());
}

JointVector random_configuration(const Cell& cell, Random& random) {
  JointVector q = JointVector::zero(cell.arm.joints);
  for (int j = 0; j < cell.arm.joints; ++j) q[j] = random.uniform(-std::numbers::pi, std::numbers::pi);
  return q;
}

ViewDesignModel random_model(Random& random) {
  ViewDesignModel m;
  m.camera = {.width = 640, .height = 480, .fx = 534.78, .fy = 534.10, .cx = 308.63, .cy = 226.92};
  const Eigen::Vector3d lean = 0.3 * random.direction();
  m.flange_T_camera = {Eigen::Quaterniond(rotation_exp({0, 0, random.uniform(-3.1, 3.1)}) * rotation_exp(lean)),
                       Eigen::Vector3d(random.uniform(-.08, .08), random.uniform(-.08, .08), random.uniform(.03, .08))};
  // On a circle about the arm, between table height and its shoulder's, turned towards it.
  const double around = random.uniform(-std::numbers::pi, std::numbers::pi);
  const Eigen::Vector3d at =
      rotation_exp({0, 0, around}) * Eigen::Vector3d(random.uniform(.7, .95), 0, random.uniform(0, .6));
  const Eigen::Vector3d away = (at - Eigen::Vector3d(0, 0, random.uniform(.5, .8))).normalized();
  Eigen::Matrix3d rotation;
  rotation.col(2) = away;
  rotation.col(0) = Eigen::Vector3d::UnitZ().cross(away).normalized();
  rotation.col(1) = rotation.col(2).cross(rotation.col(0));
  m.base_T_board = {Eigen::Quaterniond(rotation), at - rotation * m.board.center()};
  return m;
}

/// Empty when fewer than twice the views see the board within the draws: such a board hangs badly.
std::optional<Cell> random_cell(std::uint64_t seed) {
  constexpr int kDrawsMax = 400'000;
  constexpr std::size_t kPool = 200;
  Random random(seed, 7700);
  Cell cell;
  cell.truth = random_model(random);
  for (int i = 0; i < kDrawsMax && cell.seen_from.size() < kPool; ++i) {
    const JointVector q = random_configuration(cell, random);
    if (sees_board(cell, q)) cell.seen_from.push_back(q);
  }
  if (cell.seen_from.size() < 2 * kViews) return std::nullopt;
  return cell;
}

/// Mean squares over cells: m^2 and rad^2 of the Cramer-Rao bound.
struct Bound {
  double translation2 = 0, rotation2 = 0;
  int count = 0;
  void add(const Cell& cell, const std::vector<JointVector>& views) {
    Matrix12d information = prior_information();
    for (const JointVector& q : views) information += view_information(cell.truth, forward(cell.arm, q).flange());
    const Matrix6d covariance = predicted_covariance(information);
    translation2 += covariance.topLeftCorner<3, 3>().trace();
    rotation2 += covariance.bottomRightCorner<3, 3>().trace();
    ++count;
  }
  void add(const Bound& mean) {
    translation2 += mean.translation2 / mean.count;
    rotation2 += mean.rotation2 / mean.count;
    ++count;
  }
  [[nodiscard]] double mm() const { return 1e3 * std::sqrt(translation2 / count); }
  [[nodiscard]] double mrad() const { return 1e3 * std::sqrt(rotation2 / count); }
};

Bound random_bound(const Cell& cell, std::uint64_t seed) {
  Random random(seed, 7701);
  Bound bound;
  for (int draw = 0; draw < kDraws; ++draw) {
    std::vector<JointVector> pool = cell.seen_from, views;
    while (views.size() < kViews) {
      const auto pick = static_cast<std::ptrdiff_t>(random.below(static_cast<int>(pool.size())));
      views.push_back(pool[static_cast<std::size_t>(pick)]);
      pool.erase(pool.begin() + pick);
    }
    bound.add(cell, views);
  }
  return bound;
}

ViewDesignModel belief(const Cell& cell, Random& random) {
  ViewDesignModel wrong = cell.truth;
  Vector6d error;
  error << kBelief_m * random.direction(), kBelief_rad * random.direction();
  wrong.flange_T_camera = Transform<Flange, Camera>(perturb(wrong.flange_T_camera.pose(), error));
  return wrong;
}

/// Views as `next` chooses them, from the first configuration that sees the board; those that in truth do not show it
/// whole bring nothing.
template <typename Next>
std::vector<JointVector> chosen_views(const Cell& cell, const ViewDesignModel& model, int views_max, Next&& next) {
  Matrix12d information = prior_information();
  std::vector<JointVector> taken, seen;
  JointVector at = cell.seen_from.front();
  CalibrationViewOptions options;
  for (int view = 0; view < views_max; ++view) {
    options.step = static_cast<std::uint32_t>(view);
    // One view alone leaves directions open, which only the volume tells apart.
    options.criterion = view < 3 ? DesignCriterion::kVolume : DesignCriterion::kCost;
    const CalibrationViewInputs inputs{cell.arm,    cell.body,   cell.space, cell.clearance,
                                       {&model, 1}, information, taken};
    const auto choice = next(inputs, at, options);
    if (!choice || choice->outcome != CalibrationViewChoice::Outcome::kChosen) break;
    at = choice->target;
    taken.push_back(at);
    information += view_information(model, forward(cell.arm, at).flange());
    if (check_view(cell.truth, forward(cell.arm, at).flange(), {.margin_px = 0}) == ViewFault::kNone) {
      seen.push_back(at);
    }
  }
  return seen;
}

/// Configurations that look at the board from everywhere around it.
std::vector<JointVector> views_around(const Cell& cell, std::uint64_t seed) {
  constexpr int kDrawsMax = 40'000;
  constexpr std::size_t kPool = 3000;
  Random random(seed, 7703);
  const Eigen::Vector3d center = cell.truth.base_T_board * cell.truth.board.center();
  const Eigen::Vector3d front = -cell.truth.base_T_board.rotation().col(2);
  const auto camera_T_flange = cell.truth.flange_T_camera.inverse();
  std::vector<JointVector> pool;
  for (int i = 0; i < kDrawsMax && pool.size() < kPool; ++i) {
    const Eigen::Vector3d direction = direction_within(front, ViewLimits{}.tilt_max_rad, random);
    const auto base_T_camera = look_at<Camera>(center + 0.05 * random.normal3(), direction, random.uniform(0.2, 1.2),
                                               random.uniform(0, 2 * std::numbers::pi));
    for (const JointVector& q : inverse(cell.arm, base_T_camera * camera_T_flange, cell.seen_from.front())) {
      if (sees_board(cell, q)) pool.push_back(q);
    }
  }
  return pool;
}

/// What nobody can do on the way: knows the truth, and exchanges views of the finished set for better ones of a large
/// pool until none is better (Fedorov 1972). How much is left between it and views chosen one by one.
std::vector<JointVector> exchanged(const Cell& cell, std::vector<JointVector> views, std::uint64_t seed) {
  constexpr int kPassesMax = 4;
  const auto information_of = [&](const JointVector& q) {
    return view_information(cell.truth, forward(cell.arm, q).flange());
  };
  const std::vector<JointVector> pool = views_around(cell, seed);
  std::vector<Matrix12d> offered;
  for (const JointVector& q : pool) offered.push_back(information_of(q));
  Matrix12d sum = prior_information();
  for (const JointVector& q : views) sum += information_of(q);
  double best = design_cost(predicted_covariance(sum));
  for (int pass = 0; pass < kPassesMax; ++pass) {
    const double before = best;
    for (JointVector& view : views) {
      const Matrix12d rest = sum - information_of(view);
      for (std::size_t i = 0; i < pool.size(); ++i) {
        const double cost = design_cost(predicted_covariance(rest + offered[i]));
        if (cost >= best) continue;
        best = cost;
        view = pool[i];
      }
      sum = rest + information_of(view);
    }
    if (best == before) break;
  }
  return views;
}

void report_bound(Report& report, const std::string& name, const Bound& ours, const char* peer, const Bound& other,
                  const Goal& goal) {
  report.add(measured("view_design/" + name, ours.mm(), "mm", peer, other.mm(), goal));
  report.add(measured("view_design/" + name + "/rotation", ours.mrad(), "mrad", peer, other.mrad(), goal));
}

}  // namespace

void bench_view_design(const Options& options, Report& report) {
  const int cells = options.amount(1, 10, 40);
  Bound designed, drawn, fixed, best_set;
  std::vector<double> choice_s;
  double fixed_views_taken = 0;
  int fewer = 0;
  Planner planner;
  for (std::uint64_t seed = 1; designed.count < cells; ++seed) {
    const auto cell = random_cell(seed);
    if (!cell) continue;
    Random random(seed, 7702);
    const ViewDesignModel model = belief(*cell, random);
    const auto best = chosen_views(*cell, model, kViews, [&](const auto& inputs, const auto& at, const auto& how) {
      const double start = thread_seconds();
      auto choice = next_calibration_view(inputs, planner, at, how);
      choice_s.push_back(thread_seconds() - start);
      return choice;
    });
    int next = 0;
    const auto listed =
        chosen_views(*cell, model, kFixedViews, [&](const auto& inputs, const auto& at, const auto& how) {
          return next_fixed_view(inputs, planner, at, next, how);
        });
    designed.add(*cell, best);
    fewer += best.size() < kViews ? 1 : 0;
    drawn.add(random_bound(*cell, seed));
    fixed_views_taken += static_cast<double>(listed.size());
    fixed.add(*cell, listed);
    best_set.add(*cell, exchanged(*cell, best, seed));
  }
  report_bound(report, "designed15", designed, "15 random views", drawn, Goal::ratio_at_most(1 / kGain));
  report_bound(report, "designed15/exchange", designed, "exchange algorithm that knows the truth", best_set,
               Goal::none());
  report_bound(report, "designed15/fixed", designed, "the fixed list", fixed, Goal::none());
  report.add(measured("view_design/views_of_the_fixed_list", fixed_views_taken / cells, "views", "of", kFixedViews,
                      Goal::none()));
  report.add(measured("view_design/cells_with_fewer_than_15_views", fewer, "cells", "of", cells, Goal::none()));
  report.add(timed("view_design/view_choice_time", 1e3 * median(choice_s), "ms", "", std::nullopt, Goal::none()));
}

}  // namespace firstlook::bench
