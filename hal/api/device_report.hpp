/// What a device says of itself: whether it works, its figures, and what to do when it does not.
#pragma once

#include <cstdint>
#include <string_view>

#include "platform/core/fixed_text.hpp"
#include "platform/core/fixed_vector.hpp"
#include "platform/core/result.hpp"
#include "platform/core/time.hpp"

namespace firstlook::hal {

enum class DeviceState : std::uint8_t {
  kReady,
  kStarting,    ///< was asked for and has not answered yet; nothing is wrong so far
  kMissing,     ///< never answered
  kUnsuitable,  ///< answered, and is not what the configuration says
  kLost,        ///< worked, and does no longer
};

[[nodiscard]] constexpr std::string_view name_of(DeviceState state) {
  constexpr std::string_view kNames[] = {"ready", "starting", "missing", "unsuitable", "lost"};
  return kNames[static_cast<std::size_t>(state)];
}

struct DeviceNumber {
  std::string_view name;  ///< of a literal; its unit last: "rate_hz"
  double value = 0;
};

/// Never allocates.
struct DeviceReport {
  DeviceState state = DeviceState::kStarting;
  FixedText<96> device;   ///< which one: "can0 node 10"
  FixedText<232> detail;  ///< what it is, or what is wrong
  FixedText<232> remedy;  ///< what to do; empty when nothing is
  FixedVector<DeviceNumber, 20> numbers;

  void add(std::string_view name, double value) { numbers.push_back({name, value}); }
};

/// A device that can tell. Loop thread; never blocks, never allocates.
class ReportingDevice {
 public:
  virtual ~ReportingDevice() = default;
  [[nodiscard]] virtual DeviceReport report(Instant now) const = 0;
};

}  // namespace firstlook::hal
