/// `firstlook campaign`: the job in many random cells.
#pragma once

#include <cstdint>
#include <string>

namespace firstlook {

struct CampaignCommandOptions {
  int cells = 0;
  std::int64_t first_seed = 1;
  int jobs = 0;        ///< 0: one for each usable processor
  std::string shard;   ///< "I/N"; empty: all
  std::string faults;  ///< that the simulated cell takes; empty: none
  std::string json;    ///< empty: summary.json in the folder; "-": stdout
  std::string out;     ///< empty: campaigns/seed-S
  double cell_limit_s = 1800;
  int kept_max = 20;
  bool merge = false;
};

/// Runs what is not finished, writes the summary, and prints its table on stdout (on stderr when the summary goes
/// there).
/// @return the process's exit code: 0; 2; 3 for data, disk or missing cells; 6 after a stop signal; 70 when a cell
/// broke a rule or its process
int run_campaign_command(const CampaignCommandOptions& options);

}  // namespace firstlook
