#include "algorithms/view_planning/locate.hpp"

#include <array>

namespace firstlook {
namespace {

constexpr double kDegree_rad = 0.017453292519943295;
// The start posture looks outwards and down: a board on the floor, on the cart or high on a wall needs other tilts.
constexpr std::array<double, 5> kTilts_rad{0, 25 * kDegree_rad, -25 * kDegree_rad, 50 * kDegree_rad, -50 * kDegree_rad};
constexpr double kNewShare = 0.6;  // of the field of view; the board must fit into the rest to be whole in some view

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
  for (const JointVector& q : base_turns(arm, start, kNewShare * horizontal_fov_rad, kTilts_rad)) {
    if (views.full()) break;
    if (q == views.back()) continue;
    if (certify(arm, body, space, clearance, views.back(), q).certified()) views.push_back(q);
  }
  return views;
}

}  // namespace firstlook
