#include "app/shell/event_codec.hpp"

#include "platform/journal/archive.hpp"
#include "platform/loop/event.hpp"
#include "platform/loop/jobs.hpp"

namespace firstlook {
namespace {
template <typename AppEvent>
std::optional<MachineEvent> as(std::span<const std::byte> bytes) {
  AppEvent event;
  if (!unpack(bytes, event)) return std::nullopt;
  return event;
}
}  // namespace

std::optional<MachineEvent> decode_event(std::uint16_t kind, std::span<const std::byte> bytes) {
  switch (kind) {
    case kEventTimer: {
      std::uint32_t id = 0;
      if (!unpack(bytes, id)) return std::nullopt;
      return TimerFired{static_cast<MachineTimer>(id)};
    }
    case kEventJobDone: {
      ByteReader reader(bytes);
      std::uint16_t job = 0;
      std::uint32_t number = 0;
      reader(job, number);
      Fault failed = Fault::kInternal;
      bool done = false;
      reader(done);
      if (!done) reader(failed);
      if (!reader.ok() || job < static_cast<std::uint16_t>(JobKind::kLocateViews) ||
          job > static_cast<std::uint16_t>(kLastJobKind)) {
        return std::nullopt;
      }
      if (!done) return JobCompleted{static_cast<JobKind>(job), number, {}, failed};
      return JobCompleted{static_cast<JobKind>(job), number, bytes.subspan(kJobHeadBytes + 1), std::nullopt};
    }
    case ArmReported::kKind:
      return as<ArmReported>(bytes);
    case ColorFrameArrived::kKind:
      return as<ColorFrameArrived>(bytes);
    case DepthFrameArrived::kKind:
      return as<DepthFrameArrived>(bytes);
    case OperatorActed::kKind:
      return as<OperatorActed>(bytes);
    case CommandRefused::kKind:
      return as<CommandRefused>(bytes);
    case ShutdownAsked::kKind:
      return as<ShutdownAsked>(bytes);
    case DeviceChanged::kKind: {
      const auto changed = as<DeviceChanged>(bytes);
      const auto* device = changed ? std::get_if<DeviceChanged>(&*changed) : nullptr;
      const bool known = device != nullptr && static_cast<std::size_t>(device->device) < kCartDevices;
      return known ? changed : std::nullopt;
    }
    default:
      return std::nullopt;
  }
}

}  // namespace firstlook
