#include "app/campaign/summary.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace firstlook {
namespace {

/// values: sorted, not empty; share: 0..1.
double quantile(const std::vector<double>& values, double share) {
  const double rank = share * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::size_t>(std::floor(rank));
  const std::size_t above = std::min(below + 1, values.size() - 1);
  return values[below] + (rank - static_cast<double>(below)) * (values[above] - values[below]);
}

}  // namespace

std::optional<Distribution> distribution(std::vector<double> values) {
  if (values.empty()) return std::nullopt;
  std::ranges::sort(values);
  const double sum = std::accumulate(values.begin(), values.end(), 0.0);
  return Distribution{.cells = values.size(),
                      .min = values.front(),
                      .p5 = quantile(values, 0.05),
                      .median = quantile(values, 0.5),
                      .p95 = quantile(values, 0.95),
                      .max = values.back(),
                      .mean = sum / static_cast<double>(values.size())};
}

std::optional<Distribution> distribution_of(const std::vector<CellRecord>& cells,
                                            std::optional<double> CellFigures::* figure) {
  std::vector<double> values;
  for (const CellRecord& cell : cells) {
    if (cell.figures.*figure) values.push_back(*(cell.figures.*figure));
  }
  return distribution(std::move(values));
}

std::optional<Distribution> distribution_of(const std::vector<CellRecord>& cells, double CellWall::* figure) {
  std::vector<double> values;
  for (const CellRecord& cell : cells) values.push_back(cell.wall.*figure);
  return distribution(std::move(values));
}

std::uint64_t total(const std::vector<CellRecord>& cells, std::optional<double> CellFigures::* count) {
  double sum = 0;
  for (const CellRecord& cell : cells) sum += (cell.figures.*count).value_or(0);
  return static_cast<std::uint64_t>(sum);
}

std::size_t count_of(const std::vector<CellRecord>& cells, CellOutcome outcome) {
  return static_cast<std::size_t>(std::ranges::count(cells, outcome, &CellRecord::outcome));
}

std::size_t count_with_coverage(const std::vector<CellRecord>& cells, double coverage) {
  return static_cast<std::size_t>(std::ranges::count_if(cells, [coverage](const CellRecord& cell) {
    return cell.figures.coverage_of_observable && *cell.figures.coverage_of_observable >= coverage;
  }));
}

CellRates rates_per_minute(const std::vector<CellRecord>& cells) {
  double total_s = 0, processor_s = 0;
  for (const CellRecord& cell : cells) {
    total_s += cell.wall.total_s;
    processor_s += cell.wall.processor_s;
  }
  const auto rate = [&](double s) {
    return s > 0 ? std::optional(60 * static_cast<double>(cells.size()) / s) : std::nullopt;
  };
  return {rate(total_s), rate(processor_s)};
}

int CampaignCells::broken() const {
  return static_cast<int>(std::ranges::count_if(finished, [](const CellRecord& cell) {
    return cell.touched() || !ended_safely(cell.outcome) || cell.reason.empty() ||
           cell.figures.loop_allocations.value_or(0) > 0;
  }));
}

std::vector<const CellRecord*> worst_cells(const std::vector<CellRecord>& cells, const FigureColumn& column,
                                           std::size_t count) {
  std::vector<const CellRecord*> found;
  for (const CellRecord& cell : cells) {
    if (cell.figures.*column.value) found.push_back(&cell);
  }
  std::ranges::stable_sort(found, [&](const CellRecord* a, const CellRecord* b) {
    const double va = *(a->figures.*column.value), vb = *(b->figures.*column.value);
    return column.worst == Worst::kLowest ? va < vb : va > vb;
  });
  if (found.size() > count) found.resize(count);
  return found;
}

}  // namespace firstlook
