/// The clock of a device against ours, from when its frames arrive. Pure.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>

namespace firstlook::hal {

/// A frame is delayed by a varying time, never hurried: the smallest difference seen is the best. Clocks drift, so that
/// difference is let go slowly (100 ppm are more than two quartzes differ by).
class DeviceClock {
 public:
  /// @return our time of a device's stamp, both in nanoseconds; never later than `arrived_ns`. A stamp that steps back
  /// by more than a second, or lags by more than one behind, is of a clock that began anew.
  std::int64_t ours_ns(std::int64_t device_ns, std::int64_t arrived_ns) {
    const std::int64_t difference = arrived_ns - device_ns;
    if (offset_ && (device_ns < last_device_ns_ - kBreak_ns || difference > *offset_ + kBreak_ns)) offset_.reset();
    if (offset_) *offset_ += std::max<std::int64_t>(0, arrived_ns - last_arrived_ns_) / kLeak;
    offset_ = offset_ ? std::min(*offset_, difference) : difference;
    last_device_ns_ = device_ns;
    last_arrived_ns_ = arrived_ns;
    return device_ns + *offset_;
  }

 private:
  static constexpr std::int64_t kBreak_ns = 1'000'000'000;
  static constexpr std::int64_t kLeak = 10'000;
  std::optional<std::int64_t> offset_;
  std::int64_t last_device_ns_ = 0, last_arrived_ns_ = 0;
};

}  // namespace firstlook::hal
