#include "app/shell/job_settings.hpp"

#include <algorithm>
#include <array>

#include "algorithms/calibration/touched_board.hpp"
#include "algorithms/mapping/map_planes.hpp"
#include "app/config/board_config.hpp"
#include "app/config/load_config.hpp"

namespace firstlook {
namespace {
constexpr std::string_view kScopeLine = "# only: ";
constexpr std::array<std::pair<RunScope, std::string_view>, 4> kScopes = {{{RunScope::kEverything, "everything"},
                                                                           {RunScope::kCalibrate, "calibrate"},
                                                                           {RunScope::kMap, "map"},
                                                                           {RunScope::kVerify, "verify"}}};
}  // namespace

std::string_view name_of(RunScope scope) { return kScopes[static_cast<std::size_t>(scope)].second; }

std::optional<RunScope> find_scope(std::string_view name) {
  for (const auto& [scope, text] : kScopes) {
    if (text == name) return scope;
  }
  return std::nullopt;
}

namespace {
/// Of several boards the first is touched.
void set_touch_test(const Config& config, MachineSettings& s) {
  const auto targets = targets_of(config);
  if (config.calibration.touch_test != "yes" || !targets) return;
  const BoardSpec& board = targets->front().board;
  for (const int point : corners_to_touch(board, config.calibration.touch_corners)) s.touch_points.push_back(point);
  s.touch_columns = board.has_marker_corners() ? 0 : board.inner_columns;
}
}  // namespace

MachineSettings machine_settings(const Config& config, RunScope scope) {
  MachineSettings s;
  s.scope = scope;
  s.start_source = config.start_source == "panel" ? StartSource::kPanel : StartSource::kPendant;
  s.settle_time_s = config.calibration.settle_time_s;
  s.frames_per_view = config.calibration.frames_per_view;
  s.targets = std::max(1, static_cast<int>(config.boards.size()));
  s.calibration_views_min = config.calibration.views_min;
  s.calibration_views_max = config.calibration.views_max;
  s.verify_views = config.calibration.verify_views;
  s.see_on_the_way = config.calibration.time_offset == "estimate";
  s.depth_beside = config.calibration.depth == "estimate";
  s.color_at_looks = planes_from_words(config.map.planes).value_or(PlaneChoice{}).color;
  s.explore_views_max = config.explore.views_max;
  // The thesis's sensor was off while the arm moved and a map was loaded.
  s.frames_while_moving_hz = config.explore.views == "thesis2014" ? 0 : config.explore.frames_while_moving_hz;
  set_touch_test(config, s);
  if (config.parking_rad) s.parking_rad = *config.parking_rad;
  return s;
}

std::string journal_config(const Config& config, RunScope scope) {
  return std::string(kScopeLine) + std::string(name_of(scope)) + "\n" + print_config(config);
}

Result<MachineSettings> settings_from_journal(const std::string& text) {
  const auto end = text.find('\n');
  if (!text.starts_with(kScopeLine) || end == std::string::npos) {
    return failure(Fault::kJournalBroken, "the header does not name what was run");
  }
  const auto scope = find_scope(std::string_view(text).substr(kScopeLine.size(), end - kScopeLine.size()));
  if (!scope) return failure(Fault::kJournalBroken, "the header names an unknown kind of run");
  const auto config = parse_config(std::string_view(text).substr(end + 1), "journal");
  if (!config) return std::unexpected(config.error());
  return machine_settings(*config, *scope);
}

}  // namespace firstlook
