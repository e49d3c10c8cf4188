/// Grades a run against the truth. The code under test cannot reach it: main alone connects the two.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "algorithms/kinematics/arm_model.hpp"
#include "algorithms/mapping/voxel_map.hpp"
#include "algorithms/motion/free_space.hpp"
#include "hal/sim/observable_set.hpp"
#include "platform/core/time.hpp"
#include "platform/core/transform.hpp"

namespace firstlook::sim {

/// What the program holds for free to move in, as it publishes it. Asked on the loop thread only.
class KnownFreeView {
 public:
  virtual ~KnownFreeView() = default;
  [[nodiscard]] virtual const GridGeometry& geometry() const = 0;
  /// True where the body may be at this moment: known free, or intact safe zone.
  [[nodiscard]] virtual bool free_for_motion(std::size_t voxel) const = 0;
  /// True where a hit has taken a voxel out of the safe zone. Elsewhere what lies inside the zone's cylinder is free,
  /// also where the cylinder cuts through a voxel.
  [[nodiscard]] virtual bool zone_revoked(std::size_t /*voxel*/) const { return true; }
  /// True when the map says something of the voxel.
  [[nodiscard]] virtual bool known(std::size_t voxel) const { return free_for_motion(voxel); }
  /// Another number after each change of all this.
  [[nodiscard]] virtual std::uint32_t revision() const { return 0; }
};

/// What a run ends with. Parts that were not reached stay empty.
struct FinalClaims {
  std::optional<Transform<Flange, Camera>> flange_T_camera;
  /// Translation m, rotation rad; left perturbation in the flange frame: R = Exp(d_r) R_estimate, t = t_estimate + d_t.
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  std::optional<Transform<Camera, Depth>> camera_T_depth;
  std::optional<double> color_offset_s, depth_offset_s;  ///< added to the cameras' stamps
  const VoxelMap* map = nullptr;
  std::span<const std::uint8_t> reach_zone;  ///< one byte for each voxel of the map, 0 is outside; empty: everything
  double now_s = 0;                          ///< for the age of what is known free
  double free_max_age_s = 600;
  ObservableOptions observable;  ///< the run's own clearance and sensor limits
};

/// Known share of the observable voxels inside a region that the cell names (behind the screens, inside the box).
struct RegionFigure {
  std::string name;
  Eigen::Vector3d low_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d high_m = Eigen::Vector3d::Zero();
  std::size_t observable = 0;
  std::size_t known = 0;
  double known_fraction = 0;  ///< of the observable voxels; 0 without any
};

/// The object `truth` of result.json. Figures of parts that were not reached are empty.
struct TruthFigures {
  std::optional<double> hand_eye_error_mm;    ///< distance of the camera's origin
  std::optional<double> hand_eye_error_mrad;  ///< angle of the rotation between estimate and truth
  std::optional<double> hand_eye_mahalanobis2;
  std::optional<double> depth_camera_error_mm;  ///< of its place on the colour camera
  std::optional<double> depth_camera_error_mrad;
  std::optional<double> color_stamps_error_s;  ///< after correction: positive when they are still ahead of the arm
  std::optional<double> depth_stamps_error_s;
  std::uint64_t contacts = 0;
  std::uint64_t unknown_entries = 0;
  std::optional<double> coverage_of_observable;
  std::optional<double> known_95_s, known_99_s;  ///< when so many hundredths of what can be observed were known
  /// Known free for motion although the voxel's centre lies in matter: half a voxel of tolerance on either side.
  std::optional<std::uint64_t> false_free_voxels;
  /// Share of the reach zone's voxels that are occupied although neither they nor a neighbour (26 of them: a surface
  /// tolerance of one voxel) hold matter or the arm's bolted base.
  std::optional<double> false_occupied_fraction;
  std::vector<RegionFigure> regions;
  std::size_t observable_voxels = 0;
  std::uint64_t body_checks = 0;  ///< how often the true body was held against the scene
};

class Grader {
 public:
  virtual ~Grader() = default;
  /// From now on entries are judged by this view; null (the beginning): by the safe zone's cylinder. The view must
  /// outlive the cell or be taken back with null.
  virtual void watch(const KnownFreeView* view) = 0;
  [[nodiscard]] virtual std::uint64_t contacts() const = 0;
  [[nodiscard]] virtual std::uint64_t unknown_entries() const = 0;
  /// The truth about a finished run. With a map it computes the observable set: some seconds.
  [[nodiscard]] virtual TruthFigures grade(const FinalClaims& claims) = 0;
  /// Known share of each region's observable voxels now, e.g. after the sweep; only counted for maps of one geometry.
  [[nodiscard]] virtual std::vector<RegionFigure> regions(const FinalClaims& claims) = 0;
  /// The true mount, for reports and tests; means nothing for a camera that is not on the flange.
  [[nodiscard]] virtual Transform<Flange, Camera> true_flange_T_camera() const = 0;
};

}  // namespace firstlook::sim
