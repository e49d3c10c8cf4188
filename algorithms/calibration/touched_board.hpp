/// Where a board hangs, told without any camera: the arm's tip was led onto some of its points.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "algorithms/calibration/calibration_view.hpp"
#include "algorithms/calibration/hand_eye_refinement.hpp"
#include "platform/core/result.hpp"

namespace firstlook {

inline constexpr std::size_t kTouchesMax = 20;  ///< as many corners as the thesis touched (section 8-4-1)

/// One touch: where the arm said that its flange was while the tip stood on a point of the board.
struct Touch {
  Transform<Base, Flange> base_T_flange;
  int corner = 0;  ///< number of the point, as BoardSpec::corner counts
};

/// Where the tip is on the flange, as somebody measured it.
struct TipOffset {
  Eigen::Vector3d flange_p_tip_m = Eigen::Vector3d::Zero();
  double sigma_m = 0.0005;  ///< for each axis; 0: exact
};

struct TouchOptions {
  std::optional<TipOffset> tip;  ///< empty: estimated from the touches, together with the board
  /// How far from the point a hand sets the tip, for each axis, the board's unevenness included. What the touches show
  /// themselves counts more the more of them there are; this counts like two touches.
  double touch_sigma_m = 0.0003;
  ArmSigma arm_sigma{1e-4, 2e-4};  ///< one deviation for all touches: their poses are close together
  double gate = 5;                 ///< touches farther off than so many sigmas are left out
  double coarse_max = 5;           ///< a hand is not so many times less steady than expected
  double left_out_max = 1.0 / 3;   ///< more than this share left out: the touches contradict each other
  double tip_sigma_max_m = 0.003;  ///< of an estimated tip, in the direction that the touches tell worst
};

struct TouchFit {
  int corner = 0;    ///< as said
  std::string name;  ///< of it, see corner_name
  bool used = true;
  Eigen::Vector3d off_m = Eigen::Vector3d::Zero();  ///< from the point to where it was touched, in the board's axes
  std::optional<int> rather;                        ///< of a touch left out: the other point that the tip stood on
  std::string rather_name;
};

struct TouchedBoard {
  Transform<Base, Board> base_T_board;
  Matrix6d covariance = Matrix6d::Zero();  ///< of pose_difference: the hand's, the tip's and the arm's errors
  Eigen::Vector3d flange_p_tip_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d tip_sigma_m = Eigen::Vector3d::Zero();
  bool tip_estimated = false;
  double tip_chi2 = 0;  ///< by how much the touches would fit better with another tip than given; 3 degrees of freedom
  double horn_residual_rms_m = 0;  ///< distance of touch and point after Horn's closed form with the tip as it came out
  double residual_rms_m = 0;       ///< the same after the refinement; both over the touches used
  double residual_max_m = 0;
  double touch_sigma_m = 0;  ///< as the touches show it and as it was expected, weighed
  double chi2 = 0;           ///< of the residuals, by the expected sigma
  int degrees_of_freedom = 0;
  double chi2_limit = 0;   ///< one right set of touches in 1000 exceeds it
  double scale = 1;        ///< distances between the touches over those between the board's points
  double scale_sigma = 0;  ///< by touch_sigma_m
  int used = 0;
  std::vector<TouchFit> fits;  ///< one for each touch
};

/// Horn's absolute orientation, then least squares over the board's pose and the tip with what is known of both. Wrong
/// touches (another point than was said, a tip that slipped) are found by the least median of squares over parts of the
/// touches (Rousseeuw 1984) and left out. Under 1 ms for 20 touches.
/// @return kTouchesUnusable with the reason: fewer than three touches (four when the tip is to be estimated), points on
/// a line, orientations of the arm that leave the tip open, touches that contradict each other; kDataMalformed for more
/// than kTouchesMax, numbers that are not finite, and points that the board does not have
[[nodiscard]] Result<TouchedBoard> locate_touched_board(const BoardSpec& board, std::span<const Touch> touches,
                                                        const TouchOptions& options = {});

/// `count` points to touch (or all, when the board has fewer), well spread over the board: the one nearest to its
/// origin first, then each time the one farthest from those before it.
[[nodiscard]] std::vector<int> corners_to_touch(const BoardSpec& board, int count);

/// "corner (3, 2)", column and row from 0, for points in columns and rows, "point 7" for others.
[[nodiscard]] std::string corner_name(const BoardSpec& board, int corner);

}  // namespace firstlook
