/// Jobs that look at the board: find where to look from, detect it, compare it.
#include <algorithm>
#include <cmath>

#include "algorithms/calibration/board_ambiguity.hpp"
#include "algorithms/calibration/camera_on_arm.hpp"
#include "algorithms/view_planning/identify.hpp"
#include "algorithms/view_planning/locate.hpp"
#include "algorithms/vision/detector_presets.hpp"
#include "algorithms/vision/target_detection.hpp"
#include "app/jobs/workbench.hpp"

namespace firstlook {
namespace {

ViewList list_of(const Result<Turns>& turns) {
  ViewList list;
  if (!turns) {
    list.fault = turns.error().fault;
    return list;
  }
  for (const JointVector& q : *turns) {
    if (!list.views_rad.full()) list.views_rad.push_back(q);
  }
  return list;
}

double horizontal_fov_rad(const CameraIntrinsics& camera) { return 2 * std::atan(camera.width / (2 * camera.fx)); }

}  // namespace

ViewList Workbench::locate_views(const FromHere& here) {
  return list_of(firstlook::locate_views(arm_, envelope_body_, space_of(MotionPhase::kBeforeCalibration),
                                         blind_terms_.clearance(), here.at_rad,
                                         horizontal_fov_rad(color_.intrinsics())));
}

ViewList Workbench::identify_motions(const FromHere& here) {
  return list_of(firstlook::identify_motions(arm_, envelope_body_, space_of(MotionPhase::kBeforeCalibration),
                                             blind_terms_.clearance(), here.at_rad));
}

Result<CornerSet> Workbench::corners_of(const hal::Frame& frame) {
  if (const auto delivered = color_.read_corners(frame)) {
    CornerSet set;
    for (const auto& c : delivered->corners_px) set.corners_px.emplace_back(c[0], c[1]);
    if (static_cast<int>(set.corners_px.size()) != board_.corners()) {
      return failure(Fault::kBoardNotFound, "the camera reports {} corners", set.corners_px.size());
    }
    return set;
  }
  const CameraIntrinsics& camera = color_.intrinsics();
  const MutableGrayImage image{gray_.items().data(), camera.width, camera.height};
  if (const Status read = color_.read(frame, image); !read) return std::unexpected(read.error());
  const auto preset = find_detector_preset(config_.board.detector).value_or(DetectorPreset{});
  return detect_target(GrayImage{image.data, image.width, image.height}, board_, preset.detection);
}

BoardSight Workbench::sight_of(const DetectArguments& arguments) {
  std::vector<CornerSet> found;
  for (const PosedFrame& posed : arguments.frames) {
    auto corners = corners_of(posed.frame);
    if (corners) found.push_back(std::move(*corners));
    // A board that is not in the first frame of a standing arm is not in the others.
    if (found.empty()) break;
  }
  BoardSight sight;
  if (found.empty() || found.size() * 2 < arguments.frames.size()) return sight;  // not even half of the frames show it
  if (auto picture = judge_standing(found)) {
    sight.still = picture->still;
    sight.moved_px = picture->moved_px;
    if (sight.still || arguments.looks >= kLooksMax) {
      sight.picture = std::move(*picture);
      sight.frames = std::move(found);
    }
  } else {
    sight.still = false;
    sight.moved_px = kFramesAgree_px;  // at least: average_corners found no two alike
  }
  return sight;
}

/// The frame that was read last is the picture of this observation.
void Workbench::keep_picture(std::size_t observation) {
  const std::size_t pixels = gray_.size();
  if ((observation + 1) * pixels > pictures_.size()) return;
  const auto from = gray_.items();
  std::copy(from.begin(), from.end(), pictures_.items().begin() + static_cast<std::ptrdiff_t>(observation * pixels));
}

/// Which of the poses that each picture allows was true: the views taken so far tell it of each other.
void Workbench::settle_observations(BoardLook purpose) {
  std::vector<OpenView> open;
  for (const Observation& o : observations_) open.push_back(open_view(board_, o.view, o.pose));
  const bool verifies = purpose == BoardLook::kVerify && facts_.stored;
  const auto choices = verifies ? settle_choices(open, facts_.stored->flange_T_camera) : settle_choices(open);
  for (std::size_t i = 0; i < open.size(); ++i) {
    const PoseChoice& choice = open[i].choices[choices[i]];
    Observation& o = observations_[i];
    adopt_choice(board_, choice, o.pose);
    if (choice.reversed) std::reverse(o.view.corners_px.begin(), o.view.corners_px.end());
  }
}

DetectResult Workbench::detect_board(const DetectArguments& arguments) {
  DetectResult result;
  if (arguments.purpose == BoardLook::kVerify && arguments.looks == 1) ++verification_looks_;
  const BoardSight sight = sight_of(arguments);
  result.still = sight.still;
  result.moved_px = sight.moved_px;
  if (!sight.picture) return result;
  const CornerSet& corners = sight.picture->mean;
  const auto pose = estimate_board_pose(camera(), board_, corners);
  if (!pose) return result;
  result.found = true;
  result.rms_px = pose->residual_rms_px;
  const Eigen::Vector3d p = pose->camera_T_board.translation();
  const Eigen::Quaterniond q = pose->camera_T_board.quaternion();
  result.camera_p_board_m = {p.x(), p.y(), p.z()};
  result.camera_q_board_xyzw = {q.x(), q.y(), q.z(), q.w()};

  const PosedFrame& last = arguments.frames.back();
  last_stamp_s_ = std::max(last_stamp_s_, last.frame.stamp.seconds());
  if (arguments.purpose == BoardLook::kLocate) identify_reference_ = *pose;
  if (arguments.purpose == BoardLook::kIdentify && identify_reference_) {
    result.changed = compare_views(color_.intrinsics(), board_, *identify_reference_, *pose).changed;
  }
  if ((arguments.purpose == BoardLook::kCollect || arguments.purpose == BoardLook::kVerify) &&
      observations_.size() < static_cast<std::size_t>(config_.calibration.views_max)) {
    Observation o;
    o.joints_rad = last.at_rad;
    o.time_s = last.frame.stamp.seconds();
    o.view = {forward(arm_, last.at_rad).flange(), corners.corners_px, corners.ids};
    o.pose = *pose;
    o.residual_rms_px = pose->residual_rms_px;
    o.settling = {static_cast<int>(arguments.looks), sight.moved_px, sight.picture->scatter_px, sight.still};
    o.plane = plane_beside(arguments, *pose);
    o.frames = sight.frames;
    keep_picture(observations_.size());
    observations_.push_back(std::move(o));
    settle_observations(arguments.purpose);
  }
  return result;
}

CheckBoardResult Workbench::check_board(const DetectArguments& arguments) {
  CheckBoardResult result;
  if (!hand_eye_) return result;
  const BoardSight sight = sight_of(arguments);
  result.still = sight.still;
  result.moved_px = sight.moved_px;
  if (!sight.picture) return result;
  const auto pose = estimate_board_pose(camera(), board_, sight.picture->mean);
  if (!pose) return result;
  result.seen = true;
  const auto base_T_flange = forward(arm_, arguments.frames.back().at_rad).flange();
  const auto base_T_board = base_T_flange * hand_eye_->flange_T_camera * pose->camera_T_board;
  const Eigen::Vector3d middle = board_.center();
  result.shift_mm = 1000 * (base_T_board * middle - hand_eye_->base_T_board * middle).norm();

  // What a board that stands still may seem to have moved, 3 sigma: the hand-eye and the arm at the board's distance,
  // and the pose estimate itself.
  const double distance = (pose->camera_T_board * middle).norm();
  const double hand_eye_sigma = point_sigma(hand_eye_->flange_T_camera, hand_eye_->covariance, distance);
  const double arm_sigma = std::hypot(hand_eye_->arm_sigma.translation_m, hand_eye_->arm_sigma.rotation_rad * distance);
  const double corner_sigma = std::max(hand_eye_->corner_sigma_px, 0.05);
  const Matrix6d look = corner_sigma * corner_sigma * pose->unit_covariance;
  const double look_sigma =
      std::sqrt(look.topLeftCorner<3, 3>().trace() + middle.squaredNorm() * look.bottomRightCorner<3, 3>().trace());
  const double sigma =
      std::sqrt(3 * (hand_eye_sigma * hand_eye_sigma + arm_sigma * arm_sigma) + look_sigma * look_sigma);
  result.limit_mm = 1000 * 3 * sigma;
  result.moved = result.shift_mm > result.limit_mm;
  return result;
}

}  // namespace firstlook
