/// Our views to the very end, where little is left and lies far apart: to hold one way of choosing against another. By
/// name only (`--only tail`); cells that no comparison uses.
#include <fmt/format.h>

#include <vector>

#include "tests/bench/bench.hpp"
#include "tests/bench/exploration.hpp"

namespace firstlook::bench {

void bench_tail(const Options& options, Report& report) {
  constexpr std::uint64_t kFirstCell = 200'001;
  constexpr int kAtOnce = 2;
  const int cells = options.amount(1, 12, 60);
  std::vector<ExploredCell::Way> ways(static_cast<std::size_t>(cells));
  WorkerPool workers(kAtOnce);
  const double computed_s = process_seconds();
  workers.parallel_for(cells, [&](int i, int) {
    WorkerPool alone(1);
    KnownTruth truth;
    ways[static_cast<std::size_t>(i)] =
        explore(kFirstCell + static_cast<std::uint64_t>(i), Views::kOurs, alone, truth, {}, Until::kEnd);
  });
  const double each_s = (process_seconds() - computed_s) / cells;
  std::vector<double> to_95_s, to_99_s, to_end_s, stops, coverage;
  for (const ExploredCell::Way& way : ways) {
    if (way.to_95) to_95_s.push_back(way.to_95->time_s);
    if (way.to_99) to_99_s.push_back(way.to_99->time_s);
    to_end_s.push_back(way.end.time_s);
    stops.push_back(way.end.stops);
    coverage.push_back(way.coverage);
  }
  const auto add = [&](const char* name, const std::vector<double>& values, const char* unit) {
    double sum = 0;
    for (const double value : values) sum += value;
    const std::string text = fmt::format("mean of {} cells; median", values.size());
    report.add(measured(fmt::format("tail/{}", name), sum / static_cast<double>(values.size()), unit, text,
                        median(values), Goal::none()));
  };
  add("to_95", to_95_s, "s");
  add("to_99", to_99_s, "s");
  add("to_end", to_end_s, "s");
  add("stops", stops, "");
  add("coverage", coverage, "");
  report.add(measured("tail/computing", each_s, "s", "for each cell", std::nullopt, Goal::none()));
}

}  // namespace firstlook::bench
