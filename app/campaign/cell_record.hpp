/// What a campaign keeps of a cell: how its process ended, and the figures of its result.json.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "platform/core/result.hpp"

namespace firstlook {

/// The first four are the outcomes of a run; the others are processes that ended without one.
enum class CellOutcome : std::uint8_t {
  kDone,
  kCalibrationRejected,
  kSafelyStopped,
  kFaulted,
  kCrashed,  ///< ended by a signal
  kHung,     ///< ended by the campaign, at its limit
  kFailed    ///< ended with an error, or with an exit code that its own result does not have
};
inline constexpr std::array<std::string_view, 7> kCellOutcomeNames = {
    "done", "calibration_rejected", "safely_stopped", "faulted", "crashed", "hung", "failed"};
[[nodiscard]] constexpr std::string_view name_of(CellOutcome outcome) {
  return kCellOutcomeNames[static_cast<std::size_t>(outcome)];
}
[[nodiscard]] std::optional<CellOutcome> find_cell_outcome(std::string_view name);
/// The first three: the job came to an end that DESIGN 12 calls done, rejected or safely stopped.
[[nodiscard]] constexpr bool ended_safely(CellOutcome outcome) { return outcome <= CellOutcome::kSafelyStopped; }

/// Figures of a run; empty where result.json has null, or where there is none.
struct CellFigures {
  std::optional<double> coverage_of_observable;
  std::optional<double> robot_time_s;  ///< end of the last phase
  std::optional<double> views, calibration_views;
  std::optional<double> time_to_95_s, views_to_95, time_to_99_s,
      views_to_99;  ///< of the observable, since mapping began
  std::optional<double> hand_eye_error_mm, hand_eye_error_mrad, hand_eye_mahalanobis2;
  std::optional<double> min_clearance_m;
  std::optional<double> false_free_voxels, false_occupied_fraction;
  std::optional<double> stall_s, peak_bytes;
  std::optional<double> contacts, unknown_entries, loop_allocations;
};

/// Which end of a figure's distribution is the bad one.
enum class Worst : std::uint8_t { kNotAsked, kLowest, kHighest };

struct FigureColumn {
  std::string_view name;  ///< in state files and the summary; with its unit
  std::string_view path;  ///< JSON pointer into result.json; empty: see CellFigures
  std::optional<double> CellFigures::* value;
  Worst worst;
};
inline constexpr std::array<FigureColumn, 16> kFigureColumns = {{
    {"coverage_of_observable", "/truth/coverage_of_observable", &CellFigures::coverage_of_observable, Worst::kLowest},
    {"robot_time_s", "", &CellFigures::robot_time_s, Worst::kHighest},
    {"views", "/mapping/views", &CellFigures::views, Worst::kHighest},
    {"time_to_95_s", "/truth/to_95/time_s", &CellFigures::time_to_95_s, Worst::kHighest},
    {"views_to_95", "/truth/to_95/views", &CellFigures::views_to_95, Worst::kNotAsked},
    {"time_to_99_s", "/truth/to_99/time_s", &CellFigures::time_to_99_s, Worst::kHighest},
    {"views_to_99", "/truth/to_99/views", &CellFigures::views_to_99, Worst::kNotAsked},
    {"calibration_views", "/hand_eye/views", &CellFigures::calibration_views, Worst::kNotAsked},
    {"hand_eye_error_mm", "/truth/hand_eye_error_mm", &CellFigures::hand_eye_error_mm, Worst::kHighest},
    {"hand_eye_error_mrad", "/truth/hand_eye_error_mrad", &CellFigures::hand_eye_error_mrad, Worst::kHighest},
    {"hand_eye_mahalanobis2", "/truth/hand_eye_mahalanobis2", &CellFigures::hand_eye_mahalanobis2, Worst::kHighest},
    {"min_clearance_m", "/safety/min_clearance_m", &CellFigures::min_clearance_m, Worst::kLowest},
    {"false_free_voxels", "/truth/false_free_voxels", &CellFigures::false_free_voxels, Worst::kHighest},
    {"false_occupied_fraction", "/truth/false_occupied_fraction", &CellFigures::false_occupied_fraction,
     Worst::kNotAsked},
    {"stall_s", "/wall/stall_s", &CellFigures::stall_s, Worst::kNotAsked},
    {"peak_bytes", "/memory/peak_bytes", &CellFigures::peak_bytes, Worst::kNotAsked},
}};
/// What must be zero in every cell.
inline constexpr std::array<FigureColumn, 3> kCountColumns = {{
    {"contacts", "/truth/contacts", &CellFigures::contacts, Worst::kNotAsked},
    {"unknown_entries", "/truth/unknown_entries", &CellFigures::unknown_entries, Worst::kNotAsked},
    {"loop_allocations_after_seal", "/memory/loop_allocations_after_seal", &CellFigures::loop_allocations,
     Worst::kNotAsked},
}};

/// What differs from computer to computer.
struct CellWall {
  double total_s = 0;      ///< from start to end of the process
  double processor_s = 0;  ///< that it used
  double peak_resident_bytes = 0;
  bool kept = false;  ///< its run folder stands in kept/
};

struct CellRecord {
  int index = 0;
  std::int64_t seed = 0;
  CellOutcome outcome = CellOutcome::kFailed;
  std::string reason;
  CellFigures figures;
  std::string decisions_hash;  ///< empty without result.json
  /// Voxels that stayed unknown, by the reason that the run gives; in alphabetical order.
  std::vector<std::pair<std::string, std::uint64_t>> remaining;
  CellWall wall;

  [[nodiscard]] bool touched() const {
    return figures.contacts.value_or(0) > 0 || figures.unknown_entries.value_or(0) > 0;
  }
};

/// What the result.json of a run says. Error: kDataMalformed.
struct CellResult {
  CellOutcome outcome = CellOutcome::kFailed;
  std::int64_t seed = 0;
  std::string reason;
  CellFigures figures;
  std::string decisions_hash;
  std::vector<std::pair<std::string, std::uint64_t>> remaining;
};
[[nodiscard]] Result<CellResult> read_cell_result(std::string_view result_json);

/// One line of JSON, without the newline, and back. Error: kDataMalformed.
[[nodiscard]] std::string cell_line(const CellRecord& cell);
[[nodiscard]] Result<CellRecord> parse_cell_line(std::string_view line);

}  // namespace firstlook
