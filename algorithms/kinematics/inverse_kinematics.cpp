#include "algorithms/kinematics/inverse_kinematics.hpp"

#include <Eigen/Cholesky>
#include <cmath>
#include <numbers>

#include "platform/core/ensure.hpp"

namespace firstlook {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;
constexpr double kPi = std::numbers::pi;
constexpr double kSingularSine = 1e-9;  // of joint 5: below it the axes of joints 4 and 6 are parallel
constexpr double kNearby_rad = 0.01;    // factory corrections of UR arms stay within: Newton steps bridge them
constexpr double kNearby_m = 0.005;
constexpr double kEdge = 1e-9;  // a cosine may exceed 1 by rounding at the edge of the reach

/// Pose error as a small displacement and rotation vector in base coordinates.
Vector6 pose_error(const Pose& wanted, const Pose& is) {
  Vector6 e;
  e.head<3>() = wanted.translation() - is.translation();
  Eigen::Vector3d turn = Eigen::Vector3d::Zero();
  for (int axis = 0; axis < 3; ++axis) turn += is.linear().col(axis).cross(wanted.linear().col(axis));
  e.tail<3>() = turn / 2;
  return e;
}

/// Newton steps with minimum norm (damped, so that a singular configuration is left as it is) until the pose agrees.
bool polish(const ArmModel& arm, const Pose& wanted, JointVector& q) {
  constexpr double kGood = 1e-11;
  constexpr double kAccepted = 5e-10;
  for (int step = 0;; ++step) {
    const LinkFrames frames = forward(arm, q);
    const Pose& flange = frames.base_T_link[6];
    const Vector6 error = pose_error(wanted, flange);
    const double largest = error.lpNorm<Eigen::Infinity>();
    // An antipodal rotation has no cross product either; the trace tells.
    const bool same_side = (wanted.linear().array() * flange.linear().array()).sum() > 2;
    if (same_side && largest < kGood) return true;
    if (step == 8) return same_side && largest < kAccepted;
    Matrix6 jacobian;
    for (int j = 0; j < 6; ++j) {
      const Pose& before = frames.base_T_link[static_cast<std::size_t>(j)];
      const Eigen::Vector3d axis = before.linear().col(2);
      jacobian.col(j) << axis.cross(flange.translation() - before.translation()), axis;
    }
    const Matrix6 normal = jacobian * jacobian.transpose() + 1e-10 * Matrix6::Identity();
    const Vector6 dq = jacobian.transpose() * normal.ldlt().solve(error);
    for (int j = 0; j < 6; ++j) q[j] += dq[j];
  }
}

/// Moves each angle by whole turns into the limits, as near to the reference as possible. False: outside the limits.
bool wrap(const ArmModel& arm, const JointVector& reference, JointVector& q) {
  for (int j = 0; j < 6; ++j) {
    const auto i = static_cast<std::size_t>(j);
    const double lowest = q[j] + 2 * kPi * std::ceil((arm.lower_rad[i] - q[j]) / (2 * kPi));
    if (lowest > arm.upper_rad[i]) return false;
    double best = lowest;
    for (double angle = lowest; angle <= arm.upper_rad[i]; angle += 2 * kPi) {
      if (std::abs(angle - reference[j]) < std::abs(best - reference[j])) best = angle;
    }
    q[j] = best;
  }
  return true;
}

struct Wrist {
  double q5 = 0;
  double q6 = 0;
  Eigen::Vector3d x4 = Eigen::Vector3d::UnitX();  // in the plane of upper arm and forearm
  Eigen::Vector3d z4 = Eigen::Vector3d::UnitZ();  // axis of joint 5
};

/// Joints 5 and 6 for one shoulder side (plane normal z1) and wrist sign.
Wrist wrist_of(const Pose& flange, const Eigen::Vector3d& z1, double sign, double reference_q6) {
  Wrist w;
  const Eigen::Vector3d x6 = flange.linear().col(0);
  const Eigen::Vector3d y6 = flange.linear().col(1);
  const Eigen::Vector3d z6 = flange.linear().col(2);
  const double c5 = z6.dot(z1);
  const Eigen::Vector3d in_plane = z6 - c5 * z1;
  const double s5 = sign * in_plane.norm();
  w.q5 = std::atan2(s5, c5);
  if (std::abs(s5) < kSingularSine) {
    w.q6 = reference_q6;
    const Eigen::Vector3d y5 = std::sin(w.q6) * x6 + std::cos(w.q6) * y6;
    w.z4 = -(y5 - y5.dot(z1) * z1).normalized();
    w.x4 = z1.cross(w.z4);
    return w;
  }
  w.x4 = -in_plane / s5;
  w.z4 = w.x4.cross(z1);
  const Eigen::Vector3d x5 = c5 * w.x4 + s5 * z1;
  w.q6 = std::atan2(-x6.dot(w.z4), x6.dot(x5));
  return w;
}

}  // namespace

bool has_closed_form_inverse(const ArmModel& arm) {
  if (arm.joints != 6 || !arm.base_T_first.isApprox(Pose::Identity(), 0)) return false;
  constexpr double kAlpha[] = {kPi / 2, 0, 0, kPi / 2, -kPi / 2, 0};
  for (std::size_t j = 0; j < 6; ++j) {
    const DhRow& row = arm.dh[j];
    if (std::abs(row.theta_offset_rad) > kNearby_rad || std::abs(row.alpha_rad - kAlpha[j]) > kNearby_rad) return false;
    if (std::abs(row.beta_rad) > kNearby_rad || std::abs(row.gamma_rad) > kNearby_rad) return false;
    const bool is_link = j == 1 || j == 2;
    if (is_link && (std::abs(row.d_m) > kNearby_m || std::abs(row.a_m) < 10 * kNearby_m)) return false;
    if (!is_link && std::abs(row.a_m) > kNearby_m) return false;
  }
  return true;
}

InverseSolutions inverse(const ArmModel& arm, const Transform<Base, Flange>& base_T_flange,
                         const JointVector& reference_rad) {
  ENSURE(4021, has_closed_form_inverse(arm));
  InverseSolutions solutions;
  const Pose& flange = base_T_flange.pose();
  const double d4 = arm.dh[1].d_m + arm.dh[2].d_m + arm.dh[3].d_m;  // along parallel axes
  const double d5 = arm.dh[4].d_m;
  const double a2 = arm.dh[1].a_m;
  const double a3 = arm.dh[2].a_m;

  // Joint 1: the wrist's centre lies d4 beside the vertical plane of the arm.
  const Eigen::Vector3d o5 = flange.translation() - arm.dh[5].d_m * flange.linear().col(2);
  const double radius = o5.head<2>().norm();
  if (radius == 0 || d4 > radius * (1 + kEdge)) return solutions;
  const double direction = std::atan2(o5.y(), o5.x());
  const double beside = std::asin(std::min(1.0, d4 / radius));
  for (const double q1 : {direction + beside, direction + kPi - beside}) {
    const Eigen::Vector3d x1(std::cos(q1), std::sin(q1), 0);
    const Eigen::Vector3d z1(std::sin(q1), -std::cos(q1), 0);
    for (const double wrist_sign : {1.0, -1.0}) {
      const Wrist w = wrist_of(flange, z1, wrist_sign, reference_rad[5]);
      if (wrist_sign < 0 && std::abs(std::sin(w.q5)) < kSingularSine) continue;  // the same solution again
      // Joints 2 and 3: two links in the plane of x1 and the vertical, to where joint 4 sits.
      const Eigen::Vector3d o3 = o5 - d5 * w.z4 - d4 * z1;
      const double u = o3.dot(x1);
      const double v = o3.z() - arm.dh[0].d_m;
      const double c3 = (u * u + v * v - a2 * a2 - a3 * a3) / (2 * a2 * a3);
      if (std::abs(c3) > 1 + kEdge) continue;
      const double elbow = std::acos(std::clamp(c3, -1.0, 1.0));
      for (const double q3 : {elbow, -elbow}) {
        const double q2 = std::atan2(v, u) - std::atan2(a3 * std::sin(q3), a2 + a3 * std::cos(q3));
        const double q4 = std::atan2(w.x4.z(), w.x4.dot(x1)) - q2 - q3;
        JointVector q{q1, q2, q3, q4, w.q5, w.q6};
        if (polish(arm, flange, q) && wrap(arm, reference_rad, q)) solutions.push_back(q);
      }
    }
  }
  return solutions;
}

}  // namespace firstlook
