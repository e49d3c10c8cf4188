#include "algorithms/view_planning/fixed_views.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "algorithms/kinematics/inverse_kinematics.hpp"
#include "algorithms/kinematics/self_collision.hpp"
#include "algorithms/vision/camera_model.hpp"
#include "algorithms/vision/rotation.hpp"

namespace firstlook {
namespace {

constexpr int kColumns = 4, kRows = 3;
constexpr double kDegree_rad = std::numbers::pi / 180;
constexpr double kTargetMargin_m = 0.005;  // states with less trap the arm (FACTS 3)

/// Turns of the board in the camera frame.
std::array<Eigen::Matrix3d, 4> turns() {
  return {Eigen::Matrix3d::Identity(), rotation_exp({25 * kDegree_rad, 0, 0}), rotation_exp({0, 25 * kDegree_rad, 0}),
          rotation_exp({0, 0, 45 * kDegree_rad})};
}

/// The board turned by `rotation`, its middle `range_m` away in the direction of a place in the picture: `across` and
/// `down` from -1 (edge) to 1.
Transform<Camera, Board> board_at(const CameraIntrinsics& camera, const BoardSpec& board,
                                  const Eigen::Matrix3d& rotation, double range_m, double across, double down) {
  const Eigen::Vector3d direction((camera.width * (1 + across) / 2 - camera.cx) / camera.fx,
                                  (camera.height * (1 + down) / 2 - camera.cy) / camera.fy, 1);
  Pose pose = Pose::Identity();
  // The camera turns, the board keeps its face to it.
  pose.linear() = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), direction).toRotationMatrix() * rotation;
  pose.translation() = range_m * direction.normalized() - pose.linear() * board.center();
  return Transform<Camera, Board>(pose);
}

bool is_in_picture(const CameraIntrinsics& camera, const BoardSpec& board, const Transform<Camera, Board>& pose,
                   double margin_px) {
  return std::ranges::all_of(board.outer_corners(), [&](int corner) {
    const auto pixel = project(camera, pose * board.corner(corner));
    return pixel && pixel->x() >= margin_px && pixel->x() <= camera.width - 1 - margin_px && pixel->y() >= margin_px &&
           pixel->y() <= camera.height - 1 - margin_px;
  });
}

/// As far towards the place as the whole board stays in the picture.
Transform<Camera, Board> place_board(const CameraIntrinsics& camera, const BoardSpec& board,
                                     const Eigen::Matrix3d& rotation, double range_m, double across, double down,
                                     double margin_px) {
  constexpr int kHalvings = 20;
  double inside = 0, outside = 1;
  for (int i = 0; i < kHalvings; ++i) {
    const double share = (inside + outside) / 2;
    const bool fits = is_in_picture(
        camera, board, board_at(camera, board, rotation, range_m, share * across, share * down), margin_px);
    (fits ? inside : outside) = share;
  }
  return board_at(camera, board, rotation, range_m, inside * across, inside * down);
}

}  // namespace

std::array<Transform<Board, Camera>, kFixedViews> fixed_views(const CameraIntrinsics& camera, const BoardSpec& board,
                                                              const Transform<Camera, Board>& first, double margin_px) {
  static_assert(kColumns * kRows * 4 == kFixedViews);
  std::array<Transform<Board, Camera>, kFixedViews> views;
  const Eigen::Vector3d middle = first * board.center();
  // As it looks from straight ahead: the board keeps its face to the camera when it moves over the picture.
  const Eigen::Matrix3d ahead =
      Eigen::Quaterniond::FromTwoVectors(middle, Eigen::Vector3d::UnitZ()).toRotationMatrix() * first.rotation();
  std::size_t number = 0;
  for (const Eigen::Matrix3d& turn : turns()) {
    for (int row = 0; row < kRows; ++row) {
      for (int i = 0; i < kColumns; ++i) {
        const int column = row % 2 == 0 ? i : kColumns - 1 - i;  // there and back
        const double across = 2.0 * column / (kColumns - 1) - 1, down = 2.0 * row / (kRows - 1) - 1;
        views[number++] =
            place_board(camera, board, turn * ahead, middle.norm(), across, down, margin_px + 1).inverse();
      }
    }
  }
  return views;
}

Result<CalibrationViewChoice> next_fixed_view(const CalibrationViewInputs& inputs, Planner& planner,
                                              const JointVector& current, int& next,
                                              const CalibrationViewOptions& options) {
  ENSURE(4541, next >= 0 && next <= kFixedViews);
  const CalibrationViewInputs& in = inputs;
  const ViewDesignModel& model = in.models.front();
  const PlannerOptions planning{
      .seed = options.seed + options.step, .iterations_max = options.plan_iterations_max, .limits = options.speed};
  const Status begun = planner.begin(in.arm, in.body, in.space, in.clearance, current, planning);
  if (!begun) return std::unexpected(begun.error());
  const JointVector& first = in.taken.empty() ? current : in.taken.front();
  const auto camera_T_board = (forward(in.arm, first).flange() * model.flange_T_camera).inverse() * model.base_T_board;
  const auto views = fixed_views(model.camera, model.board, camera_T_board, options.limits.margin_px);
  CalibrationViewChoice choice;
  choice.before = predicted_hand_eye(in.information);
  choice.after = choice.before;
  while (next < kFixedViews) {
    const auto base_T_flange =
        model.base_T_board * views[static_cast<std::size_t>(next++)] * model.flange_T_camera.inverse();
    if (check_view(model, base_T_flange, options.limits) != ViewFault::kNone) continue;
    auto postures = inverse(in.arm, base_T_flange, current);
    std::stable_sort(postures.begin(), postures.end(), [&](const JointVector& a, const JointVector& b) {
      return joint_distance_rad(a, current) < joint_distance_rad(b, current);
    });
    for (const JointVector& q : postures) {
      ++choice.considered;
      if (!configuration_is_free(in.arm, in.body, in.space, in.clearance, q, kTargetMargin_m)) continue;
      if (hides_board(model, place(in.body.capsules, forward(in.arm, q)), base_T_flange)) continue;
      ++choice.feasible;
      const Result<Path> path = planner.plan_to(q);
      if (!path) continue;
      choice.outcome = CalibrationViewChoice::Outcome::kChosen;
      choice.target = q;
      choice.shown = 1;
      choice.path = *path;
      choice.after = predicted_hand_eye(in.information + joint_view_information(in.models, 1, base_T_flange));
      return choice;
    }
  }
  return choice;
}

}  // namespace firstlook
