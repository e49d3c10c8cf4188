/// The private channel of a simulated robot: where its joints truly are, for simulated cameras and the grading of
/// another process. No robot has it; nothing that is under test may read it.
#pragma once

#include <string_view>

#include "hal/sim/ur_controller/controller.hpp"
#include "hal/sim/ur_controller/session.hpp"

namespace firstlook::sim::ur {

// Big-endian. First kTruthGreeting and the true DH table: theta, d, a, alpha of each joint. Then 125 times a second a
// time that no reboot touches (s) and six joint angles. Bytes of the other side: kTouched, when the body touches
// something.
inline constexpr std::string_view kTruthGreeting = "FLT1";
/// In place of it when the robot's time is that of its client: turns follow (stepped_service.hpp).
inline constexpr std::string_view kLockstepGreeting = "FLL1";
inline constexpr std::size_t kTruthHeadBytes = 4 + kJoints * 4 * 8;
inline constexpr std::size_t kTruthSampleBytes = 7 * 8;
inline constexpr char kTouched = 'T';

class TruthSession final : public Session {
 public:
  explicit TruthSession(Controller& controller);
  void receive(std::string_view bytes) override;
  void on_cycle() override;
  [[nodiscard]] bool is_private() const override { return true; }

 private:
  Controller& controller_;
  std::uint64_t every_cycles_;
};

}  // namespace firstlook::sim::ur
