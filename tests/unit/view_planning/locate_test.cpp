#include "algorithms/view_planning/locate.hpp"

#include <catch2/catch.hpp>
#include <set>

#include "algorithms/motion/clearance.hpp"

using namespace firstlook;

namespace {
const ArmModel kUr5 = *find_arm_model("ur5");
const Body kBody = body_with_envelope(kUr5);
const Clearance kClearance = required_clearance({}).clearance();
constexpr double kFov_rad = 0.785;
}  // namespace

TEST_CASE("the board is looked for all around, each move certified in the safe zone", "[locate]") {
  const FreeSpace space;
  const JointVector start = default_start(kUr5);
  const auto views = locate_views(kUr5, kBody, space, kClearance, start, kFov_rad);
  REQUIRE(views);
  REQUIRE(views->front() == start);
  std::set<int> sectors;
  for (std::size_t i = 0; i < views->size(); ++i) {
    if (i > 0) REQUIRE(certify(kUr5, kBody, space, kClearance, (*views)[i - 1], (*views)[i]).certified());
    const Eigen::Vector3d view = forward(kUr5, (*views)[i]).flange().rotation().col(2);
    sectors.insert(static_cast<int>(std::floor(std::atan2(view.y(), view.x()) / kFov_rad)));
  }
  REQUIRE(sectors.size() == 8);  // every 45 degrees
  REQUIRE(views->size() > 16);   // more than one tilt
}

TEST_CASE("cameras on inner links look all around at several tilts, each move certified", "[locate]") {
  const Body body = body_with_envelopes(kUr5);
  const FreeSpace space;
  const JointVector start = default_start(kUr5);
  const auto outer = locate_views(kUr5, body, space, kClearance, start, kFov_rad);
  REQUIRE(outer);
  const Turns views = locate_views_of_inner_links(kUr5, body, space, kClearance, start, kFov_rad);
  REQUIRE_FALSE(views.empty());
  for (const std::size_t link : {2UL, 3UL}) {
    const auto tilt_deg = [&](const JointVector& q) {  // of the link's x axis, from the horizon
      return std::lround(std::asin(forward(kUr5, q).base_T_link[link].linear()(2, 0)) / 0.017453292519943295);
    };
    std::set<long> before, tilts;
    for (const JointVector& q : *outer) before.insert(tilt_deg(q));
    REQUIRE(before.size() == 1);
    for (const JointVector& q : views) tilts.insert(tilt_deg(q));
    REQUIRE(tilts.size() >= 3);
  }
  std::set<int> sectors;
  JointVector at = start;
  for (const JointVector& q : views) {
    REQUIRE(certify(kUr5, body, space, kClearance, at, q).certified());
    at = q;
    const Eigen::Vector3d along = forward(kUr5, q).base_T_link[1].linear().col(0);
    sectors.insert(static_cast<int>(std::floor(std::atan2(along.y(), along.x()) / kFov_rad)));
  }
  REQUIRE(sectors.size() >= 8);
}

TEST_CASE("inner links without room to turn leave no views", "[locate]") {
  FreeSpace space;
  space.zone.radius_m = 0.1;
  REQUIRE(locate_views_of_inner_links(kUr5, kBody, space, kClearance, default_start(kUr5), kFov_rad).empty());
}

TEST_CASE("views behind a keep-out are skipped, the others stay", "[locate]") {
  FreeSpace space;
  space.keep_out_boxes.push_back({{0.15, -2, -1}, {2, 2, 2}});
  JointVector start = default_start(kUr5);
  const auto all = locate_views(kUr5, kBody, FreeSpace{}, kClearance, start, kFov_rad);
  // Some base angle is free of the box: take the first.
  bool tried = false;
  for (const JointVector& q : *all) {
    if (!configuration_is_free(kUr5, kBody, space, kClearance, q)) continue;
    const auto views = locate_views(kUr5, kBody, space, kClearance, q, kFov_rad);
    REQUIRE(views);
    REQUIRE(views->size() < all->size());
    for (std::size_t i = 1; i < views->size(); ++i) {
      REQUIRE(certify(kUr5, kBody, space, kClearance, (*views)[i - 1], (*views)[i]).certified());
    }
    tried = true;
    break;
  }
  REQUIRE(tried);
}

TEST_CASE("a start outside the safe zone is refused", "[locate]") {
  FreeSpace space;
  space.zone.radius_m = 0.1;
  const auto views = locate_views(kUr5, kBody, space, kClearance, default_start(kUr5), kFov_rad);
  REQUIRE_FALSE(views);
  REQUIRE(views.error().fault == Fault::kStartBlocked);
}
