/// Arms with few and with many joints, three poses and many: solved, or what stays open is stated.
#include <catch2/catch.hpp>
#include <vector>

#include "algorithms/calibration/unobservable.hpp"
#include "algorithms/calibration/verdict.hpp"
#include "tests/support/sanitized_builds.hpp"
#include "tests/unit/calibration/synthetic_views.hpp"

using namespace firstlook;
using test::kDegree;

namespace {

struct Joint {
  Eigen::Vector3d offset_m;  ///< from the joint before
  Eigen::Vector3d axis;
  double range_rad;
};

/// The thesis's simulated arm: a joint upright, one across, the camera 600 mm up and 275 mm forward of the hand.
const std::vector<Joint> kTwoJoints = {{{0, 0, 0.5}, {0, 0, 1}, 40 * kDegree}, {{0, 0, 0.4}, {0, 1, 0}, 25 * kDegree}};

/// Axes and lengths of the PR2's right arm (pan, lift, upper arm roll, elbow, forearm roll, wrist flex, wrist roll).
const std::vector<Joint> kSevenJoints = {
    {{0, -0.188, 0.8}, {0, 0, 1}, 40 * kDegree}, {{0.1, 0, 0}, {0, 1, 0}, 30 * kDegree},
    {{0, 0, 0}, {1, 0, 0}, 60 * kDegree},        {{0.4, 0, 0}, {0, 1, 0}, 40 * kDegree},
    {{0, 0, 0}, {1, 0, 0}, 80 * kDegree},        {{0.321, 0, 0}, {0, 1, 0}, 40 * kDegree},
    {{0, 0, 0}, {1, 0, 0}, 80 * kDegree}};

Pose flange_at(const std::vector<Joint>& arm, const std::vector<double>& q) {
  Pose pose = Pose::Identity();
  for (std::size_t i = 0; i < arm.size(); ++i) {
    pose.translate(arm[i].offset_m);
    pose.rotate(Eigen::AngleAxisd(q[i], arm[i].axis));
  }
  return pose;
}

/// z of the camera along x of the flange.
Pose camera_in_flange(const Eigen::Vector3d& position) {
  Pose pose = Pose::Identity();
  pose.linear() << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  pose.linear() = pose.linear() * rotation_exp({0.05, -0.03, 0.08});
  pose.translation() = position;
  return pose;
}

/// Pairs of an arm with 0.1 mm and 0.2 mrad that looks at a board 2.5 m ahead, 1.45 m up; the board's pose with
/// `board_noise` of 1 mm and 2 mrad.
std::vector<PosePair> pairs_of_arm(const std::vector<Joint>& arm, const Pose& flange_T_camera, int count,
                                   double board_noise, Random& random) {
  Pose base_T_board = camera_in_flange({2.5, 0, 1.45});
  std::vector<PosePair> pairs;
  for (int i = 0; i < count; ++i) {
    std::vector<double> q;
    for (const Joint& joint : arm) q.push_back(random.uniform(-joint.range_rad, joint.range_rad));
    const Pose flange = flange_at(arm, q);
    const Pose board = (flange * flange_T_camera).inverse(Eigen::Isometry) * base_T_board;
    Vector6d noise;
    noise << board_noise * 1e-3 * random.normal3(), board_noise * 2e-3 * random.normal3();
    const Vector6d arm_noise = test::arm_noise({1e-4 * board_noise, 2e-4 * board_noise}, random);
    pairs.push_back(
        {Transform<Base, Flange>(perturb(flange, arm_noise)), Transform<Camera, Board>(perturb(board, noise))});
  }
  return pairs;
}

}  // namespace

TEST_CASE("an arm with two joints: 15 poses are solved", "[calibration][arms]") {
  const Pose truth = camera_in_flange({0.275, 0, 0.6});
  constexpr std::uint64_t kSeeds = test::trials(20);
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    CAPTURE(seed);
    Random random(seed, 71);
    const auto exact = calibrate_hand_eye_from_pairs(pairs_of_arm(kTwoJoints, truth, 15, 0, random));
    REQUIRE(exact);
    CHECK(pose_difference(truth, exact->flange_T_camera.pose()).norm() < 1e-8);
    const auto noisy = calibrate_hand_eye_from_pairs(pairs_of_arm(kTwoJoints, truth, 15, 1, random));
    REQUIRE(noisy);
    const Vector6d error = pose_difference(truth, noisy->flange_T_camera.pose());
    CHECK(error.dot(noisy->covariance.ldlt().solve(error)) < 40);
    CHECK(error.tail<3>().norm() < 0.02);
    CHECK(unobservable_of(pairs_of_arm(kTwoJoints, truth, 15, 1, random)).parameters() == 0);
  }
}

TEST_CASE("an arm with seven joints: 144 poses are solved and accepted", "[calibration][arms]") {
  const Pose truth = camera_in_flange({0.05, 0.02, 0.07});
  Random random(3, 72);
  const auto exact = calibrate_hand_eye_from_pairs(pairs_of_arm(kSevenJoints, truth, 144, 0, random));
  REQUIRE(exact);
  // Table 6-2 of the thesis: 0.017 mm by Tsai's method without noise.
  CHECK(pose_difference(truth, exact->flange_T_camera.pose()).norm() < 1e-8);
  constexpr std::uint64_t kSeeds = test::trials(5);
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    Random noise(seed, 73);
    const auto noisy = calibrate_hand_eye_from_pairs(pairs_of_arm(kSevenJoints, truth, 144, 0.5, noise));
    REQUIRE(noisy);
    for (const std::string& reason : noisy->reasons) UNSCOPED_INFO(reason);
    CHECK(noisy->verdict == Verdict::kAccepted);
    const Vector6d error = pose_difference(truth, noisy->flange_T_camera.pose());
    CHECK(error.dot(noisy->covariance.ldlt().solve(error)) < 25);
  }
}

TEST_CASE("one joint: the two parameters that stay open are named", "[calibration][arms]") {
  const std::vector<Joint> one = {{{0, 0, 0.5}, {0, 0, 1}, 60 * kDegree}};
  Random random(4, 74);
  const auto pairs = pairs_of_arm(one, camera_in_flange({0.1, 0, 0.2}), 12, 0.2, random);
  const Unobservable open = unobservable_of(pairs);
  REQUIRE(open.translations.size() == 1);
  CHECK(open.translations[0].isApprox(Eigen::Vector3d(0, 0, 1), 1e-2));
  REQUIRE(open.turns.size() == 1);
  CHECK(open.turns[0].axis.isApprox(Eigen::Vector3d(0, 0, 1), 1e-2));
  CHECK(open.turns[0].point_m.norm() < 5e-3);
  const auto result = calibrate_hand_eye_from_pairs(pairs);
  REQUIRE_FALSE(result);
  CHECK(result.error().fault == Fault::kDegenerateMotion);
  INFO(result.error().detail());
  CHECK(std::string(result.error().detail())
            .find("position along (0.00, 0.00, 1.00), its turn about (0.00, 0.00, 1.00)") != std::string::npos);
}

TEST_CASE("parallel joints leave one parameter open, sliding ones three, none six", "[calibration][arms]") {
  const std::vector<Joint> scara = {{{0, 0, 0.5}, {0, 0, 1}, 60 * kDegree}, {{0.4, 0, 0}, {0, 0, 1}, 60 * kDegree}};
  Random random(5, 75);
  const Unobservable planar = unobservable_of(pairs_of_arm(scara, camera_in_flange({0.1, 0, 0}), 12, 0.2, random));
  CHECK(planar.translations.size() == 1);
  CHECK(planar.turns.empty());

  std::vector<PosePair> sliding, still;
  for (int i = 0; i < 8; ++i) {
    Pose pose = Pose::Identity();
    pose.translation() = 0.3 * random.normal3();
    sliding.push_back({Transform<Base, Flange>(pose), Transform<Camera, Board>(Pose::Identity())});
    still.push_back({Transform<Base, Flange>(Pose::Identity()), Transform<Camera, Board>(Pose::Identity())});
  }
  CHECK(unobservable_of(sliding).translations.size() == 3);
  CHECK(unobservable_of(sliding).turns.empty());
  CHECK(unobservable_text(unobservable_of(sliding)).find("did not turn") != std::string::npos);
  CHECK(unobservable_of(still).parameters() == 6);
}

TEST_CASE("three poses are always attempted, 250 are taken", "[calibration][arms]") {
  const test::Setup setup;
  int solved = 0;
  for (std::uint64_t seed = 0; seed < 30; ++seed) {
    Random random(seed, 76);
    const auto three = calibrate_hand_eye_from_pairs(test::observe_pairs(setup, 3, random));
    if (!three) {
      CHECK(three.error().fault == Fault::kDegenerateMotion);
      continue;
    }
    ++solved;
    CHECK(three->views == 3);
    CHECK(three->verdict == Verdict::kRejected);
    CHECK(three->reasons.front().find("3 usable views") != std::string::npos);
    CHECK(pose_difference(setup.flange_T_camera, three->flange_T_camera.pose()).head<3>().norm() < 0.05);
  }
  CHECK(solved >= 25);
  Random random(1, 77);
  const auto many = calibrate_hand_eye_from_pairs(test::observe_pairs(setup, 250, random));
  REQUIRE(many);
  CHECK(many->views == 250);
  CHECK(many->verdict == Verdict::kAccepted);
}
