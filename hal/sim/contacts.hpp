/// Follows the true, unpadded body through the true scene: contacts, and entries into space not known to be free.
#pragma once

#include <cstdint>
#include <vector>

#include "algorithms/kinematics/arm_model.hpp"
#include "algorithms/mapping/safe_zone.hpp"
#include "algorithms/motion/body.hpp"
#include "hal/sim/grader.hpp"
#include "hal/sim/simulated_arm.hpp"
#include "hal/sim/true_world.hpp"

namespace firstlook::sim {

inline constexpr double kBodyStep_m = 0.002;         ///< no body point moves farther between two checks
inline constexpr double kOverlapTolerance_m = 1e-6;  ///< less than this is rounding, not an entry

/// The camera's housing as it is: a Kinect is 0.28 m wide along x of the colour camera and 0.07 m deep.
[[nodiscard]] Capsule true_housing(int link, const Pose& link_T_camera);

/// The arm's true geometry and that of the camera on one of its links, in link frames; link 0: the camera is not on the
/// arm.
[[nodiscard]] Capsules true_capsules(const ArmModel& arm, int link, const Pose& link_T_camera);

class ContactMonitor final : public BodyWatcher {
 public:
  /// Links 0 and 1 are exempt while they stay inside the allowance, as for planner and guardian; so is the part of the
  /// upper arm that turns inside the housing of link 1, which is a sphere for all three. The world must outlive it.
  ContactMonitor(const ArmModel& arm, const Capsules& body, const BaseAllowance& allowance, const SafeZone& zone,
                 const TrueWorld& world);

  /// The scene has changed: from now on this is the world.
  void set_world(const TrueWorld& world);
  /// See Grader::watch. Allocates.
  void watch(const KnownFreeView* view);
  bool body_moved(Instant stamp, const JointVector& from_rad, const JointVector& to_rad) override;
  /// Nothing is counted while a person leads the arm by hand: the touch test brings its tip to the board on purpose,
  /// and it is that person who moves it. From the first motion of the program's own on everything counts anew, so that
  /// an arm that moves off from where it is in contact, or outside of what is known free, is found.
  void body_led() override;

  [[nodiscard]] std::uint64_t contacts() const { return contacts_; }
  [[nodiscard]] std::uint64_t unknown_entries() const { return unknown_entries_; }
  [[nodiscard]] std::uint64_t checks() const { return checks_; }

 private:
  void check(const JointVector& q_rad);
  void check_contact(const Capsules& placed);
  void check_zone(const Capsules& placed);
  void check_voxels(const Capsules& placed);
  /// One voxel that the body overlaps now.
  void occupy(const Capsule& placed, const Eigen::Vector3i& voxel, bool& outside_grid);
  struct Excuse {
    bool in_zone = false, in_allowed_link = false;
  };
  [[nodiscard]] Excuse excuse(const Capsule& placed, const Eigen::Vector3i& voxel) const;
  [[nodiscard]] bool exempt(const Capsule& placed) const;

  const ArmModel arm_;
  const Capsules body_;
  const Capsules base_links_;  ///< links 0 and 1 as planner and guardian hold them
  const BaseAllowance allowance_;
  const SafeZone zone_;
  const TrueWorld* world_;
  const KnownFreeView* view_ = nullptr;

  Capsules last_;     ///< where the body was at the last check; empty before the first
  Capsules allowed_;  ///< links that the base allowance excuses, as placed in this check
  std::vector<std::uint32_t>
      overlapped_;  ///< for each voxel the number of the last check in which the body overlapped it
  std::uint32_t check_number_ = 1;
  bool in_contact_ = false;
  bool outside_ = false;  ///< of the zone, or of the grid
  std::uint64_t contacts_ = 0;
  std::uint64_t unknown_entries_ = 0;
  std::uint64_t checks_ = 0;
};

}  // namespace firstlook::sim
