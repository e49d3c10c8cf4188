#include "app/campaign/cell_record.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

namespace firstlook {
namespace {

using Json = nlohmann::ordered_json;

std::optional<double> number_at(const Json& json, std::string_view path) {
  const Json::json_pointer pointer{std::string(path)};
  if (!json.contains(pointer) || !json.at(pointer).is_number()) return std::nullopt;
  return json.at(pointer).get<double>();
}

std::string text_at(const Json& json, const char* key) {
  return json.contains(key) && json.at(key).is_string() ? json.at(key).get<std::string>() : std::string();
}

std::optional<double> last_phase_end_s(const Json& result) {
  const Json::json_pointer phases("/phases");
  if (!result.contains(phases) || !result.at(phases).is_array() || result.at(phases).empty()) return std::nullopt;
  return number_at(result.at(phases).back(), "/end_s");
}

std::vector<std::pair<std::string, std::uint64_t>> remaining_by_reason(const Json& result) {
  std::map<std::string, std::uint64_t> voxels;
  const Json::json_pointer remaining("/mapping/remaining");
  if (result.contains(remaining) && result.at(remaining).is_array()) {
    for (const Json& cluster : result.at(remaining)) {
      voxels[text_at(cluster, "reason")] += static_cast<std::uint64_t>(number_at(cluster, "/voxels").value_or(0));
    }
  }
  return {voxels.begin(), voxels.end()};
}

/// A whole number stays one in the file.
Json number_json(const std::optional<double>& value) {
  if (!value) return nullptr;
  const auto whole = static_cast<std::int64_t>(*value);
  return static_cast<double>(whole) == *value ? Json(whole) : Json(*value);
}

template <typename Columns>
Json figures_json(const CellFigures& figures, const Columns& columns) {
  Json json = Json::object();
  for (const FigureColumn& column : columns) json[std::string(column.name)] = number_json(figures.*column.value);
  return json;
}

template <typename Columns>
void read_figures(const Json& json, const Columns& columns, CellFigures& figures) {
  for (const FigureColumn& column : columns) figures.*column.value = number_at(json, fmt::format("/{}", column.name));
}

bool is_whole_number(const Json& json, const char* key) {
  return json.contains(key) && json.at(key).is_number_integer();
}

}  // namespace

std::optional<CellOutcome> find_cell_outcome(std::string_view name) {
  const auto found = std::ranges::find(kCellOutcomeNames, name);
  if (found == kCellOutcomeNames.end()) return std::nullopt;
  return static_cast<CellOutcome>(found - kCellOutcomeNames.begin());
}

Result<CellResult> read_cell_result(std::string_view result_json) {
  const Json json = Json::parse(result_json, nullptr, false);
  if (!json.is_object()) return failure(Fault::kDataMalformed, "result.json is no JSON object");
  const auto outcome = find_cell_outcome(text_at(json, "outcome"));
  if (!outcome || *outcome > CellOutcome::kFaulted || !is_whole_number(json, "seed")) {
    return failure(Fault::kDataMalformed, "result.json has no outcome or no seed of a run");
  }
  CellResult result;
  result.outcome = *outcome;
  result.seed = json["seed"].get<std::int64_t>();
  result.reason = text_at(json, "reason");
  result.decisions_hash = text_at(json, "decisions_hash");
  for (const FigureColumn& column : kFigureColumns) {
    if (!column.path.empty()) result.figures.*column.value = number_at(json, column.path);
  }
  for (const FigureColumn& column : kCountColumns) result.figures.*column.value = number_at(json, column.path);
  result.figures.robot_time_s = last_phase_end_s(json);
  result.remaining = remaining_by_reason(json);
  return result;
}

std::string cell_line(const CellRecord& cell) {
  Json remaining = Json::object();
  for (const auto& [reason, voxels] : cell.remaining) remaining[reason] = voxels;
  const Json json = {{"index", cell.index},
                     {"seed", cell.seed},
                     {"outcome", name_of(cell.outcome)},
                     {"reason", cell.reason},
                     {"counts", figures_json(cell.figures, kCountColumns)},
                     {"figures", figures_json(cell.figures, kFigureColumns)},
                     {"remaining", remaining},
                     {"decisions_hash", cell.decisions_hash},
                     {"wall",
                      {{"total_s", cell.wall.total_s},
                       {"processor_s", cell.wall.processor_s},
                       {"peak_resident_bytes", number_json(cell.wall.peak_resident_bytes)},
                       {"kept", cell.wall.kept}}}};
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

Result<CellRecord> parse_cell_line(std::string_view line) {
  const Json json = Json::parse(line, nullptr, false);
  const auto wrong = [] { return failure(Fault::kDataMalformed, "not the line of a cell"); };
  if (!json.is_object() || !is_whole_number(json, "index") || !is_whole_number(json, "seed")) return wrong();
  for (const char* key : {"counts", "figures", "remaining", "wall"}) {
    if (!json.contains(key) || !json.at(key).is_object()) return wrong();
  }
  const auto outcome = find_cell_outcome(text_at(json, "outcome"));
  if (!outcome) return wrong();
  CellRecord cell;
  cell.index = json["index"].get<int>();
  cell.seed = json["seed"].get<std::int64_t>();
  cell.outcome = *outcome;
  cell.reason = text_at(json, "reason");
  cell.decisions_hash = text_at(json, "decisions_hash");
  read_figures(json["counts"], kCountColumns, cell.figures);
  read_figures(json["figures"], kFigureColumns, cell.figures);
  const Json& remaining = json["remaining"];
  for (const auto& [reason, voxels] : remaining.items()) {
    if (!voxels.is_number_unsigned()) return wrong();
    cell.remaining.emplace_back(reason, voxels.get<std::uint64_t>());
  }
  const Json& wall = json["wall"];
  cell.wall.total_s = number_at(wall, "/total_s").value_or(0);
  cell.wall.processor_s = number_at(wall, "/processor_s").value_or(0);
  cell.wall.peak_resident_bytes = number_at(wall, "/peak_resident_bytes").value_or(0);
  cell.wall.kept = wall.contains("kept") && wall.at("kept") == true;
  return cell;
}

}  // namespace firstlook
