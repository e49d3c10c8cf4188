#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "app/campaign/summary.hpp"

namespace firstlook {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kSchema = 1;
constexpr std::size_t kWorstListed = 10;
constexpr std::size_t kSeedsListed = 10;

Json or_null(const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); }

Json distribution_json(const std::optional<Distribution>& d) {
  if (!d) return nullptr;
  return {{"cells", d->cells}, {"min", d->min}, {"p5", d->p5},    {"median", d->median},
          {"p95", d->p95},     {"max", d->max}, {"mean", d->mean}};
}

Json campaign_json(const CampaignCells& cells) {
  return {{"first_seed", cells.list.first_seed},
          {"cells", cells.list.cells},
          {"shard", cells.shard.whole() ? Json(nullptr) : Json(cells.shard.text())},
          {"sensor", cells.identity.sensor},
          {"faults", cells.identity.faults},
          {"program", cells.identity.program},
          {"configuration", cells.identity.configuration}};
}

Json outcomes_json(const CampaignCells& cells) {
  Json json = Json::object();
  for (std::size_t i = 0; i < kCellOutcomeNames.size(); ++i) {
    json[std::string(kCellOutcomeNames[i])] = count_of(cells.finished, static_cast<CellOutcome>(i));
  }
  return json;
}

/// "E2005" of "E2005 no board seen ...", so that details do not split a group; else the whole.
std::string reason_key(const std::string& reason) {
  const bool code = reason.size() >= 5 && reason[0] == 'E' &&
                    std::all_of(reason.begin() + 1, reason.begin() + 5, [](char c) { return c >= '0' && c <= '9'; });
  return code ? reason.substr(0, 5) : reason;
}

/// Of cells that are not done: how many for which reason.
Json reasons_json(const CampaignCells& cells) {
  std::map<std::pair<CellOutcome, std::string>, std::vector<const CellRecord*>> groups;
  for (const CellRecord& cell : cells.finished) {
    if (cell.outcome != CellOutcome::kDone) groups[{cell.outcome, reason_key(cell.reason)}].push_back(&cell);
  }
  Json json = Json::array();
  for (const auto& [key, members] : groups) {
    Json seeds = Json::array();
    for (std::size_t i = 0; i < std::min(kSeedsListed, members.size()); ++i) seeds.push_back(members[i]->seed);
    json.push_back({{"outcome", name_of(key.first)},
                    {"reason", members.front()->reason},
                    {"cells", members.size()},
                    {"seeds", seeds},
                    {"command", run_command(members.front()->seed, cells.list.faults)}});
  }
  return json;
}

Json safety_json(const CampaignCells& cells) {
  Json graded =
      std::ranges::count_if(cells.finished, [](const CellRecord& c) { return c.figures.contacts.has_value(); });
  Json touched = Json::array();
  for (const CellRecord& cell : cells.finished) {
    if (!cell.touched()) continue;
    touched.push_back({{"seed", cell.seed},
                       {"contacts", or_null(cell.figures.contacts)},
                       {"unknown_entries", or_null(cell.figures.unknown_entries)},
                       {"command", run_command(cell.seed, cells.list.faults)}});
  }
  return {{"cells_graded", graded},
          {"contacts", total(cells.finished, &CellFigures::contacts)},
          {"unknown_entries", total(cells.finished, &CellFigures::unknown_entries)},
          {"false_free_voxels", total(cells.finished, &CellFigures::false_free_voxels)},
          {"loop_allocations_after_seal", total(cells.finished, &CellFigures::loop_allocations)},
          {"cells_with_contacts_or_entries", touched}};
}

Json reached_json(const CampaignCells& cells, double coverage) {
  const std::size_t count = count_with_coverage(cells.finished, coverage);
  const Json share = cells.finished.empty()
                         ? Json(nullptr)
                         : Json(static_cast<double>(count) / static_cast<double>(cells.finished.size()));
  return {{"cells", count}, {"share", share}};
}

Json below_json(const CampaignCells& cells, double coverage) {
  Json below = Json::array();
  for (const CellRecord& cell : cells.finished) {
    if (cell.figures.coverage_of_observable.value_or(-1) >= coverage) continue;
    Json remaining = Json::object();
    for (const auto& [reason, voxels] : cell.remaining) remaining[reason] = voxels;
    below.push_back({{"seed", cell.seed},
                     {"coverage_of_observable", or_null(cell.figures.coverage_of_observable)},
                     {"outcome", name_of(cell.outcome)},
                     {"reason", cell.reason},
                     {"remaining", remaining},
                     {"command", run_command(cell.seed, cells.list.faults)}});
  }
  return below;
}

Json worst_json(const CampaignCells& cells) {
  Json json = Json::object();
  for (const FigureColumn& column : kFigureColumns) {
    if (column.worst == Worst::kNotAsked) continue;
    Json list = Json::array();
    for (const CellRecord* cell : worst_cells(cells.finished, column, kWorstListed)) {
      list.push_back({{"seed", cell->seed},
                      {"value", or_null(cell->figures.*column.value)},
                      {"outcome", name_of(cell->outcome)},
                      {"command", run_command(cell->seed, cells.list.faults)}});
    }
    json[std::string(column.name)] = list;
  }
  return json;
}

Json rate_json(const CampaignCells& cells) {
  const CellRates rates = rates_per_minute(cells.finished);
  return {{"by_clock", or_null(rates.by_clock)}, {"by_processor_time", or_null(rates.by_processor_time)}};
}

Json wall_json(const CampaignCells& cells) {
  Json kept = Json::array();
  for (const CellRecord& cell : cells.finished) {
    if (cell.wall.kept) kept.push_back(cell.seed);
  }
  const auto of = [&](double CellWall::* value) { return distribution_json(distribution_of(cells.finished, value)); };
  return {{"cell_s", of(&CellWall::total_s)},
          {"cell_processor_s", of(&CellWall::processor_s)},
          {"peak_resident_bytes", of(&CellWall::peak_resident_bytes)},
          {"cells_per_minute_per_core", rate_json(cells)},
          {"kept_seeds", kept}};
}

}  // namespace

std::string summary_json(const CampaignCells& cells) {
  Json json;
  json["schema"] = kSchema;
  json["campaign"] = campaign_json(cells);
  json["cells"] = {{"asked", cells.asked()},
                   {"finished", cells.finished.size()},
                   {"missing", cells.missing()},
                   {"broken", cells.broken()}};
  json["outcomes"] = outcomes_json(cells);
  json["reasons"] = reasons_json(cells);
  json["safety"] = safety_json(cells);
  json["coverage"] = {{"at_least_0_99", reached_json(cells, 0.99)},
                      {"at_least_0_95", reached_json(cells, 0.95)},
                      {"below_0_99", below_json(cells, 0.99)}};
  for (const FigureColumn& column : kFigureColumns) {
    json["figures"][std::string(column.name)] = distribution_json(distribution_of(cells.finished, column.value));
  }
  json["worst"] = worst_json(cells);
  json["wall"] = wall_json(cells);
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace firstlook
