#include "algorithms/calibration/board_plane.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

#include "algorithms/vision/camera_model.hpp"
#include "platform/core/ensure.hpp"
#include "platform/core/random.hpp"

namespace firstlook {
namespace {

constexpr double kDistanceMin_m = 0.05;  // of the plane from the camera: nearer is no view of a board
constexpr double kMadToSigma = 1.4826;   // of a normal distribution
constexpr double kInlierSigmas = 3;
// Variance of a normal distribution cut off at 3 sigma, over that of the whole.
constexpr double kCutVariance = 0.9733;
constexpr int kTriples = 64;  // half of the pixels wrong: one good triple in 64 but for 2e-4 of cases
constexpr std::size_t kScoredMax = 512;
constexpr int kRefinements = 8;

/// One return: its ray (x/z, y/z, 1) and 1/z.
struct Return {
  Eigen::Vector3d ray;
  double inverse_depth = 0;
};

/// Where the board should be seen.
struct Region {
  Eigen::Vector3d plane;  ///< expected 1/z = plane . ray
  Pose board_T_depth;
  Eigen::Vector2d low, high;  ///< on the board
  int u_low = 0, u_high = -1, v_low = 0, v_high = -1;

  [[nodiscard]] bool contains(const Eigen::Vector3d& ray) const {
    const double inverse = plane.dot(ray);
    if (!(inverse > 0)) return false;
    const Eigen::Vector3d on_board = board_T_depth * (ray / inverse);
    return on_board.x() > low.x() && on_board.x() < high.x() && on_board.y() > low.y() && on_board.y() < high.y();
  }
};

Result<Region> region_of(const CameraIntrinsics& camera, const BoardSpec& board, const Pose& depth_T_board,
                         double margin_m) {
  Region region;
  const auto plane = expected_plane(Pose::Identity(), depth_T_board);
  if (!plane) return failure(Fault::kBoardNotFound, "the depth camera does not face the board");
  region.plane = plane->inverse_depth;
  region.board_T_depth = depth_T_board.inverse(Eigen::Isometry);
  region.low = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());
  region.high = -region.low;
  for (const int corner : board.outer_corners()) {
    region.low = region.low.cwiseMin(board.corner(corner).head<2>());
    region.high = region.high.cwiseMax(board.corner(corner).head<2>());
  }
  region.low.array() += margin_m;
  region.high.array() -= margin_m;
  Eigen::Vector2d first = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity()), last = -first;
  for (const double x : {region.low.x(), region.high.x()}) {
    for (const double y : {region.low.y(), region.high.y()}) {
      const auto pixel = project(camera, depth_T_board * Eigen::Vector3d(x, y, 0));
      if (!pixel) return failure(Fault::kBoardNotFound, "the board is not in front of the depth camera");
      first = first.cwiseMin(*pixel);
      last = last.cwiseMax(*pixel);
    }
  }
  region.u_low = static_cast<int>(std::ceil(std::clamp(first.x(), 0.0, camera.width - 1.0)));
  region.u_high = static_cast<int>(std::floor(std::clamp(last.x(), -1.0, camera.width - 1.0)));
  region.v_low = static_cast<int>(std::ceil(std::clamp(first.y(), 0.0, camera.height - 1.0)));
  region.v_high = static_cast<int>(std::floor(std::clamp(last.y(), -1.0, camera.height - 1.0)));
  return region;
}

/// All returns of the region, and how many pixels it has.
struct Returns {
  std::vector<Return> near_plane;
  int looked_at = 0;
  int returned = 0;
};

Returns returns_in(const DepthImage& image, const CameraIntrinsics& camera, const Region& region,
                   const BoardPlaneOptions& options) {
  Returns found;
  const double area = std::max(0, region.u_high - region.u_low + 1) * std::max(0, region.v_high - region.v_low + 1);
  const int step = std::max(1, static_cast<int>(std::ceil(std::sqrt(area / options.pixels_max))));
  for (int v = region.v_low; v <= region.v_high; v += step) {
    for (int u = region.u_low; u <= region.u_high; u += step) {
      const auto normalized = undistort(camera, Eigen::Vector2d(u, v));
      if (!normalized) continue;
      const Eigen::Vector3d ray(normalized->x(), normalized->y(), 1);
      if (!region.contains(ray)) continue;
      const double expected = region.plane.dot(ray);
      ++found.looked_at;
      const std::uint16_t units = image.pixels.at(u, v);
      if (units == 0) continue;
      ++found.returned;
      const double inverse = image.units_per_m / units;
      const double wrong_max = options.wrong_max_m * expected * expected;
      if (std::abs(inverse - expected) <= wrong_max) found.near_plane.push_back({ray, inverse});
    }
  }
  return found;
}

double residual(const Return& r, const Eigen::Vector3d& plane) { return r.inverse_depth - plane.dot(r.ray); }

double median_residual(std::span<const Return> returns, const Eigen::Vector3d& plane, std::size_t step,
                       std::vector<double>& scratch) {
  scratch.clear();
  for (std::size_t i = 0; i < returns.size(); i += step) scratch.push_back(std::abs(residual(returns[i], plane)));
  const auto middle = scratch.begin() + static_cast<std::ptrdiff_t>(scratch.size() / 2);
  std::nth_element(scratch.begin(), middle, scratch.end());
  return *middle;
}

/// The plane through three of the returns that has the least median distance to all.
Eigen::Vector3d least_median_plane(std::span<const Return> returns, const Eigen::Vector3d& expected) {
  Random random(returns.size());
  std::vector<double> scratch;
  const std::size_t step = 1 + returns.size() / kScoredMax;
  const auto any = [&]() -> const Return& {
    return returns[static_cast<std::size_t>(random.below(static_cast<int>(returns.size())))];
  };
  Eigen::Vector3d best = expected;
  double best_median = median_residual(returns, best, step, scratch);
  for (int i = 0; i < kTriples; ++i) {
    const Return& a = any();
    const Return& b = any();
    const Return& c = any();
    Eigen::Matrix3d rays;
    rays << a.ray.transpose(), b.ray.transpose(), c.ray.transpose();
    const Eigen::FullPivLU<Eigen::Matrix3d> lu(rays);
    if (!lu.isInvertible()) continue;
    const Eigen::Vector3d plane = lu.solve(Eigen::Vector3d(a.inverse_depth, b.inverse_depth, c.inverse_depth));
    const double median = median_residual(returns, plane, step, scratch);
    if (median < best_median) {
      best_median = median;
      best = plane;
    }
  }
  return best;
}

/// Least squares over the returns within three sigmas, until the same ones stay.
Result<BoardPlane> refined_plane(std::span<const Return> returns, Eigen::Vector3d plane) {
  BoardPlane result;
  std::vector<double> scratch;
  double sigma = kMadToSigma * median_residual(returns, plane, 1, scratch);
  for (int round = 0; round < kRefinements; ++round) {
    Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    int count = 0;
    for (const Return& r : returns) {
      if (std::abs(residual(r, plane)) > kInlierSigmas * sigma) continue;
      information += r.ray * r.ray.transpose();
      right += r.inverse_depth * r.ray;
      ++count;
    }
    const Eigen::LDLT<Eigen::Matrix3d> ldlt(information);
    if (count < 4 || ldlt.info() != Eigen::Success || !(ldlt.vectorD().minCoeff() > 0)) {
      return failure(Fault::kBoardNotFound, "too few depth pixels span no plane");
    }
    plane = ldlt.solve(right);
    double squares = 0;
    int inside = 0;
    for (const Return& r : returns) {
      const double e = residual(r, plane);
      if (std::abs(e) > kInlierSigmas * sigma) continue;
      squares += e * e;
      ++inside;
    }
    result.inverse_depth = plane;
    result.unit_information = information;
    result.pixels = count;
    result.noise = std::sqrt(squares / std::max(1, inside - 3) / kCutVariance);
    if (inside == count && std::abs(result.noise - sigma) <= 1e-3 * sigma) break;
    sigma = result.noise;
  }
  return result;
}

}  // namespace

Result<BoardPlane> find_board_plane(const DepthImage& image, const CameraIntrinsics& camera, const BoardSpec& board,
                                    const Transform<Depth, Board>& depth_T_board_expected,
                                    const BoardPlaneOptions& options) {
  ENSURE(2701, image.pixels.width == camera.width && image.pixels.height == camera.height && image.units_per_m > 0);
  if (!depth_T_board_expected.pose().matrix().allFinite()) {
    return failure(Fault::kBoardNotFound, "the board's expected pose is not finite");
  }
  const auto region = region_of(camera, board, depth_T_board_expected.pose(), options.edge_margin_m);
  if (!region) return std::unexpected(region.error());
  const Returns returns = returns_in(image, camera, *region, options);
  if (returns.looked_at < options.pixels_min) {
    return failure(Fault::kBoardNotFound, "only {} pixels of the depth image see the board, {} are needed",
                   returns.looked_at, options.pixels_min);
  }
  const double enough = options.share_min * returns.looked_at;
  if (returns.returned < enough) {
    return failure(Fault::kBoardNotFound, "{} of {} depth pixels at the board have no return: too near, dark or shiny",
                   returns.looked_at - returns.returned, returns.looked_at);
  }
  if (static_cast<double>(returns.near_plane.size()) < enough) {
    return failure(Fault::kBoardNotFound, "{} of {} depth pixels at the board lie elsewhere: something is before it",
                   returns.returned - static_cast<int>(returns.near_plane.size()), returns.looked_at);
  }
  auto plane = refined_plane(returns.near_plane, least_median_plane(returns.near_plane, region->plane));
  if (!plane) return plane;
  plane->share = static_cast<double>(plane->pixels) / returns.looked_at;
  if (plane->pixels < enough) {
    return failure(Fault::kBoardNotFound, "only {} of {} depth pixels at the board lie on one plane", plane->pixels,
                   returns.looked_at);
  }
  if (plane->noise > 4 * options.noise_at_1m) {
    return failure(Fault::kBoardNotFound,
                   "depth scatters by {:.1f} mm at 1 m around the board's plane, {:.1f} expected", 1000 * plane->noise,
                   1000 * options.noise_at_1m);
  }
  return plane;
}

BoardPlane merged(std::span<const BoardPlane> planes) {
  ENSURE(2702, !planes.empty());
  BoardPlane sum;
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  double squares = 0;
  for (const BoardPlane& plane : planes) {
    sum.unit_information += plane.unit_information;
    right += plane.unit_information * plane.inverse_depth;
    squares += plane.pixels * plane.noise * plane.noise;
    sum.pixels += plane.pixels;
    sum.share += plane.share / static_cast<double>(planes.size());
  }
  sum.inverse_depth = sum.unit_information.ldlt().solve(right);
  sum.noise = std::sqrt(squares / std::max(1, sum.pixels));
  return sum;
}

std::optional<ExpectedPlane> expected_plane(const Pose& camera_T_depth, const Pose& camera_T_board) {
  const Eigen::Vector3d n = camera_T_board.linear().col(2);
  const Eigen::Vector3d lever = camera_T_board.translation() - camera_T_depth.translation();
  const double distance = n.dot(lever);  // of the depth camera from the plane, signed as n
  if (!(std::abs(distance) > kDistanceMin_m)) return std::nullopt;
  const Eigen::Matrix3d depth_R_camera = camera_T_depth.linear().transpose();
  const Eigen::Vector3d normal = depth_R_camera * n;
  ExpectedPlane plane;
  plane.inverse_depth = normal / distance;
  // n turns by d_r x n with the board, and against the camera by n x d_r when the depth camera turns.
  plane.by_camera_T_depth.leftCols<3>() = normal * n.transpose() / (distance * distance);
  plane.by_camera_T_depth.rightCols<3>() = depth_R_camera * cross_matrix(n) / distance;
  plane.by_camera_T_board.leftCols<3>() = -normal * n.transpose() / (distance * distance);
  plane.by_camera_T_board.rightCols<3>() =
      -depth_R_camera * cross_matrix(n) / distance - normal * n.cross(lever).transpose() / (distance * distance);
  return plane;
}

}  // namespace firstlook
