#include "algorithms/calibration/time_offset.hpp"

#include <Eigen/Cholesky>
#include <catch2/catch.hpp>
#include <string>

#include "tests/support/sanitized_builds.hpp"
#include "tests/unit/calibration/synthetic_depth.hpp"

using namespace firstlook;
using Catch::Matchers::Contains;
using test::DepthSetup;

namespace {

/// A UR5 that looks at a board 0.7 m before its camera, and sweeps of its joints around there.
struct Sweep {
  DepthSetup setup;
  TimedCell cell;
  JointVector home_rad{0.2, -1.7, 1.9, -1.8, -1.5, 0.3};
  double speed_rad_s = 0.3;
  double period_s = 1.0 / 15;
  double turn_rad = 0.12;  ///< from one end of a motion to the other, at most, on each joint
  double corner_sigma_px = 0.1;

  Sweep() {
    cell.arm = find_arm_model("ur5").value();
    cell.flange_T_camera = Transform<Flange, Camera>(Eigen::Quaterniond::Identity(), {0, -0.07, 0.06});
    Pose camera_T_board = Pose::Identity();
    camera_T_board.linear() = rotation_exp({0.3, -0.25, 0.1});
    camera_T_board.translation() = Eigen::Vector3d(0, 0, 0.7) - camera_T_board.linear() * setup.color.board.center();
    const auto flange = forward(cell.arm, home_rad).flange();
    cell.base_T_board = flange * cell.flange_T_camera * Transform<Camera, Board>(camera_T_board);
    Vector6d sigma;
    sigma << Eigen::Vector3d::Constant(2e-4), Eigen::Vector3d::Constant(3e-4);
    cell.covariance.diagonal() << sigma.cwiseAbs2(), 4 * sigma.cwiseAbs2();
    cell.arm_sigma = {1e-4, 2e-4};
    cell.depth = believed_mount(Transform<Camera, Depth>(setup.camera_T_depth), 2e-4, 5e-4, 1e-3);
  }
};

/// What is really there: drawn as the cell's covariances say.
struct Truth {
  Pose flange_T_camera, base_T_board, camera_T_depth;
  double scale = 1;
};

Vector6d normal6(Random& random) {
  Vector6d n;
  n << random.normal3(), random.normal3();
  return n;
}

Truth drawn(const Sweep& s, Random& random) {
  const Vector12d sigma = s.cell.covariance.diagonal().cwiseSqrt();
  const Vector7d depth_sigma = s.cell.depth.covariance.diagonal().cwiseSqrt();
  return {perturb(s.cell.flange_T_camera.pose(), sigma.head<6>().cwiseProduct(normal6(random))),
          perturb(s.cell.base_T_board.pose(), sigma.tail<6>().cwiseProduct(normal6(random))),
          perturb(s.cell.depth.camera_T_depth.pose(), depth_sigma.head<6>().cwiseProduct(normal6(random))),
          1 + depth_sigma[6] * random.normal()};
}

/// From one configuration to another and no farther, at constant speed after a start of 0.25 s.
struct Ramp {
  JointVector from_rad, to_rad;
  double duration_s = 1;
  [[nodiscard]] JointVector at(double t) const {
    const double start_s = std::min(0.25, duration_s / 2), cruise_s = duration_s - start_s;
    const double u = std::clamp(t, 0.0, duration_s);
    double way = u - start_s / 2;
    if (u < start_s) way = u * u / (2 * start_s);
    if (u > cruise_s) way = cruise_s - start_s / 2 + (start_s - (duration_s - u) * (duration_s - u) / start_s) / 2;
    return interpolate(from_rad, to_rad, way / (duration_s - start_s));
  }
};

Ramp ramp(const Sweep& s, Random& random) {
  Ramp r{s.home_rad, s.home_rad, 1};
  for (int j = 0; j < 6; ++j) {
    r.from_rad[j] += s.turn_rad * random.uniform(-1, 1);
    r.to_rad[j] += s.turn_rad * random.uniform(-1, 1);
  }
  r.duration_s = 0.3 + (r.to_rad - r.from_rad).max_abs() / s.speed_rad_s;
  return r;
}

std::vector<JointSample> joints_around(const Ramp& way, double start_s, double stamp_s) {
  std::vector<JointSample> samples;
  for (double t = stamp_s - 0.224; t < stamp_s + 0.225; t += 0.016) samples.push_back({t, way.at(t - start_s)});
  return samples;
}

SeenPose seen_pose(const Sweep& s, const Pose& camera_T_board, Random& random) {
  const auto& color = s.setup.color;
  std::vector<Eigen::Vector2d> corners;
  for (int i = 0; i < color.board.corners(); ++i) {
    const auto pixel = project(color.camera, camera_T_board * color.board.corner(i));
    corners.push_back(pixel.value() + s.corner_sigma_px * Eigen::Vector2d(random.normal(), random.normal()));
  }
  const auto pose = estimate_board_pose(color.camera, color.board, corners).value();
  return {pose.camera_T_board, s.corner_sigma_px * s.corner_sigma_px * pose.unit_covariance};
}

BoardPlane seen_plane(const Sweep& s, const Truth& truth, const Pose& camera_T_board, Random& random) {
  DepthSetup setup = s.setup;
  setup.camera_T_depth = truth.camera_T_depth;
  setup.depth_scale = truth.scale;
  const Transform<Depth, Board> place(setup.camera_T_depth.inverse(Eigen::Isometry) * camera_T_board);
  return find_board_plane(test::observe_depth(setup, camera_T_board, random).image(), setup.depth, setup.color.board,
                          place)
      .value();
}

/// Frames of `motions` motions whose stamps need `offset_s` to be right.
std::vector<MovingFrame> observe(const Sweep& s, const Truth& truth, int motions, double offset_s, bool depth,
                                 Random& random) {
  std::vector<MovingFrame> frames;
  for (int m = 0; m < motions; ++m) {
    const Ramp way = ramp(s, random);
    const double start_s = 100.0 * m;
    const Vector6d shared = test::arm_noise(s.cell.arm_sigma, random);
    for (double t = start_s + 0.05; t < start_s + way.duration_s; t += s.period_s) {
      const Vector6d deviation = shared + test::arm_noise(s.cell.arm_sigma, random);
      const Pose flange = perturb(forward(s.cell.arm, way.at(t - start_s)).flange().pose(), deviation);
      const Pose camera_T_board = (flange * truth.flange_T_camera).inverse(Eigen::Isometry) * truth.base_T_board;
      MovingFrame frame{t - offset_s, joints_around(way, start_s, t - offset_s), {}, m};
      if (depth) {
        frame.seen = seen_plane(s, truth, camera_T_board, random);
      } else {
        frame.seen = seen_pose(s, camera_T_board, random);
      }
      frames.push_back(std::move(frame));
    }
  }
  return frames;
}

TimeOffset estimated(const Sweep& s, std::span<const MovingFrame> frames) {
  const auto result = estimate_time_offset(s.cell, frames);
  if (!result) FAIL(result.error().detail());
  return *result;
}

std::string why(const Result<TimeOffset>& result, Fault fault) {
  REQUIRE_FALSE(result);
  CHECK(result.error().fault == fault);
  return std::string(result.error().detail());
}

}  // namespace

TEST_CASE("the derivatives of a frame's residual are those of finite differences", "[calibration]") {
  Random random(31);
  const Sweep s;
  for (const bool depth : {false, true}) {
    const auto frames = observe(s, drawn(s, random), 1, 0, depth, random);
    const MovingFrame& frame = frames[frames.size() / 2];
    const double at_s = 0.003;  // in the middle between two samples of the joints
    const TimedTerm term = timed_term(s.cell, frame, at_s).value();
    const auto slope = [&](const TimedCell& plus, const TimedCell& minus, double plus_s, double minus_s) {
      return TimedTerm::Residual(timed_term(minus, frame, minus_s)->residual -
                                 timed_term(plus, frame, plus_s)->residual);
    };
    constexpr double kStep = 1e-6;
    CHECK((slope(s.cell, s.cell, at_s + kStep, at_s - kStep) / (2 * kStep) - term.by_global.col(0)).norm() <
          2e-3 * term.by_global.col(0).norm());  // a turn of 1 mrad is left between seen and predicted
    for (int k = 0; k < 6; ++k) {
      TimedCell plus = s.cell, minus = s.cell;
      const Vector6d step = kStep * Vector6d::Unit(k);
      plus.flange_T_camera = Transform<Flange, Camera>(perturb(s.cell.flange_T_camera.pose(), step));
      minus.flange_T_camera = Transform<Flange, Camera>(perturb(s.cell.flange_T_camera.pose(), -step));
      CHECK((slope(plus, minus, at_s, at_s) / (2 * kStep) - term.by_global.col(1 + k)).norm() < 1e-3);
      plus = minus = s.cell;
      plus.base_T_board = Transform<Base, Board>(perturb(s.cell.base_T_board.pose(), step));
      minus.base_T_board = Transform<Base, Board>(perturb(s.cell.base_T_board.pose(), -step));
      CHECK((slope(plus, minus, at_s, at_s) / (2 * kStep) - term.by_global.col(7 + k)).norm() < 1e-3);
      if (!depth) continue;
      plus = minus = s.cell;
      plus.depth.camera_T_depth = Transform<Camera, Depth>(perturb(s.setup.camera_T_depth, step));
      minus.depth.camera_T_depth = Transform<Camera, Depth>(perturb(s.setup.camera_T_depth, -step));
      CHECK((slope(plus, minus, at_s, at_s) / (2 * kStep) - term.by_global.col(13 + k)).norm() < 1e-3);
    }
  }
}

TEST_CASE("the offset of a colour camera's stamps is found as sure as its sigma says", "[calibration]") {
  constexpr int kTrials = test::trials(100);
  Random random(32);
  const Sweep s;
  double squares = 0, sigma = 0, error2 = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const double offset_s = random.uniform(-0.15, 0.15);
    const TimeOffset result = estimated(s, observe(s, drawn(s, random), 6, offset_s, false, random));
    const double error = result.offset_s - offset_s;
    squares += error * error / (result.sigma_s * result.sigma_s) / kTrials;
    error2 += error * error / kTrials;
    sigma += result.sigma_s / kTrials;
    CHECK(result.motions == 6);
  }
  INFO("rms " << 1e3 * std::sqrt(error2) << " ms, sigma " << 1e3 * sigma << " ms");
  CHECK(squares == Approx(1).margin(0.45));  // standard deviation of the mean of 100 trials 0.14
  CHECK(sigma < 0.5e-3);
}

TEST_CASE("the offset of a depth camera's stamps is found from the board's plane", "[calibration]") {
  constexpr int kTrials = test::trials(40);
  Random random(33);
  const Sweep s;
  double squares = 0, sigma = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const double offset_s = random.uniform(-0.15, 0.15);
    const TimeOffset result = estimated(s, observe(s, drawn(s, random), 6, offset_s, true, random));
    const double error = result.offset_s - offset_s;
    squares += error * error / (result.sigma_s * result.sigma_s) / kTrials;
    sigma += result.sigma_s / kTrials;
  }
  INFO("sigma " << 1e3 * sigma << " ms");
  CHECK(squares == Approx(1).margin(0.7));  // standard deviation of the mean of 40 trials 0.22
  CHECK(sigma < 1e-3);
}

TEST_CASE("a clock that is ahead needs a negative offset", "[calibration]") {
  Random random(34);
  const Sweep s;
  auto frames = observe(s, drawn(s, random), 6, 0, false, random);
  for (MovingFrame& frame : frames) frame.stamp_s += 0.020;
  const TimeOffset result = estimated(s, frames);
  CHECK(result.offset_s == Approx(-0.020).margin(3 * result.sigma_s));
}

TEST_CASE("frames that show another board are left out", "[calibration]") {
  Random random(35);
  const Sweep s;
  auto frames = observe(s, drawn(s, random), 6, 0.03, false, random);
  for (std::size_t i = 0; i < frames.size(); i += 7) {
    auto& pose = std::get<SeenPose>(frames[i].seen);
    pose.camera_T_board =
        Transform<Camera, Board>(mirrored_pose(pose.camera_T_board.pose(), s.setup.color.board.center()));
  }
  const TimeOffset result = estimated(s, frames);
  CHECK(result.left_out >= static_cast<int>(frames.size() / 7));
  CHECK(result.offset_s == Approx(0.03).margin(4 * result.sigma_s));
}

TEST_CASE("what cannot tell an offset is refused with the reason", "[calibration]") {
  Random random(36);
  Sweep s;
  const Truth truth = drawn(s, random);
  SECTION("too slow") {
    s.turn_rad = 0.002;
    s.speed_rad_s = 0.003;
    const auto result = estimate_time_offset(s.cell, observe(s, truth, 6, 0, false, random));
    CHECK_THAT(why(result, Fault::kDegenerateMotion), Contains("too slowly") && Contains("2.0 ms are needed"));
  }
  SECTION("standing") {
    s.turn_rad = 0;
    const auto result = estimate_time_offset(s.cell, observe(s, truth, 6, 0, false, random));
    CHECK_THAT(why(result, Fault::kDegenerateMotion), Contains("did not move"));
  }
  SECTION("board not seen") {
    CHECK_THAT(why(estimate_time_offset(s.cell, {}), Fault::kTooFewViews), Contains("in 0 frames on the way"));
  }
  SECTION("joints not known") {
    auto frames = observe(s, truth, 6, 0, false, random);
    for (MovingFrame& frame : frames) frame.joints.resize(10);
    CHECK_THAT(why(estimate_time_offset(s.cell, frames), Fault::kTooFewViews), Contains("around 0 of"));
  }
  SECTION("numbers that are not finite") {
    auto frames = observe(s, truth, 6, 0, false, random);
    frames[3].stamp_s = std::nan("");
    CHECK(estimated(s, frames).frames < static_cast<int>(frames.size()));
    for (MovingFrame& frame : frames) std::get<SeenPose>(frame.seen).covariance(0, 0) = std::nan("");
    CHECK_THAT(why(estimate_time_offset(s.cell, frames), Fault::kTooFewViews), Contains("in 0 frames"));
  }
  SECTION("beyond the range") {
    TimeOffsetOptions options;
    options.range_s = 0.1;
    const auto result = estimate_time_offset(s.cell, observe(s, truth, 6, 0.12, false, random), options);
    REQUIRE_FALSE(result);
    CHECK((result.error().fault == Fault::kClockWrong || result.error().fault == Fault::kSolveFailed));
  }
  SECTION("frames that contradict each other") {
    auto frames = observe(s, truth, 6, 0, false, random);
    for (std::size_t i = 0; i + 1 < frames.size(); i += 2) std::swap(frames[i].seen, frames[i + 1].seen);
    const auto result = estimate_time_offset(s.cell, frames);
    CHECK_THAT(why(result, Fault::kClockWrong), Contains("frames on the way"));
  }
}
