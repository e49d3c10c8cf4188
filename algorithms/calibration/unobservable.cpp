#include "algorithms/calibration/unobservable.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <numbers>

#include "algorithms/vision/rotation.hpp"

namespace firstlook {
namespace {

constexpr double kLength_m = 0.3;  // a metre of translation against a radian of rotation: the size of arms and mounts
constexpr double kShown = std::numbers::pi / 180;

/// Ad_A - I on (v / kLength_m, w): how a displacement of the flange changes when it is carried along a motion A.
Matrix6d carried_minus_itself(const Pose& a) {
  Matrix6d m = Matrix6d::Zero();
  m.topLeftCorner<3, 3>() = a.linear() - Eigen::Matrix3d::Identity();
  m.topRightCorner<3, 3>() = cross_matrix(a.translation() / kLength_m) * a.linear();
  m.bottomRightCorner<3, 3>() = m.topLeftCorner<3, 3>();
  return m;
}

/// Three numbers without a minus before a zero.
std::string direction_text(const Eigen::Vector3d& v) {
  const Eigen::Array3d rounded = (v.array() * 100).round() / 100 + 0.0;
  return fmt::format("({:.2f}, {:.2f}, {:.2f})", rounded.x(), rounded.y(), rounded.z());
}

/// Orthonormal basis of the vectors that the symmetric matrix maps to nearly nothing.
template <int N>
Eigen::Matrix<double, N, Eigen::Dynamic> kernel_of(const Eigen::Matrix<double, N, N>& mean_squares) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, N, N>> solver(mean_squares);
  int count = 0;
  while (count < N && solver.eigenvalues()[count] < kShown * kShown) ++count;
  return solver.eigenvectors().leftCols(count);
}

/// An axis and its opposite are one: the first number that is not small is positive.
Eigen::Vector3d upright(const Eigen::Vector3d& v) {
  for (int i = 2; i >= 0; --i) {
    if (std::abs(v[i]) > 0.1) return v[i] < 0 ? Eigen::Vector3d(-v) : v;
  }
  return v;
}

}  // namespace

Unobservable unobservable_of(std::span<const PosePair> pairs) {
  std::size_t motions = 0;
  for (int k = 0; k < target_count(pairs); ++k) {
    const std::size_t own = pairs_of_target(pairs, k).size();
    motions += own * own;
  }
  Matrix6d mean = Matrix6d::Zero();
  for (const PosePair& from : pairs) {
    for (const PosePair& to : pairs) {
      if (from.target != to.target) continue;
      const Matrix6d change = carried_minus_itself((from.base_T_flange.inverse() * to.base_T_flange).pose());
      mean += change.transpose() * change / static_cast<double>(motions);
    }
  }
  Unobservable result;
  const Eigen::Matrix3d translation_only = mean.topLeftCorner<3, 3>();
  const auto translations = kernel_of<3>(translation_only);
  for (Eigen::Index i = 0; i < translations.cols(); ++i) result.translations.push_back(upright(translations.col(i)));
  // A turn may come with a translation that is open itself: of these the one without.
  const auto all = kernel_of<6>(mean);
  Eigen::Matrix<double, 3, Eigen::Dynamic> rotations = all.bottomRows<3>();
  const Eigen::Matrix3d spread = rotations * rotations.transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(spread);
  for (int i = 2; i >= 0 && static_cast<int>(result.turns.size()) + translations.cols() < all.cols(); --i) {
    const Eigen::Vector3d axis = axes.eigenvectors().col(i);
    const Eigen::VectorXd weights =
        rotations.transpose() * axis / std::max(1e-12, axes.eigenvalues()[i]);  // least of all that turn about it
    const Eigen::Vector3d velocity = kLength_m * (all.topRows<3>() * weights);
    result.turns.push_back({upright(axis), axis.cross(velocity)});
  }
  return result;
}

std::string unobservable_text(const Unobservable& unobservable) {
  if (unobservable.parameters() == 0) return {};
  if (unobservable.parameters() == 6) return "the arm did not turn or move: nothing of the camera's pose is determined";
  std::string text;
  if (unobservable.translations.size() == 3) {
    text = "the arm did not turn: where the camera sits on the flange is not determined";
  } else {
    for (const Eigen::Vector3d& direction : unobservable.translations) {
      text += (text.empty() ? "the camera's position along " : " and along ") + direction_text(direction);
    }
  }
  for (const Unobservable::Turn& turn : unobservable.turns) {
    const Eigen::Array3d mm = (turn.point_m * 1e3).array().round() + 0.0;
    text += fmt::format("{} turn about {} through ({:.0f}, {:.0f}, {:.0f}) mm", text.empty() ? "the camera's" : ", its",
                        direction_text(turn.axis), mm.x(), mm.y(), mm.z());
  }
  if (unobservable.translations.size() == 3) return text;
  return text + fmt::format(" of the flange {} not determined: all motions turn about that axis",
                            unobservable.parameters() == 1 ? "is" : "are");
}

}  // namespace firstlook
