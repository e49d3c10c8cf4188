/// Cells of a campaign as tests need them.
#pragma once

#include "app/campaign/summary.hpp"

namespace firstlook::test {

inline CampaignIdentity sample_identity() {
  return {.first_seed = 10, .sensor = "fast", .faults = "", .program = "0.1.0-00000001", .configuration = "00000002"};
}

/// Cell `index` of that campaign, done, with this much of the observable known.
inline CellRecord sample_cell(int index, double coverage) {
  CellRecord cell;
  cell.index = index;
  cell.seed = 10 + index;
  cell.outcome = CellOutcome::kDone;
  cell.reason = "camera known";
  cell.figures.coverage_of_observable = coverage;
  cell.figures.robot_time_s = 100.5 + index;
  cell.figures.views = 40 + index;
  cell.figures.hand_eye_error_mm = 0.1 * index;
  cell.figures.false_free_voxels = 0;
  cell.figures.contacts = cell.figures.unknown_entries = cell.figures.loop_allocations = 0;
  cell.decisions_hash = "abc" + std::to_string(index);
  cell.remaining = {{"occluded", 12}, {"out of reach", 3}};
  cell.wall = {30.25, 28.5, 1e8, false};
  return cell;
}

inline CampaignCells sample_campaign(std::vector<CellRecord> finished, int cells) {
  CampaignCells campaign;
  campaign.list = {10, cells, ""};
  campaign.identity = sample_identity();
  campaign.finished = std::move(finished);
  return campaign;
}

}  // namespace firstlook::test
