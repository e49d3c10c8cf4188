/// The last lines of a job, for people.
#pragma once

#include "app/report/run_record.hpp"
#include "platform/linux/terminal.hpp"

namespace firstlook {

void narrate_result(const RunRecord& record, Narrator& narrator);

}  // namespace firstlook
