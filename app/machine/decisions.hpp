/// What the machine decides. The live shell carries decisions out; a replay compares them with the record.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "app/machine/events.hpp"
#include "hal/api/operator_devices.hpp"
#include "hal/api/robot_arm.hpp"

namespace firstlook {

enum class StateId : std::uint8_t;

enum class Outcome : std::uint8_t { kDone, kCalibrationRejected, kSafelyStopped, kFaulted };
[[nodiscard]] constexpr std::string_view name_of(Outcome outcome) {
  constexpr std::array<std::string_view, 4> kNames = {"done", "calibration_rejected", "safely_stopped", "faulted"};
  return kNames[static_cast<std::size_t>(outcome)];
}

/// How the job ended and why. `fault` is kInternal's number only for outcome done, where it means nothing.
struct Ending {
  Outcome outcome = Outcome::kDone;
  bool has_fault = false;
  Fault fault = Fault::kInternal;
  /// For kCameraOnInnerLink the links, counted from 1, of which one carries the camera.
  int camera_link_low = 0, camera_link_high = 0;
};

/// Receiver of decisions, one call each, in order.
class DecisionSink {
 public:
  virtual ~DecisionSink() = default;
  virtual void state_entered(Instant now, StateId state) = 0;
  virtual void move_arm(Instant now, const hal::Segment& segment) = 0;
  virtual void stop_arm(Instant now) = 0;
  /// `arguments` are packed values of the kind's argument type.
  virtual void start_job(Instant now, JobKind kind, std::uint32_t number, std::span<const std::byte> arguments) = 0;
  virtual void set_timer(Instant now, MachineTimer timer, Instant due) = 0;
  virtual void cancel_timer(Instant now, MachineTimer timer) = 0;
  /// One line for the pendant and the terminal.
  virtual void show(Instant now, std::string_view line) = 0;
  virtual void light(Instant now, hal::Light light) = 0;
  /// What was known free is unknown for motion until seen again (safety rule 7).
  virtual void forget_known_free(Instant now) = 0;
  virtual void stop_recorded(Instant now, Fault cause) = 0;
  virtual void finished(Instant now, const Ending& ending) = 0;
};

}  // namespace firstlook
