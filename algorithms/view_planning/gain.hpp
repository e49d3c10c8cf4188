/// The expected gain of a look: unknown voxels along the rays that the arm's own body leaves free.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "algorithms/view_planning/far_returns.hpp"
#include "algorithms/view_planning/view_context.hpp"
#include "platform/core/fixed_vector.hpp"

namespace firstlook {

/// How finely a look is sampled for its gain.
struct GainSampling {
  int columns = 44;  ///< 1.3 degrees for a Kinect: a 5 cm voxel is met out to 2.2 m, and the reach zone ends before
  int rows = 33;
  int cluster_voxels_min =
      8;                     ///< unknown voxels in smaller clusters count nothing: rays see them everywhere along edges
  int again_futile_max = 2;  ///< the same for a free voxel that motion cannot use yet
  int futile_max = 1;        ///< looks without result after which a voxel is taken to be solid or to give no return
};

/// Counts, for each voxel, looks that should have told something about it and did not (no return, grazing, dark
/// surface), and of them those along rays with a surface behind. Without it a voxel that the sensor cannot resolve
/// would attract the arm forever. Memory is taken at construction.
class FutileLooks {
 public:
  explicit FutileLooks(const GridGeometry& geometry) : count_(geometry.count(), 0) {}
  [[nodiscard]] int count(std::size_t index) const { return count_[index] & kMax; }
  [[nodiscard]] int backed(std::size_t index) const { return count_[index] >> kBits; }
  void add(std::size_t index, bool backed) {
    if (count(index) < kMax) ++count_[index];
    if (backed && this->backed(index) < kMax) count_[index] = static_cast<std::uint8_t>(count_[index] + kMax + 1);
  }
  void clear() { std::fill(count_.begin(), count_.end(), std::uint8_t{0}); }

 private:
  static constexpr int kBits = 4, kMax = (1 << kBits) - 1;
  std::vector<std::uint8_t> count_;
};

/// Scratch of one worker.
class GainWorker {
 public:
  GainWorker(const GridGeometry& geometry, std::size_t rays_max);
  GainScratch scratch;
  GainRays rays;       ///< those that the body leaves free
  GainRays returning;  ///< and of these those that are not known to go where nothing returns
};

/// Counts gains on one map. The plane is built once for each choice, then any number of workers count on it.
class GainModel {
 public:
  GainModel(const GridGeometry& geometry, const DepthSensor& sensor, const GainSampling& sampling = {});
  [[nodiscard]] static std::size_t required_bytes(const GridGeometry& geometry, const DepthSensor& sensor,
                                                  const GainSampling& sampling = {});

  /// Takes the memory that contexts with a prior map need: prior_bytes().
  void allow_prior() { prior_plane_.emplace(geometry_); }
  [[nodiscard]] static std::size_t prior_bytes(const GridGeometry& geometry) {
    return GainPlane::required_bytes(geometry);
  }

  /// Learns from a frame where rays end outside of the map.
  void learn_returns(const DepthImage& depth, const Transform<Base, Depth>& base_T_depth,
                     std::span<const float> self_depth_m) {
    far_.learn(depth, sensor_.intrinsics, base_T_depth, self_depth_m);
  }

  /// Reads map, zone, free space and prior map (after allow_prior() only). Unknown voxels of the zone in clusters that
  /// are large enough count; free ones
  /// that motion cannot use yet count as `again`; a free voxel that holds a surface stops rays: a part of it was hit,
  /// and what lies behind that part is the inside of things; voxels with futile_max futile looks stop rays like
  /// occupied ones. Rays that have a known surface behind them count such a voxel still, until as many of their kind
  /// were futile, too: a look into the open sky tells nothing, one past the same place towards a wall does.
  void prepare(const ViewContext& context);

  /// On the prepared map: what a look at q would tell counts no more, as if it had been taken. Holds until the next
  /// prepare(). False, and nothing has changed, where more than that would change: rays with a surface behind them tell
  /// something there.
  [[nodiscard]] bool assume_look(const ViewContext& context, const JointVector& q_rad, GainWorker& worker);

  /// What a look at configuration q would tell on the prepared map. Rays end at the trusted range; nearer than the
  /// sensor's minimum nothing counts; rays that meet the body are left out.
  [[nodiscard]] ViewGain count(const ViewContext& context, const JointVector& q_rad, GainWorker& worker) const;
  /// The same in two steps: as if nothing of it were doubtful, which weighs no less, and then what of it is.
  [[nodiscard]] ViewGain count_at_most(const ViewContext& context, const JointVector& q_rad, GainWorker& worker) const;
  void find_doubtful(const ViewContext& context, const JointVector& q_rad, GainWorker& worker, ViewGain& gain) const;

  /// After a look at q was integrated into the map: voxels that its rays meet first and that are still unknown, or free
  /// but still not usable for motion, had a futile look. Call it once for each look; returns how many there were.
  std::size_t remember_look(const ViewContext& context, const JointVector& q_rad, GainWorker& worker);

  [[nodiscard]] const FutileLooks& futile() const { return futile_; }
  /// Every look may tell something again: what was known is no longer.
  void forget_futile() { futile_.clear(); }
  [[nodiscard]] const DepthSensor& sensor() const { return sensor_; }
  [[nodiscard]] const GainSampling& sampling() const { return sampling_; }
  [[nodiscard]] GainWorker worker() const { return {geometry_, rays_.ends_m.size()}; }
  /// Indices of unknown voxels of the zone that touch a free one and are not written off, ascending; from prepare().
  [[nodiscard]] std::span<const std::uint32_t> frontier() const { return frontier_; }
  /// Whether only rays with a known surface behind count this unknown voxel; from prepare().
  [[nodiscard]] bool needs_backing(std::size_t index) const {
    return futile_.count(index) >= sampling_.futile_max && futile_.backed(index) < sampling_.futile_max;
  }
  /// Whether a ray along a unit direction meets a known surface within the sensor's range, in the map or beyond it.
  [[nodiscard]] bool is_backed(const VoxelMap& map, const Eigen::Vector3d& from_m,
                               const Eigen::Vector3d& direction) const;
  /// Whether a ray along a unit direction goes, by what has been seen, where nothing returns.
  [[nodiscard]] bool is_open(const Eigen::Vector3d& from_m, const Eigen::Vector3d& direction) const {
    return far_.is_open(from_m, from_m + sensor_.range_max_m * direction);
  }
  /// Unknown voxels of the zone; from prepare().
  [[nodiscard]] std::size_t unknown() const { return unknown_; }

 private:
  /// The rays that no capsule of the body blocks; lives in the worker when some are.
  const GainRays& free_rays(const ViewContext& context, const LinkFrames& frames,
                            const Transform<Base, Depth>& base_T_depth, GainWorker& worker) const;
  /// Counts on the plane.
  [[nodiscard]] ViewGain count_along(const GainRays& rays, const Transform<Base, Depth>& base_T_depth,
                                     GainScratch& scratch) const;
  using Passed = FixedVector<std::uint32_t, 128>;
  /// The unknown voxels that needs_backing() on a ray to `end` (base; `depth_m` along the optical axis), in order, into
  /// `passed`; none when it has no backing. `is_open(index)` may say at once that a voxel is free and hides nothing.
  template <typename IsOpen>
  void pass_with_backing(const ViewContext& context, const Eigen::Vector3d& eye, const Eigen::Vector3d& end,
                         double depth_m, IsOpen is_open, Passed& passed) const;
  /// Unknown voxels that needs_backing() and rays with backing see, beyond those counted on the plane.
  [[nodiscard]] std::uint32_t count_backed(const ViewContext& context, const Transform<Base, Depth>& base_T_depth,
                                           const GainRays& rays, GainScratch& scratch) const;
  /// Of `rays` those that do not go where nothing returns, into the worker's.
  const GainRays& returning_rays(const Transform<Base, Depth>& base_T_depth, const GainRays& rays,
                                 GainWorker& worker) const;
  void find_frontier(const ViewContext& context);
  void prepare_prior(const ViewContext& context);

  GridGeometry geometry_;
  DepthSensor sensor_;
  GainSampling sampling_;
  GainRays rays_;
  double half_cone_rad_ = 0;  ///< the widest ray off the optical axis
  GainPlane plane_;
  std::optional<GainPlane> prior_plane_;  ///< 1 where a surface is expected; empty: no prior map is allowed
  std::size_t unknown_ = 0;
  std::vector<std::uint32_t> frontier_;
  FutileLooks futile_;
  FarReturns far_;
  Eigen::AlignedBox3d backed_only_m_;  ///< around the voxels that needs_backing(); empty without any
};

}  // namespace firstlook
