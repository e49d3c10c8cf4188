/// The values that the thesis leaves open, chosen for it: each in turn the best of some, over cells that no comparison
/// uses. By name only (`--only thesis_tuning`): some ten minutes of two cores.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>

#include "tests/bench/bench.hpp"
#include "tests/bench/exploration.hpp"

namespace firstlook::bench {
namespace {

constexpr std::uint64_t kFirstCell = 100'001;
constexpr int kWorkers = 2;
constexpr double kNotReached = 1.5;  // times what it took before it gave up short of 95 %

struct Parameter {
  const char* name;
  std::vector<double> values;
  void (*set)(ThesisOptions&, double);
};

const std::vector<Parameter>& parameters() {
  static const std::vector<Parameter> list = {
      {"weight_per_m", {0, 75, 150, 300, 600, 1200, 2400}, [](ThesisOptions& o, double v) { o.weight_per_m = v; }},
      {"radius_max_m", {0.6, 0.7, 0.8, 0.9}, [](ThesisOptions& o, double v) { o.radius_max_m = v; }},
      {"radius_min_m", {0.2, 0.3, 0.4, 0.5}, [](ThesisOptions& o, double v) { o.radius_min_m = v; }},
      {"polar_max_rad", {1.57, 1.8, 2.1, 2.6}, [](ThesisOptions& o, double v) { o.polar_max_rad = v; }},
      {"rays_min",
       {10, 40, 160, 400, 800},
       [](ThesisOptions& o, double v) { o.rays_min = static_cast<std::uint32_t>(v); }},
      {"plan_iterations_max",
       {100, 400, 1600},
       [](ThesisOptions& o, double v) { o.plan_iterations_max = static_cast<int>(v); }},
  };
  return list;
}

/// The cells, each with what can be observed in it; as many at once as there are workers.
class Trials {
 public:
  explicit Trials(int cells) : truths_(static_cast<std::size_t>(cells)) {}

  /// Mean seconds to 95 % of what can be observed; at least that, where it exceeds `enough_s`: then the rest is spared.
  [[nodiscard]] double cost_s(const ThesisOptions& options, double enough_s) {
    const int cells = static_cast<int>(truths_.size());
    double sum_s = 0;
    for (int first = 0; first < cells && sum_s < enough_s * cells; first += kWorkers) {
      std::array<double, kWorkers> costs_s{};
      const int count = std::min(kWorkers, cells - first);
      workers_.parallel_for(count,
                            [&](int i, int) { costs_s[static_cast<std::size_t>(i)] = explore_s(first + i, options); });
      sum_s += std::accumulate(costs_s.begin(), costs_s.end(), 0.0);
    }
    return sum_s / cells;
  }

 private:
  double explore_s(int cell, const ThesisOptions& options) {
    WorkerPool alone(1);
    const auto way = explore(kFirstCell + static_cast<std::uint64_t>(cell), Views::kThesis, alone,
                             truths_[static_cast<std::size_t>(cell)], options, Until::k95);
    return way.to_95 ? way.to_95->time_s : kNotReached * way.end.time_s;
  }

  WorkerPool workers_{kWorkers};
  std::vector<KnownTruth> truths_;
};

}  // namespace

void bench_thesis_tuning(const Options& options, Report& report) {
  ThesisOptions best;
  Trials trials(options.amount(1, 6, 20));
  double best_s = trials.cost_s(best, std::numeric_limits<double>::infinity());
  report.add(measured("thesis_tuning/as_it_stands", best_s, "s", "", std::nullopt, Goal::none()));
  for (int pass = 1; pass <= (options.smoke ? 1 : 2); ++pass) {
    for (const Parameter& parameter : parameters()) {
      for (const double value : parameter.values) {
        ThesisOptions tried = best;
        parameter.set(tried, value);
        const double s = trials.cost_s(tried, best_s);
        report.add(measured(fmt::format("thesis_tuning/pass{}/{}/{}", pass, parameter.name, value), s, "s",
                            "best so far", best_s, Goal::none()));
        if (s >= best_s) continue;
        best_s = s;
        best = tried;
      }
      if (options.smoke) break;
    }
  }
}

}  // namespace firstlook::bench
