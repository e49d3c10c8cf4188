/// What can happen to the machine. Each event has one number on the loop and in the journal.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <variant>

#include "app/machine/job_types.hpp"
#include "hal/api/cameras.hpp"
#include "hal/api/operator_devices.hpp"
#include "hal/api/robot_arm.hpp"

namespace firstlook {

/// A report of the arm with the guardian's finding for it (safety rule 11: independent of the planner).
struct ArmReported {
  static constexpr std::uint16_t kKind = 16;
  hal::ArmState state;
  double guardian_margin_m = 0;  ///< how far the body stands inside known free space; negative: it does not
  template <typename Archive>
  void fields(Archive& a) {
    a(state.stamp, state.position_rad, state.velocity_rad_s, state.safety, state.program_running, state.moving,
      state.segment, guardian_margin_m);
  }
};

struct ColorFrameArrived {
  static constexpr std::uint16_t kKind = 17;
  hal::Frame frame;
  template <typename Archive>
  void fields(Archive& a) {
    a(frame.stamp, frame.sequence, frame.slot);
  }
};

struct DepthFrameArrived {
  static constexpr std::uint16_t kKind = 18;
  hal::Frame frame;
  template <typename Archive>
  void fields(Archive& a) {
    a(frame.stamp, frame.sequence, frame.slot);
  }
};

enum class OperatorDevice : std::uint8_t { kPendant, kPanel };

struct OperatorActed {
  static constexpr std::uint16_t kKind = 19;
  OperatorDevice device = OperatorDevice::kPendant;
  hal::OperatorAction action = hal::OperatorAction::kPlay;
  template <typename Archive>
  void fields(Archive& a) {
    a(device, action);
  }
};

/// The arm refused a command of ours.
struct CommandRefused {
  static constexpr std::uint16_t kKind = 20;
  Fault fault = Fault::kInternal;
  template <typename Archive>
  void fields(Archive& a) {
    a(fault);
  }
};

/// The program is to end: by SIGINT or SIGTERM, because its time is over, or because it cannot go on.
struct ShutdownAsked {
  static constexpr std::uint16_t kKind = 21;
  Fault cause = Fault::kProgramStopped;
  template <typename Archive>
  void fields(Archive& a) {
    a(cause);
  }
};

/// The devices that tell of themselves.
enum class CartDevice : std::uint8_t { kArm, kColorCamera, kDepthCamera, kPanel };
inline constexpr std::size_t kCartDevices = 4;
[[nodiscard]] constexpr std::string_view name_of(CartDevice device) {
  constexpr std::array<std::string_view, kCartDevices> kNames = {"arm", "colour camera", "depth camera", "panel"};
  return kNames[static_cast<std::size_t>(device)];
}

/// A device is not there, or not as it must be; or it is again.
struct DeviceChanged {
  static constexpr std::uint16_t kKind = 22;
  CartDevice device = CartDevice::kArm;
  bool present = true;
  template <typename Archive>
  void fields(Archive& a) {
    a(device, present);
  }
};

/// What the machine waits for by time. The number is the timer's on the loop.
enum class MachineTimer : std::uint32_t { kState = 0, kSettle = 1, kSupervise = 2 };

struct TimerFired {
  MachineTimer timer = MachineTimer::kState;
};

/// A job is done; `result` of the kind's type is unpacked by the state that asked for it. One that failed has none.
struct JobCompleted {
  JobKind kind = JobKind::kPlan;
  std::uint32_t number = 0;
  std::span<const std::byte> result;
  std::optional<Fault> failed;
};

/// A frame together with the arm's joints at its stamp, made by the machine itself from arm reports around it.
struct ColorPosed {
  PosedFrame frame;
};
struct DepthPosed {
  PosedFrame frame;
};

using MachineEvent = std::variant<ArmReported, ColorFrameArrived, DepthFrameArrived, OperatorActed, CommandRefused,
                                  ShutdownAsked, DeviceChanged, TimerFired, JobCompleted, ColorPosed, DepthPosed>;

}  // namespace firstlook
