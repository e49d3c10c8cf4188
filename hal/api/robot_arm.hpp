/// The arm as firstlook needs it: where it is, move one segment, stop.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "platform/core/joint_vector.hpp"
#include "platform/core/result.hpp"
#include "platform/core/time.hpp"

namespace firstlook::hal {

/// Safety state of the controller, as far as firstlook acts on it.
enum class ArmSafety : std::uint8_t { kNormal, kReduced, kProtectiveStop, kEmergencyStop, kRecovery, kFault };

/// One report of the arm. Positions are those at `stamp`.
struct ArmState {
  Instant stamp{};
  JointVector position_rad;
  JointVector velocity_rad_s;
  ArmSafety safety = ArmSafety::kNormal;
  bool program_running = false;  ///< consent: the operator's program plays and is not paused
  bool moving = false;           ///< a segment is being executed
  std::uint32_t segment = 0;     ///< number of the last segment that was accepted; 0 before the first
};

/// One joint-linear move without blend, as URScript's movej: all joints start and end together, trapezoidal speed of
/// the joint with the longest way.
struct Segment {
  std::uint32_t number = 0;  ///< counts up from 1; reported back in ArmState::segment
  JointVector target_rad;
  double speed_rad_s = 0;          ///< of the leading joint
  double acceleration_rad_s2 = 0;  ///< of the leading joint
};

struct ArmCounters {
  std::uint64_t states = 0;
  std::uint64_t segments = 0;
  std::uint64_t stops = 0;
  std::uint64_t refused = 0;
};

/// Calls never block and never allocate; all from the loop thread.
class RobotArm {
 public:
  virtual ~RobotArm() = default;
  /// Model name as in ArmModel ("ur5"). Constant after construction.
  [[nodiscard]] virtual const char* model() const = 0;
  /// The next report not yet taken with stamp <= now, oldest first. Empty when there is none.
  [[nodiscard]] virtual std::optional<ArmState> poll(Instant now) = 0;
  /// When the next report is expected (virtual time jumps there).
  [[nodiscard]] virtual Instant next_due() const = 0;
  /// Starts a segment from where the arm is. Errors: kProgramStopped without consent or while one is running,
  /// kProtectiveStop, kLinkLost.
  [[nodiscard]] virtual Status move(const Segment& segment, Instant now) = 0;
  /// Brakes on the path (category 2) and withdraws the segment. Always accepted.
  virtual void stop(Instant now) = 0;
  [[nodiscard]] virtual ArmCounters counters() const = 0;
};

}  // namespace firstlook::hal
