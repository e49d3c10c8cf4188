/// A run record as a real job would leave it, made from a seed: for tests of what is written about a run.
#pragma once

#include "app/report/run_record.hpp"

namespace firstlook {

/// Sixteen calibration views with pictures of a board, 24 views of a map, three clusters that stay unknown, one stop.
[[nodiscard]] RunRecord sample_record();

}  // namespace firstlook
