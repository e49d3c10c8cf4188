/// Proofs that the body keeps its clearance: of one configuration, and along a whole joint-linear segment.
#pragma once

#include <cstdint>

#include "algorithms/motion/body.hpp"
#include "algorithms/motion/free_space.hpp"

namespace firstlook {

/// Capsule axes are divided until pieces are shorter than this; the margin is conservative by at most half of it.
inline constexpr double kAxisSpacing_m = 0.01;
/// What a configuration needs beyond the clearance to be moved from or to: the certificate's bisection ends there.
inline constexpr double kMarginMin_m = 2e-4;
/// Targets keep this inside the joint limits; where the arm stands may be beyond them by what encoders round.
inline constexpr double kLimitMargin_rad = 0.01;
inline constexpr double kLimitTolerance_rad = 1e-3;

/// Whether every joint is finite and at least `margin_rad` inside its limits.
[[nodiscard]] bool within_limits(const ArmModel& arm, const JointVector& q_rad, double margin_rad);

/// How much the body clears everything that is not free, and itself, beyond what is required (a lower bound: at most
/// kAxisSpacing_m / 2 below what zone, field and keep-outs say along the axes, exact in the zone). Negative: not
/// allowed. About 0.5 us.
[[nodiscard]] double configuration_margin(const ArmModel& arm, const Body& body, const FreeSpace& space,
                                          const Clearance& clearance, const JointVector& q_rad);

/// The same as configuration_margin >= margin_m, faster; besides, q_rad must be kLimitMargin_rad inside the joint
/// limits.
[[nodiscard]] bool configuration_is_free(const ArmModel& arm, const Body& body, const FreeSpace& space,
                                         const Clearance& clearance, const JointVector& q_rad,
                                         double margin_m = kMarginMin_m);

enum class CertificateVerdict : std::uint8_t { kCertified, kStartBlocked, kEndBlocked, kBlocked };

/// The outcome of `certify`.
struct Certificate {
  CertificateVerdict verdict = CertificateVerdict::kBlocked;
  double fraction = 0;  ///< where the proof failed, 0 at `from`, 1 at `to`
  int capsule = -1;     ///< of body.capsules; the farther one of a self collision; -1 when certified
  bool self_collision = false;
  double margin_m = 0;  ///< proven lower bound for the whole segment; when it failed, the bound that fell short
  int evaluations = 0;  ///< configurations looked at
  [[nodiscard]] bool certified() const { return verdict == CertificateVerdict::kCertified; }
};

/// Proves that the margin stays >= 0 on the whole segment between two configurations, or says where it cannot.
/// Intervals are bisected until the margin at the middle exceeds how far any point of the capsule can move within the
/// interval (twist.hpp); nothing is sampled at a step size. Ends need kMarginMin_m; a configuration more than
/// kLimitTolerance_rad outside the joint limits counts as blocked. 7 to 35 us for 0.6 rad.
[[nodiscard]] Certificate certify(const ArmModel& arm, const Body& body, const FreeSpace& space,
                                  const Clearance& clearance, const JointVector& from, const JointVector& to);

}  // namespace firstlook
