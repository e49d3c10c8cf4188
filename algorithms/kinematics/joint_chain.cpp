#include "algorithms/kinematics/joint_chain.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "platform/core/ensure.hpp"

namespace firstlook {
namespace {

using Eigen::Vector3d;

constexpr double kPi = std::numbers::pi;
constexpr double kSame = 1e-9;  // axes and points nearer than this coincide
constexpr double kRounding =
    1e-13;  // angles and lengths this near to a round one are that: products of sines and cosines

double snapped(double value, std::initializer_list<double> round) {
  for (const double r : round) {
    if (std::abs(value - r) < kRounding) return r;
  }
  return value;
}

double snapped_angle(double angle_rad) { return snapped(angle_rad, {0, kPi / 2, -kPi / 2, kPi, -kPi}); }

Eigen::Matrix3d about(double angle_rad, const Vector3d& axis) {
  return Eigen::AngleAxisd(angle_rad, axis).toRotationMatrix();
}

/// The two turns that bring z onto `direction`, after the turn about z that the position asked for.
void tilt_row(DhRow& row, const Vector3d& direction) {
  const Vector3d v = about(-row.theta_offset_rad, Vector3d::UnitZ()) * direction;
  row.beta_rad = snapped_angle(std::asin(std::clamp(v.x(), -1.0, 1.0)));
  row.alpha_rad = snapped_angle(std::atan2(-v.y(), v.z()));
}

/// The row that takes a frame to a frame at `point` with its z along `direction`; its x is where the row leaves it.
DhRow row_to(const Vector3d& point, const Vector3d& direction) {
  DhRow row;
  row.d_m = snapped(point.z(), {0});
  const double away_m = point.head<2>().norm();
  const double across = direction.head<2>().norm();
  double theta = 0;
  if (away_m > kSame) {
    theta = std::atan2(point.y(), point.x());
  } else if (across > kSame) {
    theta = std::atan2(-direction.x(), direction.y());  // x across both axes: no second turn
  }
  // Of the two ways to write it the one with the smaller angle, as tables have it: a may be negative.
  const bool turned = theta > kPi / 2 + kSame || theta < -kPi / 2 + kSame;
  row.theta_offset_rad = snapped_angle(turned ? (theta > 0 ? theta - kPi : theta + kPi) : theta);
  row.a_m = away_m > kSame ? (turned ? -away_m : away_m) : 0;
  tilt_row(row, direction);
  return row;
}

/// The row that takes a frame to another one.
DhRow row_to(const Pose& pose) {
  const Vector3d z = pose.linear().col(2);
  DhRow row = row_to(pose.translation(), z);
  if (pose.translation().head<2>().norm() <= kSame && z.head<2>().norm() <= kSame && z.z() > 0) {
    row.theta_offset_rad = snapped_angle(std::atan2(pose.linear()(1, 0), pose.linear()(0, 0)));
    tilt_row(row, z);
    return row;
  }
  const Eigen::Matrix3d rest = (about(row.theta_offset_rad, Vector3d::UnitZ()) *
                                about(row.alpha_rad, Vector3d::UnitX()) * about(row.beta_rad, Vector3d::UnitY()))
                                   .transpose() *
                               pose.linear();
  row.gamma_rad = snapped_angle(std::atan2(rest(1, 0), rest(0, 0)));
  return row;
}

/// A line in space.
struct Axis {
  Vector3d point;
  Vector3d direction;
};

Vector3d nearest_point(const Axis& axis, const Vector3d& to) {
  return axis.point + axis.direction.dot(to - axis.point) * axis.direction;
}

/// Base in the root: axis 1 is its z or points against it; otherwise as little moved as possible.
Pose base_on(const Axis& first) {
  Pose root_T_base = Pose::Identity();
  const bool parallel = first.direction.head<2>().norm() < kSame;
  const double side = first.direction.z() < -kSame ? -1 : 1;
  if (!parallel) {
    const Vector3d z = side * first.direction;
    const Vector3d along = std::abs(z.x()) < 0.9 ? Vector3d::UnitX() : Vector3d::UnitY();
    const Vector3d x = (along - along.dot(z) * z).normalized();
    root_T_base.linear() << x, z.cross(x), z;
  }
  const Vector3d foot = nearest_point(first, Vector3d::Zero());
  for (int i = 0; i < 3; ++i) root_T_base.translation()[i] = snapped(foot[i], {0});
  return root_T_base;
}

Pose row_pose(const DhRow& row) {
  return Eigen::AngleAxisd(row.theta_offset_rad, Vector3d::UnitZ()) * Eigen::Translation3d(row.a_m, 0, row.d_m) *
         Pose(about(row.alpha_rad, Vector3d::UnitX()) * about(row.beta_rad, Vector3d::UnitY()) *
              about(row.gamma_rad, Vector3d::UnitZ()));
}

}  // namespace

ChainedArm arm_from_chain(const JointChain& chain, std::string_view name) {
  const std::size_t n = chain.joints.size();
  ENSURE(4031, n >= 2 && n <= kJointsMax);
  // Everything in the root's frame, at joints zero.
  std::vector<Pose> given = {Pose::Identity()};
  std::vector<Axis> axes;
  for (const ChainJoint& joint : chain.joints) {
    ENSURE(4032, joint.axis.norm() > 0);
    given.push_back(given.back() * joint.before_T_joint);
    axes.push_back({given.back().translation(), given.back().linear() * joint.axis.normalized()});
  }
  ChainedArm made;
  ArmModel& arm = made.arm;
  arm.name = name;
  arm.joints = static_cast<int>(n);
  made.root_T_base = base_on(axes.front());
  const bool down = (made.root_T_base.linear().col(2)).dot(axes.front().direction) < 0;
  if (down) arm.base_T_first.linear() = Eigen::DiagonalMatrix<double, 3>(1, -1, -1);

  std::vector<Pose> ours = {made.root_T_base * arm.base_T_first};
  for (std::size_t i = 0; i < n; ++i) {
    const Pose before_T_root = ours.back().inverse(Eigen::Isometry);
    if (i + 1 < n) {
      const Vector3d at = nearest_point(axes[i + 1], ours.back().translation());
      arm.dh[i] = row_to(before_T_root * at, before_T_root.linear() * axes[i + 1].direction);
    } else {
      arm.dh[i] = row_to(before_T_root * given.back() * chain.last_T_tip);
    }
    ours.push_back(ours.back() * row_pose(arm.dh[i]));
    const ChainJoint& joint = chain.joints[i];
    arm.lower_rad[i] = joint.lower_rad;
    arm.upper_rad[i] = joint.upper_rad;
    arm.speed_max_rad_s[i] = joint.speed_max_rad_s;
  }
  arm.acceleration_max_rad_s2 = kUsualAcceleration_rad_s2;
  for (const Capsule& c : chain.body) {
    const auto link = static_cast<std::size_t>(c.link);
    const Pose ours_T_given = ours[link].inverse(Eigen::Isometry) * given[link];
    arm.body.push_back({ours_T_given * c.a, ours_T_given * c.b, c.radius_m + kBodyPadding_m, c.link});
  }
  return made;
}

}  // namespace firstlook
