#include "algorithms/kinematics/near_dh.hpp"

#include <Eigen/Cholesky>
#include <cmath>
#include <numbers>
#include <vector>

#include "platform/core/random.hpp"

namespace firstlook {
namespace {

constexpr int kConfigurations = 150;
constexpr int kSteps = 12;
constexpr std::uint64_t kSeed = 20, kStream = 1601;
// A milliradian at the flange counts as much as 0.3 mm: what it moves at the board.
constexpr double kLever_m = 0.3;
constexpr double kStep = 1e-6;
// Weight of the published table against one configuration's flange: keeps what the flange hardly tells, shifts along
// parallel axes above all, which would take the frames away from the links again.
constexpr double kHold = 1e-2;

struct Setup {
  ArmModel arm;
  std::vector<JointVector> joints;
  std::vector<Pose> flange;
};

double& parameter(ArmModel& arm, int i) {
  DhRow& row = arm.dh[static_cast<std::size_t>(i / 4)];
  switch (i % 4) {
    case 0:
      return row.theta_offset_rad;
    case 1:
      return row.d_m;
    case 2:
      return row.a_m;
    default:
      return row.alpha_rad;
  }
}

/// How far a table has the flange from where it is: metres, and radians as metres at the lever.
Eigen::VectorXd residuals(const ArmModel& arm, const Setup& setup) {
  Eigen::VectorXd all(6 * static_cast<Eigen::Index>(setup.joints.size()));
  for (std::size_t i = 0; i < setup.joints.size(); ++i) {
    const Pose here = forward(arm, setup.joints[i]).flange().pose();
    const Eigen::AngleAxisd turn(Eigen::Matrix3d(setup.flange[i].linear().transpose() * here.linear()));
    const auto at = 6 * static_cast<Eigen::Index>(i);
    all.segment<3>(at) = here.translation() - setup.flange[i].translation();
    all.segment<3>(at + 3) = kLever_m * turn.angle() * turn.axis();
  }
  return all;
}

Eigen::MatrixXd jacobian(const ArmModel& arm, const Setup& setup, int parameters) {
  Eigen::MatrixXd columns(6 * static_cast<Eigen::Index>(setup.joints.size()), parameters);
  for (int i = 0; i < parameters; ++i) {
    ArmModel low = arm, high = arm;
    parameter(low, i) -= kStep;
    parameter(high, i) += kStep;
    columns.col(i) = (residuals(high, setup) - residuals(low, setup)) / (2 * kStep);
  }
  return columns;
}

}  // namespace

NearDh near_dh(const ArmModel& published, const std::array<DhRow, kJointsMax>& measured) {
  Setup setup{published, {}, {}};
  setup.arm.dh = measured;
  Random random(kSeed, kStream);
  for (int i = 0; i < kConfigurations; ++i) {
    JointVector q = JointVector::zero(published.joints);
    for (int j = 0; j < q.size(); ++j) q[j] = random.uniform(-std::numbers::pi, std::numbers::pi);
    setup.joints.push_back(q);
    setup.flange.push_back(forward(setup.arm, q).flange().pose());
  }
  const int parameters = 4 * published.joints;
  ArmModel arm = published, from = published;
  const auto away = [&](ArmModel& table) {
    Eigen::VectorXd change(parameters);
    for (int i = 0; i < parameters; ++i) change[i] = parameter(table, i) - parameter(from, i);
    return change;
  };
  Eigen::VectorXd now = residuals(arm, setup);
  double cost = now.squaredNorm();
  for (int step = 0; step < kSteps; ++step) {
    const Eigen::MatrixXd j = jacobian(arm, setup, parameters);
    Eigen::MatrixXd normal = j.transpose() * j;
    normal.diagonal().array() += kHold;
    const Eigen::VectorXd change = normal.ldlt().solve(j.transpose() * now + kHold * away(arm));
    ArmModel next = arm;
    for (int i = 0; i < parameters; ++i) parameter(next, i) -= change[i];
    const Eigen::VectorXd after = residuals(next, setup);
    const double cost_after = after.squaredNorm() + kHold * away(next).squaredNorm();
    if (!(cost_after < cost)) break;
    arm = next;
    now = after;
    cost = cost_after;
  }
  NearDh found;
  found.dh = arm.dh;
  double sum_m2 = 0, sum_rad2 = 0;
  for (int i = 0; i < kConfigurations; ++i) {
    const double off_m = now.segment<3>(6 * i).norm(), off_rad = now.segment<3>(6 * i + 3).norm() / kLever_m;
    sum_m2 += off_m * off_m;
    sum_rad2 += off_rad * off_rad;
    found.worst_m = std::max(found.worst_m, off_m);
    found.worst_rad = std::max(found.worst_rad, off_rad);
  }
  found.rms_m = std::sqrt(sum_m2 / kConfigurations);
  found.rms_rad = std::sqrt(sum_rad2 / kConfigurations);
  return found;
}

}  // namespace firstlook
