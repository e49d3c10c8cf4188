#include "tests/bench/exploration.hpp"

#include <fmt/format.h>

namespace firstlook::bench {
namespace {

constexpr int kStopsMax = 400;
constexpr int kCandidates = 320, kCandidatesOmniscient = 1500, kRefinedOmniscient = 64;

/// One exploration of a cell while it goes on.
struct Exploration {
  ExploredCell& cell;
  Views views;
  WorkerPool& workers;
  ExploreOptions options;
  ThesisOptions drawing;
  bool surfaces_count = false;

  [[nodiscard]] ViewContext context() {
    return views == Views::kOmniscient ? cell.omniscient_context(surfaces_count) : cell.context();
  }
  [[nodiscard]] Result<ViewChoice> choose_now() {
    options.timing.limits = drawing.limits = cell.timing().limits;
    const ViewContext now = context();
    return views == Views::kThesis ? choose_as_thesis(now, cell.joints(), cell.chooser().planner(), drawing)
                                   : choose_ours(cell, now, options, workers);
  }
  /// False when no view is left.
  [[nodiscard]] bool choose_view(Path& path) {
    for (const auto pace : {ExploredCell::Pace::kRoomy, ExploredCell::Pace::kNormal, ExploredCell::Pace::kSlow}) {
      cell.set_pace(pace);
      const Result<ViewChoice> choice = choose_now();
      if (choice && choice->outcome == ViewChoice::Outcome::kChosen) {
        path = choice->path;
        return true;
      }
      // What cannot be seen with room to spare may still be seen without.
      if (pace != ExploredCell::Pace::kRoomy && choice && choice->outcome == ViewChoice::Outcome::kComplete)
        return false;
    }
    return false;
  }
};

}  // namespace

Result<ViewChoice> choose_ours(ExploredCell& cell, const ViewContext& context, const ExploreOptions& options,
                               WorkerPool& workers) {
  return cell.chooser().choose(context, cell.joints(), options, [&workers](int n, IndexedBody body) {
    workers.parallel_for(n, [&body](int index, int worker) { body(index, worker); });
  });
}

ExploredCell::Way explore(std::uint64_t seed, Views views, WorkerPool& workers, KnownTruth& truth,
                          const ThesisOptions& thesis, Until until) {
  const bool omniscient = views == Views::kOmniscient, as_thesis = views == Views::kThesis;
  ExploredCell cell(fmt::format("random:{}", seed), seed, omniscient ? kCandidatesOmniscient : kCandidates,
                    workers.workers());
  cell.find_truth(workers, truth);
  if (as_thesis) cell.sweep(false);  // ours is over at once: the first view tells more a second
  Exploration exploration{cell, views, workers, {}, thesis};
  exploration.drawing.seed = exploration.options.seed = seed;
  exploration.options.gain_min = kWorthVoxels;
  if (omniscient) exploration.options.refined = kRefinedOmniscient;
  const auto reached = [&] {
    if (until == Until::kEnd) return false;
    return until == Until::k95 ? cell.way().to_95.has_value() : cell.way().to_99.has_value();
  };
  while (!reached() && cell.way().end.stops < kStopsMax) {
    Path path;
    if (!exploration.choose_view(path)) {
      if (!omniscient || exploration.surfaces_count) break;
      exploration.surfaces_count = true;  // nothing else is left
      continue;
    }
    ++exploration.options.step, ++exploration.drawing.step;
    cell.follow(path, !as_thesis);
    if (!as_thesis) cell.chooser().remember_look(exploration.context(), cell.joints());
  }
  return cell.way();
}

}  // namespace firstlook::bench
