#include "algorithms/motion/planner.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "platform/core/ensure.hpp"

namespace firstlook {
namespace {

constexpr std::uint64_t kRandomStream = 4001;

/// "start: what is carried by link 6 meets the arm itself, 12.0 mm short of what must remain" for the detail of an
/// error.
std::unexpected<Error> blocked(Fault fault, std::string_view what, const ArmModel& arm, const Body& body,
                               const Certificate& c) {
  if (c.capsule < 0) return failure(fault, "{} is outside the joint limits", what);
  const int link = body.capsules[static_cast<std::size_t>(c.capsule)].link;
  const bool carried = static_cast<std::size_t>(c.capsule) >= arm.body.size();  // the arm's own come first
  return failure(fault, "{}: {} {} {}, {:.1f} mm short of what must remain", what,
                 carried ? "what is carried by link" : "link", link,
                 c.self_collision ? "meets the arm itself" : "leaves known free space",
                 1e3 * std::max(0.0, kMarginMin_m - c.margin_m));
}

}  // namespace

std::size_t Planner::required_bytes(int nodes_max) {
  const auto nodes = static_cast<std::size_t>(nodes_max);
  return 2 * nodes * sizeof(Node) + (2 * nodes + 2) * sizeof(JointVector);
}

Planner::Planner(int nodes_max) : nodes_max_(static_cast<std::size_t>(nodes_max)) {
  ENSURE(4131, nodes_max >= 2);
  from_start_.reserve(nodes_max_);
  from_goal_.reserve(nodes_max_);
  chain_.reserve(2 * nodes_max_ + 2);
}

Result<Path> Planner::plan(const ArmModel& arm, const Body& body, const FreeSpace& space, const Clearance& clearance,
                           const JointVector& start, const JointVector& goal, const PlannerOptions& options) {
  if (const Status begun = begin(arm, body, space, clearance, start, options); !begun) {
    return std::unexpected(begun.error());
  }
  return plan_to(goal);
}

Status Planner::begin(const ArmModel& arm, const Body& body, const FreeSpace& space, const Clearance& clearance,
                      const JointVector& start, const PlannerOptions& options) {
  ENSURE(4132, options.step_m > 0);
  arm_ = &arm;
  body_ = &body;
  space_ = space;
  clearance_ = clearance;
  options_ = options;
  start_ = start;
  random_ = Random(options.seed, kRandomStream);
  weight_m_.fill(0);
  for (const LeverArms& levers : body.levers) {
    for (std::size_t j = 0; j < weight_m_.size(); ++j) weight_m_[j] = std::max(weight_m_[j], levers[j]);
  }
  from_start_.clear();
  from_start_.push_back({.q = start});
  trail_nodes_ = 1;
  const Certificate standing = check(start, start);
  if (!standing.certified()) return blocked(Fault::kStartBlocked, "start", arm, body, standing);
  follow_trail();
  return {};
}

/// From the latest back, each configuration from the nearest one that is reached.
void Planner::follow_trail() {
  for (auto q = options_.trail.rbegin(); q != options_.trail.rend() && from_start_.size() < nodes_max_ / 4; ++q) {
    const int from = nearest(from_start_, *q);
    if (from_start_[static_cast<std::size_t>(from)].q == *q) continue;
    if (!configuration_is_free(*arm_, *body_, space_, clearance_, *q)) continue;
    if (check(from_start_[static_cast<std::size_t>(from)].q, *q).certified()) {
      from_start_.push_back({.q = *q, .parent = from});
    }
  }
  trail_nodes_ = from_start_.size();
  options_.trail = {};
}

Result<Path> Planner::plan_to(const JointVector& goal) {
  ENSURE(4133, arm_ != nullptr);
  const Certificate straight = check(start_, goal);
  if (straight.verdict == CertificateVerdict::kStartBlocked)
    return blocked(Fault::kStartBlocked, "start", *arm_, *body_, straight);
  if (straight.verdict == CertificateVerdict::kEndBlocked)
    return blocked(Fault::kNoPath, "goal", *arm_, *body_, straight);
  if (straight.certified()) {
    chain_.assign({start_, goal});
    return finish();
  }
  if (!search(goal)) {
    return failure(Fault::kNoPath,
                   "no connection after {} samples, {} and {} configurations reached from start and goal",
                   options_.iterations_max, from_start_.size(), from_goal_.size());
  }
  skip_waypoints();
  cut_corners();
  skip_waypoints();
  return finish();
}

Certificate Planner::check(const JointVector& from, const JointVector& to) const {
  return certify(*arm_, *body_, space_, clearance_, from, to);
}

double Planner::distance_m(const JointVector& a, const JointVector& b) const {
  double squared = 0;
  for (int j = 0; j < arm_->joints; ++j) {
    const double d = (a[j] - b[j]) * weight_m_[static_cast<std::size_t>(j)];
    squared += d * d;
  }
  return std::sqrt(squared);
}

int Planner::nearest(const Tree& tree, const JointVector& q) const {
  int best = 0;
  double best_m = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < tree.size(); ++i) {
    const double d = distance_m(tree[i].q, q);
    if (d < best_m) best_m = d, best = static_cast<int>(i);
  }
  return best;
}

/// Adds a node one step from `from` towards a configuration, or at it; -1 when the step is not free or the pool is
/// full.
int Planner::extend(Tree& tree, int from, const JointVector& towards) const {
  if (tree.size() == nodes_max_) return -1;
  const JointVector& q = tree[static_cast<std::size_t>(from)].q;
  const double length_m = distance_m(q, towards);
  const JointVector next = length_m <= options_.step_m ? towards : interpolate(q, towards, options_.step_m / length_m);
  if (!configuration_is_free(*arm_, *body_, space_, clearance_, next)) return -1;
  if (!check(q, next).certified()) return -1;
  tree.push_back({.q = next, .parent = from});
  return static_cast<int>(tree.size()) - 1;
}

/// Steps from the nearest node towards `target` as far as it is free; the node at the target, or -1.
int Planner::connect(Tree& tree, const JointVector& target) const {
  int node = nearest(tree, target);
  while (node >= 0 && tree[static_cast<std::size_t>(node)].q != target) node = extend(tree, node, target);
  return node;
}

/// Uniform within half a turn about the middle of start and goal: more would only repeat the same poses.
JointVector Planner::sample(const JointVector& goal) {
  JointVector q = JointVector::zero(arm_->joints);
  for (int j = 0; j < arm_->joints; ++j) {
    const auto i = static_cast<std::size_t>(j);
    const double middle = (start_[j] + goal[j]) / 2;
    const double reach = std::max(std::numbers::pi, std::abs(start_[j] - goal[j]) / 2);
    q[j] = random_.uniform(std::max(arm_->lower_rad[i], middle - reach), std::min(arm_->upper_rad[i], middle + reach));
  }
  return q;
}

bool Planner::search(const JointVector& goal) {
  if (from_start_.size() > nodes_max_ / 2) from_start_.resize(trail_nodes_);  // make room: it was grown for other goals
  from_goal_.clear();
  from_goal_.push_back({.q = goal});
  if (const int met = connect(from_start_, goal); met >= 0) {
    collect(met, 0);
    return true;
  }
  for (int i = 0; i < options_.iterations_max; ++i) {
    const bool grow_start = i % 2 == 0;
    Tree& tree = grow_start ? from_start_ : from_goal_;
    Tree& other = grow_start ? from_goal_ : from_start_;
    const JointVector towards = sample(goal);
    const int grown = extend(tree, nearest(tree, towards), towards);
    if (grown < 0) continue;
    const int met = connect(other, tree[static_cast<std::size_t>(grown)].q);
    if (met < 0) continue;
    collect(grow_start ? grown : met, grow_start ? met : grown);
    return true;
  }
  return false;
}

/// Writes the branch of the start tree, root first, and the branch of the goal tree, root last.
void Planner::collect(int start_leaf, int goal_leaf) {
  chain_.clear();
  for (int i = start_leaf; i >= 0; i = from_start_[static_cast<std::size_t>(i)].parent) {
    chain_.push_back(from_start_[static_cast<std::size_t>(i)].q);
  }
  std::reverse(chain_.begin(), chain_.end());
  for (int i = from_goal_[static_cast<std::size_t>(goal_leaf)].parent; i >= 0;
       i = from_goal_[static_cast<std::size_t>(i)].parent) {
    chain_.push_back(from_goal_[static_cast<std::size_t>(i)].q);
  }
}

/// Goes from each waypoint straight to one as far ahead as possible, halving the stretch until the proof holds.
void Planner::skip_waypoints() {
  for (std::size_t i = 0; i + 2 < chain_.size(); ++i) {
    for (std::size_t ahead = chain_.size() - 1 - i; ahead >= 2; ahead /= 2) {
      if (!check(chain_[i], chain_[i + ahead]).certified()) continue;
      const auto first = chain_.begin() + static_cast<std::ptrdiff_t>(i) + 1;
      chain_.erase(first, first + static_cast<std::ptrdiff_t>(ahead) - 1);
      break;
    }
  }
}

/// Replaces random corners by straight segments where that is shorter by 5 % of what it replaces or more.
void Planner::cut_corners() {
  for (int attempt = 0; attempt < options_.shortcuts_max && chain_.size() > 2; ++attempt) {
    const auto corner = 1 + static_cast<std::size_t>(random_.below(static_cast<int>(chain_.size()) - 2));
    const JointVector before = interpolate(chain_[corner], chain_[corner - 1], random_.uniform());
    const JointVector after = interpolate(chain_[corner], chain_[corner + 1], random_.uniform());
    const double around_m = distance_m(before, chain_[corner]) + distance_m(chain_[corner], after);
    if (distance_m(before, after) > 0.95 * around_m || chain_.size() + 1 > kWaypointsMax) continue;
    if (!check(before, after).certified() || !check(chain_[corner - 1], before).certified() ||
        !check(after, chain_[corner + 1]).certified()) {
      continue;
    }
    chain_[corner] = before;
    chain_.insert(chain_.begin() + static_cast<std::ptrdiff_t>(corner) + 1, after);
  }
}

/// Proves every segment once more, in the direction of travel, and times it.
Result<Path> Planner::finish() const {
  if (chain_.size() > kWaypointsMax) {
    return failure(Fault::kNoPath, "the path found has {} waypoints, more than {}", chain_.size(), kWaypointsMax);
  }
  Path path;
  path.margin_m = std::numeric_limits<double>::infinity();
  path.waypoints.push_back(chain_[0]);
  for (std::size_t i = 1; i < chain_.size(); ++i) {
    const Certificate proof = check(chain_[i - 1], chain_[i]);
    if (!proof.certified()) return blocked(Fault::kNoPath, "segment", *arm_, *body_, proof);
    const SegmentTiming timing = time_segment(*arm_, body_->capsules, chain_[i - 1], chain_[i], options_.limits);
    path.waypoints.push_back(chain_[i]);
    path.margin_m = std::min(path.margin_m, proof.margin_m);
    path.length_rad += timing.leading_angle_rad;
    path.duration_s += timing.duration_s;
  }
  return path;
}

}  // namespace firstlook
