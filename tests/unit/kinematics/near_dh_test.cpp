#include "algorithms/kinematics/near_dh.hpp"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>
#include <cmath>

#include "platform/core/random.hpp"

namespace firstlook {
namespace {

struct Line {
  Eigen::Vector3d point, direction;
};

/// The DH table of a chain whose joint axes, at joints 0, are these lines, the last with the flange's frame: by the
/// common normals, as a factory's calibration program does it.
std::array<DhRow, kJointsMax> dh_of(const std::vector<Line>& axes, const Pose& flange) {
  std::array<DhRow, kJointsMax> dh{};
  Pose frame = Pose::Identity();
  for (std::size_t j = 0; j < 6; ++j) {
    // In the frame whose z is this joint's axis: where the next axis is.
    const Pose inverse = frame.inverse(Eigen::Isometry);
    const Eigen::Vector3d p = inverse * axes[j + 1].point, z = inverse.linear() * axes[j + 1].direction;
    DhRow& row = dh[j];
    const Eigen::Vector3d normal = Eigen::Vector3d::UnitZ().cross(z).normalized();
    // p + t z = d ez + a normal
    Eigen::Matrix3d m;
    m << Eigen::Vector3d::UnitZ(), normal, -z;
    Eigen::Vector3d solution = m.fullPivLu().solve(p);
    Eigen::Vector3d x = normal;
    if (j == 5) x = inverse.linear() * flange.linear().col(0);
    row.d_m = solution[0];
    row.a_m = j == 5 ? 0 : solution[1];
    row.theta_offset_rad = std::atan2(x.y(), x.x());
    row.alpha_rad = std::atan2(x.dot(Eigen::Vector3d::UnitZ().cross(z)), z.z());
    Pose step = Pose::Identity();
    step.rotate(Eigen::AngleAxisd(row.theta_offset_rad, Eigen::Vector3d::UnitZ()));
    step.translate(Eigen::Vector3d(0, 0, row.d_m));
    step.translate(Eigen::Vector3d(row.a_m, 0, 0));
    step.rotate(Eigen::AngleAxisd(row.alpha_rad, Eigen::Vector3d::UnitX()));
    frame = frame * step;
  }
  return dh;
}

/// An arm whose axes were tilted by so much, each about its link's x and y.
std::vector<Line> tilted_axes(const ArmModel& arm, double tilt_rad, Pose& flange) {
  Random random(3, 4);
  std::vector<Line> axes;
  Pose frame = Pose::Identity();
  for (std::size_t j = 0; j < 6; ++j) {
    axes.push_back({frame.translation(), frame.linear().col(2)});
    const DhRow& row = arm.dh[j];
    frame.rotate(Eigen::AngleAxisd(row.theta_offset_rad, Eigen::Vector3d::UnitZ()));
    frame.translate(Eigen::Vector3d(0, 0, row.d_m));
    frame.translate(Eigen::Vector3d(row.a_m, 0, 0));
    frame.rotate(Eigen::AngleAxisd(row.alpha_rad, Eigen::Vector3d::UnitX()));
    if (j == 5) break;
    frame.rotate(Eigen::AngleAxisd(tilt_rad * random.normal(), Eigen::Vector3d::UnitX()));
    frame.rotate(Eigen::AngleAxisd(tilt_rad * random.normal(), Eigen::Vector3d::UnitY()));
  }
  flange = frame;
  axes.push_back({frame.translation(), frame.linear().col(2)});
  return axes;
}

}  // namespace

TEST_CASE("axes that are nearly parallel are measured with frames far away; a table near the links is found",
          "[kinematics]") {
  const ArmModel arm = *find_arm_model("ur5e");
  constexpr double kTilt_rad = 4e-4;
  Pose flange;
  const std::vector<Line> axes = tilted_axes(arm, kTilt_rad, flange);
  ArmModel measured = arm;
  measured.dh = dh_of(axes, flange);
  CHECK(std::abs(measured.dh[1].d_m) + std::abs(measured.dh[2].d_m) > 1);  // far away: what this is for
  const NearDh near = near_dh(arm, measured.dh);
  ArmModel nearer = arm;
  nearer.dh = near.dh;
  for (std::size_t j = 0; j < 6; ++j) {
    CHECK(std::abs(near.dh[j].d_m - arm.dh[j].d_m) < 0.01);
    CHECK(std::abs(near.dh[j].a_m - arm.dh[j].a_m) < 0.01);
  }
  double published_m = 0, near_m = 0;
  Random random(9, 9);
  for (int i = 0; i < 200; ++i) {
    JointVector q = JointVector::zero(6);
    for (int j = 0; j < 6; ++j) q[j] = random.uniform(-3, 3);
    const Eigen::Vector3d there = forward(measured, q).flange().translation();
    published_m = std::max(published_m, (forward(arm, q).flange().translation() - there).norm());
    near_m = std::max(near_m, (forward(nearer, q).flange().translation() - there).norm());
  }
  CAPTURE(published_m, near_m, near.rms_m, near.rms_rad);
  CHECK(near_m < 0.5 * published_m);
  CHECK(near.rms_m < 3e-4);
  CHECK(near.rms_rad < 2 * kTilt_rad);
  CHECK(near_m < 2 * near.worst_m);
}

TEST_CASE("a table that is near already is kept", "[kinematics]") {
  const ArmModel arm = *find_arm_model("ur5");
  ArmModel measured = arm;
  Random random(5, 6);
  for (std::size_t j = 0; j < 6; ++j) {
    measured.dh[j].theta_offset_rad += 3e-4 * random.normal();
    measured.dh[j].d_m += 2e-4 * random.normal();
    measured.dh[j].a_m += 2e-4 * random.normal();
    measured.dh[j].alpha_rad += 3e-4 * random.normal();
  }
  const NearDh near = near_dh(arm, measured.dh);
  CHECK(near.worst_m < 1e-6);
  CHECK(near.worst_rad < 1e-6);
}

}  // namespace firstlook
