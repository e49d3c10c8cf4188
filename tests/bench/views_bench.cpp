/// Views: how long the choice of the next one takes, and how good the choices are beside the thesis's and beside those
/// of somebody who knows the cell.
#include <fmt/format.h>

#include <algorithm>

#include "platform/loop/worker_pool.hpp"
#include "tests/bench/bench.hpp"
#include "tests/bench/exploration.hpp"

namespace firstlook::bench {
namespace {

constexpr int kWorkers = 2;

void bench_choice(const Options& options, Report& report) {
  constexpr int kCandidates = 840;  // of these at least 500 must be found free, as the goal says
  constexpr int kCandidatesMin = 500;
  ExploredCell cell("workshop", 1, kCandidates, kWorkers);
  WorkerPool workers(kWorkers);
  cell.sweep(true);  // what a choice costs later on, too
  std::vector<double> choices_s, computing_s;
  int free_least = kCandidates;
  ExploreOptions explore;
  const int choices = options.amount(2, 12, 40);
  for (explore.step = 0; static_cast<int>(explore.step) < choices; ++explore.step) {
    const double start = wall_seconds(), computed = process_seconds();
    const auto choice = choose_ours(cell, cell.context(), explore, workers);
    const double seconds = wall_seconds() - start, computing = process_seconds() - computed;
    // The last one is the certificate that ends exploration, many times as dear; it is no choice.
    if (!choice || choice->outcome != ViewChoice::Outcome::kChosen) break;
    choices_s.push_back(seconds);
    computing_s.push_back(computing);
    free_least = std::min(free_least, choice->free);
    cell.follow(choice->path, true);
    cell.chooser().remember_look(cell.context(), cell.joints());
  }
  Row row = timed("views/choose/5cm", 1e3 * median(choices_s), "ms", "", std::nullopt, Goal::ours_at_most(100));
  if (choices_s.empty() || free_least < kCandidatesMin) row.void_because = fmt::format("{} free", free_least);
  report.add(row);
  // Both threads together, whatever else the machine does: half of it is what an idle one would take at best.
  report.add(timed("views/choose/5cm/computing", 1e3 * median(computing_s), "ms", "", std::nullopt, Goal::none()));
  report.add(timed("views/choose/5cm/longest", 1e3 * quantile(choices_s, 1), "ms", "", std::nullopt, Goal::none()));
}

using Reached = std::optional<ExploredCell::Reached>;

/// The median of ours over theirs in the cells where both came so far, and how many others there are.
void add_ratio(Report& report, const std::string& name, const char* unit, const std::string& peer, double ratio_max,
               const std::vector<std::pair<Reached, Reached>>& cells, double (*figure)(const ExploredCell::Reached&)) {
  std::vector<double> ours, theirs, ratios;
  int we_did_not = 0, they_did_not = 0;
  for (const auto& [we, they] : cells) {
    we_did_not += we ? 0 : 1;
    they_did_not += they ? 0 : 1;
    if (!we || !they) continue;
    ours.push_back(figure(*we));
    theirs.push_back(figure(*they));
    ratios.push_back(ours.back() / theirs.back());
  }
  std::string text = fmt::format("{}, {} cells", peer, ratios.size());
  if (we_did_not + they_did_not > 0) text += fmt::format("; fell short: ours {}, it {}", we_did_not, they_did_not);
  Row row = measured(name, median(ours), unit, text, median(theirs), Goal::ratio_at_most(ratio_max));
  row.ratio = median(ratios);
  if (ratios.empty()) row.void_because = "no cell that both explored so far";
  report.add(row);
}

/// Goals: issue "the next best view". Cells 1 to N, each the same for all.
void bench_strategies(const Options& options, Report& report) {
  constexpr double kOverThesis = 0.7, kOverOmniscient = 1.25;
  WorkerPool workers(kWorkers);
  std::vector<std::pair<Reached, Reached>> thesis_95, omniscient_95, omniscient_99;
  for (std::uint64_t seed = 1; seed <= static_cast<std::uint64_t>(options.amount(1, 8, 100)); ++seed) {
    KnownTruth truth;
    const ExploredCell::Way ours = explore(seed, Views::kOurs, workers, truth, {}, Until::k99);
    const ExploredCell::Way thesis = explore(seed, Views::kThesis, workers, truth, {}, Until::k95);
    const ExploredCell::Way omniscient = explore(seed, Views::kOmniscient, workers, truth, {}, Until::k99);
    thesis_95.emplace_back(ours.to_95, thesis.to_95);
    omniscient_95.emplace_back(ours.to_95, omniscient.to_95);
    omniscient_99.emplace_back(ours.to_99, omniscient.to_99);
  }
  const auto time_s = [](const ExploredCell::Reached& reached) { return reached.time_s; };
  const auto stops = [](const ExploredCell::Reached& reached) { return static_cast<double>(reached.stops); };
  add_ratio(report, "views/time95", "s", "thesis2014", kOverThesis, thesis_95, time_s);
  add_ratio(report, "views/stops95", "stops", "thesis2014", kOverThesis, thesis_95, stops);
  add_ratio(report, "views/time95/omniscient", "s", "omniscient", kOverOmniscient, omniscient_95, time_s);
  add_ratio(report, "views/time99/omniscient", "s", "omniscient", kOverOmniscient, omniscient_99, time_s);
  add_ratio(report, "views/stops99/omniscient", "stops", "omniscient", kOverOmniscient, omniscient_99, stops);
}

}  // namespace

void bench_views(const Options& options, Report& report) {
  bench_choice(options, report);
  bench_strategies(options, report);
}

}  // namespace firstlook::bench
