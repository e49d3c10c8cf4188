/// What the scripted cameras have in common: frames at a fixed rate, some of them lost, the last ones held.
#pragma once

#include <cstdint>
#include <optional>
#include <set>

#include "hal/api/cameras.hpp"

namespace firstlook::mock {

/// Interface is hal::ColorCamera or hal::DepthCamera.
template <typename Interface>
class MockStream : public Interface {
 public:
  static constexpr std::uint32_t kHeld = 32;

  MockStream(const CameraIntrinsics& intrinsics, Duration period) : intrinsics_(intrinsics), period_(period) {}

  // The script.
  void lose(std::uint32_t sequence) { lost_.insert(sequence); }
  void stall_at(Instant stamp) { stall_ = stamp; }

  [[nodiscard]] const CameraIntrinsics& intrinsics() const override { return intrinsics_; }
  [[nodiscard]] std::optional<hal::Frame> poll(Instant now) override {
    std::optional<hal::Frame> newest;
    for (; stamp_of(next_) <= now && stamp_of(next_) < stall_; ++next_) {
      ++counters_.frames;
      if (lost_.contains(next_)) {
        ++counters_.lost;
      } else {
        newest = hal::Frame{stamp_of(next_), next_, next_ % kHeld};
      }
    }
    return newest;
  }
  [[nodiscard]] Instant next_due() const override {
    return stamp_of(next_) < stall_ ? stamp_of(next_) : Instant{INT64_MAX / 2};
  }
  [[nodiscard]] hal::StreamCounters counters() const override { return counters_; }

 protected:
  [[nodiscard]] bool holds(const hal::Frame& frame) const {
    return frame.sequence < next_ && frame.sequence + kHeld >= next_ && frame.slot == frame.sequence % kHeld &&
           !lost_.contains(frame.sequence);
  }
  template <typename Image>
  [[nodiscard]] bool fits(const Image& image) const {
    return image.width == intrinsics_.width && image.height == intrinsics_.height;
  }

 private:
  [[nodiscard]] Instant stamp_of(std::uint32_t sequence) const { return Instant{} + period_ * (sequence + 1); }

  CameraIntrinsics intrinsics_;
  Duration period_;
  Instant stall_{INT64_MAX / 2};
  std::set<std::uint32_t> lost_;
  std::uint32_t next_ = 0;
  hal::StreamCounters counters_;
};

}  // namespace firstlook::mock
