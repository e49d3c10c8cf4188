/// Several scan lines of a sweeping sensor (a scanner on a moving joint, a push broom) as one update of the map.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "algorithms/mapping/voxel_map.hpp"
#include "platform/core/result.hpp"

namespace firstlook {

/// One line of a scanner in its own plane: ranges at equal angles from its z axis towards its x axis, taken from one
/// place.
struct ScanLine {
  Transform<Base, Depth> base_T_scanner;  ///< at the line's own time
  std::span<const float> ranges_m;        ///< along each ray; not finite or 0: no return
  double angle_first_rad = 0;
  double angle_step_rad = 0;
};

struct ScannerLimits {
  double range_min_m = 0.1;      ///< nearer returns are dropped
  double range_trusted_m = 3.0;  ///< farther ones clear up to here and mark nothing (safety rule 9)
};

/// Collects the lines of one sweep and applies them at its end: one update for each voxel and sweep, occupied before
/// free, as if all lines were one frame; a voxel that a hundred lines graze is missed once. All memory is taken at
/// construction.
class SweepUpdate {
 public:
  SweepUpdate(const GridGeometry& geometry, const ScannerLimits& limits);
  [[nodiscard]] static std::size_t required_bytes(const GridGeometry& geometry);

  /// Forgets the lines so far.
  void begin();
  /// @return kFrameRefused for a pose that is no rigid motion or farther away than OctoMap's keys reach, or angles that
  /// are not finite; the sweep is then unchanged.
  [[nodiscard]] Status add(const ScanLine& line);
  /// Ends the sweep.
  /// @param base_T_scanner  stands for the sweep where poses are compared (safety rule 1): that of its middle line
  /// @param stamp_s         not negative
  FrameChange apply(VoxelMap& map, const Transform<Base, Depth>& base_T_scanner, double stamp_s);

 private:
  void mark_crossed(const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m);

  GridGeometry geometry_;
  ScannerLimits limits_;
  std::vector<std::uint64_t> missed_, hit_;
  std::vector<std::uint8_t> crossed_;  ///< octants of each voxel that a ray crossed
  std::vector<std::uint8_t> surface_;  ///< octants that were hit
};

}  // namespace firstlook
