/// The grader of a simulated cell.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hal/sim/contacts.hpp"
#include "hal/sim/grader.hpp"
#include "hal/sim/known_times.hpp"
#include "hal/sim/true_world.hpp"
#include "platform/loop/worker_pool.hpp"

namespace firstlook::sim {

/// A part of the cell that reports ask for by name: a box in base coordinates.
struct NamedRegion {
  std::string name;
  Eigen::Vector3d low_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d high_m = Eigen::Vector3d::Zero();
};

/// The truth that a grader knows. The world and the threads must outlive it.
struct Truth {
  ArmModel arm;
  const TrueWorld* world = nullptr;
  int link = 6;  ///< that carries the camera; 0: none
  Pose link_T_camera = Pose::Identity();
  Transform<Camera, Depth> camera_T_depth;
  CameraIntrinsics depth;
  double color_clock_s = 0, depth_clock_s = 0;  ///< how far the cameras' stamps are ahead
  FreeSpace space;                              ///< safe zone and keep-outs as configured
  JointVector start_rad;
  std::vector<NamedRegion> regions;
  std::uint64_t seed = 1;
};

class TruthGrader final : public Grader {
 public:
  /// The threads compute what could be observed.
  TruthGrader(const Truth& truth, WorkerPool& workers);

  [[nodiscard]] ContactMonitor& monitor() { return monitor_; }
  [[nodiscard]] KnownTimes& known_times() { return known_times_; }

  void watch(const KnownFreeView* view) override;
  [[nodiscard]] std::uint64_t contacts() const override { return monitor_.contacts(); }
  [[nodiscard]] std::uint64_t unknown_entries() const override { return monitor_.unknown_entries(); }
  [[nodiscard]] TruthFigures grade(const FinalClaims& claims) override;
  [[nodiscard]] std::vector<RegionFigure> regions(const FinalClaims& claims) override;
  [[nodiscard]] Transform<Flange, Camera> true_flange_T_camera() const override {
    return Transform<Flange, Camera>(truth_.link_T_camera);
  }

 private:
  /// A hand-eye transform and views from all around exist only for a camera on the flange.
  [[nodiscard]] bool camera_on_flange() const { return truth_.link == truth_.arm.joints; }
  /// Computed once for each geometry and set of options.
  const ObservableSet& observable(const GridGeometry& geometry, const ObservableOptions& options);
  void grade_alignment(const FinalClaims& claims, TruthFigures& figures) const;
  void grade_hand_eye(const FinalClaims& claims, TruthFigures& figures) const;
  void grade_map(const FinalClaims& claims, TruthFigures& figures);
  [[nodiscard]] double false_occupied_fraction(const FinalClaims& claims) const;

  Truth truth_;
  ContactMonitor monitor_;
  KnownTimes known_times_;
  WorkerPool& workers_;
  struct Known {
    GridGeometry geometry;
    ObservableOptions options;
    ObservableSet set;
  };
  std::optional<Known> known_;
};

}  // namespace firstlook::sim
