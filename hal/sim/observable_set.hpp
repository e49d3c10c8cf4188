/// What could be observed: the plain fixpoint over reachable free configurations in the true scene. Knows nothing of
/// any run; coverage is graded against it.
#pragma once

#include <cstdint>
#include <tuple>
#include <vector>

#include "algorithms/kinematics/arm_model.hpp"
#include "algorithms/mapping/grid_geometry.hpp"
#include "algorithms/motion/body.hpp"
#include "algorithms/motion/free_space.hpp"
#include "hal/sim/true_world.hpp"
#include "platform/core/camera_intrinsics.hpp"
#include "platform/loop/worker_pool.hpp"

namespace firstlook::sim {

/// What the run was configured with; the fixpoint moves and sees by the same rules.
struct ObservableOptions {
  Clearance clearance{.voxels_m = 0.08, .surface_m = 0.03};
  double sensor_range_min_m = 0.5;      ///< along the optical axis
  double sensor_range_max_m = 5.0;      ///< beyond there is no return
  double sensor_range_trusted_m = 3.0;  ///< a farther return clears up to here
  double zone_margin_m = 0.10;          ///< of the reach zone that is mapped: stopping distance and a voxel
  double zone_floor_m = -0.3;
  int samples = 6000;  ///< configurations drawn; 8000 see 0.4 % more in `workshop`
  int neighbors = 10;  ///< edges tried for each

  [[nodiscard]] bool operator==(const ObservableOptions& o) const {
    const auto values = [](const ObservableOptions& x) {
      return std::tuple(x.clearance.voxels_m, x.clearance.surface_m, x.sensor_range_min_m, x.sensor_range_max_m,
                        x.sensor_range_trusted_m, x.zone_margin_m, x.zone_floor_m, x.samples, x.neighbors);
    };
    return values(*this) == values(o);
  }
};

struct ObservableProblem {
  const ArmModel* arm = nullptr;
  const TrueWorld* world = nullptr;
  GridGeometry geometry;
  Body body;               ///< as the program pads it, with the true mount
  Capsules true_capsules;  ///< what hides the view: arm and camera as they are
  Transform<Flange, Depth> flange_T_depth;
  CameraIntrinsics sensor;  ///< field of view; rays are spread by the voxel size
  FreeSpace space;          ///< safe zone and keep-outs; the field is the fixpoint's own
  JointVector start_rad;
  std::uint64_t seed = 1;
  ObservableOptions options;
};

struct ObservableSet {
  std::vector<std::uint8_t> seen;  ///< one byte for each voxel of the mapped zone: 1 can be known (free or occupied)
  std::vector<std::uint8_t> zone;  ///< the mapped zone: nothing outside counts
  std::size_t voxels = 0;          ///< of seen
  int configurations_free = 0;     ///< of the samples, at the end
  int configurations_reached = 0;
  int rounds = 0;
};

/// Iterates: reach what certified edges reach inside known free space, look from everything reached, until nothing is
/// new. The same for every number of workers.
[[nodiscard]] ObservableSet observable_set(const ObservableProblem& problem, WorkerPool& workers);

}  // namespace firstlook::sim
