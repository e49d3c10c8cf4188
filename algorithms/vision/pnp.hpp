/// The pose of a target by the published solvers, to choose and to compare; estimate_board_pose is what calibration
/// uses.
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "algorithms/vision/target.hpp"
#include "platform/core/camera_intrinsics.hpp"
#include "platform/core/result.hpp"
#include "platform/core/transform.hpp"

namespace firstlook {

enum class PnpMethod : std::uint8_t {
  kIterative,  ///< Levenberg-Marquardt from a homography
  kP3p,        ///< Gao et al. 2003 on the three outermost points, a fourth and then all decide between its solutions
  kEpnp,       ///< Lepetit, Moreno-Noguer and Fua 2009, polished by Levenberg-Marquardt
  kIppe,       ///< Collins and Bartoli 2014: both poses of a plane
};
[[nodiscard]] std::string_view pnp_method_name(PnpMethod method);
[[nodiscard]] std::optional<PnpMethod> find_pnp_method(std::string_view name);

/// Random sampling (Fischler and Bolles 1981) before the solve, by P3P on fours of points; OpenCV's,
/// with its fixed seed.
struct RansacOptions {
  int iterations = 100;
  double reprojection_max_px = 8;  ///< of an inlier
  int inliers_min = 10;            ///< fewer are no pose; for targets with fewer points: all of them
};

struct PnpOptions {
  PnpMethod method = PnpMethod::kIterative;
  std::optional<RansacOptions> ransac;
};

struct PnpSolution {
  Transform<Camera, Board> camera_T_board;
  double residual_rms_px = 0;  ///< over the inliers, for each coordinate
};

struct PnpResult {
  std::vector<PnpSolution> solutions;  ///< best first, target in front of the camera; IPPE and P3P: all they found
  std::vector<std::size_t> inliers;    ///< indices of the points that took part, ascending
};

/// @return kBoardNotFound when the points are not the target's, the solver finds nothing, or too few are inliers;
/// kConfigBadValue for an unusable camera or target; kOutOfMemory
[[nodiscard]] Result<PnpResult> solve_pnp(const CameraIntrinsics& camera, const BoardSpec& board,
                                          const SeenPoints& points, const PnpOptions& options = {});

}  // namespace firstlook
