/// The heavy work that the machine asks for: one struct of arguments and one of results for each kind of job. All are
/// values: a job's result is an event like any other, so a replay needs no camera, no map and no solver.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "hal/api/cameras.hpp"
#include "platform/core/fault_table.hpp"
#include "platform/core/fixed_vector.hpp"
#include "platform/core/joint_vector.hpp"

namespace firstlook {

enum class JobKind : std::uint16_t {
  kLocateViews = 1,
  kIdentifyMotions,
  kPlan,
  kDetectBoard,
  kNextCalibrationView,
  kSolve,
  kValidate,
  kIntegrate,
  kNextSweepView,
  kNextView,
  kCertifyPath,
  kCheckBoard,
  kSummarize,
  kForgetKnownFree,
  kNextVerificationView,
  kVerifyCalibration,
  kSeeOnTheWay,
  kTouchTest,
  kColorLook,
};
inline constexpr JobKind kLastJobKind = JobKind::kColorLook;

/// What people read: "choosing the next view".
[[nodiscard]] constexpr std::string_view name_of(JobKind kind) {
  constexpr std::array<std::string_view, static_cast<std::size_t>(kLastJobKind)> kNames = {
      "choosing where to look for the board",
      "choosing motions that tell the camera's link",
      "planning a path",
      "finding the board",
      "choosing the next calibration view",
      "solving the calibration",
      "validating the calibration",
      "integrating a depth frame",
      "choosing the next view of the sweep",
      "choosing the next view",
      "certifying a path",
      "checking the board",
      "summing up what remains unknown",
      "forgetting what was known free",
      "choosing the next view to test the calibration from",
      "testing the stored calibration",
      "looking at the board on the way",
      "comparing touches with the calibration",
      "taking the colours of a look"};
  return kNames[static_cast<std::size_t>(kind) - 1];
}

inline constexpr std::size_t kPathMax = 32;
inline constexpr std::size_t kViewListMax = 64;

/// One `movej` of a certified path.
struct Leg {
  JointVector target_rad;
  double speed_rad_s = 0;
  double acceleration_rad_s2 = 0;
  template <typename Archive>
  void fields(Archive& a) {
    a(target_rad, speed_rad_s, acceleration_rad_s2);
  }
};
using Route = FixedVector<Leg, kPathMax>;

/// Which body and which free space a motion is certified for (safety rules 2 and 3).
enum class MotionPhase : std::uint8_t {
  kLinkUnknown,        ///< a camera envelope on every link, safe zone only
  kBeforeCalibration,  ///< camera envelope at the flange, safe zone only
  kMapping,            ///< calibrated camera, known free space of the map
};

struct NoArguments {      ///< kSolve, kValidate, kVerifyCalibration, kSummarize, kForgetKnownFree; also the last one's
                          ///< result
  std::uint8_t none = 0;  // a value takes at least one byte
  template <typename Archive>
  void fields(Archive& a) {
    a(none);
  }
};

/// kLocateViews, kIdentifyMotions, kNextCalibrationView, kNextVerificationView, kNextSweepView, kNextView
struct FromHere {
  JointVector at_rad;
  std::uint32_t step = 0;  ///< counts the calls of this kind; seeds the candidates. kLocateViews: 1 for the views of a
                           ///< camera on an inner link
  double now_s = 0;
  /// kNextView, kNextCalibrationView: the arm is under way to `at_rad`, and this is for after the look there.
  bool after_look = false;
  template <typename Archive>
  void fields(Archive& a) {
    a(at_rad, step, now_s, after_look);
  }
};

struct ViewList {  ///< kLocateViews, kIdentifyMotions (outermost joint first)
  FixedVector<JointVector, kViewListMax> views_rad;
  Fault fault = Fault::kNothingReachable;  ///< why it is empty
  template <typename Archive>
  void fields(Archive& a) {
    a(views_rad, fault);
  }
};

struct PlanArguments {  ///< kPlan, kCertifyPath (the path as it was chosen)
  JointVector from_rad;
  JointVector to_rad;
  MotionPhase phase = MotionPhase::kBeforeCalibration;
  std::uint32_t step = 0;
  double now_s = 0;
  Route path;             ///< only for kCertifyPath
  bool foreseen = false;  ///< kCertifyPath: it leads to the view that was chosen for after the look
  template <typename Archive>
  void fields(Archive& a) {
    a(from_rad, to_rad, phase, step, now_s, path, foreseen);
  }
};

struct PlanResult {
  bool found = false;
  Fault fault = Fault::kNoPath;  ///< why not
  Route path;
  double margin_m = 0;  ///< smallest proven margin along the path
  template <typename Archive>
  void fields(Archive& a) {
    a(found, fault, path, margin_m);
  }
};

/// A frame with where the arm was at its stamp.
struct PosedFrame {
  hal::Frame frame;
  JointVector at_rad;
  JointVector velocity_rad_s{};  ///< between the reports before and after the stamp
  double reports_apart_s = 0;    ///< of these two
  template <typename Archive>
  void fields(Archive& a) {
    a(frame.stamp, frame.sequence, frame.slot, at_rad, velocity_rad_s, reports_apart_s);
  }
};

enum class BoardLook : std::uint8_t { kLocate, kIdentify, kCollect, kConclude, kVerify };

/// Depth frames of a calibration view: two average their noise, more would not be faster than the colour frames.
inline constexpr std::size_t kDepthBesideMax = 2;

/// What is added to the stamps of each camera's frames to have the arm's time; 0 where it is taken as right.
struct StampOffsets {
  double color_s = 0;
  double depth_s = 0;
  template <typename Archive>
  void fields(Archive& a) {
    a(color_s, depth_s);
  }
};

/// Looks from one stop whose picture moved are taken again, up to so many: 2 s with three frames of 30 Hz.
inline constexpr std::uint32_t kLooksMax = 16;

/// kDetectBoard, kCheckBoard: detect in each frame, average; kDetectBoard remembers it as view number `view` when
/// found. A picture that moves is not used before the last look.
struct DetectArguments {
  BoardLook purpose = BoardLook::kLocate;
  std::uint32_t view = 0;
  FixedVector<PosedFrame, 8> frames;
  std::uint32_t looks = 1;                                  ///< from this stop, this one included
  FixedVector<PosedFrame, kDepthBesideMax> depth_frames{};  ///< taken beside them; only for kCollect
  template <typename Archive>
  void fields(Archive& a) {
    a(purpose, view, frames, looks, depth_frames);
  }
};

/// Where the arm's joints were at a time.
struct JointsAtTime {
  Instant stamp{};
  JointVector at_rad;
  template <typename Archive>
  void fields(Archive& a) {
    a(stamp, at_rad);
  }
};

/// kSeeOnTheWay: frames taken while the arm moved between two calibration views, with their stamps as the cameras have
/// them, and the joints from before them to after them.
struct WayArguments {
  hal::Frame color, depth;
  bool has_depth = false;
  std::uint32_t motion = 0;              ///< counts the motions
  FixedVector<JointsAtTime, 64> joints;  ///< 0.96 s: both windows when the stamps are off by 0.2 s in opposite ways
  template <typename Archive>
  void fields(Archive& a) {
    a(color.stamp, color.sequence, color.slot, depth.stamp, depth.sequence, depth.slot, has_depth, motion, joints);
  }
};

struct WayResult {
  bool seen = false;   ///< the board in the colour frame
  bool plane = false;  ///< its plane in the depth frame
  template <typename Archive>
  void fields(Archive& a) {
    a(seen, plane);
  }
};

/// Which of the targets that the job looks for: bit k is target k.
using TargetMask = std::uint16_t;

struct DetectResult {
  bool found = false;
  TargetMask targets = 0;  ///< that were found; what follows is of the first of them
  double rms_px = 0;
  std::array<double, 3> camera_p_board_m{};     ///< origin of the board in the camera
  std::array<double, 4> camera_q_board_xyzw{};  ///< rotation of the board in the camera
  bool changed = false;                         ///< against the first view of kIdentify: the image moved with the joint
  bool still = true;                            ///< false: the picture moved between the frames
  double moved_px = 0;                          ///< from frame to frame, see standing_picture.hpp
  template <typename Archive>
  void fields(Archive& a) {
    a(found, targets, rms_px, camera_p_board_m, camera_q_board_xyzw, changed, still, moved_px);
  }
};

struct CalibrationViewResult {
  bool found = false;  ///< false: no reachable view helps
  bool target_met = false;
  Route path;
  double sigma_mm = 0;  ///< predicted standard deviation after the views taken so far (norm over axes)
  double sigma_mrad = 0;
  template <typename Archive>
  void fields(Archive& a) {
    a(found, target_met, path, sigma_mm, sigma_mrad);
  }
};

struct SolveResult {
  bool solved = false;
  Fault fault = Fault::kSolveFailed;
  std::array<double, 3> translation_m{};
  std::array<double, 4> quaternion_xyzw{};
  double sigma_mm = 0;
  double sigma_mrad = 0;
  double reprojection_rms_px = 0;
  bool depth_estimated = false;  ///< the depth camera's pose on the colour camera
  double depth_moved_mm = 0;     ///< from where it was said to be
  double depth_moved_mrad = 0;
  StampOffsets offsets;
  bool stamps_wrong = false;  ///< frames on the way fit no offset that is looked for
  TargetMask targets = 0;     ///< whose place was solved
  template <typename Archive>
  void fields(Archive& a) {
    a(targets, solved, fault, translation_m, quaternion_xyzw, sigma_mm, sigma_mrad, reprojection_rms_px,
      depth_estimated, depth_moved_mm, depth_moved_mrad, offsets, stamps_wrong);
  }
};

/// Views that are taken when one at the end contradicts the others, to tell a wrong view from a board that has moved.
inline constexpr std::int32_t kSecondLooks = 2;

struct ValidateResult {
  bool accepted = false;
  bool more_views_tell = false;  ///< rejected for its last view alone: wrong by itself, or something has moved
  double holdout_rms_px = 0;
  double usable_distance_m = 0;
  double clearance_m = 0;  ///< of safety rule 5, with this calibration
  template <typename Archive>
  void fields(Archive& a) {
    a(accepted, more_views_tell, holdout_rms_px, usable_distance_m, clearance_m);
  }
};

/// Corners that a touch test takes at most.
inline constexpr std::size_t kTouchPointsMax = 20;

/// kTouchTest: where the arm's joints were while its tip stood on a point of the board.
struct TouchedPoint {
  std::int32_t point = 0;
  JointVector at_rad;
  template <typename Archive>
  void fields(Archive& a) {
    a(point, at_rad);
  }
};
struct TouchTestArguments {
  FixedVector<TouchedPoint, kTouchPointsMax> touches;
  template <typename Archive>
  void fields(Archive& a) {
    a(touches);
  }
};

struct TouchTestResult {
  bool usable = false;  ///< false: `fault` says why there is nothing to compare with
  Fault fault = Fault::kInternal;
  bool agrees = false;
  double residual_rms_mm = 0;  ///< of the touches, after Horn
  double error_mm = 0;         ///< of the camera, mean over the views
  double error_mrad = 0;
  double chi2 = 0;
  double chi2_limit = 0;
  double clearance_m = 0;  ///< of safety rule 5, with this calibration; 0 when it does not agree
  template <typename Archive>
  void fields(Archive& a) {
    a(usable, fault, agrees, residual_rms_mm, error_mm, error_mrad, chi2, chi2_limit, clearance_m);
  }
};

struct VerificationViewResult {
  bool found = false;       ///< false: no other view of the board can be reached
  bool target_met = false;  ///< the views so far would show an error of the sizes that matter
  Route path;
  double detectable_mm = 0;    ///< smallest errors of the hand-eye transform that the views so far would surely show
  double detectable_mrad = 0;  ///< both 0 until there are views enough to say
  template <typename Archive>
  void fields(Archive& a) {
    a(found, target_met, path, detectable_mm, detectable_mrad);
  }
};

struct VerifyResult {
  bool accepted = false;
  double chi2 = 0;
  double chi2_limit = 0;
  double residual_rms_px = 0;
  double clearance_m = 0;  ///< of safety rule 5, with this calibration
  StampOffsets offsets;    ///< as stored with it
  TargetMask targets = 0;  ///< whose place the test gives
  template <typename Archive>
  void fields(Archive& a) {
    a(accepted, targets, chi2, chi2_limit, residual_rms_px, clearance_m, offsets);
  }
};

struct IntegrateArguments {
  PosedFrame frame;
  double now_s = 0;
  bool at_view = false;  ///< the look at a stop, not a frame on the way
  JointVector arm_rad;   ///< where the arm is now
  Route ahead;           ///< the legs that still lie ahead: they are certified again on the new map
  template <typename Archive>
  void fields(Archive& a) {
    a(frame, now_s, at_view, arm_rad, ahead);
  }
};

struct IntegrateResult {
  bool used = false;
  bool path_free = true;                              ///< the legs ahead are still certified
  std::uint64_t unknown = 0, free = 0, occupied = 0;  ///< voxels of the mapped zone
  std::uint64_t gained = 0;                           ///< unknown voxels of the zone that this frame made known
  bool at_view = false;                               ///< as asked
  bool frozen = false;  ///< pixel for pixel the picture of the frame before: noise makes that impossible
  template <typename Archive>
  void fields(Archive& a) {
    a(used, path_free, unknown, free, occupied, gained, at_view, frozen);
  }
};

/// kColorLook: the colours of a depth frame that was integrated just before.
struct ColorArguments {
  PosedFrame color;
  PosedFrame depth;
  template <typename Archive>
  void fields(Archive& a) {
    a(color, depth);
  }
};

struct ColorResult {
  std::uint32_t points = 0;  ///< that gave their voxels a colour
  template <typename Archive>
  void fields(Archive& a) {
    a(points);
  }
};

struct NextViewResult {  ///< kNextSweepView, kNextView
  bool found = false;    ///< false: the sweep is done, or no view sees more (ARCHITECTURE.md, termination)
  Fault fault = Fault::kNothingReachable;
  bool blocked = false;  ///< not found because the arm does not stand in known free space
  Route path;
  double gain_expected = 0;
  std::uint32_t candidates = 0;
  template <typename Archive>
  void fields(Archive& a) {
    a(found, fault, blocked, path, gain_expected, candidates);
  }
};

struct CheckBoardResult {
  TargetMask seen = 0;   ///< of those whose place is known
  TargetMask moved = 0;  ///< of those that were seen
  double shift_mm = 0;   ///< of the one that moved farthest beyond its limit
  double limit_mm = 0;
  bool still = true;  ///< false: the picture moved between the frames
  double moved_px = 0;
  template <typename Archive>
  void fields(Archive& a) {
    a(seen, moved, shift_mm, limit_mm, still, moved_px);
  }
};

struct SummarizeResult {
  std::uint32_t clusters = 0;
  template <typename Archive>
  void fields(Archive& a) {
    a(clusters);
  }
};

}  // namespace firstlook
