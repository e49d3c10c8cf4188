/// Why a cluster of voxels stays unknown, decided by tests.
#pragma once

#include <array>
#include <string_view>

#include "algorithms/mapping/remaining.hpp"
#include "algorithms/view_planning/gain.hpp"

namespace firstlook {

enum class RemainingReason : std::uint8_t {
  kOccluded,    ///< something occupied stands between it and every place that the camera could take
  kOutOfRange,  ///< in view, but nearer than the minimum or farther than the trusted range
  kOutOfReach,  ///< the arm could look at it, but only from space that is not known to be free
  kNoReturn,    ///< looked at without an answer, or in view only along rays that go where nothing returns
};
/// "occluded", "out_of_range", "out_of_reach", "no_return": the words of result.json.
[[nodiscard]] std::string_view to_string(RemainingReason reason);

struct RemainingEntry {
  std::size_t voxels = 0;
  Eigen::Vector3d center_m = Eigen::Vector3d::Zero();
  AxisBox box;
  RemainingReason reason = RemainingReason::kOccluded;
};

struct ReasonOptions {
  std::uint64_t seed = 1;
  int configurations = 600;     ///< inside the joint limits and clear of the arm itself, wherever they are
  int voxels_per_cluster = 24;  ///< frontier voxels tested, evenly spread
};

/// One entry for each cluster, in their order. Each tested frontier voxel votes: no_return when its looks were futile;
/// else by whether any sampled configuration, ignoring what is known to be free, has it in view at a good range
/// (out_of_reach), in view at a bad range only (out_of_range), against the open only (no_return), or not at all
/// (occluded). The most votes win.
[[nodiscard]] std::vector<RemainingEntry> explain_remaining(const ViewContext& context, const GainModel& gain,
                                                            std::span<const UnknownCluster> clusters,
                                                            const ReasonOptions& options = {});

}  // namespace firstlook
