/// The private channel of a simulated robot: where its joints truly are, for simulated cameras and the grading of
/// another process. No robot has it; nothing that is under test may read it.
#pragma once

#include <string>
#include <string_view>

#include "hal/sim/ur_controller/controller.hpp"
#include "hal/sim/ur_controller/session.hpp"

namespace firstlook::sim::ur {

// Big-endian. First kTruthGreeting and the true DH table: theta, d, a, alpha of each joint. Then 125 times a second a
// time that no reboot touches (s), six joint angles, and a byte: 1 where a hand leads the arm or has left it. The other
// side sends kTouched when the body touches something, and kLead with eight numbers when a hand leads the arm: joints
// (rad), speed and acceleration (rad/s, rad/s²).
inline constexpr std::string_view kTruthGreeting = "FLT2";
/// In place of it when the robot's time is that of its client: turns follow (stepped_service.hpp).
inline constexpr std::string_view kLockstepGreeting = "FLL1";
inline constexpr std::size_t kTruthHeadBytes = 4 + kJoints * 4 * 8;
inline constexpr std::size_t kTruthSampleBytes = 7 * 8 + 1;
inline constexpr char kTouched = 'T';
inline constexpr char kLead = 'L';
inline constexpr std::size_t kLeadBytes = 1 + 8 * 8;

class TruthSession final : public Session {
 public:
  explicit TruthSession(Controller& controller);
  void receive(std::string_view bytes) override;
  void on_cycle() override;
  [[nodiscard]] bool is_private() const override { return true; }

 private:
  Controller& controller_;
  std::uint64_t every_cycles_;
  std::string received_;
};

/// What leads the arm, as the channel sends it.
[[nodiscard]] std::string lead_message(const JointVector& to_rad, double speed_rad_s, double acceleration_rad_s2);

}  // namespace firstlook::sim::ur
