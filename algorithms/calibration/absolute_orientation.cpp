#include "algorithms/calibration/absolute_orientation.hpp"

#include <Eigen/Eigenvalues>
#include <cmath>

#include "platform/core/ensure.hpp"

namespace firstlook {
namespace {

Eigen::Vector3d mean_of(std::span<const Eigen::Vector3d> points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& p : points) sum += p;
  return points.empty() ? sum : sum / static_cast<double>(points.size());
}

double squared_spread(std::span<const Eigen::Vector3d> points) {
  const Eigen::Vector3d mean = mean_of(points);
  double sum = 0;
  for (const Eigen::Vector3d& p : points) sum += (p - mean).squaredNorm();
  return sum;
}

}  // namespace

Pose absolute_orientation(std::span<const Eigen::Vector3d> in_a, std::span<const Eigen::Vector3d> in_b) {
  ENSURE(2420, in_a.size() == in_b.size());
  const Eigen::Vector3d mean_a = mean_of(in_a), mean_b = mean_of(in_b);
  Eigen::Matrix3d s = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < in_a.size(); ++i) s += (in_b[i] - mean_b) * (in_a[i] - mean_a).transpose();
  Eigen::Matrix4d n;
  n << s(0, 0) + s(1, 1) + s(2, 2), s(1, 2) - s(2, 1), s(2, 0) - s(0, 2), s(0, 1) - s(1, 0),  //
      s(1, 2) - s(2, 1), s(0, 0) - s(1, 1) - s(2, 2), s(0, 1) + s(1, 0), s(2, 0) + s(0, 2),   //
      s(2, 0) - s(0, 2), s(0, 1) + s(1, 0), s(1, 1) - s(0, 0) - s(2, 2), s(1, 2) + s(2, 1),   //
      s(0, 1) - s(1, 0), s(2, 0) + s(0, 2), s(1, 2) + s(2, 1), s(2, 2) - s(0, 0) - s(1, 1);
  const Eigen::Vector4d q = Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d>(n).eigenvectors().col(3);
  Pose a_T_b = Pose::Identity();
  a_T_b.linear() = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix();
  a_T_b.translation() = mean_a - a_T_b.linear() * mean_b;
  return a_T_b;
}

double scale_between(std::span<const Eigen::Vector3d> in_a, std::span<const Eigen::Vector3d> in_b) {
  const double spread_b = squared_spread(in_b);
  return spread_b > 0 ? std::sqrt(squared_spread(in_a) / spread_b) : 1;
}

}  // namespace firstlook
