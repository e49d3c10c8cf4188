/// report.html and result.json of a calibration from recorded data.
#pragma once

#include <filesystem>
#include <string>

#include "app/dataset/calibration_dataset.hpp"
#include "app/report/run_record.hpp"

namespace firstlook {

/// "8 views of a board: checkerboard, 9x6 ...", or of several targets with their names.
[[nodiscard]] std::string views_text(const CalibrationDataset& data);

/// What the pages tell: verdict, hand-eye, the solvers side by side, and each view with the corners found and
/// predicted; the pictures of as many views as a page shows are read again from `folder` where they are there.
[[nodiscard]] RunRecord record_of_dataset(const std::filesystem::path& folder, const CalibrationDataset& data,
                                          const HandEyeResult& result, const HandEyeOptions& options);

/// The whole page, for a record of record_of_dataset. The same record gives the same bytes.
/// @param data  for what it says of itself: source, target, notes
[[nodiscard]] std::string dataset_report_html(const RunRecord& record, const CalibrationDataset& data);

}  // namespace firstlook
