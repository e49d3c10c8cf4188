/// Decisions as bytes: every decision is packed and handed to a log before it is carried out, so that the record and
/// what happened cannot differ. A replay hands the same bytes to a log that compares.
#pragma once

#include "app/machine/decisions.hpp"
#include "app/machine/state_table.hpp"
#include "platform/journal/archive.hpp"

namespace firstlook {

enum class DecisionKind : std::uint16_t {
  kStateEntered = 1,
  kMoveArm,
  kStopArm,
  kStartJob,
  kSetTimer,
  kCancelTimer,
  kShow,
  kLight,
  kForgetKnownFree,
  kStopRecorded,
  kFinished,
};

class DecisionLog {
 public:
  virtual ~DecisionLog() = default;
  virtual void decision(DecisionKind kind, Instant now, std::span<const std::byte> bytes) = 0;
};

/// Packs each decision for the log, then passes it on; `next` may be null.
class LoggedDecisions final : public DecisionSink {
 public:
  LoggedDecisions(DecisionLog& log, DecisionSink* next) : log_(log), next_(next) {}

  void state_entered(Instant now, StateId state) override {
    record(DecisionKind::kStateEntered, now, state);
    if (next_ != nullptr) next_->state_entered(now, state);
  }
  void move_arm(Instant now, const hal::Segment& segment) override {
    record(DecisionKind::kMoveArm, now, segment.number, segment.target_rad, segment.speed_rad_s,
           segment.acceleration_rad_s2);
    if (next_ != nullptr) next_->move_arm(now, segment);
  }
  void stop_arm(Instant now) override {
    record(DecisionKind::kStopArm, now);
    if (next_ != nullptr) next_->stop_arm(now);
  }
  void start_job(Instant now, JobKind kind, std::uint32_t number, std::span<const std::byte> arguments) override {
    ByteWriter writer(bytes_);
    writer(kind, number);
    writer.raw(arguments.data(), arguments.size());
    log_.decision(DecisionKind::kStartJob, now, {bytes_.data(), writer.size()});
    if (next_ != nullptr) next_->start_job(now, kind, number, arguments);
  }
  void set_timer(Instant now, MachineTimer timer, Instant due) override {
    record(DecisionKind::kSetTimer, now, timer, due);
    if (next_ != nullptr) next_->set_timer(now, timer, due);
  }
  void cancel_timer(Instant now, MachineTimer timer) override {
    record(DecisionKind::kCancelTimer, now, timer);
    if (next_ != nullptr) next_->cancel_timer(now, timer);
  }
  void show(Instant now, std::string_view line) override {
    log_.decision(DecisionKind::kShow, now, std::as_bytes(std::span(line.data(), line.size())));
    if (next_ != nullptr) next_->show(now, line);
  }
  void light(Instant now, hal::Light light) override {
    record(DecisionKind::kLight, now, light);
    if (next_ != nullptr) next_->light(now, light);
  }
  void forget_known_free(Instant now) override {
    record(DecisionKind::kForgetKnownFree, now);
    if (next_ != nullptr) next_->forget_known_free(now);
  }
  void stop_recorded(Instant now, Fault cause) override {
    record(DecisionKind::kStopRecorded, now, cause);
    if (next_ != nullptr) next_->stop_recorded(now, cause);
  }
  void finished(Instant now, const Ending& ending) override {
    record(DecisionKind::kFinished, now, ending.outcome, ending.has_fault, ending.fault);
    if (next_ != nullptr) next_->finished(now, ending);
  }

 private:
  template <typename... Fields>
  void record(DecisionKind kind, Instant now, const Fields&... fields) {
    ByteWriter writer(bytes_);
    writer(fields...);
    ENSURE(7211, writer.ok());
    log_.decision(kind, now, {bytes_.data(), writer.size()});
  }

  DecisionLog& log_;
  DecisionSink* next_;
  std::array<std::byte, 8192 + 64> bytes_{};
};

}  // namespace firstlook
