/// The exploration of a cell to its end by one of three choosers, for figures about views.
#pragma once

#include "algorithms/view_planning/thesis_views.hpp"
#include "platform/loop/worker_pool.hpp"
#include "tests/bench/explored_cell.hpp"

namespace firstlook::bench {

enum class Views : std::uint8_t { kOurs, kThesis, kOmniscient };

/// The next view as a job chooses it, with the workers' threads.
[[nodiscard]] Result<ViewChoice> choose_ours(ExploredCell& cell, const ViewContext& context,
                                             const ExploreOptions& options, WorkerPool& workers);

/// Percent of what can be observed, or no view left; what comes then has no figure.
enum class Until : std::uint8_t { k95, k99, kEnd };

/// What can be observed in a cell, by who explored it first; empty before.
using KnownTruth = std::optional<sim::ObservableSet>;

/// Explores `random:seed` so far, or until no view is left, or for 400 stops.
/// @param thesis  for kThesis; its seed, step and limits are set here
[[nodiscard]] ExploredCell::Way explore(std::uint64_t seed, Views views, WorkerPool& workers, KnownTruth& truth,
                                        const ThesisOptions& thesis = {}, Until until = Until::k99);

}  // namespace firstlook::bench
