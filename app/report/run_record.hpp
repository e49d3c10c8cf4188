/// All that result.json, views.csv and the report tell about a run: plain values, filled by whoever drives the job.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "algorithms/calibration/verdict.hpp"
#include "algorithms/mapping/voxel_map.hpp"
#include "algorithms/motion/clearance.hpp"
#include "app/machine/decisions.hpp"
#include "platform/core/camera_intrinsics.hpp"
#include "platform/core/fault_table.hpp"
#include "platform/core/joint_vector.hpp"
#include "platform/core/transform.hpp"

namespace firstlook {

/// Row-major grey pixels.
struct GrayPicture {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> pixels;
};

/// Row-major RGB pixels, three bytes each, and what they show.
struct RgbPicture {
  std::string caption;
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> pixels;
};

struct PhaseRecord {
  std::string name;
  double start_s = 0;
  double end_s = 0;
};

/// One view of the board that took part in the calibration, in the order taken.
struct CalibrationViewRecord {
  double time_s = 0;
  JointVector joints_rad;
  Transform<Base, Flange> base_T_flange;
  std::vector<Eigen::Vector2d> detected_px;
  std::vector<Eigen::Vector2d> reprojected_px;  ///< same order; empty when not solved
  double rms_px = 0;
  bool held_out = false;
  GrayPicture picture;  ///< whole frame of the camera; empty without one (e.g. --sensor fast)
};

/// One look of sweep or exploration, in the order taken; counts are those of the mapped zone after it.
struct MappingViewRecord {
  std::string phase;  ///< "sweep" or "explore"
  double time_s = 0;
  JointVector joints_rad;
  double gain_expected = 0;  ///< as scored when chosen; 0 for the first look
  std::uint64_t gain_seen = 0;
  std::uint64_t unknown = 0, free = 0, occupied = 0;
};

/// A cluster of voxels that stayed unknown.
struct RemainingRecord {
  std::uint64_t voxels = 0;
  std::string reason;
  Eigen::Vector3d center_m = Eigen::Vector3d::Zero();  ///< base
};

/// Null in result.json when nothing was mapped.
struct MappingRecord {
  double resolution_m = 0;
  std::vector<MappingViewRecord> views;
  VoxelCounts voxels;
  std::vector<RemainingRecord> remaining;
  std::uint64_t frames_integrated = 0;
  std::uint64_t frames_dropped = 0;
};

struct StopRecord {
  double time_s = 0;
  std::string cause;
};

struct SafetyRecord {
  std::optional<ClearanceTerms> clearance;  ///< empty when no calibration gave one
  std::optional<double> min_clearance_m;  ///< smallest distance of the body to anything not free; empty without motion
  std::vector<StopRecord> stops;
};

/// One row of the memory page.
struct PoolRecord {
  std::string name;
  std::uint64_t reserved_bytes = 0;
  std::uint64_t peak_bytes = 0;
};

struct MemoryRecord {
  std::uint64_t budget_bytes = 0;
  std::uint64_t peak_bytes = 0;
  std::uint64_t loop_allocations_after_seal = 0;
  std::vector<PoolRecord> pools;
};

/// What differs from run to run. Only result.json's `wall` and the report's last section show it.
struct WallRecord {
  std::string started;  ///< UTC, ISO 8601
  double total_s = 0;
  double stall_s = 0;
  std::uint64_t rss_bytes = 0;
  std::string folder;
  int workers = 0;
};

/// The simulator's grade. Null in result.json without a simulated cell; a member is null when it was not determined.
struct TruthRecord {
  std::optional<double> hand_eye_error_mm;
  std::optional<double> hand_eye_error_mrad;
  std::optional<double> hand_eye_mahalanobis2;
  std::uint64_t contacts = 0;
  std::uint64_t unknown_entries = 0;
  std::optional<double> coverage_of_observable;  ///< 0..1
  std::optional<std::uint64_t> false_free_voxels;
  /// A part of the cell that is named in its description, e.g. behind the screens: share of its observable voxels
  /// known.
  struct Region {
    std::string name;
    std::uint64_t observable = 0;
    double known_after_sweep = 0;  ///< 0..1
    double known = 0;              ///< 0..1, at the end
  };
  std::vector<Region> regions;
};

/// A line of the fault log.
struct FaultRecord {
  double time_s = 0;
  Fault fault = Fault::kInternal;
  std::string detail;
};

/// Where the run came from, as far as it does not change from machine to machine.
struct Provenance {
  std::string version;
  std::string arm_model;
  std::string sensor;       ///< "full" or "fast"
  std::string config_yaml;  ///< print_config of what the run used
  std::string journal_hash;
};

struct RunRecord {
  Outcome outcome = Outcome::kFaulted;
  std::string reason;  ///< one sentence; for `done`, too
  std::int64_t seed = 0;
  std::string cell;
  std::vector<PhaseRecord> phases;
  std::string decisions_hash;

  std::optional<HandEyeResult> hand_eye;
  std::string solver;           ///< closed form that started it
  CameraIntrinsics intrinsics;  ///< of the colour camera; width 0: unknown, no camera_info.yaml
  std::vector<CalibrationViewRecord> calibration_views;

  std::optional<MappingRecord> mapping;
  std::vector<RgbPicture> map_pictures;
  std::optional<SafetyRecord> safety;
  std::optional<MemoryRecord> memory;
  std::vector<FaultRecord> faults;
  Provenance provenance;
  WallRecord wall;
  std::optional<TruthRecord> truth;
};

}  // namespace firstlook
