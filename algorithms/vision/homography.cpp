#include "algorithms/vision/homography.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>

namespace firstlook {
namespace {

/// Moves the points' centre to the origin and their RMS distance to sqrt(2).
std::optional<Eigen::Matrix3d> normalization(std::span<const Eigen::Vector2d> points) {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const auto& p : points) mean += p;
  mean /= static_cast<double>(points.size());
  double spread = 0;
  for (const auto& p : points) spread += (p - mean).squaredNorm();
  if (!std::isfinite(spread) || spread <= 0) return std::nullopt;
  const double scale = std::sqrt(2 * static_cast<double>(points.size()) / spread);
  Eigen::Matrix3d m;
  m << scale, 0, -scale * mean.x(), 0, scale, -scale * mean.y(), 0, 0, 1;
  return m;
}

}  // namespace

Eigen::Vector2d apply_homography(const Eigen::Matrix3d& h, const Eigen::Vector2d& point) {
  return (h * point.homogeneous()).hnormalized();
}

std::optional<Eigen::Matrix3d> square_to_quad(double side, std::span<const Eigen::Vector2d, 4> quad) {
  const auto cross = [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); };
  const Eigen::Vector2d right = quad[1] - quad[2], left = quad[3] - quad[2];
  const Eigen::Vector2d skew = quad[0] - quad[1] + quad[2] - quad[3];  // 0 for a parallelogram
  const double area = cross(right, left);
  const double scale = right.norm() * left.norm();
  constexpr double kSineMin = 1e-9;
  if (!std::isfinite(scale) || std::abs(area) <= kSineMin * scale) return std::nullopt;
  const double g = cross(skew, left) / area, h = cross(right, skew) / area;
  Eigen::Matrix3d m;
  m.col(0) << quad[1] - quad[0] + g * quad[1], g;
  m.col(1) << quad[3] - quad[0] + h * quad[3], h;
  m.col(2) << quad[0], 1;
  if (std::abs(m.determinant()) <= kSineMin * scale) return std::nullopt;
  m.leftCols<2>() /= side;
  return m;
}

std::optional<Eigen::Matrix3d> fit_homography(std::span<const Eigen::Vector2d> from,
                                              std::span<const Eigen::Vector2d> to) {
  if (from.size() < 4 || from.size() != to.size()) return std::nullopt;
  const auto from_scale = normalization(from), to_scale = normalization(to);
  if (!from_scale || !to_scale) return std::nullopt;
  Eigen::Matrix<double, 9, 9> normal = Eigen::Matrix<double, 9, 9>::Zero();
  for (std::size_t i = 0; i < from.size(); ++i) {
    const Eigen::Vector3d a = *from_scale * from[i].homogeneous();
    const Eigen::Vector2d b = (*to_scale * to[i].homogeneous()).hnormalized();
    Eigen::Matrix<double, 9, 1> row = Eigen::Matrix<double, 9, 1>::Zero();
    row << -a, Eigen::Vector3d::Zero(), b.x() * a;
    normal += row * row.transpose();
    row << Eigen::Vector3d::Zero(), -a, b.y() * a;
    normal += row * row.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 9, 9>> eigen(normal);
  // A second vanishing eigenvalue: the points lie on a line, or coincide.
  if (eigen.info() != Eigen::Success || eigen.eigenvalues()(1) < 1e-12 * eigen.eigenvalues()(8)) return std::nullopt;
  const Eigen::Matrix<double, 9, 1> h = eigen.eigenvectors().col(0);
  const Eigen::Matrix3d normalized = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(h.data());
  const Eigen::Matrix3d result = to_scale->inverse() * normalized * *from_scale;
  if (!result.allFinite() || result.norm() == 0) return std::nullopt;
  return Eigen::Matrix3d(result / result.norm());
}

}  // namespace firstlook
