#include "algorithms/kinematics/factory_kinematics.hpp"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>
#include <cmath>

#include "algorithms/kinematics/inverse_kinematics.hpp"
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

/// The largest difference of flange poses over random configurations, metres and radians.
std::pair<double, double> flanges_apart(const ArmModel& a, const ArmModel& b) {
  Random random(9, 9);
  std::pair<double, double> worst{0, 0};
  for (int i = 0; i < 200; ++i) {
    JointVector q = JointVector::zero(6);
    for (int j = 0; j < 6; ++j) q[j] = random.uniform(-3, 3);
    const Pose apart = forward(a, q).flange().pose().inverse(Eigen::Isometry) * forward(b, q).flange().pose();
    worst.first = std::max(worst.first, apart.translation().norm());
    worst.second = std::max(worst.second, std::abs(Eigen::AngleAxisd(apart.linear()).angle()));
  }
  return worst;
}

TEST_CASE("axes that are nearly parallel are measured with frames far away, they come back to the links, exactly",
          "[kinematics]") {
  for (const char* name : {"ur3", "ur5e", "ur10e"}) {
    const ArmModel published = *find_arm_model(name);
    for (const double tilt_rad : {4e-4, 2e-3}) {
      Pose flange;
      ArmModel told = published;
      told.dh = dh_of(tilted_axes(published, tilt_rad, flange), flange);
      CHECK(std::abs(told.dh[1].d_m) + std::abs(told.dh[2].d_m) > 0.5);  // far away: what this is for
      const MeasuredArm measured = with_factory_axes(published, told.dh);
      const auto apart = flanges_apart(measured.arm, told);
      const auto error = flanges_apart(published, told);
      CAPTURE(name, tilt_rad, apart.first, apart.second, error.first);
      CHECK(error.first > 1e-4);
      CHECK(apart.first < 1e-9);
      CHECK(apart.second < 1e-7);  // an angle of a matrix this near to the identity
      CHECK(measured.frames_off_m < 0.01);
      CHECK(measured.frames_off_rad < 20 * tilt_rad);
      for (std::size_t j = 0; j < 6; ++j) {
        CHECK(std::abs(measured.arm.dh[j].d_m - published.dh[j].d_m) < 0.005);
        CHECK(std::abs(measured.arm.dh[j].a_m - published.dh[j].a_m) < 0.005);
      }
      REQUIRE(has_closed_form_inverse(measured.arm));
      const JointVector q{0.3, -1.2, 1.4, -0.7, 1.1, 0.4};
      bool found = false;
      for (const JointVector& solution : inverse(measured.arm, forward(told, q).flange(), q))
        found = found || (solution - q).max_abs() < 1e-7;
      CHECK(found);
    }
  }
}

TEST_CASE("a table that is near already stays what it was", "[kinematics]") {
  const ArmModel published = *find_arm_model("ur5");
  ArmModel told = published;
  Random random(5, 6);
  for (std::size_t j = 0; j < 6; ++j) {
    told.dh[j].theta_offset_rad += 3e-4 * random.normal();
    told.dh[j].d_m += 2e-4 * random.normal();
    told.dh[j].a_m += 2e-4 * random.normal();
    told.dh[j].alpha_rad += 3e-4 * random.normal();
  }
  const MeasuredArm measured = with_factory_axes(published, told.dh);
  const auto apart = flanges_apart(measured.arm, told);
  CHECK(apart.first < 1e-12);
  CHECK(apart.second < 1e-7);
  CHECK(measured.frames_off_m < 0.003);
  CHECK(measured.frames_off_rad < 0.005);
  CHECK(has_closed_form_inverse(measured.arm));
}

TEST_CASE("the table of another arm has frames far from this one's", "[kinematics]") {
  const MeasuredArm measured = with_factory_axes(*find_arm_model("ur5"), find_arm_model("ur10")->dh);
  CHECK(measured.frames_off_m > 0.1);
}

}  // namespace firstlook
