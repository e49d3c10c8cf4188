/// How the picture came to rest at the stops of a calibration, summed up.
#pragma once

#include <optional>
#include <span>

#include "app/report/run_record.hpp"

namespace firstlook {

struct SettlingSummary {
  double scatter_px = 0;    ///< RMS over the views
  double moved_max_px = 0;  ///< in the looks that were used
  int looked_again = 0;     ///< stops whose first look showed a picture that moved
  int looks_max = 1;        ///< at one stop
  int restless = 0;         ///< stops at which it never stood still
};

/// Empty for recorded data.
[[nodiscard]] std::optional<SettlingSummary> settling_of(std::span<const CalibrationViewRecord> views);

}  // namespace firstlook
