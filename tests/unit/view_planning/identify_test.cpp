#include "algorithms/view_planning/identify.hpp"

#include <catch2/catch.hpp>

#include "algorithms/motion/clearance.hpp"

using namespace firstlook;

namespace {
const ArmModel kUr5 = *find_arm_model("ur5");
const Body kBody = body_with_envelope(kUr5);
const Clearance kClearance = required_clearance({}).clearance();
}  // namespace

TEST_CASE("each joint is moved alone, the outermost first", "[identify]") {
  const FreeSpace space;
  const JointVector at = default_start(kUr5);
  const auto motions = identify_motions(kUr5, kBody, space, kClearance, at);
  REQUIRE(motions);
  REQUIRE(motions->size() == 12);
  for (int i = 0; i < 12; ++i) {
    const JointVector& motion = (*motions)[static_cast<std::size_t>(i)];
    const JointVector change = motion - at;
    for (int j = 0; j < 6; ++j) {
      if (j == 5 - i / 2) {
        REQUIRE(std::abs(change[j]) >= 0.045);
        REQUIRE(std::abs(change[j]) <= 0.14 + 1e-9);
        if (i % 2 == 1) REQUIRE(change[j] == Approx(at[j] - (*motions)[static_cast<std::size_t>(i - 1)][j]));
      } else {
        REQUIRE(change[j] == 0);
      }
    }
    REQUIRE(certify(kUr5, kBody, space, kClearance, at, motion).certified());
    if (i % 2 == 0) continue;
    const double margin_m = configuration_margin(kUr5, kBody, space, kClearance, motion);
    const JointVector& before = (*motions)[static_cast<std::size_t>(i - 1)];
    REQUIRE(configuration_margin(kUr5, kBody, space, kClearance, before) >= margin_m - 1e-9);
  }
}

TEST_CASE("a blocked arm is told so", "[identify]") {
  FreeSpace space;
  space.zone_intact = false;
  const auto motions = identify_motions(kUr5, kBody, space, kClearance, default_start(kUr5));
  REQUIRE_FALSE(motions);
  REQUIRE(motions.error().fault == Fault::kStartBlocked);
}

TEST_CASE("a joint at its limit turns the other way", "[identify]") {
  ArmModel arm = kUr5;
  const JointVector at = default_start(arm);
  arm.upper_rad[5] = at[5] + 0.01;
  const auto motions = identify_motions(arm, kBody, FreeSpace{}, kClearance, at);
  REQUIRE(motions);
  REQUIRE(motions->front()[5] == Approx(at[5] - 0.14));
}
