/// report.html: what a person reads after a run. One file, no network, no script needed.
#pragma once

#include <string>

#include "app/report/run_record.hpp"

namespace firstlook {

/// The whole page. Only its last section (`This machine`) depends on `record.wall`; the rest has the same bytes for the
/// same record. All text of the record is escaped. About 60 kB for each calibration view with a picture.
[[nodiscard]] std::string report_html(const RunRecord& record);

}  // namespace firstlook
