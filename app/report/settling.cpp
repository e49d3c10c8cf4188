#include "app/report/settling.hpp"

#include <algorithm>
#include <cmath>

namespace firstlook {

std::optional<SettlingSummary> settling_of(std::span<const CalibrationViewRecord> views) {
  SettlingSummary summary;
  double squared = 0;
  int count = 0;
  for (const CalibrationViewRecord& view : views) {
    if (!view.settling) continue;
    const SettlingRecord& s = *view.settling;
    squared += s.scatter_px * s.scatter_px;
    ++count;
    summary.moved_max_px = std::max(summary.moved_max_px, s.moved_px);
    summary.looked_again += s.looks > 1 ? 1 : 0;
    summary.looks_max = std::max(summary.looks_max, s.looks);
    summary.restless += s.still ? 0 : 1;
  }
  if (count == 0) return std::nullopt;
  summary.scatter_px = std::sqrt(squared / count);
  return summary;
}

}  // namespace firstlook
