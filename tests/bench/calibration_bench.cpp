/// Monte Carlo of the hand-eye calibration: refined error over what no estimator can beat, other solvers beside it.
#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <string>
#include <thread>

#include "algorithms/calibration/hand_eye_refinement.hpp"
#include "algorithms/calibration/view_gate.hpp"
#include "algorithms/vision/board_pose.hpp"
#include "tests/bench/bench.hpp"
#include "tests/bench/hand_eye_peers.hpp"
#include "tests/unit/calibration/synthetic_views.hpp"

namespace firstlook::bench {
namespace {

struct ArmQuality {
  const char* name;
  ArmSigma sigma;
};
constexpr ArmQuality kArms[] = {{"perfect", {0, 0}}, {"good", {1e-4, 2e-4}}, {"poor", {5e-4, 1e-3}}};
constexpr int kViews[] = {15, 25, 50};
constexpr double kPixels[] = {0.1, 0.3};
// What is stated for a perfect arm: a sigma of 0 means "estimate it".
constexpr ArmSigma kPerfectStated{1e-6, 1e-6};
constexpr double kStatedMax = 1.05, kEstimatedMax = 1.10;  // error over the bound
constexpr double kNormalizedLow = 5.5, kNormalizedHigh = 6.5;

/// Mean squares over the trials.
struct Errors {
  double translation2 = 0, rotation2 = 0, normalized = 0;
  int trials = 0;
  void add(const Vector6d& error) {
    translation2 += error.head<3>().squaredNorm();
    rotation2 += error.tail<3>().squaredNorm();
    ++trials;
  }
  void add(const Errors& other) {
    translation2 += other.translation2;
    rotation2 += other.rotation2;
    normalized += other.normalized;
    trials += other.trials;
  }
  [[nodiscard]] double mm() const { return 1e3 * std::sqrt(translation2 / trials); }
  [[nodiscard]] double mrad() const { return 1e3 * std::sqrt(rotation2 / trials); }
};

struct Outcome {
  Errors efficient, stated, estimated;
  std::vector<Errors> peers = std::vector<Errors>(hand_eye_peers().size());
  int failed = 0;  ///< our own solves
  std::vector<double> solve_s;

  void add(const Outcome& other) {
    efficient.add(other.efficient);
    stated.add(other.stated);
    estimated.add(other.estimated);
    for (std::size_t i = 0; i < peers.size(); ++i) peers[i].add(other.peers[i]);
    failed += other.failed;
    solve_s.insert(solve_s.end(), other.solve_s.begin(), other.solve_s.end());
  }
};

/// Error of the maximum likelihood estimate of the problem linearised at the truth: for Gaussian noise it reaches the
/// Cramér-Rao bound, and on the same draws its sampling error is ours.
Vector6d efficient_error(const test::Setup& s, const std::vector<Pose>& flanges,
                         const std::vector<CalibrationView>& views) {
  Matrix12d information = Matrix12d::Zero();
  Vector12d right = Vector12d::Zero();
  const double weight = 1 / (s.corner_sigma_px * s.corner_sigma_px);
  for (std::size_t v = 0; v < views.size(); ++v) {
    const ViewGeometry truth{s.flange_T_camera, s.base_T_board, flanges[v]};
    ViewNormal normal;
    for (int i = 0; i < s.board.corners(); ++i) {
      const auto term = corner_term(s.camera, truth, s.board.corner(i));
      normal.add(*term, views[v].corners_px[static_cast<std::size_t>(i)] - term->pixel, weight);
    }
    information += normal.global;
    right += normal.global_right;
    if (s.arm_sigma.translation_m == 0) continue;
    // The arm's word is one more observation of the flange; eliminate the flange.
    Vector6d arm_weight;
    arm_weight << Eigen::Vector3d::Constant(std::pow(s.arm_sigma.translation_m, -2)),
        Eigen::Vector3d::Constant(std::pow(s.arm_sigma.rotation_rad, -2));
    const Vector6d said = pose_difference(views[v].base_T_flange.pose(), flanges[v]);
    const Matrix6d arm = normal.arm + Matrix6d(arm_weight.asDiagonal());
    const Vector6d arm_right = normal.arm_right + arm_weight.cwiseProduct(said);
    const Eigen::LDLT<Matrix6d> solver(arm);
    information -= normal.global_arm * solver.solve(normal.global_arm.transpose());
    right -= normal.global_arm * solver.solve(arm_right);
  }
  return Vector12d(information.ldlt().solve(right)).head<6>();
}

void add_refined(Errors& errors, int& failed, const test::Setup& s, const Result<Refinement>& fit) {
  if (!fit) {
    ++failed;
    return;
  }
  const Vector6d error = pose_difference(s.flange_T_camera, fit->flange_T_camera.pose());
  errors.add(error);
  errors.normalized += error.dot(fit->covariance.ldlt().solve(error));
}

void run_trial(const test::Setup& s, int views_each, std::uint64_t trial, Outcome& out) {
  Random random(trial, static_cast<std::uint64_t>(views_each));
  std::vector<Pose> flanges;
  std::vector<CalibrationView> views;
  for (int i = 0; i < views_each; ++i) {
    flanges.push_back(test::flange_for(s, test::random_camera_T_board(s, random)));
    views.push_back(test::observe(s, flanges.back(), random));
  }
  out.efficient.add(efficient_error(s, flanges, views));

  std::vector<PosePair> pairs;
  const double start = thread_seconds();
  for (const CalibrationView& view : views) {
    const auto pose = estimate_board_pose_robust(s.camera, s.board, view.corners_px);
    if (pose) pairs.push_back({view.base_T_flange, pose->pose.camera_T_board});
  }
  const auto closed = robust_closed_form(pairs, Solver::kParkMartin, RefinementOptions{}.view_gate);
  if (!closed) {
    ++out.failed;
    return;
  }
  const auto estimated = refine_hand_eye(s.camera, s.board, views, *closed);
  out.solve_s.push_back(thread_seconds() - start);
  add_refined(out.estimated, out.failed, s, estimated);
  RefinementOptions stated;
  stated.arm_sigma = s.arm_sigma.translation_m > 0 ? s.arm_sigma : kPerfectStated;
  add_refined(out.stated, out.failed, s, refine_hand_eye(s.camera, s.board, views, *closed, stated));

  const auto peers = hand_eye_peers();
  for (std::size_t i = 0; i < peers.size(); ++i) {
    if (peers[i].solve == nullptr) continue;
    if (const auto pose = peers[i].solve(pairs)) out.peers[i].add(pose_difference(s.flange_T_camera, *pose));
  }
}

/// What libraries say on standard output (ViSP prints every residual) goes nowhere.
class QuietOutput {
 public:
  QuietOutput() : output_(dup(STDOUT_FILENO)) {
    std::fflush(stdout);
    const int nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC);
    dup2(nowhere, STDOUT_FILENO);
    close(nowhere);
  }
  ~QuietOutput() {
    std::fflush(stdout);
    std::cout.flush();
    dup2(output_, STDOUT_FILENO);
    close(output_);
  }
  QuietOutput(const QuietOutput&) = delete;
  QuietOutput& operator=(const QuietOutput&) = delete;

 private:
  int output_;
};

/// Trials shared by two threads: errors do not depend on who is quick.
Outcome run_trials(const test::Setup& s, int views_each, int trials) {
  const QuietOutput quiet;
  Outcome outcomes[2];
  const auto work = [&](int which) {
    for (int trial = which; trial < trials; trial += 2) {
      run_trial(s, views_each, static_cast<std::uint64_t>(trial) + 1, outcomes[which]);
    }
  };
  std::thread other(work, 1);
  work(0);
  other.join();
  outcomes[0].add(outcomes[1]);
  return std::move(outcomes[0]);
}

void report_errors(Report& report, const std::string& name, const Errors& ours, const Errors& bound, double ratio_max) {
  const Goal goal = Goal::ratio_at_most(ratio_max);
  report.add(measured(name, ours.mm(), "mm", "efficient estimator", bound.mm(), goal));
  report.add(measured(name + "/rotation", ours.mrad(), "mrad", "efficient estimator", bound.mrad(), goal));
}

void report_peers(Report& report, const std::string& name, const Outcome& outcome) {
  const auto peers = hand_eye_peers();
  for (std::size_t i = 0; i < peers.size(); ++i) {
    const bool there = outcome.peers[i].trials > 0;
    report.add(measured(fmt::format("{}/{}", name, peers[i].name), outcome.estimated.mm(), "mm", peers[i].title,
                        there ? std::optional(outcome.peers[i].mm()) : std::nullopt, Goal::none()));
  }
}

}  // namespace

void bench_calibration(const Options& options, Report& report) {
  const int trials = options.amount(4, 60, 1000);
  for (const ArmQuality& arm : kArms) {
    Errors stated, estimated;
    int failed = 0, tried = 0;
    for (const int views : kViews) {
      for (const double pixels : kPixels) {
        if (options.smoke && (views != 15 || pixels != 0.1)) continue;
        test::Setup setup;
        setup.arm_sigma = arm.sigma;
        setup.corner_sigma_px = pixels;
        const Outcome outcome = run_trials(setup, views, trials);
        const std::string name = fmt::format("calibration/views{}/px{}/{}", views, pixels, arm.name);
        report_errors(report, name, outcome.stated, outcome.efficient, kStatedMax);
        report_errors(report, name + "/estimated", outcome.estimated, outcome.efficient, kEstimatedMax);
        stated.add(outcome.stated);
        estimated.add(outcome.estimated);
        failed += outcome.failed;
        tried += 2 * trials;
        if (views != 25 || pixels != 0.1) continue;
        report_peers(report, name, outcome);
        report.add(timed(name + "/solve_time", 1e3 * median(outcome.solve_s), "ms", "", std::nullopt,
                         Goal::ours_at_most(500)));
      }
    }
    // Over all views and pixels of one arm: 6 is expected, one solve scatters by 3.5.
    const Goal honest = Goal::ours_between(kNormalizedLow, kNormalizedHigh);
    const std::string name = fmt::format("calibration/normalized_error2/{}", arm.name);
    report.add(measured(name, stated.normalized / stated.trials, "", "", std::nullopt, honest));
    report.add(measured(name + "/estimated", estimated.normalized / estimated.trials, "", "", std::nullopt, honest));
    report.add(measured(fmt::format("calibration/failed/{}", arm.name), failed, "solves",
                        fmt::format("of {} solves", tried), tried, Goal::ours_at_most(0)));
  }
}

}  // namespace firstlook::bench
