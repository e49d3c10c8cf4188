#include "algorithms/motion/certificate.hpp"

#include <algorithm>
#include <bitset>
#include <limits>

#include "platform/core/ensure.hpp"

namespace firstlook {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kFieldSag_m = 0.02;  // README: what the field's bound is low by between voxel centres

/// When to stop refining a margin.
struct Wanted {
  double enough = kInfinity;  ///< more than this need not be told apart
  double stop = -kInfinity;   ///< less than this is a failure, however much less
};

/// Lower bound over a piece of a capsule's axis of the margin of its points, refined until it is enough or the piece is
/// short. Along a segment the depth in the (convex) zone is smallest at an end; distances to voxels, those of the field
/// and those that the zone lost, are read in the middle and can fall by half the length towards the ends. A bound of a
/// whole piece holds for its halves too (`inherited`), so that whether the result is enough does not depend on what is
/// asked for. What is blocked mostly is so by far: a point that falls short by more than the field's bound can be low
/// (kFieldSag_m) ends the search.
double axis_margin(const FreeSpace& space, const Clearance& need, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                   double length_m, const Wanted& wanted, double inherited) {
  const Eigen::Vector3d middle = (a + b) / 2;
  const double in_zone = std::min(space.zone_surface_margin_m(a, need), space.zone_surface_margin_m(b, need));
  double bound = inherited;
  if (in_zone > bound) bound = std::max(bound, std::min(in_zone, space.revoked_margin_m(middle, need) - length_m / 2));
  if (bound >= wanted.enough || (space.field == nullptr && space.revoked == nullptr)) return bound;
  const double in_field = space.field_margin_m(middle, need);
  bound = std::max(bound, in_field - length_m / 2);
  if (bound >= wanted.enough || length_m <= kAxisSpacing_m) return bound;
  if (in_field < wanted.stop - kFieldSag_m) {
    const double here = std::max(in_field, space.zone_margin_m(middle, need));
    if (here < wanted.stop - kFieldSag_m) return here;
  }
  const double first = axis_margin(space, need, a, middle, length_m / 2, wanted, bound);
  if (first < wanted.stop) return first;
  return std::min(first, axis_margin(space, need, middle, b, length_m / 2, wanted, bound));
}

/// The same for keep-outs.
double keep_out_margin(const FreeSpace& space, const Clearance& need, const Eigen::Vector3d& a,
                       const Eigen::Vector3d& b, double length_m, const Wanted& wanted, double inherited) {
  const Eigen::Vector3d middle = (a + b) / 2;
  const double bound = std::max(inherited, space.keep_out_margin_m(middle, need) - length_m / 2);
  if (bound >= wanted.enough || length_m <= kAxisSpacing_m) return bound;
  const double first = keep_out_margin(space, need, a, middle, length_m / 2, wanted, bound);
  if (first < wanted.stop) return first;
  return std::min(first, keep_out_margin(space, need, middle, b, length_m / 2, wanted, bound));
}

/// Margin of one placed capsule, as `wanted` for its surface.
double capsule_margin(const FreeSpace& space, const Clearance& need, const Capsule& placed, const Wanted& wanted) {
  const double r = placed.radius_m;
  const double length_m = (placed.b - placed.a).norm();
  const Wanted axis{.enough = wanted.enough + r, .stop = wanted.stop + r};
  double margin = axis_margin(space, need, placed.a, placed.b, length_m, axis, -kInfinity) - r;
  if (!space.keep_out_boxes.empty() || !space.keep_out_planes.empty()) {
    margin = std::min(margin, keep_out_margin(space, need, placed.a, placed.b, length_m, axis, -kInfinity) - r);
  }
  return margin;
}

Capsule place(const Capsule& capsule, const LinkFrames& frames) {
  const Pose& base_T_link = frames.base_T_link[static_cast<std::size_t>(capsule.link)];
  return {base_T_link * capsule.a, base_T_link * capsule.b, capsule.radius_m, capsule.link};
}

double pair_margin(const Capsules& placed, const SelfPair& pair) {
  const Capsule& n = placed[static_cast<std::size_t>(pair.near)];
  const Capsule& f = placed[static_cast<std::size_t>(pair.far)];
  return segment_distance_m(n.a, n.b, f.a, f.b) - pair.axes_apart_m;
}

/// The same as self_margin_m >= margin_m. Most pairs are so far apart that the balls around their capsules tell.
bool pairs_keep(const Capsules& placed, const SelfPairs& pairs, double margin_m) {
  constexpr double kRounding_m = 1e-9;
  FixedVector<double, kCapsulesMax> half_m;
  for (const Capsule& c : placed) half_m.push_back((c.b - c.a).norm() / 2);
  return std::all_of(pairs.begin(), pairs.end(), [&](const SelfPair& pair) {
    const auto near = static_cast<std::size_t>(pair.near), far = static_cast<std::size_t>(pair.far);
    const double apart_m = pair.axes_apart_m + margin_m + half_m[near] + half_m[far] + kRounding_m;
    const Eigen::Vector3d twice = placed[near].a + placed[near].b - placed[far].a - placed[far].b;
    return (apart_m >= 0 && twice.squaredNorm() >= 4 * apart_m * apart_m) || pair_margin(placed, pair) >= margin_m;
  });
}

/// A stretch of the segment with what is still to be proven on it.
struct Interval {
  double middle = 0;
  double half = 0;
  std::bitset<kCapsulesMax> capsules;
  std::bitset<kSelfPairsMax> pairs;
};

class Proof {
 public:
  Proof(const ArmModel& arm, const Body& body, const FreeSpace& space, const Clearance& clearance,
        const JointVector& from, const JointVector& to)
      : arm_(arm), body_(body), space_(space), need_(clearance), from_(from), to_(to), dq_(to - from) {
    for (std::size_t i = 0; i < body.capsules.size(); ++i) {
      bend_.push_back(second_derivative_bound(body.levers[i], body.capsules[i].link, dq_));
      double sweep = 0;
      for (int k = 0; k < arm.joints; ++k) sweep += std::abs(dq_[k]) * body.levers[i][static_cast<std::size_t>(k)];
      sweep_.push_back(sweep);
      if (body.exempt[i] == 0) all_.capsules.set(i);
    }
    for (std::size_t i = 0; i < body.self_pairs.size(); ++i) all_.pairs.set(i);
    all_.middle = all_.half = 0.5;
  }

  Certificate run() {
    result_.margin_m = kInfinity;
    if (!end_is_free(from_, 0, CertificateVerdict::kStartBlocked) ||
        !end_is_free(to_, 1, CertificateVerdict::kEndBlocked))
      return result_;
    FixedVector<Interval, 64> open;  // depth first: one waits on each level
    open.push_back(all_);
    while (!open.empty()) {
      Interval here = open.back();
      open.pop_back();
      if (!prove(here)) return result_;
      if (here.capsules.none() && here.pairs.none()) continue;
      ENSURE(4121, open.size() + 2 <= open.capacity());
      const double quarter = here.half / 2;
      open.push_back({here.middle + quarter, quarter, here.capsules, here.pairs});
      open.push_back({here.middle - quarter, quarter, here.capsules, here.pairs});
    }
    result_.verdict = CertificateVerdict::kCertified;
    result_.fraction = 1;
    return result_;
  }

 private:
  bool fail(CertificateVerdict verdict, double fraction, int capsule, bool self, double margin) {
    result_.verdict = verdict;
    result_.fraction = fraction;
    result_.capsule = capsule;
    result_.self_collision = self;
    result_.margin_m = margin;
    return false;
  }

  bool end_is_free(const JointVector& q, double fraction, CertificateVerdict verdict) {
    if (!within_limits(arm_, q, -kLimitTolerance_rad)) return fail(verdict, fraction, -1, false, -kInfinity);
    ++result_.evaluations;
    const Capsules placed = place(body_.capsules, forward(arm_, q));
    for (std::size_t i = 0; i < placed.size(); ++i) {
      if (body_.exempt[i] != 0) continue;
      const double margin = capsule_margin(space_, need_, placed[i], {kMarginMin_m, kMarginMin_m});
      if (!(margin >= kMarginMin_m)) return fail(verdict, fraction, static_cast<int>(i), false, margin);
    }
    for (const SelfPair& pair : body_.self_pairs) {
      const double margin = pair_margin(placed, pair);
      if (!(margin >= kMarginMin_m)) return fail(verdict, fraction, pair.far, true, margin);
    }
    return true;
  }

  /// Strikes out what holds on the whole interval. False when something is too near in its middle.
  bool prove(Interval& at) {
    ++result_.evaluations;
    const LinkFrames frames = forward(arm_, from_ + dq_ * at.middle);
    const LinkTwists twists = link_twists(frames, dq_);
    for (std::size_t i = 0; i < body_.capsules.size(); ++i) {
      if (!at.capsules.test(i)) continue;
      const Capsule c = place(body_.capsules[i], frames);
      const double speed =
          std::sqrt(std::max(twists.velocity(c.link, c.a).squaredNorm(), twists.velocity(c.link, c.b).squaredNorm()));
      const double moves = travel(speed, i, at.half);
      const double margin = capsule_margin(space_, need_, c, {std::max(moves, kMarginMin_m), kMarginMin_m});
      if (!(margin >= kMarginMin_m))
        return fail(CertificateVerdict::kBlocked, at.middle, static_cast<int>(i), false, margin);
      if (margin < moves) continue;
      at.capsules.reset(i);
      result_.margin_m = std::min(result_.margin_m, margin - moves);
    }
    if (at.pairs.none()) return true;
    const Capsules placed = place(body_.capsules, frames);
    for (std::size_t i = 0; i < body_.self_pairs.size(); ++i) {
      if (!at.pairs.test(i)) continue;
      const SelfPair& pair = body_.self_pairs[i];
      const double margin = pair_margin(placed, pair);
      if (!(margin >= kMarginMin_m)) return fail(CertificateVerdict::kBlocked, at.middle, pair.far, true, margin);
      const double moves = relative_travel(twists, placed, pair, at.half, margin);
      if (margin < moves) continue;
      at.pairs.reset(i);
      result_.margin_m = std::min(result_.margin_m, margin - moves);
    }
    return true;
  }

  /// No point of the capsule's axis moves farther than this from where it is in the middle (twist.hpp).
  [[nodiscard]] double travel(double speed, std::size_t capsule, double half) const {
    return std::min(half * speed + half * half / 2 * bend_[capsule], half * sweep_[capsule]);
  }

  /// The same for the farther capsule of a pair as seen from the nearer one's link: fewer joints move it, so its own
  /// bounds hold.
  [[nodiscard]] double relative_travel(const LinkTwists& twists, const Capsules& placed, const SelfPair& pair,
                                       double half, double margin) const {
    const auto far = static_cast<std::size_t>(pair.far);
    if (margin >= half * sweep_[far]) return half * sweep_[far];
    const Capsule& f = placed[far];
    const int near_link = placed[static_cast<std::size_t>(pair.near)].link;
    const auto speed = [&](const Eigen::Vector3d& p) {
      return (twists.velocity(f.link, p) - twists.velocity(near_link, p)).squaredNorm();
    };
    return travel(std::sqrt(std::max(speed(f.a), speed(f.b))), far, half);
  }

  const ArmModel& arm_;
  const Body& body_;
  const FreeSpace& space_;
  Clearance need_;
  JointVector from_, to_, dq_;
  FixedVector<double, kCapsulesMax> bend_;   ///< bound of |p''|
  FixedVector<double, kCapsulesMax> sweep_;  ///< bound of |p'| in any configuration
  Interval all_;
  Certificate result_;
};

}  // namespace

bool within_limits(const ArmModel& arm, const JointVector& q, double margin_rad) {
  if (q.size() != arm.joints || !q.all_finite()) return false;
  for (int j = 0; j < arm.joints; ++j) {
    const auto i = static_cast<std::size_t>(j);
    if (q[j] < arm.lower_rad[i] + margin_rad || q[j] > arm.upper_rad[i] - margin_rad) return false;
  }
  return true;
}

double configuration_margin(const ArmModel& arm, const Body& body, const FreeSpace& space, const Clearance& clearance,
                            const JointVector& q_rad) {
  const Capsules placed = place(body.capsules, forward(arm, q_rad));
  double margin = self_margin_m(placed, body.self_pairs);
  for (std::size_t i = 0; i < placed.size(); ++i) {
    if (body.exempt[i] == 0) margin = std::min(margin, capsule_margin(space, clearance, placed[i], {.enough = margin}));
  }
  return margin;
}

bool configuration_is_free(const ArmModel& arm, const Body& body, const FreeSpace& space, const Clearance& clearance,
                           const JointVector& q_rad, double margin_m) {
  if (!within_limits(arm, q_rad, kLimitMargin_rad)) return false;
  const LinkFrames frames = forward(arm, q_rad);
  for (std::size_t i = body.capsules.size(); i-- > 0;) {  // the outermost capsules fail most often
    if (body.exempt[i] != 0) continue;
    const Capsule placed = place(body.capsules[i], frames);
    if (!(capsule_margin(space, clearance, placed, {margin_m, margin_m}) >= margin_m)) return false;
  }
  return pairs_keep(place(body.capsules, frames), body.self_pairs, margin_m);
}

Certificate certify(const ArmModel& arm, const Body& body, const FreeSpace& space, const Clearance& clearance,
                    const JointVector& from, const JointVector& to) {
  return Proof(arm, body, space, clearance, from, to).run();
}

}  // namespace firstlook
