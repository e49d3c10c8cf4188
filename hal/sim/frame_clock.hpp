/// When a simulated camera exposes and delivers, which frames it loses, and where the arm was at each exposure.
#pragma once

#include <array>
#include <cstdint>
#include <mutex>
#include <optional>

#include "hal/api/cameras.hpp"
#include "hal/sim/true_motion.hpp"
#include "platform/core/random.hpp"

namespace firstlook::sim {

struct FrameTiming {
  Duration period = milliseconds(33);
  Instant first{};                       ///< middle of the first exposure
  Duration transfer = milliseconds(16);  ///< until a frame is delivered: one USB frame time and the driver's copy
  double drop_share = 0;
  double stall_s = 0;         ///< no frame from here on
  double freeze_s = 0;        ///< from here on the picture before
  double clock_offset_s = 0;  ///< added to the stamps
  std::uint64_t seed = 1;
  std::uint64_t drop_stream = 0;
};

/// What a frame shows, fixed at its exposure; rendered only when somebody reads it.
struct ExposedFrame {
  std::uint32_t sequence = 0;  ///< of the frame that holds it
  std::uint32_t picture = 0;   ///< number of the exposure that is shown; seeds its noise
  Instant exposed{};           ///< in true time
  JointVector true_joints_rad;
  bool used = false;
};

class FrameClock {
 public:
  static constexpr std::uint32_t kSlots = 64;

  FrameClock(const FrameTiming& timing, TrueMotion& arm) : timing_(timing), arm_(arm) {}

  /// Loop thread; frames that come between two calls are counted and skipped.
  [[nodiscard]] std::optional<hal::Frame> poll(Instant now);
  [[nodiscard]] Instant next_due() const;
  [[nodiscard]] hal::StreamCounters counters() const { return counters_; }
  /// Any thread. kFrameGone when the slot holds another frame by now.
  [[nodiscard]] Result<ExposedFrame> find(const hal::Frame& frame) const;

 private:
  [[nodiscard]] Instant exposed(std::uint32_t sequence) const { return timing_.first + timing_.period * sequence; }
  [[nodiscard]] bool stalled(std::uint32_t sequence) const { return exposed(sequence).seconds() >= timing_.stall_s; }
  [[nodiscard]] bool dropped(std::uint32_t sequence) const;
  [[nodiscard]] hal::Frame keep(std::uint32_t sequence);

  FrameTiming timing_;
  TrueMotion& arm_;
  std::uint32_t next_ = 0;
  Instant retry_{};  ///< a frame is due, but where the arm was is not known yet
  hal::StreamCounters counters_;
  ExposedFrame shown_;  ///< the last picture taken before a freeze
  mutable std::mutex mutex_;
  std::array<ExposedFrame, kSlots> slots_{};
};

}  // namespace firstlook::sim
