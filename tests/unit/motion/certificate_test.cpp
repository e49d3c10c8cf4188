#include "algorithms/motion/certificate.hpp"

#include <catch2/catch.hpp>
#include <cstdlib>

#include "random_cell.hpp"

using namespace firstlook;
using namespace firstlook::test;

namespace {

constexpr Clearance kNeed{.voxels_m = 0.06, .surface_m = 0.015};

struct Case {
  const char* name;
  bool zone_intact;
  bool keep_outs;
  int taken = 0;  ///< voxels that hits took from the zone
};

FreeSpace space_of(const RandomCell& cell, const Case& c, const RandomCell* zone_left = nullptr) {
  FreeSpace space;
  space.field = &cell.field;
  space.zone_intact = c.zone_intact;
  if (zone_left != nullptr) space.revoked = &zone_left->field;
  if (c.keep_outs) {
    space.keep_out_boxes.push_back({{0.3, -0.2, 0.1}, {0.5, 0.3, 0.4}});
    space.keep_out_planes.push_back({Eigen::Vector3d(-1, 0.2, 0).normalized(), -0.6});
  }
  return space;
}

}  // namespace

TEST_CASE("dense sampling confirms every certificate, and what has room is certified") {
  const ArmModel arm = *find_arm_model("ur5");
  Pose mount = Pose::Identity();
  mount.translation() = Eigen::Vector3d(0, -0.07, 0.05);
  const Body bodies[] = {bare_body(arm), body_with_envelope(arm),
                         body_with_camera(arm, Transform<Flange, Camera>(mount))};
  Random random(1);
  int segments = 0;
  int certified = 0;
  int roomy = 0;
  int free_for_samples = 0;
  int timid = 0;
  const char* const asked = std::getenv("FIRSTLOOK_CERTIFICATE_SEGMENTS");
  constexpr int kCases = 4, kSegmentsOfCell = 130;
  const int cells = asked == nullptr ? 6 : std::max(6, std::atoi(asked) / (kCases * kSegmentsOfCell) + 1);
  for (const Case& c : {Case{"map alone", false, false}, Case{"map and zone", true, false},
                        Case{"keep-outs", true, true}, Case{"hits in the zone", true, false, 25}}) {
    for (std::uint64_t seed = 1; seed <= static_cast<std::uint64_t>(cells); ++seed) {
      RandomCell cell(seed, 8);
      const RandomCell left = take_from_zone(cell, seed, c.taken);
      const RandomCell* const zone_left = c.taken > 0 ? &left : nullptr;
      const FreeSpace space = space_of(cell, c, zone_left);
      for (int i = 0; i < kSegmentsOfCell; ++i) {
        Body body = bodies[seed % 3];
        if (i % 3 == 0) body.self_pairs.clear();  // their margins are small everywhere and would hide the others
        JointVector from = random_joints(random, 3.1);
        for (int k = 0; k < 300 && !configuration_is_free(arm, body, space, kNeed, from); ++k) {
          from = random_joints(random, 3.1);
        }
        JointVector to = from + random_joints(random, 0.6);
        to[2] = std::clamp(to[2], -3.1, 3.1);
        const Certificate proof = certify(arm, body, space, kNeed, from, to);
        ++segments;
        certified += proof.certified() ? 1 : 0;
        double lowest = 1;
        double lowest_at = 0;
        constexpr int kSteps = 24;
        for (int k = 0; k <= kSteps; ++k) {
          const double t = static_cast<double>(k) / kSteps;
          const double m = sampled_margin_m(arm, body, cell, space, kNeed, interpolate(from, to, t), 0.025, zone_left);
          if (m < lowest) lowest = m, lowest_at = t;
          if (m < 0 && !proof.certified()) break;
        }
        INFO(c.name << " seed " << seed << " segment " << i << " lowest " << lowest << " at " << lowest_at);
        if (proof.certified()) {
          REQUIRE(lowest >= std::min(proof.margin_m, kSampledMax_m) - 1e-9);
          REQUIRE(proof.margin_m >= 0);
        } else {
          // Where it says that it failed there is little room: axis spacing and the field's bound, no more.
          const double there =
              sampled_margin_m(arm, body, cell, space, kNeed, interpolate(from, to, proof.fraction), 0.025, zone_left);
          REQUIRE(there < 0.03);
          REQUIRE(proof.margin_m < kMarginMin_m);
          REQUIRE(proof.capsule >= 0);
        }
        free_for_samples += lowest >= 0 ? 1 : 0;
        timid += lowest >= 0 && !proof.certified() ? 1 : 0;
        if (lowest > 0.04) {
          ++roomy;
          REQUIRE(proof.certified());
        }
      }
    }
  }
  CHECK(segments >= 2000);
  CHECK(certified > segments / 5);
  CHECK(roomy > 10);
  if (asked == nullptr) return;
  WARN(segments << " segments, " << certified << " certified, each confirmed; " << free_for_samples
                << " free for dense sampling, of which " << timid << " have no certificate");
}

TEST_CASE("the quick verdict about a configuration is that of its margin") {
  const ArmModel arm = *find_arm_model("ur5");
  Pose mount = Pose::Identity();
  mount.translation() = Eigen::Vector3d(0, -0.07, 0.05);
  const Body bodies[] = {body_with_envelope(arm), body_with_camera(arm, Transform<Flange, Camera>(mount))};
  Random random(8);
  int free = 0, near = 0;
  for (std::uint64_t seed = 21; seed <= 32; ++seed) {
    RandomCell cell(seed, 8);
    const Case c{"", seed % 2 == 0, seed % 3 == 0, seed % 4 < 2 ? 0 : 25};
    const RandomCell left = take_from_zone(cell, seed, c.taken);
    const FreeSpace space = space_of(cell, c, c.taken > 0 ? &left : nullptr);
    for (int i = 0; i < 10000; ++i) {
      const Body& body = bodies[i % 2];
      const JointVector q = random_joints(random, 3.1);
      const double margin = configuration_margin(arm, body, space, kNeed, q);
      REQUIRE(configuration_is_free(arm, body, space, kNeed, q, 0.005) == (margin >= 0.005));
      free += margin >= 0.005 ? 1 : 0;
      near += std::abs(margin - 0.005) < 0.02 ? 1 : 0;
    }
  }
  CHECK(free > 10000);
  CHECK(near > 5000);
}

TEST_CASE("the margin of a configuration is a tight lower bound") {
  const ArmModel arm = *find_arm_model("ur5");
  const Body body = bare_body(arm);
  Random random(2);
  double gap_sum = 0;
  int count = 0;
  for (std::uint64_t seed = 11; seed <= 14; ++seed) {
    RandomCell cell(seed, 8);
    const Case c{"", seed % 2 == 0, seed % 2 == 0, seed % 4 < 2 ? 0 : 25};
    const RandomCell left = take_from_zone(cell, seed, c.taken);
    const RandomCell* const zone_left = c.taken > 0 ? &left : nullptr;
    const FreeSpace space = space_of(cell, c, zone_left);
    for (int i = 0; i < 400; ++i) {
      const JointVector q = random_joints(random, 3.1);
      const double margin = configuration_margin(arm, body, space, kNeed, q);
      CHECK(configuration_is_free(arm, body, space, kNeed, q, 0) == (margin >= 0));
      CHECK(configuration_is_free(arm, body, space, kNeed, q, -0.03) == (margin >= -0.03));
      const double sampled = sampled_margin_m(arm, body, cell, space, kNeed, q, 0.01, zone_left);
      REQUIRE(std::min(margin, kSampledMax_m) <= sampled + 1e-9);
      if (margin < -0.05 || margin > kSampledMax_m) continue;  // inside an obstacle distances are cut at zero
      gap_sum += sampled - margin;
      ++count;
    }
  }
  REQUIRE(count > 50);
  CHECK(gap_sum / count < 0.02);
}

TEST_CASE("a start in contact is said to be blocked, not the path") {
  const ArmModel arm = *find_arm_model("ur5");
  const Body body = bare_body(arm);
  FreeSpace space;  // zone alone
  const JointVector start = default_start(arm);
  const double top = space.zone.height_m;
  // Lower the roof of the zone until the arm just does not fit.
  double low = 0.5;
  double high = top;
  for (int i = 0; i < 60; ++i) {
    space.zone.height_m = (low + high) / 2;
    (configuration_margin(arm, body, space, {.surface_m = 0.01}, start) >= 0 ? high : low) = space.zone.height_m;
  }
  space.zone.height_m = low - 1e-9;
  const double margin = configuration_margin(arm, body, space, {.surface_m = 0.01}, start);
  REQUIRE(margin < 0);
  REQUIRE(margin > -1e-8);
  JointVector to = start;
  to[0] += 0.5;
  const Certificate proof = certify(arm, body, space, {.surface_m = 0.01}, start, to);
  CHECK(proof.verdict == CertificateVerdict::kStartBlocked);
  CHECK(proof.fraction == 0);
  CHECK(proof.capsule >= 0);
  CHECK(proof.margin_m == Approx(margin).margin(1e-12));
  // With room again the base turns all the way round, and the proof terminates near the roof too.
  space.zone.height_m = high + 2 * kMarginMin_m;
  to[0] = start[0] + 3;
  CHECK(certify(arm, body, space, {.surface_m = 0.01}, start, to).certified());
}

TEST_CASE("ends outside the joint limits are blocked") {
  const ArmModel arm = *find_arm_model("ur5");
  const Body body = bare_body(arm);
  const FreeSpace space;
  JointVector beyond = default_start(arm);
  beyond[0] = 6.4;
  const Certificate proof = certify(arm, body, space, {}, default_start(arm), beyond);
  CHECK(proof.verdict == CertificateVerdict::kEndBlocked);
  CHECK(proof.capsule == -1);
  beyond[0] = std::numeric_limits<double>::quiet_NaN();
  CHECK(certify(arm, body, space, {}, beyond, default_start(arm)).verdict == CertificateVerdict::kStartBlocked);
}

TEST_CASE("an arm that encoders put just beyond a limit can move away, but no target is put there") {
  const ArmModel arm = *find_arm_model("ur5");
  const Body body = bare_body(arm);
  FreeSpace space;
  space.zone.radius_m = 3;
  space.zone.height_m = 3;
  JointVector at = default_start(arm);
  JointVector inside = at;
  at[5] = arm.upper_rad[5] + 0.5 * kLimitTolerance_rad;
  CHECK(certify(arm, body, space, {}, at, inside).certified());
  CHECK_FALSE(configuration_is_free(arm, body, space, {}, at));
  at[5] = arm.upper_rad[5] + 2 * kLimitTolerance_rad;
  CHECK(certify(arm, body, space, {}, at, inside).verdict == CertificateVerdict::kStartBlocked);
  inside[5] = arm.upper_rad[5] - 0.5 * kLimitMargin_rad;
  CHECK_FALSE(configuration_is_free(arm, body, space, {}, inside));
  inside[5] = arm.upper_rad[5] - 1.5 * kLimitMargin_rad;
  CHECK(configuration_is_free(arm, body, space, {}, inside));
}

TEST_CASE("a thin obstacle between two free ends is never jumped over") {
  const ArmModel arm = *find_arm_model("ur5");
  const Body body = bare_body(arm);
  FreeSpace space;
  space.zone.radius_m = 3;
  space.zone.height_m = 3;
  // A sheet of 0.2 mm in the half plane y = 0, x < 0, where a base turn of half a circle must pass.
  const JointVector from{-1.2, -1.2, 0.6, -1.0, -1.57, 0};
  JointVector to = from;
  to[0] = 1.2;
  REQUIRE(certify(arm, body, space, {}, from, to).certified());
  Random random(3);
  for (int i = 0; i < 200; ++i) {
    space.keep_out_boxes.clear();
    const Eigen::Vector3d hand = forward(arm, interpolate(from, to, random.uniform(0.1, 0.9))).flange().translation();
    space.keep_out_boxes.push_back({hand - Eigen::Vector3d::Constant(1e-4), hand + Eigen::Vector3d::Constant(1e-4)});
    const Certificate proof = certify(arm, body, space, {}, from, to);
    REQUIRE_FALSE(proof.certified());
  }
}

TEST_CASE("every joint of the wrist turns all the way round in the open") {
  const ArmModel arm = *find_arm_model("ur5");
  const Body body = bare_body(arm);
  FreeSpace space;
  space.zone.radius_m = 3;
  space.zone.height_m = 3;
  for (const double bend : {-1.57, 1.57}) {
    for (const int joint : {3, 5}) {
      JointVector from{0, -1.57, 0.5, 0, bend, 0};
      JointVector to = from;
      from[joint] = -3.1;
      to[joint] = 3.2;
      CHECK(certify(arm, body, space, {}, from, to).certified());
    }
  }
}

TEST_CASE("the arm does not pass through itself") {
  const ArmModel arm = *find_arm_model("ur5");
  const Body body = bare_body(arm);
  FreeSpace space;
  space.zone.radius_m = 3;
  space.zone.height_m = 3;
  space.zone.floor_m = -1.5;
  const JointVector from{0, -1.57, 0, 1.57, 1.5, 0};
  JointVector to = from;
  to[4] = 4.8;  // the hand sweeps over the forearm
  const Certificate proof = certify(arm, body, space, {}, from, to);
  CHECK(proof.verdict == CertificateVerdict::kBlocked);
  CHECK(proof.self_collision);
}
