/// hand_eye.yaml: a calibration as a run leaves it behind, and as a later run takes it up again.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "algorithms/calibration/calibration_view.hpp"
#include "algorithms/calibration/depth_to_color.hpp"
#include "algorithms/calibration/hand_eye_refinement.hpp"
#include "algorithms/kinematics/arm_model.hpp"
#include "platform/core/camera_intrinsics.hpp"
#include "platform/core/result.hpp"
#include "platform/core/transform.hpp"

namespace firstlook {

/// The arm of a calibration from recorded data that nobody named; no job takes that one up.
inline constexpr std::string_view kUnknownArm = "unknown";

/// What a camera's stamps need to be the arm's time.
struct StoredOffset {
  double offset_s = 0;
  double sigma_s = 0;
};

/// Everything that hand_eye.yaml says: the transform, how sure it is, and what it holds for.
struct StoredCalibration {
  bool accepted = false;
  std::string arm_model = std::string(kUnknownArm);
  std::uint64_t kinematics = 0;  ///< kinematics_checksum of the arm that it was made with
  Transform<Flange, Camera> flange_T_camera;
  Matrix6d covariance = Matrix6d::Zero();  ///< see pose_difference
  double corner_sigma_px = 0;              ///< as estimated from its views
  ArmSigma arm_sigma;
  CameraIntrinsics intrinsics;  ///< of the colour camera; width 0: solved from pose pairs, none known
  std::optional<Transform<Camera, Depth>> camera_T_depth;  ///< as used with it; empty: no depth camera took part
  /// When the depth camera's pose was estimated: that pose with its covariance, and what was stated of it then.
  std::optional<DepthMount> depth_mount;
  std::optional<Transform<Camera, Depth>> stated_camera_T_depth;
  std::optional<StoredOffset> color_offset, depth_offset;  ///< when they were estimated
  std::string solver;
  int views = 0;        ///< used in the solve
  int views_given = 0;  ///< with those left out as wrong
  double reprojection_rms_px = 0;
  double holdout_rms_px = 0;  ///< of views left out of the solve in turn; 0: not validated
  double usable_distance_m = 0;
};

/// FNV-1a of the arm's name and of its DH rows to 0.1 um and 0.1 urad: the flange is where these say.
[[nodiscard]] std::uint64_t kinematics_checksum(const ArmModel& arm);

/// The file's text; every number reads back to the same bits.
[[nodiscard]] std::string hand_eye_yaml(const StoredCalibration& calibration);

/// Reads and checks a hand_eye.yaml: all keys, no others, units that can be, a unit quaternion, a covariance that is
/// one and agrees with the sigmas.
/// @return kDataMissing, kDataMalformed with file:line and what is wrong; kStoredCalibration for one that its own run
/// rejected
[[nodiscard]] Result<StoredCalibration> read_hand_eye(const std::filesystem::path& file);

/// Whether a calibration was made with this arm, colour camera and depth camera. Where a cart estimates its intrinsics,
/// those of the calibration count and only the size of the pictures is compared. Of a depth camera whose pose was
/// estimated, what is stated of it is compared.
/// @return kStoredCalibration with what differs
[[nodiscard]] Status check_belongs(const StoredCalibration& calibration, const ArmModel& arm,
                                   const CameraIntrinsics& intrinsics, const Transform<Camera, Depth>& camera_T_depth,
                                   bool estimates_intrinsics = false);

}  // namespace firstlook
