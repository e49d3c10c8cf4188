/// What the cells of a campaign say together: figures, JSON for programs, a table for people.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/campaign/cell_list.hpp"
#include "app/campaign/cell_record.hpp"
#include "app/campaign/state_file.hpp"

namespace firstlook {

/// Quantiles are interpolated linearly between ranks (type 7 of Hyndman and Fan 1996: the default of R and NumPy).
struct Distribution {
  std::size_t cells = 0;  ///< that have the figure
  double min = 0, p5 = 0, median = 0, p95 = 0, max = 0, mean = 0;
};
/// Empty without values. Order of the values does not matter.
[[nodiscard]] std::optional<Distribution> distribution(std::vector<double> values);
[[nodiscard]] std::optional<Distribution> distribution_of(const std::vector<CellRecord>& cells,
                                                          std::optional<double> CellFigures::* figure);
[[nodiscard]] std::optional<Distribution> distribution_of(const std::vector<CellRecord>& cells,
                                                          double CellWall::* figure);

/// Sum of what is to be counted, over the cells that have it.
[[nodiscard]] std::uint64_t total(const std::vector<CellRecord>& cells, std::optional<double> CellFigures::* count);
[[nodiscard]] std::size_t count_of(const std::vector<CellRecord>& cells, CellOutcome outcome);
/// Cells that know at least this share of the observable; one without a map does not.
[[nodiscard]] std::size_t count_with_coverage(const std::vector<CellRecord>& cells, double coverage);

/// Cells a minute for one core: by the clock, and by the processor's time that they used. Empty without cells.
struct CellRates {
  std::optional<double> by_clock, by_processor_time;
};
[[nodiscard]] CellRates rates_per_minute(const std::vector<CellRecord>& cells);

/// Cells of a campaign, or of a shard of it.
struct CampaignCells {
  CellList list;
  Shard shard;
  CampaignIdentity identity;
  std::vector<CellRecord> finished;  ///< of those that were asked for, by index

  [[nodiscard]] int asked() const { return static_cast<int>(list.indices(shard).size()); }
  [[nodiscard]] int missing() const { return asked() - static_cast<int>(finished.size()); }
  /// Cells that must not be: contacts, entries into unknown space, an end that is not a safe one with a reason.
  [[nodiscard]] int broken() const;
};

/// The cells with the worst values of a figure, the worst first; of equals the one with the lower index.
[[nodiscard]] std::vector<const CellRecord*> worst_cells(const std::vector<CellRecord>& cells,
                                                         const FigureColumn& column, std::size_t count);

/// The schema stands in README.md; all but `wall` depends on program and configuration alone.
[[nodiscard]] std::string summary_json(const CampaignCells& cells);
/// A page of text.
[[nodiscard]] std::string summary_table(const CampaignCells& cells);

}  // namespace firstlook
