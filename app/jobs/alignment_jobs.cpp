/// Jobs that bring the sensors into line: the depth camera with the colour camera, the stamps of both with the arm.
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "algorithms/calibration/board_ambiguity.hpp"
#include "app/jobs/workbench.hpp"

namespace firstlook {
namespace {

// A sensor of this kind measures depths that are too long or too short by up to 1 %, rarely more (two sigmas).
constexpr double kScaleSigma = 0.005;
constexpr double kCornerSigmaMin_px = 0.02;
// A given mount counts as exact; solvers divide by what it may be off.
constexpr double kExact_m = 1e-6, kExact_rad = 1e-6, kExactScale = 1e-6;

bool same_board(const Transform<Camera, Board>& a, const Transform<Camera, Board>& b) {
  constexpr double kSame_rad = 0.5;  // the other pose of a plane, or another order of its points, is farther off
  return rotation_log(a.rotation() * b.rotation().transpose()).norm() < kSame_rad;
}

/// Of the poses that a picture allows the one that is turned least from where the board should be.
Transform<Camera, Board> nearest_choice(const OpenView& view, const Transform<Camera, Board>& expected) {
  const auto turned = [&](const PoseChoice& choice) {
    return rotation_log(choice.camera_T_board.rotation() * expected.rotation().transpose()).norm();
  };
  return std::min_element(view.choices.begin(), view.choices.end(),
                          [&](const PoseChoice& a, const PoseChoice& b) { return turned(a) < turned(b); })
      ->camera_T_board;
}

}  // namespace

/// What holds before anything is estimated: what the data sheet says, or a stored calibration.
void Workbench::begin_alignment() {
  DepthCameraRecord& depth = alignment_.depth_camera;
  depth.stated = facts_.camera_T_depth;
  depth.mount.camera_T_depth = facts_.camera_T_depth;
  if (!facts_.stored) return;
  if (config_.calibration.depth == "estimate") {
    if (facts_.stored->depth_mount) {
      depth.source = ValueSource::kStored;
      depth.mount = *facts_.stored->depth_mount;
    } else {
      depth.mount = stated_mount();
      depth.reason = "the stored calibration has none";
    }
  }
  if (config_.calibration.time_offset != "estimate") return;
  if (const auto& offset = facts_.stored->color_offset) {
    alignment_.color_stamps = {ValueSource::kStored, {}, offset->offset_s, offset->sigma_s, {}};
  }
  if (const auto& offset = facts_.stored->depth_offset) {
    alignment_.depth_stamps = {ValueSource::kStored, {}, offset->offset_s, offset->sigma_s, {}};
  }
}

DepthMount Workbench::stated_mount() const {
  return believed_mount(facts_.camera_T_depth, config_.calibration.depth_sigma_mm * 1e-3,
                        config_.calibration.depth_sigma_mrad * 1e-3, kScaleSigma);
}

Result<BoardPlane> Workbench::plane_of(const hal::Frame& frame, const Transform<Camera, Board>& camera_T_board) {
  const CameraIntrinsics& camera = depth_.intrinsics();
  const ImageView<std::uint16_t> pixels{depth_pixels_.items().data(), camera.width, camera.height};
  if (const Status read = depth_.read(frame, pixels); !read) return std::unexpected(read.error());
  BoardPlaneOptions options;
  options.noise_at_1m =
      config_.depth.sigma_m(config_.depth.range_min_m) / (config_.depth.range_min_m * config_.depth.range_min_m);
  const DepthImage image{{pixels.data, pixels.width, pixels.height}, depth_.units_per_m()};
  return find_board_plane(image, camera, board_, facts_.camera_T_depth.inverse() * camera_T_board, options);
}

std::optional<BoardPlane> Workbench::plane_beside(const DetectArguments& arguments, const BoardPose& pose) {
  std::vector<BoardPlane> planes;
  for (const PosedFrame& posed : arguments.depth_frames) {
    if (const auto plane = plane_of(posed.frame, pose.camera_T_board)) planes.push_back(*plane);
  }
  if (planes.empty()) return std::nullopt;
  return merged(planes);
}

WayResult Workbench::see_on_the_way(const WayArguments& arguments) {
  WayResult result;
  if (way_sights_.size() == way_sights_.capacity()) return result;
  auto corners = corners_of(arguments.color);
  if (!corners) return result;
  const auto pose = estimate_board_pose(color_.intrinsics(), board_, *corners);
  if (!pose) return result;
  result.seen = true;
  WaySight sight;
  sight.color_stamp_s = arguments.color.stamp.seconds();
  sight.corners = std::move(*corners);
  sight.motion = static_cast<int>(arguments.motion);
  for (const JointsAtTime& joints : arguments.joints) sight.joints.push_back({joints.stamp.seconds(), joints.at_rad});
  if (arguments.has_depth) {
    if (const auto plane = plane_of(arguments.depth, pose->camera_T_board)) {
      sight.depth_stamp_s = arguments.depth.stamp.seconds();
      sight.plane = *plane;
      result.plane = true;
    }
  }
  way_sights_.push_back(std::move(sight));
  return result;
}

/// After the solve, with what it found.
void Workbench::align_sensors() {
  align_depth_camera();
  align_stamps();
}

void Workbench::align_depth_camera() {
  DepthCameraRecord& record = alignment_.depth_camera;
  if (config_.calibration.depth != "estimate") return;
  std::vector<DepthStop> stops;
  const double sigma_px = std::max(hand_eye_->corner_sigma_px, kCornerSigmaMin_px);
  const std::vector<std::size_t> counted = independent_observations();
  for (std::size_t k = 0; k < counted.size(); ++k) {
    const Observation& o = observations_[counted[k]];
    const bool wrong = k < hand_eye_->fits.size() && !hand_eye_->fits[k].used;
    if (!o.plane || wrong) continue;
    const auto pose = estimate_board_pose(camera(), board_, SeenPoints(o.view.corners_px, o.view.ids));
    if (!pose) continue;
    BoardPose settled = *pose;
    if (settled.other && !same_board(settled.camera_T_board, o.pose.camera_T_board)) {
      settled.camera_T_board = pose->other->camera_T_board;
      settled.unit_covariance = pose->other->unit_covariance;
    }
    stops.push_back({settled.camera_T_board, sigma_px * sigma_px * settled.unit_covariance, *o.plane});
  }
  record.views = static_cast<int>(stops.size());
  const DepthMount stated = stated_mount();
  record.mount = stated;  // what is not found is as sure as its data sheet
  auto estimate = estimate_depth_to_color(stops, stated, board_);
  if (!estimate) {
    record.reason = estimate.error().detail();
    return;
  }
  record.source = ValueSource::kEstimated;
  record.mount = estimate->mount;
  record.estimate = std::move(*estimate);
}

/// The board's pose in a frame on the way, with the camera as solved.
std::optional<SeenPose> Workbench::seen_pose(const WaySight& sight) const {
  const auto pose = estimate_board_pose(camera(), board_, sight.corners);
  if (!pose || sight.joints.empty()) return std::nullopt;
  const JointVector& near = sight.joints[sight.joints.size() / 2].joints_rad;
  const auto flange = forward(arm_, near).flange();
  const auto expected = (flange * hand_eye_->flange_T_camera).inverse() * hand_eye_->base_T_board;
  const OpenView open = open_view(board_, {flange, sight.corners.corners_px, sight.corners.ids}, *pose);
  // One frame, where the solve had the mean of several.
  const double single = std::sqrt(static_cast<double>(std::max(1, config_.calibration.frames_per_view)));
  const double sigma_px = std::max({single * hand_eye_->corner_sigma_px, kCornerSigmaMin_px, pose->residual_rms_px});
  return SeenPose{nearest_choice(open, expected), sigma_px * sigma_px * pose->unit_covariance};
}

void Workbench::align_stamps() {
  if (config_.calibration.time_offset != "estimate") return;
  TimedCell cell;
  cell.arm = arm_;
  cell.flange_T_camera = hand_eye_->flange_T_camera;
  cell.base_T_board = hand_eye_->base_T_board;
  cell.covariance = hand_eye_->joint_covariance.topLeftCorner<12, 12>();
  cell.arm_sigma = hand_eye_->arm_sigma;
  cell.depth = alignment_.depth_camera.mount;
  Vector7d exact;
  exact << Eigen::Vector3d::Constant(kExact_m), Eigen::Vector3d::Constant(kExact_rad), kExactScale;
  cell.depth.covariance.diagonal() += exact.cwiseAbs2();

  std::vector<MovingFrame> color, depth;
  for (const WaySight& sight : way_sights_) {
    if (const auto pose = seen_pose(sight)) color.push_back({sight.color_stamp_s, sight.joints, *pose, sight.motion});
    if (sight.plane) depth.push_back({sight.depth_stamp_s, sight.joints, *sight.plane, sight.motion});
  }
  const auto align = [&](std::span<const MovingFrame> frames, StampRecord& record) {
    const auto offset = estimate_time_offset(cell, frames);
    if (!offset) {
      record.contradicted = offset.error().fault == Fault::kClockWrong;
      record.reason = offset.error().detail();
      return;
    }
    record.source = ValueSource::kEstimated;
    record.offset_s = offset->offset_s;
    record.sigma_s = offset->sigma_s;
    record.estimate = *offset;
  };
  align(color, alignment_.color_stamps);
  align(depth, alignment_.depth_stamps);
}

}  // namespace firstlook
