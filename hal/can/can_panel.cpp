#include "hal/can/can_panel.hpp"

#include <algorithm>

namespace firstlook::can {
namespace {

constexpr Duration kTurn = milliseconds(5);       // finer than any debouncing
constexpr Duration kQuietTurn = milliseconds(8);  // while nothing bounces: 12 turns to a heartbeat

std::uint64_t bit(int number) { return number < 0 ? 0 : std::uint64_t{1} << number; }

RemoteIoOptions with_fault_outputs(const CanPanelOptions& options) {
  RemoteIoOptions io = options.io;
  io.fault_outputs = output_bits(options.wiring, hal::Light::kRed, false);
  return io;
}

}  // namespace

std::uint64_t output_bits(const PanelWiring& wiring, hal::Light light, bool buzzing) {
  const std::uint64_t buzzer = buzzing ? bit(wiring.buzzer) : 0;
  switch (light) {
    case hal::Light::kOff:
      return buzzer;
    case hal::Light::kGreen:
      return buzzer | bit(wiring.green);
    case hal::Light::kAmber:
      return buzzer | bit(wiring.amber);
    case hal::Light::kRed:
      return buzzer | bit(wiring.red);
  }
  return buzzer;
}

std::optional<Instant> Debouncer::pressed(Instant now) {
  if (level_ == settled_ || now - since_ < settle_) return {};
  settled_ = level_;
  return settled_ ? std::optional(since_) : std::nullopt;
}

CanPanel::CanPanel(SystemCalls& system, const CanPanelOptions& options)
    : options_(options),
      io_(system, with_fault_outputs(options)),
      start_(options.debounce),
      confirm_(options.debounce) {}

void CanPanel::press(Instant stamp, hal::OperatorAction action) {
  if (!events_.full()) {
    events_.push_back({stamp, action});
    return;
  }
  ++events_lost_;
  // Nobody took sixteen presses. What stops is not the one to be lost.
  const bool stops = action == hal::OperatorAction::kStop || action == hal::OperatorAction::kLost;
  if (stops) events_.back() = {stamp, action};
}

void CanPanel::take(const InputReport& report) {
  const auto level = [&](int number) { return (report.bits & bit(number)) != 0; };
  const bool stop = options_.wiring.stop >= 0 && level(options_.wiring.stop) != options_.wiring.stop_opens;
  if (report.first) {
    start_.start(level(options_.wiring.start));
    confirm_.start(level(options_.wiring.confirm));
    stop_ = false;
  }
  if (stop && !stop_) {
    press(report.stamp, hal::OperatorAction::kStop);
    // Whoever presses stop does not mean a start that is still bouncing.
    start_.start(level(options_.wiring.start));
  }
  stop_ = stop;
  enabling_ = level(options_.wiring.enabling);
  start_.change(level(options_.wiring.start), report.stamp);
  confirm_.change(level(options_.wiring.confirm), report.stamp);
}

void CanPanel::settle_buttons(Instant now) {
  if (const auto begin = start_.pressed(now); begin && !stop_) press(*begin, hal::OperatorAction::kPlay);
  if (const auto begin = confirm_.pressed(now)) press(*begin, hal::OperatorAction::kConfirm);
}

void CanPanel::show(Instant now) {
  if (buzz_asked_) {
    buzz_asked_ = false;
    buzz_until_ = now + options_.buzz;
  }
  const std::uint64_t bits = output_bits(options_.wiring, light_, now < buzz_until_);
  if (shown_once_ && bits == shown_) return;
  shown_once_ = true;
  shown_ = bits;
  io_.set_outputs(bits, now);
}

std::optional<hal::OperatorEvent> CanPanel::poll(Instant now) {
  last_turn_ = now;
  show(now);
  io_.turn(now);
  for (const InputReport& report : io_.inputs()) {
    take(report);
    settle_buttons(report.stamp);
  }
  if (io_.take_loss()) {
    enabling_ = false;
    press(now, hal::OperatorAction::kLost);
  }
  if (io_.operational()) settle_buttons(now);
  if (events_.empty()) return {};
  const hal::OperatorEvent event = events_.front();
  std::shift_left(events_.begin(), events_.end(), 1);
  events_.pop_back();
  return event;
}

Instant CanPanel::next_due() const {
  if (!events_.empty()) return last_turn_;
  const bool quiet = io_.operational() && !start_.bouncing() && !confirm_.bouncing();
  return last_turn_ + (quiet ? kQuietTurn : kTurn);
}

void CanPanel::light(hal::Light light) {
  if (light == hal::Light::kRed && light_ != light) buzz_asked_ = true;
  light_ = light;
}

}  // namespace firstlook::can
