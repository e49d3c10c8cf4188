#include "algorithms/kinematics/factory_kinematics.hpp"

#include <algorithm>
#include <cmath>

namespace firstlook {
namespace {

using Eigen::Vector3d;

constexpr double kNoOffset_m = 1e-12;

Pose turned_about_z(double angle_rad) { return Pose(Eigen::AngleAxisd(angle_rad, Vector3d::UnitZ())); }

/// The row that takes a frame to another one, its first turn as near to `theta_rad` as the position allows.
DhRow row_between(const Pose& pose, double theta_rad) {
  DhRow row;
  row.theta_offset_rad = theta_rad;
  row.d_m = pose.translation().z();
  const Vector3d aside = turned_about_z(-theta_rad) * pose.translation();
  if (const double a_m = aside.head<2>().norm(); a_m > kNoOffset_m) {
    const double side = aside.x() < 0 ? -1 : 1;  // a may be negative: published ones are
    row.a_m = side * a_m;
    row.theta_offset_rad += std::atan2(side * aside.y(), side * aside.x());
  }
  // What is left is a turn: Rx(alpha) Ry(beta) Rz(gamma).
  const Eigen::Matrix3d turn = turned_about_z(-row.theta_offset_rad).linear() * pose.linear();
  row.beta_rad = std::asin(std::clamp(turn(0, 2), -1.0, 1.0));
  row.alpha_rad = std::atan2(-turn(1, 2), turn(2, 2));
  row.gamma_rad = std::atan2(-turn(0, 1), turn(0, 0));
  return row;
}

/// The frame of a link on its measured axis: at the published one's place, x towards the published x.
/// @param before  the frame of the link before it, already chosen
Pose frame_on_axis(const Vector3d& point, const Vector3d& z, const Pose& published, const Pose& before,
                   double theta_rad) {
  double along = z.dot(published.translation() - point);
  // Where the axes cross, the place that keeps the row's first turn: its offset then lies along x.
  const Vector3d y = (before * turned_about_z(theta_rad)).linear().col(1);
  if (std::abs(y.dot(z)) > 0.5) along = y.dot(before.translation() - point) / y.dot(z);
  Pose frame = Pose::Identity();
  const Vector3d x = (published.linear().col(0) - published.linear().col(0).dot(z) * z).normalized();
  frame.linear() << x, z.cross(x), z;
  frame.translation() = point + along * z;
  return frame;
}

}  // namespace

MeasuredArm with_factory_axes(const ArmModel& published, const std::array<DhRow, kJointsMax>& measured) {
  ArmModel told = published;
  told.dh = measured;
  const LinkFrames there = forward(told, JointVector::zero(published.joints));
  FactoryFrames frames;
  for (std::size_t i = 0; i < static_cast<std::size_t>(published.joints); ++i) frames[i] = there.base_T_link[i + 1];
  return with_factory_frames(published, frames);
}

MeasuredArm with_factory_frames(const ArmModel& published, const FactoryFrames& measured) {
  MeasuredArm found{published};
  const LinkFrames here = forward(published, JointVector::zero(published.joints));
  Pose before = here.base_T_link[0];
  for (int j = 0; j < published.joints; ++j) {
    const auto i = static_cast<std::size_t>(j);
    const Pose& own = measured[i];  // its z is the next joint's axis
    const double theta_rad = published.dh[i].theta_offset_rad;
    const bool flange = j + 1 == published.joints;
    const Pose frame =
        flange ? own
               : frame_on_axis(own.translation(), own.linear().col(2), here.base_T_link[i + 1], before, theta_rad);
    found.arm.dh[i] = row_between(before.inverse(Eigen::Isometry) * frame, theta_rad);
    const Pose off = here.base_T_link[i + 1].inverse(Eigen::Isometry) * frame;
    found.frames_off_m = std::max(found.frames_off_m, off.translation().norm());
    found.frames_off_rad = std::max(found.frames_off_rad, std::abs(Eigen::AngleAxisd(off.linear()).angle()));
    before = frame;
  }
  return found;
}

}  // namespace firstlook
