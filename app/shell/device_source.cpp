#include "app/shell/device_source.hpp"

#include "app/shell/device_sources.hpp"

namespace firstlook {
namespace {
constexpr Duration kEvery = milliseconds(500);
}

Status DeviceSource::collect(Instant now, EventQueue& queue) {
  if (devices_.empty() || now < due_) return {};
  due_ = now + kEvery;
  for (ToldDevice& told : told_) told.changed = told.changed && news_;
  for (std::size_t i = 0; i < devices_.size(); ++i) {
    if (const Status taken = take(told_[i], devices_[i].reporter->report(now), now, queue); !taken) return taken;
  }
  return {};
}

Status DeviceSource::take(ToldDevice& told, const hal::DeviceReport& report, Instant now, EventQueue& queue) {
  using hal::DeviceState;
  const bool absent = report.state == DeviceState::kStarting ? told.absent : report.state != DeviceState::kReady;
  const bool turned = absent != told.absent;
  if (turned) {
    if (const Status pushed = push_event(queue, now, DeviceChanged{told.device, !absent}); !pushed) return pushed;
  }
  const bool otherwise = absent && (report.state != told.report.state || report.remedy != told.report.remedy);
  news_ = news_ || turned || otherwise || (absent && report.detail != told.report.detail);
  told.changed = told.changed || turned || (otherwise && report.state != DeviceState::kStarting);
  told.absent = absent;
  told.report = report;
  return {};
}

}  // namespace firstlook
