/// result.json: the figures of a run for other programs. Its schema is a contract (README of this folder).
#pragma once

#include <string>

#include "app/report/run_record.hpp"

namespace firstlook {

/// Every section is there, null when not run; keys keep their order; the same record gives the same bytes; no date and
/// no path outside `wall`. A number that is not finite becomes null. Text that is not UTF-8 is mended.
[[nodiscard]] std::string result_json(const RunRecord& record);

}  // namespace firstlook
