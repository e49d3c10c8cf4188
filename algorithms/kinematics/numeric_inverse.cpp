#include "algorithms/kinematics/numeric_inverse.hpp"

#include <Eigen/Cholesky>
#include <cmath>
#include <numbers>

#include "platform/core/random.hpp"

namespace firstlook {
namespace {

using Eigen::Vector3d;
using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Jacobian = Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::ColMajor, 6, kJointsMax>;
using Joints = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kJointsMax, 1>;
using Normal = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kJointsMax, kJointsMax>;

constexpr std::uint64_t kStream = 4040;  // of random numbers
constexpr double kPi = std::numbers::pi;
constexpr double kGood = 5e-10;  // residual of a solution
constexpr double kAimed_rad = 0.01;
constexpr double kDifferent_rad = 0.05;  // less: the same solution
constexpr double kStepMax_rad = 0.6;
constexpr double kStalled = 1e-3;  // of the residual's norm, for each step: a start that gains less is given up
constexpr int kStallsMax = 5;
constexpr double kPlaceWeight = 0.3;  // of a metre beside the place against a radian beside the aim

/// What a posture lacks, and how that changes with each joint.
struct Lack {
  Vector6 residual = Vector6::Zero();
  Jacobian jacobian;
};

/// The velocity of a point of the last link, and its turning, for each joint.
struct Column {
  Vector3d linear;
  Vector3d angular;
};

Column column_of(const LinkFrames& frames, int joint, const Vector3d& point) {
  const Pose& before = frames.base_T_link[static_cast<std::size_t>(joint)];
  const Vector3d axis = before.linear().col(2);
  return {axis.cross(point - before.translation()), axis};
}

/// Rotation vector from one orientation to another, up to half a turn.
Vector3d turn_between(const Eigen::Matrix3d& is, const Eigen::Matrix3d& wanted) {
  const Eigen::AngleAxisd turn(wanted * is.transpose());
  return turn.angle() * turn.axis();
}

/// The flange at a pose.
struct PoseGoal {
  Pose wanted;
  [[nodiscard]] Lack lack(const ArmModel& arm, const JointVector& q) const {
    const LinkFrames frames = forward(arm, q);
    const Pose& flange = frames.base_T_link[static_cast<std::size_t>(arm.joints)];
    Lack l;
    l.residual << wanted.translation() - flange.translation(), turn_between(flange.linear(), wanted.linear());
    l.jacobian.resize(6, arm.joints);
    for (int j = 0; j < arm.joints; ++j) {
      const Column c = column_of(frames, j, flange.translation());
      l.jacobian.col(j) << c.linear, c.angular;
    }
    return l;
  }
  [[nodiscard]] bool met(const Vector6& residual) const { return residual.lpNorm<Eigen::Infinity>() < kGood; }
};

/// A sensor that has a point on its axis, and, as far as `place_weight` asks, is at a place.
struct AimGoal {
  Pose flange_T_sensor;
  Vector3d point;
  Vector3d place;
  double place_weight = 0;
  [[nodiscard]] Lack lack(const ArmModel& arm, const JointVector& q) const {
    const LinkFrames frames = forward(arm, q);
    const Pose sensor = frames.base_T_link[static_cast<std::size_t>(arm.joints)] * flange_T_sensor;
    const Vector3d eye = sensor.translation();
    const Vector3d z = sensor.linear().col(2);
    const double distance_m = std::max(1e-3, (point - eye).norm());
    const Vector3d to_point = (point - eye) / distance_m;
    Lack l;
    // z x to_point vanishes behind the sensor, too: there it is made as large as it can be.
    const Vector3d off = z.cross(to_point);
    l.residual << place_weight * (place - eye), z.dot(to_point) >= 0 || off.norm() < 1e-6 ? off : off.normalized();
    l.jacobian.resize(6, arm.joints);
    for (int j = 0; j < arm.joints; ++j) {
      const Column c = column_of(frames, j, eye);
      const Vector3d dz = c.angular.cross(z);
      const Vector3d dto = -(c.linear - c.linear.dot(to_point) * to_point) / distance_m;
      l.jacobian.col(j) << place_weight * c.linear, -(dz.cross(to_point) + z.cross(dto));
    }
    return l;
  }
  [[nodiscard]] bool met(const Vector6& residual) const {
    return place_weight == 0 && residual.tail<3>().norm() < kAimed_rad / 10;
  }
};

void clamp_to_limits(const ArmModel& arm, JointVector& q) {
  for (int j = 0; j < arm.joints; ++j) {
    const auto i = static_cast<std::size_t>(j);
    q[j] = std::clamp(q[j], arm.lower_rad[i], arm.upper_rad[i]);
  }
}

/// Levenberg-Marquardt from q, inside the limits. True when the goal is met.
template <typename Goal>
bool descend(const ArmModel& arm, const Goal& goal, int iterations_max, JointVector& q) {
  double damping = 1e-2;
  Lack here = goal.lack(arm, q);
  int stalls = 0;
  for (int i = 0; i < iterations_max; ++i) {
    if (goal.met(here.residual)) return true;
    const double norm = here.residual.norm();
    Normal normal = here.jacobian.transpose() * here.jacobian;
    normal.diagonal().array() += damping * here.residual.squaredNorm() + 1e-12;
    Joints step = normal.ldlt().solve(here.jacobian.transpose() * here.residual);
    const double largest = step.template lpNorm<Eigen::Infinity>();
    if (!(largest < 1e6)) return false;
    if (largest > kStepMax_rad) step *= kStepMax_rad / largest;
    JointVector next = q;
    for (int j = 0; j < arm.joints; ++j) next[j] += step[j];
    clamp_to_limits(arm, next);
    const Lack there = goal.lack(arm, next);
    const double now = there.residual.norm();
    if (now < norm) {
      stalls = now > (1 - kStalled) * norm ? stalls + 1 : 0;
      damping = std::max(1e-6, damping / 4);
      q = next;
      here = there;
    } else {
      ++stalls;
      damping *= 8;
    }
    if (stalls > kStallsMax) break;
  }
  return goal.met(here.residual);
}

/// Moves each angle by whole turns within the limits, as near to the reference as possible.
void unwind(const ArmModel& arm, const JointVector& reference, JointVector& q) {
  for (int j = 0; j < arm.joints; ++j) {
    const auto i = static_cast<std::size_t>(j);
    double best = q[j];
    for (const double turns : {-2.0, -1.0, 1.0, 2.0}) {
      const double angle = q[j] + turns * 2 * kPi;
      const bool inside = angle >= arm.lower_rad[i] && angle <= arm.upper_rad[i];
      if (inside && std::abs(angle - reference[j]) < std::abs(best - reference[j])) best = angle;
    }
    q[j] = best;
  }
}

/// Within the limits, half a turn to either side of the reference: every posture once.
JointVector random_start(const ArmModel& arm, const JointVector& reference, Random& random) {
  JointVector q = JointVector::zero(arm.joints);
  for (int j = 0; j < arm.joints; ++j) {
    const auto i = static_cast<std::size_t>(j);
    const double at = std::clamp(reference[j], arm.lower_rad[i], arm.upper_rad[i]);
    q[j] = random.uniform(std::max(arm.lower_rad[i], at - kPi), std::min(arm.upper_rad[i], at + kPi));
  }
  return q;
}

bool is_new(const InverseSolutions& solutions, const JointVector& q) {
  for (const JointVector& other : solutions) {
    if ((q - other).max_abs() < kDifferent_rad) return false;
  }
  return true;
}

/// Solutions from the reference and from random starts; `solve` moves a start to a solution or says no.
template <typename Solve>
InverseSolutions collect(const ArmModel& arm, const JointVector& reference, const NumericInverseOptions& options,
                         Solve solve) {
  InverseSolutions solutions;
  const auto enough = std::min(static_cast<std::size_t>(options.solutions_max), kInverseSolutionsMax);
  Random random(options.seed, kStream);
  for (int start = 0; start < options.starts_max && solutions.size() < enough; ++start) {
    JointVector q = reference;
    if (start == 0) {
      clamp_to_limits(arm, q);
    } else {
      q = random_start(arm, reference, random);
    }
    if (!solve(q)) continue;
    unwind(arm, reference, q);
    if (is_new(solutions, q)) solutions.push_back(q);
  }
  return solutions;
}

}  // namespace

InverseSolutions inverse_numeric(const ArmModel& arm, const Transform<Base, Flange>& base_T_flange,
                                 const JointVector& reference_rad, const NumericInverseOptions& options) {
  const PoseGoal goal{base_T_flange.pose()};
  return collect(arm, reference_rad, options,
                 [&](JointVector& q) { return descend(arm, goal, options.iterations_max, q); });
}

InverseSolutions inverse_of(const ArmModel& arm, const Transform<Base, Flange>& base_T_flange,
                            const JointVector& reference_rad) {
  return has_closed_form_inverse(arm) ? inverse(arm, base_T_flange, reference_rad)
                                      : inverse_numeric(arm, base_T_flange, reference_rad);
}

InverseSolutions inverse_looking(const ArmModel& arm, const Pose& flange_T_sensor, const Pose& base_T_sensor,
                                 double distance_m, const JointVector& reference_rad) {
  if (arm.joints >= 6) {
    const Transform<Base, Flange> base_T_flange(base_T_sensor * flange_T_sensor.inverse(Eigen::Isometry));
    if (has_closed_form_inverse(arm)) return inverse(arm, base_T_flange, reference_rad);
    // Callers have many places to look from: one that takes long is given up.
    return inverse_numeric(arm, base_T_flange, reference_rad,
                           {.starts_max = 3, .iterations_max = 30, .solutions_max = 2});
  }
  AimGoal near{.flange_T_sensor = flange_T_sensor,
               .point = base_T_sensor * Vector3d(0, 0, distance_m),
               .place = base_T_sensor.translation(),
               .place_weight = kPlaceWeight};
  AimGoal aimed = near;
  aimed.place_weight = 0;
  const NumericInverseOptions options{.starts_max = 12};
  return collect(arm, reference_rad, options, [&](JointVector& q) {
    descend(arm, near, options.iterations_max, q);
    if (!descend(arm, aimed, options.iterations_max, q)) return false;
    const Pose sensor = forward(arm, q).flange().pose() * flange_T_sensor;
    return sensor.linear().col(2).dot(near.point - sensor.translation()) > 0;
  });
}

}  // namespace firstlook
