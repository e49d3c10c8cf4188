/// From how a cell's process ended, and what it left behind, to its record.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "app/campaign/cell_record.hpp"
#include "platform/linux/child_process.hpp"

namespace firstlook {

/// What a process left behind.
struct CellTraces {
  ChildEnd end;
  bool at_limit = false;                   ///< the campaign ended it
  double limit_s = 0;                      ///< for the reason's text
  std::optional<std::string> result_json;  ///< empty: the file is not there
  std::string console;                     ///< what it printed, or the last part of that
};

/// Outcome, reason and figures; index, seed and wall are the caller's. Figures are taken only of a process that ended
/// by itself and agrees with its own result.json: what is half written counts as nothing. Error: kDiskWrite when the
/// run could not write its files. That tells nothing of the cell.
[[nodiscard]] Result<CellRecord> judge_cell(const CellTraces& traces, std::int64_t seed);

}  // namespace firstlook
