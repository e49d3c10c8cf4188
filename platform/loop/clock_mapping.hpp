/// From the clock of another computer to ours.
#pragma once

#include <algorithm>
#include <optional>

#include "platform/core/time.hpp"

namespace firstlook {

/// What was measured at some time over there arrives a little later here, now less, now more late. The least
/// delay of the last seconds is the way through the network at its best; what is left of it makes stamps late by some
/// tenths of a millisecond. Two windows that follow each other, so that the clocks may drift.
class ClockMapping {
 public:
  static constexpr Duration kWindow{4'000'000'000};
  /// A leap of this much is another clock: the other computer was switched off in between.
  static constexpr Duration kLeap = milliseconds(500);

  /// When that was on our clock: never after `arrived`, and later at each call unless the clock leapt.
  [[nodiscard]] Instant to_ours(double there_s, Instant arrived) {
    const Duration offset = arrived - Instant{seconds(there_s).ns};
    const bool leapt = least_ && (least_->ns - offset.ns > kLeap.ns || offset.ns - least_->ns > kLateMax.ns);
    if (!least_ || leapt || arrived < window_from_) restart(offset, arrived);
    if (arrived - window_from_ > kWindow) {
      before_ = current_;
      current_ = offset;
      window_from_ = arrived;
    }
    current_ = std::min(current_, offset);
    least_ = std::min(current_, before_);
    const Instant mapped = Instant{seconds(there_s).ns} + *least_;
    last_ = std::max(mapped, last_ + Duration{1});
    return std::min(last_, arrived);
  }

 private:
  static constexpr Duration kLateMax{10'000'000'000};  ///< no report is under way for so long

  void restart(Duration offset, Instant arrived) {
    current_ = before_ = offset;
    least_ = offset;
    window_from_ = arrived;
    last_ = {-1};
  }

  std::optional<Duration> least_;
  Duration current_{}, before_{};
  Instant window_from_{}, last_{-1};
};

}  // namespace firstlook
