/// The calibration's views as a dataset that `firstlook calibrate` and other tools read.
#pragma once

#include <string>

#include "app/config/config.hpp"
#include "app/report/run_record.hpp"
#include "platform/core/result.hpp"

namespace firstlook {

/// Writes board.yaml, poses.csv, camera_info.yaml and images/ (or corners.csv where there were no pictures).
/// Error: kDiskWrite.
[[nodiscard]] Status write_calibration_recording(const std::string& folder, const RunRecord& record,
                                                 const Config& config);

}  // namespace firstlook
