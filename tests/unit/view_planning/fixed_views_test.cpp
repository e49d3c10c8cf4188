#include "algorithms/view_planning/fixed_views.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>
#include <set>

#include "algorithms/motion/clearance.hpp"
#include "algorithms/vision/camera_model.hpp"

using namespace firstlook;

namespace {

const CameraIntrinsics kCamera{640, 480, 534.78, 534.10, 308.63, 226.92, .04586, -.1301, .0025, -.0006, 0};
const BoardSpec kBoard{9, 6, 0.03};
constexpr double kMargin_px = 25;

Transform<Camera, Board> first_view() {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 1, 0).normalized())),
          Eigen::Vector3d(-0.15, -0.05, 0.7)};
}

}  // namespace

TEST_CASE("the fixed list moves the board to every edge of the picture and keeps it whole", "[fixed_views]") {
  const auto views = fixed_views(kCamera, kBoard, first_view(), kMargin_px);
  const double range_m = (first_view() * kBoard.center()).norm();
  for (std::size_t orientation = 0; orientation < 4; ++orientation) {
    double left = 1e9, right = -1e9, top = 1e9, bottom = -1e9;
    for (std::size_t place = 0; place < 12; ++place) {
      const auto camera_T_board = views[12 * orientation + place].inverse();
      CHECK((camera_T_board * kBoard.center()).norm() == Approx(range_m));
      for (int i = 0; i < kBoard.corners(); ++i) {
        const auto pixel = project(kCamera, camera_T_board * kBoard.corner(i));
        REQUIRE(pixel);
        left = std::min(left, pixel->x());
        right = std::max(right, pixel->x());
        top = std::min(top, pixel->y());
        bottom = std::max(bottom, pixel->y());
      }
    }
    CHECK(left > kMargin_px);
    CHECK(left < kMargin_px + 3);
    CHECK(right < 639 - kMargin_px);
    CHECK(right > 636 - kMargin_px);
    CHECK(top > kMargin_px);
    CHECK(top < kMargin_px + 3);
    CHECK(bottom < 479 - kMargin_px);
    CHECK(bottom > 476 - kMargin_px);
  }
}

TEST_CASE("the arm goes through the fixed list in order, leaves out what it cannot reach, and comes to its end",
          "[fixed_views]") {
  const ArmModel arm = *find_arm_model("ur5");
  const Body body = body_with_envelope(arm);
  const Clearance clearance = required_clearance({}).clearance();
  const FreeSpace space;
  Planner planner;
  ViewDesignModel model;
  model.camera = kCamera;
  model.board = kBoard;
  model.flange_T_camera = {Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.0, -0.07, 0.05)};
  JointVector at = default_start(arm);
  model.base_T_board = forward(arm, at).flange() * model.flange_T_camera * first_view();
  const JointVector start = at;
  Matrix12d information = prior_information();
  std::vector<JointVector> taken;
  int next = 0;
  std::set<int> numbers;
  for (;;) {
    const CalibrationViewInputs inputs{arm, body, space, clearance, {&model, 1}, information, taken};
    const int before = next;
    const auto choice = next_fixed_view(inputs, planner, at, next);
    REQUIRE(choice);
    if (choice->outcome != CalibrationViewChoice::Outcome::kChosen) break;
    REQUIRE(next > before);
    numbers.insert(next);
    const auto base_T_flange = forward(arm, choice->target).flange();
    REQUIRE(check_view(model, base_T_flange) == ViewFault::kNone);
    REQUIRE(choice->path.waypoints.front() == at);
    for (std::size_t i = 1; i < choice->path.waypoints.size(); ++i) {
      REQUIRE(
          certify(arm, body, space, clearance, choice->path.waypoints[i - 1], choice->path.waypoints[i]).certified());
    }
    REQUIRE(design_cost(choice->after) < design_cost(choice->before));
    at = choice->target;
    taken.push_back(at);
    information += view_information(model, base_T_flange);
  }
  REQUIRE(next == kFixedViews);
  REQUIRE(numbers.size() >= 12);
  REQUIRE(predicted_sigma(predicted_covariance(information)).translation_m < 0.001);
  // From any place of the list the same place of the board is looked at: the list goes by the first view.
  const auto camera_T_board =
      (forward(arm, taken.front()).flange() * model.flange_T_camera).inverse() * model.base_T_board;
  CHECK((camera_T_board * kBoard.center()).norm() == Approx((first_view() * kBoard.center()).norm()).epsilon(1e-6));
  CHECK_FALSE(start == at);
}
