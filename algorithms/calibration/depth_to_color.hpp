/// Where the depth camera sits on the colour camera, from the plane of the board in depth images.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "algorithms/calibration/board_plane.hpp"
#include "platform/core/result.hpp"

namespace firstlook {

using Vector7d = Eigen::Matrix<double, 7, 1>;
using Matrix7d = Eigen::Matrix<double, 7, 7>;

/// The depth camera as its maker states it, or as it was found: pose on the colour camera, and how much longer its
/// depths are than the truth (1: none). No offset of disparity: over the distances of a calibration it looks like a
/// shift along the optical axis and a scale together, so it is contained in both.
struct DepthMount {
  Transform<Camera, Depth> camera_T_depth;
  double depth_scale = 1;  ///< measured = scale * true
  /// Of (pose_difference of camera_T_depth, scale): m, rad, 1.
  Matrix7d covariance = Matrix7d::Zero();
};

/// A believed mount with independent errors, the same for each axis.
[[nodiscard]] DepthMount believed_mount(const Transform<Camera, Depth>& camera_T_depth, double sigma_translation_m,
                                        double sigma_rotation_rad, double sigma_scale);

/// One stop: the board in the colour camera, and its plane in the depth camera.
struct DepthStop {
  Transform<Camera, Board> camera_T_board;
  Matrix6d covariance = Matrix6d::Zero();  ///< of its pose_difference
  BoardPlane plane;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();  ///< BoardSpec::center of the board that it shows
};

struct DepthToColorOptions {
  int stops_min = 3;               ///< planes through fewer do not even tell a rotation and a distance
  double wrong_stop = 1e-4;        ///< a stop that fits worse than this share of right ones do is left out
  double left_out_max = 1.0 / 3;   ///< more than this share left out: the stops contradict each other
  double chance_min = 0.01;        ///< disagreement that chance explains less often than this is estimated
  double offset_rms_max_m = 0.01;  ///< stops that disagree by more are not of one depth camera
  double told_ratio = 0.5;       ///< a direction counts as told where its sigma is below this part of what was believed
  double contradiction = 0.001;  ///< significance of the test of what was believed
};

/// One direction of (translation, rotation, scale) that the planes do not tell: as believed before.
struct UntoldDirection {
  std::string name;        ///< "translation along x", "rotation about (0.71, 0.00, 0.71)", "depth scale"
  double sigma_ratio = 1;  ///< sigma after over sigma before
};

/// Does what was believed agree with what the planes say, in the directions that they tell?
struct BeliefTest {
  double chi2 = 0;
  int degrees_of_freedom = 0;
  double chi2_limit = 0;
  [[nodiscard]] bool contradicted() const { return degrees_of_freedom > 0 && chi2 > chi2_limit; }
};

struct DepthStopFit {
  bool used = true;
  double chi2 = 0;      ///< of 3 degrees of freedom
  double offset_m = 0;  ///< of the plane, where the board's middle is: measured - expected, along the line of sight
  double tilt_rad = 0;  ///< between the normals
};

/// What the planes of the stops disagree beyond noise and corners, one sigma: errors of a sensor that are alike over
/// the whole board.
struct PlaneExcess {
  double offset_m = 0;  ///< at the board's middle, along its normal
  double tilt_rad = 0;  ///< about each of two axes
};

struct DepthToColor {
  DepthMount mount;
  Vector6d moved = Vector6d::Zero();  ///< pose_difference from what was believed
  double noise_at_1m = 0;             ///< m: sigma of a depth at 1 m, from the pixels
  double offset_rms_m = 0;            ///< of the stops used
  double chi2 = 0;                    ///< of the stops used
  int degrees_of_freedom = 0;
  PlaneExcess excess;  ///< 0 when noise and corners explain the stops
  std::vector<UntoldDirection> untold;
  BeliefTest belief;
  std::vector<DepthStopFit> stops;
};

/// Maximum a posteriori estimate: at each stop the plane of the depth image against the plane of the board's pose, the
/// covariance of both sides (pixels' noise / their number, and the corners') and the Gaussian belief; Levenberg and
/// Marquardt. A plane tells three of the seven numbers: what tilted boards at several distances determine is found, all
/// else stays as believed and is named. Stops that fit none of this are left out; when the rest disagree more than
/// chance explains, the excess is estimated by expectation maximisation (Dempster et al. 1977) and widens the
/// covariance.
/// @return kTooFewViews for less than stops_min stops, kSolveFailed when the stops contradict each other or numbers are
/// not finite
[[nodiscard]] Result<DepthToColor> estimate_depth_to_color(std::span<const DepthStop> stops, const DepthMount& believed,
                                                           const DepthToColorOptions& options = {});

}  // namespace firstlook
