/// Cells drawn from a seed, and the search that shows that a cell's board can be calibrated from its safe zone.
#pragma once

#include <cstdint>
#include <vector>

#include "hal/sim/scene.hpp"
#include "platform/core/result.hpp"

namespace firstlook::sim {

/// A cell with walls, 10 to 17 boxes and cylinders on the floor and on tables around the arm, a drawn mount and a drawn
/// board that at least `kDiverseViewsMin` in-zone views see whole (it draws again until they do). kCellInvalid when no
/// draw of 64 does.
[[nodiscard]] Result<Scene> make_random_cell(std::uint64_t cell_seed, std::uint64_t seed);

inline constexpr int kDiverseViewsMin = 5;

/// Configurations of the arm, out of `tries` random ones, that stand in the safe zone with the 0.20 m envelope at the
/// flange, clear of themselves, and whose true camera sees the whole board unoccluded at a tilt of at most 50 degrees.
[[nodiscard]] std::vector<JointVector> board_views(const Scene& scene, int tries, std::uint64_t seed);

/// The mount with a small error of assembly drawn from the run's seed: up to 10 mm and 3 degrees for each axis.
[[nodiscard]] Pose assembled(const Pose& nominal, std::uint64_t seed);

}  // namespace firstlook::sim
