/// What a finished job has brought about, in one sentence: `reason` of outcome done.
#pragma once

#include <string>

#include "app/report/run_record.hpp"

namespace firstlook {

/// "camera known to 0.09 mm and 0.13 mrad (1 sigma, worst axis) from 16 views of the board; 97.1 % of the space in
/// reach known after 57 views". Reads hand_eye and mapping of the record.
[[nodiscard]] std::string done_text(const RunRecord& record);

}  // namespace firstlook
