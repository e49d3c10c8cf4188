#include "algorithms/vision/board_pose.hpp"

#include <catch2/catch.hpp>

#include "algorithms/vision/camera_model.hpp"
#include "algorithms/vision/rotation.hpp"
#include "tests/unit/vision/draw_board.hpp"

using namespace firstlook;

namespace {
constexpr CameraIntrinsics kCamera{640, 480, 534.78, 534.10, 308.63, 226.92, .04586, -.1301, .0025, -.0006, 0};
const BoardSpec kBoard{9, 6, 0.03};

std::vector<Eigen::Vector2d> observe(const Pose& pose, double sigma_px, Random& random) {
  std::vector<Eigen::Vector2d> corners;
  for (int i = 0; i < kBoard.corners(); ++i) {
    corners.push_back(*project(kCamera, pose * kBoard.corner(i)) +
                      sigma_px * Eigen::Vector2d(random.normal(), random.normal()));
  }
  return corners;
}

Pose random_view(Random& random) {
  return test::look_at_board(kBoard, random.uniform(0.4, 1.2), random.uniform(0, 1.0), random.uniform(0, 6.28),
                             random.uniform(-3.14, 3.14));
}
}  // namespace

TEST_CASE("rotation vectors and matrices, also at 0 and pi", "[vision]") {
  Random random(5);
  for (int i = 0; i < 500; ++i) {
    const double angle = i % 3 == 0 ? 1e-9 : i % 3 == 1 ? 3.14159 : random.uniform(0, 3.1);
    const Eigen::Vector3d v = random.direction() * angle;
    CHECK((rotation_log(rotation_exp(v)) - v).norm() < 1e-9);
  }
  const Eigen::Vector3d phi(0.3, -1.1, 0.7), step = Eigen::Vector3d(2, -1, 3) * 1e-7;
  const Eigen::Vector3d moved = rotation_log(rotation_exp(phi + step) * rotation_exp(phi).transpose());
  CHECK((moved - left_jacobian(phi) * step).norm() < 1e-12);
}

TEST_CASE("pose from clean corners is exact at any view", "[vision]") {
  Random random(11);
  for (int i = 0; i < 300; ++i) {
    const Pose truth = random_view(random);
    const auto pose = estimate_board_pose(kCamera, kBoard, observe(truth, 0, random));
    REQUIRE(pose);
    CHECK((pose->camera_T_board.translation() - truth.translation()).norm() < 1e-9);
    CHECK(rotation_log(pose->camera_T_board.rotation() * truth.linear().transpose()).norm() < 1e-8);
  }
}

TEST_CASE("pose errors agree with the covariance", "[vision]") {
  Random random(12);
  constexpr double kSigma = 0.1;
  constexpr int kTrials = 300;
  double normalized = 0;
  for (int i = 0; i < kTrials; ++i) {
    const Pose truth = random_view(random);
    const auto pose = estimate_board_pose(kCamera, kBoard, observe(truth, kSigma, random));
    REQUIRE(pose);
    Eigen::Matrix<double, 6, 1> error;
    error << truth.translation() - pose->camera_T_board.translation(),
        rotation_log(truth.linear() * pose->camera_T_board.rotation().transpose());
    normalized += error.dot((pose->unit_covariance * kSigma * kSigma).inverse() * error) / kTrials;
    CHECK(pose->residual_rms_px < 0.2);
  }
  CHECK(normalized > 5);
  CHECK(normalized < 7.5);
}

TEST_CASE("single wrong corners do not move the robust pose", "[vision]") {
  Random random(14);
  for (int i = 0; i < 50; ++i) {
    const Pose truth = random_view(random);
    auto corners = observe(truth, 0.1, random);
    const auto clean = estimate_board_pose_robust(kCamera, kBoard, corners);
    corners[static_cast<std::size_t>(random.below(54))] += Eigen::Vector2d(9, -7);
    corners[53] += Eigen::Vector2d(0, 5);
    const auto robust = estimate_board_pose_robust(kCamera, kBoard, corners);
    REQUIRE(clean);
    REQUIRE(robust);
    CHECK((robust->pose.camera_T_board.translation() - clean->pose.camera_T_board.translation()).norm() < 2e-3);
    CHECK(robust->weights[53] == 0);
  }
}

TEST_CASE("corners that are no board are refused", "[vision]") {
  Random random(13);
  auto corners = observe(random_view(random), 0.1, random);
  auto fewer = corners;
  fewer.pop_back();
  CHECK(estimate_board_pose(kCamera, kBoard, fewer).error().fault == Fault::kBoardNotFound);
  auto wrong = corners;
  wrong[7] += Eigen::Vector2d(40, 40);
  CHECK(estimate_board_pose(kCamera, kBoard, wrong).error().fault == Fault::kBoardNotFound);
  auto nan = corners;
  nan[3].x() = std::nan("");
  CHECK_FALSE(estimate_board_pose(kCamera, kBoard, nan));
  const std::vector<Eigen::Vector2d> same(54, Eigen::Vector2d(100, 100));
  CHECK_FALSE(estimate_board_pose(kCamera, kBoard, same));
  std::vector<Eigen::Vector2d> line;
  for (int i = 0; i < 54; ++i) line.emplace_back(10 + 3 * i, 200);
  CHECK_FALSE(estimate_board_pose(kCamera, kBoard, line));
}
