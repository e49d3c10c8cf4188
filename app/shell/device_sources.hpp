/// The devices as sources of events on the loop: what they report is stamped, packed and queued.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <optional>

#include "app/jobs/published_space.hpp"
#include "app/machine/events.hpp"
#include "platform/journal/archive.hpp"
#include "platform/loop/event_loop.hpp"

namespace firstlook {

/// Packs an event of the application into the queue.
template <typename AppEvent>
[[nodiscard]] Status push_event(EventQueue& queue, Instant now, const AppEvent& event) {
  std::array<std::byte, 512> bytes;
  const std::size_t size = pack(event, std::span<std::byte>(bytes));
  ENSURE(7201, size > 0);
  return queue.push(now, AppEvent::kKind, std::span<const std::byte>(bytes.data(), size));
}

/// The arm's reports, each with the guardian's finding. Remembers how near the moving body came to what was not free,
/// before there was a map and with it.
class ArmSource final : public EventSource {
 public:
  ArmSource(hal::RobotArm& device, const ArmModel& model, const PublishedSpace& space)
      : device_(device), model_(model), space_(space) {}
  [[nodiscard]] Instant next_due() const override { return device_.next_due(); }
  [[nodiscard]] Status collect(Instant now, EventQueue& queue) override {
    while (queue.free_slots() > kReserved) {
      const auto state = device_.poll(now);
      if (!state) break;
      const GuardianVerdict& verdict = judge(state->position_rad);
      if (state->moving) {
        double& least_m = space_.mapped() ? least_mapping_m_ : least_calibrating_m_;
        least_m = std::min(least_m, verdict.distance_m);
      }
      if (const Status s = push_event(queue, now, ArmReported{*state, verdict.margin_m}); !s) return s;
    }
    return {};
  }

  /// Infinite when the arm did not move.
  [[nodiscard]] double least_distance_calibrating_m() const { return least_calibrating_m_; }
  [[nodiscard]] double least_distance_mapping_m() const { return least_mapping_m_; }

 private:
  /// The guardian's finding. An arm that stands still in a space that does not change needs no second one.
  const GuardianVerdict& judge(const JointVector& at_rad) {
    if (!judged_ || judged_->revision != space_.revision() || !(judged_->at_rad == at_rad)) {
      judged_ = Judged{at_rad, space_.revision(), space_.judge(model_, at_rad)};
    }
    return judged_->verdict;
  }

  struct Judged {
    JointVector at_rad;
    std::uint32_t revision = 0;  ///< of the published space
    GuardianVerdict verdict;
  };
  static constexpr std::size_t kReserved = 16;  // slots for the other sources of a turn
  std::optional<Judged> judged_;
  double least_calibrating_m_ = std::numeric_limits<double>::infinity();
  double least_mapping_m_ = std::numeric_limits<double>::infinity();
  hal::RobotArm& device_;
  const ArmModel& model_;
  const PublishedSpace& space_;
};

/// The frames of one camera, as handles.
template <typename FrameEvent>
class FrameSource final : public EventSource {
 public:
  explicit FrameSource(hal::FrameStream& device) : device_(device) {}
  [[nodiscard]] Instant next_due() const override { return device_.next_due(); }
  [[nodiscard]] Status collect(Instant now, EventQueue& queue) override {
    const auto frame = device_.poll(now);
    return frame ? push_event(queue, now, FrameEvent{*frame}) : Status{};
  }

 private:
  hal::FrameStream& device_;
};

/// Keys of the pendant or buttons of the panel.
template <typename Device>
class OperatorSource final : public EventSource {
 public:
  OperatorSource(Device& device, OperatorDevice which) : device_(device), which_(which) {}
  [[nodiscard]] Instant next_due() const override { return device_.next_due(); }
  [[nodiscard]] Status collect(Instant now, EventQueue& queue) override {
    const auto event = device_.poll(now);
    return event ? push_event(queue, now, OperatorActed{which_, event->action}) : Status{};
  }

 private:
  Device& device_;
  OperatorDevice which_;
};

/// What comes from the program's own surroundings: commands that the arm refused, and signals that ask it to end.
class HostSource final : public EventSource {
 public:
  void refused(Fault fault) { refused_ = fault; }
  [[nodiscard]] Instant next_due() const override { return refused_ || shutdown_ ? Instant{} : kNever; }
  /// Asks for a shutdown once, at the next turn; the first cause counts.
  void ask_shutdown(Fault cause) {
    if (shutdown_ || shutdown_sent_) return;
    shutdown_ = true;
    cause_ = cause;
  }
  [[nodiscard]] Status collect(Instant now, EventQueue& queue) override {
    if (refused_) {
      const Fault fault = *refused_;
      refused_.reset();
      if (const Status s = push_event(queue, now, CommandRefused{fault}); !s) return s;
    }
    if (shutdown_) {
      shutdown_ = false;
      shutdown_sent_ = true;
      return push_event(queue, now, ShutdownAsked{cause_});
    }
    return {};
  }

 private:
  std::optional<Fault> refused_;
  Fault cause_ = Fault::kProgramStopped;
  bool shutdown_ = false;
  bool shutdown_sent_ = false;
};

}  // namespace firstlook
