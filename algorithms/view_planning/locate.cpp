#include "algorithms/view_planning/locate.hpp"

#include <array>
#include <optional>

namespace firstlook {
namespace {

constexpr double kDegree_rad = 0.017453292519943295;
// The start posture looks outwards and down: a board on the floor, on the cart or high on a wall needs other tilts.
constexpr std::array<double, 5> kTilts_rad{0, 25 * kDegree_rad, -25 * kDegree_rad, 50 * kDegree_rad, -50 * kDegree_rad};
constexpr double kNewShare = 0.6;  // of the field of view; the board must fit into the rest to be whole in some view
// Farther than 30 degrees the upper arm of a UR takes its envelopes out of the default safe zone.
constexpr std::array<double, 4> kInnerTilts_rad{15 * kDegree_rad, -15 * kDegree_rad, 30 * kDegree_rad,
                                                -30 * kDegree_rad};
// What the next joint turns with it: nothing, back by a part, or by more, which brings the outer links in.
constexpr std::array<double, 4> kFollows{0, -0.5, -1, -1.5};

/// Those of the turns, in order, to which straight moves lead from one to the next.
void append_certified(const ArmModel& arm, const Body& body, const FreeSpace& space, const Clearance& clearance,
                      const JointVector& start, const Turns& turns, Turns& views) {
  JointVector at = start;
  for (const JointVector& q : turns) {
    if (views.full()) return;
    if (q == at || !certify(arm, body, space, clearance, at, q).certified()) continue;
    views.push_back(q);
    at = q;
  }
}

/// `start` with `joint` turned, and the next one as gives the body most room; empty where it has none.
std::optional<JointVector> roomiest(const ArmModel& arm, const Body& body, const FreeSpace& space,
                                    const Clearance& clearance, const JointVector& start, int joint, double tilt_rad) {
  std::optional<JointVector> best;
  double best_margin_m = kMarginMin_m;
  for (const double follows : kFollows) {
    JointVector q = start;
    q[joint] += tilt_rad;
    q[joint + 1] += follows * tilt_rad;
    if (!configuration_is_free(arm, body, space, clearance, q)) continue;
    const double margin_m = configuration_margin(arm, body, space, clearance, q);
    if (margin_m <= best_margin_m) continue;
    best_margin_m = margin_m;
    best = q;
  }
  return best;
}

}  // namespace

Result<Turns> locate_views(const ArmModel& arm, const Body& body, const FreeSpace& space, const Clearance& clearance,
                           const JointVector& start, double horizontal_fov_rad) {
  ENSURE(4501, horizontal_fov_rad > 0.1);
  const double margin_m = configuration_margin(arm, body, space, clearance, start);
  if (margin_m < kMarginMin_m) {
    return failure(Fault::kStartBlocked, "the start lacks {:.0f} mm of clearance", (kMarginMin_m - margin_m) * 1e3);
  }
  Turns views;
  views.push_back(start);
  append_certified(arm, body, space, clearance, start,
                   base_turns(arm, start, kNewShare * horizontal_fov_rad, kTilts_rad), views);
  return views;
}

Turns locate_views_of_inner_links(const ArmModel& arm, const Body& body, const FreeSpace& space,
                                  const Clearance& clearance, const JointVector& start, double horizontal_fov_rad) {
  ENSURE(4502, horizontal_fov_rad > 0.1);
  const int outermost = tilt_joint(arm, start).joint;
  Turns postures;
  for (const double tilt_rad : kInnerTilts_rad) {
    for (int joint = 1; joint < outermost; ++joint) {
      if (const auto q = roomiest(arm, body, space, clearance, start, joint, tilt_rad)) postures.push_back(*q);
    }
  }
  Turns views;
  append_certified(arm, body, space, clearance, start,
                   base_rounds(arm, {postures.begin(), postures.end()}, kNewShare * horizontal_fov_rad), views);
  return views;
}

}  // namespace firstlook
