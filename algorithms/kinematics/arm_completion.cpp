#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <span>
#include <string>

#include "algorithms/kinematics/joint_chain.hpp"
#include "algorithms/kinematics/self_collision.hpp"
#include "platform/core/random.hpp"

namespace firstlook {
namespace {

constexpr std::uint64_t kStream = 4030;  // of random numbers
constexpr int kPairSamples = 2000;       // postures in which pairs of capsules are looked at
constexpr int kStartSamples = 60000;
constexpr double kZoneRadius_m = 0.5;   // the default safe zone
constexpr double kZoneHeight_m = 1.13;  // of its top in Base
constexpr double kEnvelope_m = 0.20;    // at the flange
constexpr double kRoom_m = 0.03;        // beyond that nothing is gained by more room
constexpr double kSelfMin_m = 0.02;
constexpr int kBracketSides = 8;  // of the flange, to which the camera's bracket may point
constexpr double kBracket_m = 0.10, kBracketRadius_m = 0.03;
constexpr double kTurnsMax_rad = 4 * std::numbers::pi + 1e-9;  // more is no arm's range
constexpr double kLengthMax_m = 5;
constexpr double kSpeedMax_rad_s = 20;

JointVector random_posture(const ArmModel& arm, Random& random) {
  JointVector q = JointVector::zero(arm.joints);
  for (int j = 0; j < arm.joints; ++j) {
    const auto i = static_cast<std::size_t>(j);
    const double low = std::max(arm.lower_rad[i], -std::numbers::pi),
                 high = std::min(arm.upper_rad[i], std::numbers::pi);
    q[j] = low < high ? random.uniform(low, high) : arm.lower_rad[i];
  }
  return q;
}

/// How much room a bracket lacks that stands out from the flange to any side: once the camera's place is known it is
/// held apart from the links two before the last, and a start that leaves it no room traps the arm.
double bracket_lack_m(const LinkFrames& frames, const Capsules& body) {
  double lack_m = 0;
  const Pose flange = frames.flange().pose();
  for (int side = 0; side < kBracketSides; ++side) {
    const double angle_rad = 2 * std::numbers::pi * side / kBracketSides;
    const Capsule bracket{
        flange.translation(),
        flange * Eigen::Vector3d(kBracket_m * std::cos(angle_rad), kBracket_m * std::sin(angle_rad), 0),
        kBracketRadius_m};
    for (const Capsule& part : body) {
      if (frames.joints - part.link < 2) continue;
      lack_m = std::max(lack_m, kSelfMin_m - (capsule_distance_m(part, bracket) + kBodyPadding_m));
    }
  }
  return lack_m;
}

/// How much a posture lacks to be a start: 0 when body and envelope stand in the default safe zone with room to spare,
/// a bracket on the flange clears the arm, and the flange looks outwards and a little down, as a camera on it should.
double start_cost(const ArmModel& arm, const JointVector& q, const SelfPairs& pairs) {
  const LinkFrames frames = forward(arm, q);
  const Capsules body = place(arm.body, frames);
  double worst_m = 0;
  const auto stands = [&](const Eigen::Vector3d& p, double radius_m) {
    const double out_m = std::max(p.head<2>().norm() + radius_m - kZoneRadius_m,
                                  std::max(p.z() + radius_m - kZoneHeight_m, radius_m - p.z()));
    worst_m = std::max(worst_m, out_m + kRoom_m);
  };
  for (const Capsule& c : body) {
    if (c.link < 2) continue;  // link 1 turns in place
    stands(c.a, c.radius_m);
    stands(c.b, c.radius_m);
  }
  stands(frames.flange().translation(), kEnvelope_m);
  const double self_lack_m = std::max(0.0, kSelfMin_m - self_margin_m(body, pairs));
  const Eigen::Vector3d out = Eigen::Vector3d(frames.flange().translation().x(), frames.flange().translation().y(), 0);
  const Eigen::Vector3d wanted = (out.norm() > 1e-6 ? Eigen::Vector3d(out.normalized()) : Eigen::Vector3d::UnitX()) -
                                 0.35 * Eigen::Vector3d::UnitZ();
  const double looks = 1 - wanted.normalized().dot(frames.flange().rotation().col(2));
  return 20 * (self_lack_m + bracket_lack_m(frames, body)) + 5 * worst_m + 0.3 * looks;
}

std::string name_of(std::span<const std::string> names, std::size_t i) {
  return i < names.size() ? names[i] : fmt::format("joint {}", i + 1);
}

}  // namespace

Status check_arm(const ArmModel& arm, std::span<const std::string> names, unsigned bare) {
  const auto wrong = [&](std::size_t i, const std::string& what) {
    return failure(Fault::kConfigBadValue, "{:.40}: {}", name_of(names, i), what);
  };
  for (std::size_t i = 0; i < static_cast<std::size_t>(arm.joints); ++i) {
    const DhRow& row = arm.dh[i];
    for (const double v : {row.theta_offset_rad, row.d_m, row.a_m, row.alpha_rad, row.beta_rad, row.gamma_rad,
                           arm.lower_rad[i], arm.upper_rad[i], arm.speed_max_rad_s[i]}) {
      if (!std::isfinite(v)) return wrong(i, "a number is not finite");
    }
    if (std::hypot(row.a_m, row.d_m) > kLengthMax_m) {
      return wrong(i, fmt::format("the next joint is {:.0f} m away; lengths are in metres, these look like millimetres",
                                  std::hypot(row.a_m, row.d_m)));
    }
    if (!(arm.lower_rad[i] < arm.upper_rad[i])) {
      return wrong(i, fmt::format("the limits {} to {} rad are no range", arm.lower_rad[i], arm.upper_rad[i]));
    }
    if (std::max(std::abs(arm.lower_rad[i]), std::abs(arm.upper_rad[i])) > kTurnsMax_rad) {
      return wrong(i, fmt::format("the limits {} to {} rad are more than two turns; they look like degrees",
                                  arm.lower_rad[i], arm.upper_rad[i]));
    }
    if (arm.lower_rad[i] > 0 || arm.upper_rad[i] < 0) {
      // Base turns, starts and the search for pairs begin between them; nothing asks for zero itself.
      if (arm.lower_rad[i] > std::numbers::pi || arm.upper_rad[i] < -std::numbers::pi) {
        return wrong(i, fmt::format("the limits {} to {} rad leave out half a turn to either side of zero",
                                    arm.lower_rad[i], arm.upper_rad[i]));
      }
    }
    if (!(arm.speed_max_rad_s[i] > 0)) return wrong(i, "its speed limit must be above 0");
    if (arm.speed_max_rad_s[i] > kSpeedMax_rad_s) {
      return wrong(i, fmt::format("a speed limit of {} rad/s looks like degrees", arm.speed_max_rad_s[i]));
    }
  }
  unsigned covered = bare;
  for (const Capsule& c : arm.body) {
    if (!c.a.allFinite() || !c.b.allFinite() || !std::isfinite(c.radius_m)) {
      return failure(Fault::kConfigBadValue, "the body of link {}: a number is not finite", c.link);
    }
    if (c.radius_m - kBodyPadding_m <= 0) {
      return failure(Fault::kConfigBadValue, "the body of link {}: a radius must be above 0", c.link);
    }
    if (std::max(c.a.norm(), c.b.norm()) > kLengthMax_m || c.radius_m > 1) {
      return failure(Fault::kConfigBadValue, "the body of link {} is larger than any arm's; is it in millimetres?",
                     c.link);
    }
    covered |= 1U << c.link;
  }
  for (int link = 0; link <= arm.joints; ++link) {
    if ((covered >> link & 1U) == 0) {
      return failure(Fault::kConfigBadValue,
                     "link {} has no body: give it one, or say that there is none (links_without_body)", link);
    }
  }
  return {};
}

Status complete_arm(ArmModel& arm) {
  Random random(static_cast<std::uint64_t>(arm.joints), kStream);
  // Two links that touch in every posture are joined there: neighbours always, others by how they are built.
  const std::size_t count = arm.body.size();
  std::array<std::array<bool, kCapsulesMax>, kCapsulesMax> apart{};
  for (int s = 0; s < kPairSamples; ++s) {
    const Capsules body = place(arm.body, forward(arm, random_posture(arm, random)));
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t j = 0; j < count; ++j) {
        const Capsule &near = body[i], &far = body[j];
        if (far.link - near.link < 2 || apart[i][j]) continue;
        apart[i][j] = capsule_distance_m(near, far) + 2 * kBodyPadding_m > kSelfMin_m;
      }
    }
  }
  arm.own_pairs = true;
  arm.pairs.clear();
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t j = 0; j < count; ++j) {
      if (!apart[i][j]) continue;
      if (arm.pairs.full()) {
        return failure(Fault::kConfigBadValue, "more than {} pairs of capsules can meet; give the links fewer capsules",
                       arm.pairs.capacity());
      }
      arm.pairs.push_back({static_cast<std::uint8_t>(i), static_cast<std::uint8_t>(j)});
    }
  }
  if (arm.start_rad.size() == arm.joints) return {};
  const SelfPairs pairs = self_pairs_of_arm(arm, kSelfMin_m / 4);
  double best = 1e9;
  const bool turns_freely = arm.lower_rad[0] <= 0 && arm.upper_rad[0] >= 0;
  for (int s = 0; s < kStartSamples; ++s) {
    JointVector q = random_posture(arm, random);
    q[0] = turns_freely ? 0 : (arm.lower_rad[0] + arm.upper_rad[0]) / 2;
    const double cost = start_cost(arm, q, pairs);
    if (cost >= best) continue;
    best = cost;
    arm.start_rad = q;
  }
  if (self_margin_m(place(arm.body, forward(arm, arm.start_rad)), pairs) <= 0) {
    return failure(Fault::kConfigBadValue,
                   "no posture was found in which the arm does not touch itself; its capsules are too large");
  }
  return {};
}

}  // namespace firstlook
