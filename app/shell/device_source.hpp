/// The devices of the cart that tell of themselves, as a source of events: which one is missing, and which is back.
#pragma once

#include <utility>

#include "app/machine/events.hpp"
#include "hal/api/device_report.hpp"
#include "platform/core/fixed_vector.hpp"
#include "platform/loop/event_loop.hpp"

namespace firstlook {

struct TellingDevice {
  CartDevice device = CartDevice::kArm;
  const hal::ReportingDevice* reporter = nullptr;
};
using TellingDevices = FixedVector<TellingDevice, kCartDevices>;

/// What a device said last.
struct ToldDevice {
  CartDevice device = CartDevice::kArm;
  hal::DeviceReport report;
  bool absent = false;   ///< missing, lost or not what the configuration says
  bool changed = false;  ///< since the last news: worth a line
};

/// Asks every device twice a second. One that is starting is as it was before: it may still be answering.
class DeviceSource final : public EventSource {
 public:
  explicit DeviceSource(const TellingDevices& devices) : devices_(devices) {
    for (const TellingDevice& device : devices_) told_.push_back({device.device, {}, false, false});
  }
  [[nodiscard]] Instant next_due() const override { return devices_.empty() ? kNever : due_; }
  [[nodiscard]] Status collect(Instant now, EventQueue& queue) override;

  /// Whether somebody should hear of told(); asked once.
  [[nodiscard]] bool take_news() { return std::exchange(news_, false); }
  [[nodiscard]] const FixedVector<ToldDevice, kCartDevices>& told() const { return told_; }

 private:
  [[nodiscard]] Status take(ToldDevice& told, const hal::DeviceReport& report, Instant now, EventQueue& queue);

  TellingDevices devices_;
  FixedVector<ToldDevice, kCartDevices> told_;
  Instant due_{};
  bool news_ = false;
};

}  // namespace firstlook
