/// When each voxel became known, followed from outside while a job runs.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "hal/sim/grader.hpp"
#include "platform/core/time.hpp"

namespace firstlook::sim {

class KnownTimes {
 public:
  /// From now on this view is followed, and all is unknown; null: none is. Allocates.
  void watch(const KnownFreeView* view);
  /// Takes note of what has become known since the last call.
  void note(Instant now);
  /// When `share` (0..1) of the voxels with a mark (one byte for each voxel of the view) was known; empty: it never
  /// was. Voxels that fall back to unknown stay known here.
  [[nodiscard]] std::optional<double> time_s(std::span<const std::uint8_t> marks, double share) const;

 private:
  static constexpr float kNever_s = std::numeric_limits<float>::infinity();
  const KnownFreeView* view_ = nullptr;
  std::uint32_t revision_ = 0;
  std::vector<std::uint32_t> unknown_;  ///< voxels, ascending
  std::vector<float> since_s_;          ///< for each voxel
};

}  // namespace firstlook::sim
