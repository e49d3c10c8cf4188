/// What every choice of a view looks at: the arm, what it carries, where it may move, and what is known.
#pragma once

#include <cstdint>
#include <limits>
#include <span>

#include "algorithms/kinematics/speed.hpp"
#include "algorithms/mapping/insertion.hpp"
#include "algorithms/mapping/ray_cast.hpp"
#include "algorithms/mapping/voxel_map.hpp"
#include "algorithms/motion/certificate.hpp"

namespace firstlook {

/// References to things that must outlive it, all of one map geometry; cheap to make for one call.
struct ViewContext {
  const ArmModel& arm;
  const Body& body;
  const FreeSpace& space;  ///< its field was rebuilt from `map`; null before the first look
  const Clearance& clearance;
  const VoxelMap& map;
  std::span<const std::uint8_t> zone;  ///< mark_reach_zone: the voxels whose knowledge counts
  Transform<Flange, Depth> flange_T_depth;
  /// Free voxels that motion could not use at this time any more want another look before it comes (safety rule 1).
  double fresh_until_s = 0;
  double free_max_age_s = std::numeric_limits<double>::infinity();
  /// An earlier map of the cell in the same grid, or null: a hint where surfaces are, which makes nothing known.
  const VoxelMap* prior = nullptr;
};

/// What a view has to cost beside the move, and how fast the arm may be: the denominator of utility.
struct ViewTiming {
  SpeedLimits limits;
  double settle_s = 0.4;  ///< flange ring-down
  double look_s = 0.3;    ///< a few frames at 30 Hz
};

/// What a look from one place is expected to tell.
struct ViewGain {
  std::uint32_t unknown = 0;           ///< unknown voxels of the zone, each once: what coverage counts
  std::uint32_t backed = 0;            ///< of `unknown`: that only rays with a surface behind count
  std::uint32_t again = 0;             ///< free, but motion cannot use them, or not for long (safety rule 1)
  std::uint32_t expected_surface = 0;  ///< of `unknown`: where an earlier map has a surface
  /// Of `unknown` and of `again`: on rays alone that end, by what has been seen, where nothing returns.
  std::uint32_t doubtful = 0, doubtful_again = 0;

  /// A voxel that needs another look is half known for motion: it weighs a quarter of one that was never seen. One with
  /// an expected surface weighs twice: it is where the space that is free will end. What is doubtful weighs a tenth:
  /// something that nobody has seen may stand in the way and return.
  [[nodiscard]] double weight() const {
    return unknown - 0.9 * doubtful + 0.25 * (again - 0.9 * doubtful_again) + expected_surface;
  }
};

}  // namespace firstlook
