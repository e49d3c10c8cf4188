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
constexpr std::array<Row, 9> kRows = {{
    {"observable known, %", &CellFigures::coverage_of_observable, 100, 2},
    {"robot's time, s", &CellFigures::robot_time_s, 1, 0},
    {"views", &CellFigures::views, 1, 0},
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
  const auto add = [&](std::string_view label, auto value, double factor, int digits) {
    std::vector<double> values;
    for (const CellRecord& cell : cells.finished) {
      if (const std::optional<double> v = value(cell)) values.push_back(*v);
    }
    text += row_text(label, distribution(std::move(values)), factor, digits);
  };
  for (const Row& row : kRows) {
    add(row.label, [&](const CellRecord& cell) { return cell.figures.*row.value; }, row.factor, row.digits);
  }
  add("computer's time, s", [](const CellRecord& cell) { return std::optional(cell.wall.total_s); }, 1, 1);
  return text;
}

std::string outcomes_text(const CampaignCells& cells) {
  std::string text;
  for (std::size_t i = 0; i < kCellOutcomeNames.size(); ++i) {
    const auto count = std::ranges::count_if(
        cells.finished, [i](const CellRecord& cell) { return cell.outcome == static_cast<CellOutcome>(i); });
    if (count > 0) text += fmt::format("{}{} {}", text.empty() ? "" : ", ", count, kCellOutcomeNames[i]);
  }
  std::ranges::replace(text, '_', ' ');
  return text.empty() ? "none finished" : text;
}

std::uint64_t total(const CampaignCells& cells, std::optional<double> CellFigures::* value) {
  double sum = 0;
  for (const CellRecord& cell : cells.finished) sum += (cell.figures.*value).value_or(0);
  return static_cast<std::uint64_t>(sum);
}

std::string coverage_text(const CampaignCells& cells) {
  const auto share = [&](double coverage) {
    const auto count = std::ranges::count_if(cells.finished, [coverage](const CellRecord& cell) {
      return cell.figures.coverage_of_observable.value_or(-1) >= coverage;
    });
    return fmt::format("{} of {} cells", count, cells.finished.size());
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
  double total_s = 0, processor_s = 0;
  for (const CellRecord& cell : cells.finished) {
    total_s += cell.wall.total_s;
    processor_s += cell.wall.processor_s;
  }
  if (total_s <= 0 || processor_s <= 0) return {};
  const double minutes = 60 * static_cast<double>(cells.finished.size());
  return fmt::format("rate      {:.2f} cells a minute for each core by the clock, {:.2f} by processor time\n",
                     minutes / total_s, minutes / processor_s);
}

}  // namespace

std::string summary_table(const CampaignCells& cells) {
  std::string text = fmt::format("campaign  {} of {} cells, random:{} to random:{}{}{}\n", cells.finished.size(),
                                 cells.asked(), cells.list.first_seed, cells.list.seed(cells.list.cells - 1),
                                 cells.shard.whole() ? "" : ", shard " + cells.shard.text(),
                                 cells.list.faults.empty() ? "" : ", faults " + cells.list.faults);
  text += fmt::format("outcome   {}\n", outcomes_text(cells));
  text += fmt::format("safety    {} contacts, {} entries into unknown space, {} voxels free that hold matter\n",
                      total(cells, &CellFigures::contacts), total(cells, &CellFigures::unknown_entries),
                      total(cells, &CellFigures::false_free_voxels));
  text +=
      coverage_text(cells) + distributions_text(cells) + worst_text(cells) + not_done_text(cells) + rate_text(cells);
  return text;
}

}  // namespace firstlook
