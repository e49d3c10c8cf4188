#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "app/campaign/summary.hpp"

namespace firstlook {
namespace {

/// How a row of the table shows a figure.
struct Row {
  std::string_view label;
  std::optional<double> CellFigures::* value;
  double factor;
  int digits;
};
constexpr std::array<Row, 13> kRows = {{
    {"observable known, %", &CellFigures::coverage_of_observable, 100, 2},
    {"robot's time, s", &CellFigures::robot_time_s, 1, 0},
    {"views", &CellFigures::views, 1, 0},
    {"mapping to 95 %, s", &CellFigures::time_to_95_s, 1, 0},
    {"views to 95 %", &CellFigures::views_to_95, 1, 0},
    {"mapping to 99 %, s", &CellFigures::time_to_99_s, 1, 0},
    {"views to 99 %", &CellFigures::views_to_99, 1, 0},
    {"hand-eye error, mm", &CellFigures::hand_eye_error_mm, 1, 3},
    {"hand-eye error, mrad", &CellFigures::hand_eye_error_mrad, 1, 3},
    {"Mahalanobis squared", &CellFigures::hand_eye_mahalanobis2, 1, 1},
    {"least clearance, mm", &CellFigures::min_clearance_m, 1000, 1},
    {"false free voxels", &CellFigures::false_free_voxels, 1, 0},
    {"peak memory, MiB", &CellFigures::peak_bytes, 1.0 / (1 << 20), 0},
}};

std::string row_text(std::string_view label, const std::optional<Distribution>& d, double factor, int digits) {
  std::string text = fmt::format("{:22}", label);
  if (!d) return text + "         -\n";
  for (const double value : {d->min, d->p5, d->median, d->p95, d->max})
    text += fmt::format(" {:9.{}f}", factor * value, digits);
  return text + fmt::format(" {:7}\n", d->cells);
}

std::string distributions_text(const CampaignCells& cells) {
  std::string text =
      fmt::format("{:22} {:>9} {:>9} {:>9} {:>9} {:>9} {:>7}\n", "", "min", "5 %", "median", "95 %", "max", "cells");
  for (const Row& row : kRows) {
    text += row_text(row.label, distribution_of(cells.finished, row.value), row.factor, row.digits);
  }
  text += row_text("computer's time, s", distribution_of(cells.finished, &CellWall::total_s), 1, 1);
  return text;
}

std::string outcomes_text(const CampaignCells& cells) {
  std::string text;
  for (std::size_t i = 0; i < kCellOutcomeNames.size(); ++i) {
    const std::size_t count = count_of(cells.finished, static_cast<CellOutcome>(i));
    if (count > 0) text += fmt::format("{}{} {}", text.empty() ? "" : ", ", count, kCellOutcomeNames[i]);
  }
  std::ranges::replace(text, '_', ' ');
  return text.empty() ? "none finished" : text;
}

std::string coverage_text(const CampaignCells& cells) {
  const auto share = [&](double coverage) {
    return fmt::format("{} of {} cells", count_with_coverage(cells.finished, coverage), cells.finished.size());
  };
  return fmt::format("coverage  {} know 99 % of what can be observed, {} know 95 %\n", share(0.99), share(0.95));
}

/// The cell at the bad end of a figure.
std::string worst_text(const CampaignCells& cells) {
  std::string text;
  for (const Row& row : kRows) {
    const auto* column = std::ranges::find(kFigureColumns, row.value, &FigureColumn::value);
    if (column == kFigureColumns.end() || column->worst == Worst::kNotAsked) continue;
    const auto worst = worst_cells(cells.finished, *column, 3);
    if (worst.empty()) continue;
    text += fmt::format("worst     {:22}", row.label);
    for (const CellRecord* cell : worst) {
      text += fmt::format("  seed {}: {:.{}f}", cell->seed, row.factor * *(cell->figures.*row.value), row.digits);
    }
    text += "\n";
  }
  return text;
}

constexpr std::size_t kNotDoneListed = 20;

std::string not_done_text(const CampaignCells& cells) {
  std::string text;
  std::size_t listed = 0, count = 0;
  for (const CellRecord& cell : cells.finished) {
    if (cell.outcome == CellOutcome::kDone && !cell.touched()) continue;
    ++count;
    if (++listed > kNotDoneListed) continue;
    text +=
        fmt::format("look at   seed {}: {}{}: {}\n          {}\n", cell.seed, name_of(cell.outcome),
                    cell.touched() ? ", CONTACT OR ENTRY" : "", cell.reason, run_command(cell.seed, cells.list.faults));
  }
  if (count > kNotDoneListed) text += fmt::format("look at   {} more, in the summary\n", count - kNotDoneListed);
  return text;
}

std::string rate_text(const CampaignCells& cells) {
  const CellRates rates = rates_per_minute(cells.finished);
  if (!rates.by_clock || !rates.by_processor_time) return {};
  return fmt::format("rate      {:.2f} cells a minute for each core by the clock, {:.2f} by processor time\n",
                     *rates.by_clock, *rates.by_processor_time);
}

}  // namespace

std::string summary_table(const CampaignCells& cells) {
  std::string text = fmt::format("campaign  {} of {} cells, random:{} to random:{}{}{}\n", cells.finished.size(),
                                 cells.asked(), cells.list.first_seed, cells.list.seed(cells.list.cells - 1),
                                 cells.shard.whole() ? "" : ", shard " + cells.shard.text(),
                                 cells.list.faults.empty() ? "" : ", faults " + cells.list.faults);
  text += fmt::format("outcome   {}\n", outcomes_text(cells));
  text +=
      fmt::format("safety    {} contacts, {} entries into unknown space, {} voxels free that hold matter\n",
                  total(cells.finished, &CellFigures::contacts), total(cells.finished, &CellFigures::unknown_entries),
                  total(cells.finished, &CellFigures::false_free_voxels));
  text +=
      coverage_text(cells) + distributions_text(cells) + worst_text(cells) + not_done_text(cells) + rate_text(cells);
  return text;
}

}  // namespace firstlook
