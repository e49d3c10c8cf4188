#include "algorithms/view_planning/base_turns.hpp"

#include <cmath>
#include <numbers>

namespace firstlook {
namespace {

constexpr double kFullTurn_rad = 2 * std::numbers::pi;
// Of a joint that tilts the view, before one further out is passed over for it: parallel joints of an arm that was
// measured differ by some thousandths.
constexpr double kBetter = 0.02;

/// The base angles of one round, in order.
struct Window {
  double first_rad = 0;
  double step_rad = 0;  // signed
  int count = 0;
};

Window window(double lower, double upper, double start, double step_rad) {
  const double range = upper - lower;
  if (range < kFullTurn_rad) {  // the limits leave less than a turn: from the nearer end to the other
    const int count = static_cast<int>(std::ceil(range / step_rad)) + 1;
    const double step = range / (count - 1);
    return start - lower <= upper - start ? Window{lower, step, count} : Window{upper, -step, count};
  }
  const int count = static_cast<int>(std::ceil(kFullTurn_rad / step_rad - 1e-9));
  const double step = kFullTurn_rad / count;
  const double span = step * (count - 1);
  if (start + span <= upper) return {start, step, count};
  if (start - span >= lower) return {start, -step, count};
  return upper - start <= start - lower ? Window{upper, -step, count} : Window{lower, step, count};
}

}  // namespace

TiltJoint tilt_joint(const ArmModel& arm, const JointVector& q_rad) {
  const LinkFrames frames = forward(arm, q_rad);
  const Eigen::Vector3d view = frames.flange().rotation().col(2);
  TiltJoint best;
  double best_score = -1;
  // The last joint of most arms rolls the view; that of an arm that only pans and tilts is what tilts it.
  for (int joint = arm.joints == 2 ? 1 : arm.joints - 2; joint >= 1; --joint) {
    const Eigen::Vector3d axis = frames.base_T_link[static_cast<std::size_t>(joint)].linear().col(2);
    // Turning about `axis` moves the view's tip along axis x view: upwards is what tilts it. A view that points
    // straight up or down has no upwards, but then any level axis across it serves.
    const Eigen::Vector3d tip = axis.cross(view);
    const double score = tip.norm() * std::sqrt(std::max(0.0, 1 - axis.z() * axis.z()));
    if (score > best_score + kBetter) {
      best_score = score;
      best = {.joint = joint, .up_sign = tip.z() < -1e-9 ? -1.0 : 1.0};
    }
  }
  return best;
}

Turns base_rounds(const ArmModel& arm, std::span<const JointVector> postures, double step_rad) {
  Turns turns;
  if (postures.empty()) return turns;
  const Window w = window(arm.lower_rad[0], arm.upper_rad[0], postures.front()[0], step_rad);
  bool backwards = false;
  for (JointVector q : postures) {
    for (int i = 0; i < w.count && !turns.full(); ++i) {
      q[0] = w.first_rad + w.step_rad * (backwards ? w.count - 1 - i : i);
      turns.push_back(q);
    }
    backwards = !backwards;
  }
  return turns;
}

Turns base_turns(const ArmModel& arm, const JointVector& start, double step_rad, std::span<const double> tilts_rad) {
  const TiltJoint tilt = tilt_joint(arm, start);
  const auto t = static_cast<std::size_t>(tilt.joint);
  Turns postures;
  for (const double tilt_rad : tilts_rad) {
    JointVector q = start;
    q[tilt.joint] += tilt.up_sign * tilt_rad;
    if (q[tilt.joint] >= arm.lower_rad[t] && q[tilt.joint] <= arm.upper_rad[t]) postures.push_back(q);
  }
  return base_rounds(arm, {postures.begin(), postures.end()}, step_rad);
}

}  // namespace firstlook
