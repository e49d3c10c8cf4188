/// The adapter to OpenCV's pose solvers: its types and exceptions end here.
#include "algorithms/vision/pnp.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <new>
#include <numeric>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>

#include "algorithms/vision/board_pose.hpp"
#include "algorithms/vision/camera_model.hpp"
#include "algorithms/vision/rotation.hpp"

namespace firstlook {
namespace {

constexpr std::array<std::string_view, 4> kNames = {"iterative", "p3p", "epnp", "ippe"};

int flag_of(PnpMethod method) {
  switch (method) {
    case PnpMethod::kP3p:
      return cv::SOLVEPNP_P3P;
    case PnpMethod::kEpnp:
      return cv::SOLVEPNP_EPNP;
    case PnpMethod::kIppe:
      return cv::SOLVEPNP_IPPE;
    default:
      return cv::SOLVEPNP_ITERATIVE;
  }
}

/// One problem in OpenCV's terms.
struct Problem {
  const CameraIntrinsics& camera;
  std::vector<cv::Point3d> object;
  std::vector<cv::Point2d> image;
  cv::Mat matrix, distortion;
};

Problem problem_of(const CameraIntrinsics& c, const BoardSpec& board, const SeenPoints& points) {
  Problem p{c, {}, {}, {}, {}};
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d at = board.corner(points.point(i));
    p.object.emplace_back(at.x(), at.y(), at.z());
    p.image.emplace_back(points.corners_px[i].x(), points.corners_px[i].y());
  }
  p.matrix = (cv::Mat_<double>(3, 3) << c.fx, 0, c.cx, 0, c.fy, c.cy, 0, 0, 1);
  p.distortion = (cv::Mat_<double>(1, 5) << c.k1, c.k2, c.p1, c.p2, c.k3);
  return p;
}

PnpSolution solution_of(const Problem& p, const std::vector<std::size_t>& inliers, const cv::Mat& rotation_vector,
                        const cv::Mat& translation) {
  cv::Mat r;
  cv::Rodrigues(rotation_vector, r);
  Pose pose = Pose::Identity();
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) pose.linear()(i, j) = r.at<double>(i, j);
    pose.translation()[i] = translation.at<double>(i);
  }
  PnpSolution solution;
  // Through a quaternion, so that rounding leaves no trace of scale or shear.
  solution.camera_T_board = Transform<Camera, Board>(Eigen::Quaterniond(pose.linear()), pose.translation());
  double squared = 0;
  for (const std::size_t i : inliers) {
    const auto px = project(p.camera, solution.camera_T_board * Eigen::Vector3d(p.object[i].x, p.object[i].y, 0));
    constexpr double kNoImage_px = 1e6;
    squared += px ? (*px - Eigen::Vector2d(p.image[i].x, p.image[i].y)).squaredNorm() : kNoImage_px * kNoImage_px;
  }
  solution.residual_rms_px = std::sqrt(squared / (2.0 * static_cast<double>(inliers.size())));
  return solution;
}

/// The four points farthest out along the diagonals of the target, each once.
std::vector<std::size_t> outermost(const Problem& p, const std::vector<std::size_t>& inliers) {
  std::vector<std::size_t> chosen;
  constexpr std::array<std::array<double, 2>, 4> kWays = {{{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}};
  for (const auto& [x, y] : kWays) {
    std::size_t best = p.object.size();
    double farthest = -1e300;
    for (const std::size_t i : inliers) {
      const double along = x * p.object[i].x + y * p.object[i].y;
      if (along > farthest && std::find(chosen.begin(), chosen.end(), i) == chosen.end()) best = i, farthest = along;
    }
    chosen.push_back(best);
  }
  return chosen;
}

/// OpenCV's EPnP misses a plane by pixels now and then, without any noise: refined from there and from the plane's
/// other pose, the better one stays.
PnpSolution polished(const Problem& p, const std::vector<std::size_t>& inliers, const PnpSolution& start) {
  std::vector<cv::Point3d> object;
  std::vector<cv::Point2d> image;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  for (const std::size_t i : inliers) {
    object.push_back(p.object[i]), image.push_back(p.image[i]);
    center += Eigen::Vector3d(p.object[i].x, p.object[i].y, 0) / static_cast<double>(inliers.size());
  }
  PnpSolution best = start;
  for (const Pose& from : {start.camera_T_board.pose(), mirrored_pose(start.camera_T_board.pose(), center)}) {
    const Eigen::Vector3d r = rotation_log(from.linear()), t = from.translation();
    cv::Mat rotation = (cv::Mat_<double>(3, 1) << r.x(), r.y(), r.z());
    cv::Mat translation = (cv::Mat_<double>(3, 1) << t.x(), t.y(), t.z());
    cv::solvePnPRefineLM(object, image, p.matrix, p.distortion, rotation, translation);
    const PnpSolution refined = solution_of(p, inliers, rotation, translation);
    if (refined.residual_rms_px < best.residual_rms_px) best = refined;
  }
  return best;
}

std::vector<PnpSolution> solve(const Problem& p, const std::vector<std::size_t>& inliers, PnpMethod method) {
  const std::vector<std::size_t> used = method == PnpMethod::kP3p ? outermost(p, inliers) : inliers;
  std::vector<cv::Point3d> object;
  std::vector<cv::Point2d> image;
  for (const std::size_t i : used) object.push_back(p.object[i]), image.push_back(p.image[i]);
  if (method == PnpMethod::kP3p) object.pop_back(), image.pop_back();  // three points; all points decide below
  std::vector<cv::Mat> rotations, translations;
  if (method == PnpMethod::kP3p) {
    cv::solveP3P(object, image, p.matrix, p.distortion, rotations, translations, cv::SOLVEPNP_P3P);
  } else {
    cv::solvePnPGeneric(object, image, p.matrix, p.distortion, rotations, translations, false,
                        static_cast<cv::SolvePnPMethod>(flag_of(method)));
  }
  std::vector<PnpSolution> solutions;
  for (std::size_t i = 0; i < rotations.size(); ++i) {
    const PnpSolution solution = solution_of(p, inliers, rotations[i], translations[i]);
    const bool finite = solution.camera_T_board.pose().matrix().allFinite();
    if (finite && solution.camera_T_board.translation().z() > 0) solutions.push_back(solution);
  }
  if (method == PnpMethod::kEpnp && !solutions.empty()) solutions = {polished(p, inliers, solutions.front())};
  std::stable_sort(solutions.begin(), solutions.end(),
                   [](const PnpSolution& a, const PnpSolution& b) { return a.residual_rms_px < b.residual_rms_px; });
  return solutions;
}

std::vector<std::size_t> sampled_inliers(const Problem& p, const PnpOptions& options) {
  cv::Mat rotation, translation;
  std::vector<int> found;
  const bool solved = cv::solvePnPRansac(p.object, p.image, p.matrix, p.distortion, rotation, translation, false,
                                         options.ransac->iterations,
                                         static_cast<float>(options.ransac->reprojection_max_px), 0.99, found,
                                         cv::SOLVEPNP_P3P);  // samples of four; EPnP's of five are poor on a plane
  if (!solved) return {};
  std::vector<std::size_t> inliers(found.begin(), found.end());
  std::sort(inliers.begin(), inliers.end());
  return inliers;
}

Result<PnpResult> solve_with(const Problem& p, const PnpOptions& options) {
  PnpResult result;
  result.inliers.resize(p.object.size());
  std::iota(result.inliers.begin(), result.inliers.end(), std::size_t{0});
  if (options.ransac) {
    result.inliers = sampled_inliers(p, options);
    const std::size_t least =
        std::min(p.object.size(), static_cast<std::size_t>(std::max(4, options.ransac->inliers_min)));
    if (result.inliers.size() < least) {
      return failure(Fault::kBoardNotFound, "{} of {} points agree on a pose, {} are the least", result.inliers.size(),
                     p.object.size(), least);
    }
  }
  result.solutions = solve(p, result.inliers, options.method);
  if (result.solutions.empty()) {
    return failure(Fault::kBoardNotFound, "{} finds no pose for these points", pnp_method_name(options.method));
  }
  return result;
}

}  // namespace

std::string_view pnp_method_name(PnpMethod method) { return kNames[static_cast<std::size_t>(method)]; }

std::optional<PnpMethod> find_pnp_method(std::string_view name) {
  const auto* const found = std::find(kNames.begin(), kNames.end(), name);
  if (found == kNames.end()) return std::nullopt;
  return static_cast<PnpMethod>(found - kNames.begin());
}

Result<PnpResult> solve_pnp(const CameraIntrinsics& camera, const BoardSpec& board, const SeenPoints& points,
                            const PnpOptions& options) {
  if (const Status fine = check_board(board); !fine) return std::unexpected(fine.error());
  if (!is_usable(camera)) return failure(Fault::kConfigBadValue, "camera intrinsics are not usable");
  if (const Status fine = check_points(board, points); !fine) {
    return failure(Fault::kBoardNotFound, "{}", fine.error().detail());
  }
  for (const Eigen::Vector2d& px : points.corners_px) {
    if (!px.allFinite()) return failure(Fault::kBoardNotFound, "a point is not finite");
  }
  try {
    cv::setNumThreads(1);  // results and memory must not depend on the number of cores
    return solve_with(problem_of(camera, board, points), options);
  } catch (const cv::Exception& e) {
    return failure(Fault::kBoardNotFound, "OpenCV: {}", e.err);
  } catch (const std::bad_alloc&) {
    return failure(Fault::kOutOfMemory, "the pose of {} points", points.size());
  }
}

}  // namespace firstlook
