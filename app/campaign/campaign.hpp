/// Runs the cells of a campaign that have not run yet, each in a process of its own.
#pragma once

#include <filesystem>
#include <functional>
#include <vector>

#include "app/campaign/summary.hpp"
#include "platform/linux/terminal.hpp"

namespace firstlook {

struct CampaignOptions {
  CellList list;
  Shard shard;
  std::filesystem::path folder;  ///< state files, kept runs
  int jobs = 1;                  ///< processes at once
  double cell_limit_s = 1800;    ///< a cell that takes longer is ended, and recorded as hung
  int kept_max = 20;             ///< run folders of notable cells in the folder
  bool merge = false;            ///< run nothing, put together what is there
};

/// Not done, or contacts, or entries into unknown space: the run folder is worth keeping.
[[nodiscard]] bool notable(const CellRecord& cell);

/// What a call of the campaign ends with.
struct CampaignEnd {
  CampaignCells cells;  ///< all that are finished, of earlier calls, too
  bool interrupted = false;
};

/// Goes on where an earlier call has stopped. After SIGINT or SIGTERM (catch_stop_signals) the running cells are ended
/// and nothing of them is kept.
/// Errors: as read_finished_cells and StateFile::open; kDiskWrite when the folder, or a run in it, cannot be written;
/// kOutOfMemory when no process can be started. What is finished is on the disk then, too.
[[nodiscard]] Result<CampaignEnd> run_campaign(const CampaignOptions& options, const CampaignIdentity& identity,
                                               Narrator& narrator);

}  // namespace firstlook
