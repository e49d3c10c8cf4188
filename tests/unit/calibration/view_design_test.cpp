#include "algorithms/calibration/view_design.hpp"

#include <catch2/catch.hpp>

#include "tests/unit/calibration/synthetic_views.hpp"

using namespace firstlook;
using test::Setup;

namespace {
Transform<Base, Flange> candidate(const Setup& setup, Random& random) {
  return Transform<Base, Flange>(test::flange_for(setup, test::random_camera_T_board(setup, random)));
}
}  // namespace

TEST_CASE("views chosen by predicted cost beat random ones", "[calibration]") {
  const Setup setup;
  const auto model = setup.model();
  Random random(31);
  Matrix12d greedy = prior_information(), drawn = prior_information();
  for (int view = 0; view < 12; ++view) {
    Transform<Base, Flange> best;
    double best_cost = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 60; ++i) {
      const auto flange = candidate(setup, random);
      const double cost = predicted_cost(model, greedy, flange);
      if (cost < best_cost) {
        best_cost = cost;
        best = flange;
      }
    }
    CHECK(best_cost <= design_cost(predicted_covariance(greedy)));
    greedy += view_information(model, best);
    drawn += view_information(model, candidate(setup, random));
  }
  CHECK(design_cost(predicted_covariance(greedy)) < 0.7 * design_cost(predicted_covariance(drawn)));
}

TEST_CASE("one view alone tells nothing about the hand-eye transform, a turned one does", "[calibration]") {
  const Setup setup;
  const auto model = setup.model();
  Random random(32);
  const auto first = candidate(setup, random);
  Matrix12d information = prior_information() + 5 * view_information(model, first);
  CHECK(predicted_covariance(information).topLeftCorner<3, 3>().trace() > 1e-3);
  for (int i = 0; i < 4; ++i) information += view_information(model, candidate(setup, random));
  CHECK(predicted_covariance(information).topLeftCorner<3, 3>().trace() < 1e-5);
}

TEST_CASE("which views show the board well", "[calibration]") {
  const Setup setup;
  const auto model = setup.model();
  const auto flange_seeing = [&](double distance, double tilt, double aside) {
    Pose pose = Pose::Identity();
    pose.linear() = rotation_exp({tilt, 0, 0});
    pose.translation() = Eigen::Vector3d(aside, 0, distance) - pose.linear() * setup.board.center();
    return Transform<Base, Flange>(test::flange_for(setup, pose));
  };
  CHECK(check_view(model, flange_seeing(0.6, 0.2, 0)) == ViewFault::kNone);
  CHECK(check_view(model, flange_seeing(0.6, 0.2, 0.3)) == ViewFault::kOutOfImage);
  CHECK(check_view(model, flange_seeing(0.6, 1.0, 0)) == ViewFault::kTilt);
  CHECK(check_view(model, flange_seeing(0.15, 0, 0)) == ViewFault::kDistance);
  CHECK(check_view(model, flange_seeing(2.0, 0, 0)) == ViewFault::kDistance);
  CHECK(check_view(model, flange_seeing(-0.6, 0, 0)) == ViewFault::kBehind);
  CHECK(check_view(model, flange_seeing(0.6, 3.0, 0)) == ViewFault::kBehind);
  ViewLimits far;
  far.distance_max_m = 5;
  CHECK(check_view(model, flange_seeing(3.0, 0, 0), far) == ViewFault::kSpacing);
}

TEST_CASE("information of several targets: a second one in the same picture shares the arm's deviation",
          "[calibration]") {
  const Setup setup;
  std::vector<ViewDesignModel> two(2, setup.model());
  two[1].board = {7, 4, 0.04};
  two[1].base_T_board = Transform<Base, Board>(setup.base_T_board * Pose(Eigen::Translation3d(0.05, 0.02, 0.03)) *
                                               Pose(Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitZ())));
  Random random(35);
  std::vector<Transform<Base, Flange>> flanges;
  for (int i = 0; i < 8; ++i) flanges.push_back(candidate(setup, random));
  const auto sum = [&](std::uint32_t shown) {
    Eigen::MatrixXd information = joint_prior_information(2);
    for (const auto& flange : flanges) information += joint_view_information(two, shown, flange);
    return information;
  };
  // One target alone is what it is without the other, whose place stays unknown.
  Matrix12d alone = prior_information();
  for (const auto& flange : flanges) alone += view_information(two[0], flange);
  const Matrix6d first = predicted_hand_eye(sum(1)), expected = predicted_covariance(alone);
  CHECK((first - expected).norm() < 1e-6 * expected.norm());
  CHECK(predicted_joint(sum(1))(12, 12) == Approx(100));                // 10 m: the prior
  CHECK(design_cost(predicted_hand_eye(sum(3))) < design_cost(first));  // both tell more than one
  // What one picture shows of both is known of each other without the arm: better than from pictures of their own.
  Eigen::MatrixXd apart = sum(1);
  for (const auto& flange : flanges) apart += joint_view_information(two, 2, flange);
  const auto mutual = [](const Eigen::MatrixXd& information) {
    const Eigen::MatrixXd joint = predicted_joint(information);
    return (joint.block<3, 3>(6, 6) + joint.block<3, 3>(12, 12) - joint.block<3, 3>(6, 12) - joint.block<3, 3>(12, 6))
        .trace();
  };
  CHECK(mutual(sum(3)) < 0.8 * mutual(apart));
  // The only view of a target tells nothing of the camera.
  const Eigen::MatrixXd once = sum(1) + joint_view_information(two, 2, flanges[0]);
  CHECK((predicted_hand_eye(once) - first).norm() < 1e-4 * first.norm());
}
