/// What motion is measured in: random cells of the simulator, with a voxel occupied where there is matter and free
/// elsewhere, as after a perfect look around.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "algorithms/motion/body.hpp"
#include "algorithms/motion/free_space.hpp"
#include "platform/core/random.hpp"

namespace firstlook::bench {

/// A UR5 with a camera in a cell. The safe zone's cylinder does not count: the field alone says what is free.
struct MotionCell {
  GridGeometry geometry;
  std::vector<std::uint8_t> free;
  DistanceField field;
  ArmModel arm;
  Body body;
  Clearance clearance;  ///< safety rule 5 with its defaults
  FreeSpace space;      ///< points to `field`

  MotionCell(std::uint64_t seed, double resolution_m);
  MotionCell(const MotionCell&) = delete;
  MotionCell& operator=(const MotionCell&) = delete;

  [[nodiscard]] bool is_free(const JointVector& q_rad) const;
  /// Every joint within half a turn of zero.
  [[nodiscard]] JointVector random_joints(Random& random) const;
  /// A free one, with 5 mm to spare; ENSURE 9201 after 100 000 tries.
  [[nodiscard]] JointVector random_free_joints(Random& random) const;
};

/// Cells with the seeds 1 .. count.
[[nodiscard]] std::vector<std::unique_ptr<MotionCell>> motion_cells(int count, double resolution_m);

}  // namespace firstlook::bench
