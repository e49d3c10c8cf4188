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

int CampaignCells::broken() const {
  return static_cast<int>(std::ranges::count_if(finished, [](const CellRecord& cell) {
    return cell.touched() || !ended_safely(cell.outcome) || cell.reason.empty();
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
