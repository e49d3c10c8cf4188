/// All that result.json, views.csv and the report tell about a run: plain values, filled by whoever drives the job.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstdint>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

#include "algorithms/calibration/depth_to_color.hpp"
#include "algorithms/calibration/solver_comparison.hpp"
#include "algorithms/calibration/time_offset.hpp"
#include "algorithms/calibration/verdict.hpp"
#include "algorithms/calibration/verification.hpp"
#include "algorithms/kinematics/arm_model.hpp"
#include "algorithms/mapping/frame_gate.hpp"
#include "algorithms/mapping/map_change.hpp"
#include "algorithms/mapping/map_planes.hpp"
#include "algorithms/mapping/objects.hpp"
#include "algorithms/mapping/voxel_map.hpp"
#include "algorithms/motion/clearance.hpp"
#include "app/dataset/hand_eye_file.hpp"
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

/// A picture of the map and what is drawn upon it; places in px of the picture, (0, 0) the centre of its upper left
/// pixel.
struct MapPicture {
  enum class Layout : std::uint8_t { kWide, kPair, kHalf };
  struct Line {
    std::string style;  ///< class of the page's style sheet; a word of ours, not data
    std::vector<Eigen::Vector2d> points_px;
  };
  struct Label {
    std::string style, text;
    Eigen::Vector2d at_px = Eigen::Vector2d::Zero();  ///< middle of the text
  };
  /// A place of the camera.
  struct View {
    std::string style;  ///< by phase
    Eigen::Vector2d at_px = Eigen::Vector2d::Zero();
    std::optional<Eigen::Vector2d> number_px;  ///< where its number stands; empty: it has none
    int number = 0;
  };
  RgbPicture picture;
  std::string group;              ///< pictures that follow each other with the same group stand side by side under it
  Layout layout = Layout::kPair;  ///< kWide: one over the page; kPair: two; kHalf: two in half of it
  std::vector<Line> lines;
  std::vector<Label> labels;
  std::vector<View> views;
  std::optional<std::array<double, 2>> heights_m;  ///< a scale of the colours from the lowest to the highest voxel
  double text_px = 18;
};

struct PhaseRecord {
  std::string name;
  double start_s = 0;
  double end_s = 0;
};

/// One view of the board that took part in the calibration, in the order taken.
/// How the picture stood while a view was taken (standing_picture.hpp).
struct SettlingRecord {
  int looks = 1;          ///< until it stood still, or until there was no more waiting
  double moved_px = 0;    ///< in the look that was used
  double scatter_px = 0;  ///< of a corner in one of its frames
  bool still = true;
};

struct CalibrationViewRecord {
  std::string name;  ///< of recorded data: its image; of a run with several targets: time and target; else empty
  int target = 0;    ///< which of several it shows
  int station = -1;  ///< those of one place of the arm have the same number, and the same picture
  double time_s = 0;
  JointVector joints_rad;
  Transform<Base, Flange> base_T_flange;
  std::vector<Eigen::Vector2d> detected_px;
  std::vector<int> detected_ids;                ///< the board's point that each of them is; empty: all, in order
  std::vector<Eigen::Vector2d> reprojected_px;  ///< same order; empty when not solved
  double rms_px = 0;                            ///< of the above: no deviation of the arm is granted
  std::optional<double> holdout_px;  ///< the same under a solve that left this view out; empty: not validated
  bool counted = true;               ///< false: too near a later view to tell anything of its own; not in the solve
  bool used = true;                  ///< false: the solve left it out as wrong
  std::optional<SettlingRecord> settling;  ///< empty: recorded data
  GrayPicture picture;                     ///< whole frame of the camera; empty without one (e.g. --sensor fast)
};

/// One look of sweep or exploration, in the order taken; counts are voxels of the reach zone after it. When frames went
/// into the map after the last look (on the way to the parking pose, or until a stop), the last of them is a row, too:
/// phase "end". So the last row is the map as the job left it.
struct MappingViewRecord {
  std::string phase;  ///< "sweep", "explore" or "end"
  double time_s = 0;
  JointVector joints_rad;
  /// Unknown voxels that a look from here was thought to reach when it was chosen, other unknown ones seen through; 0
  /// when it was not chosen for that (first look, look around after an interruption, end).
  double gain_expected = 0;
  /// By how much the unknown voxels became fewer since the row before (the first: since the map was empty), at the view
  /// and on the way there.
  std::uint64_t gain_seen = 0;
  std::uint64_t unknown = 0, free = 0, occupied = 0;
};

/// A cluster of voxels that stayed unknown.
struct RemainingRecord {
  std::uint64_t voxels = 0;
  std::string reason;
  Eigen::Vector3d center_m = Eigen::Vector3d::Zero();  ///< base
};

/// What pixels without a return did to the map (safety rule 9).
struct HolesRecord {
  std::string policy = "ignore";  ///< map.holes
  std::uint64_t pixels_open = 0;  ///< taken for open space, of all frames
  std::uint64_t voxels_cleared = 0;
};

/// The finer map of a part of the cell.
struct FineMapRecord {
  double resolution_m = 0;
  VoxelCounts voxels;
};

/// What is kept for each voxel besides (map.planes).
struct PlanesRecord {
  PlaneCounts counts;               ///< of the whole grid
  std::uint64_t looks_colored = 0;  ///< looks whose colour frames gave colours
};

/// Null in result.json when nothing was mapped.
struct MappingRecord {
  double resolution_m = 0;
  std::vector<MappingViewRecord> views;
  VoxelCounts voxels;       ///< of the reach zone at the end, as in the last of `views`
  VoxelCounts grid_voxels;  ///< of the whole grid: what the map files hold
  std::optional<PlanesRecord> planes;
  std::optional<FineMapRecord> fine;
  std::vector<RemainingRecord> remaining;
  std::optional<MapChange> since_prior;  ///< in the reach zone; empty when no earlier map was given
  MapObjects objects;                    ///< of the whole grid, as collision_map.bt has it; without the voxels' ids
  std::uint64_t frames_integrated = 0;
  FlawCounts frames_refused{};        ///< by FrameFlaw
  std::uint64_t infinite_pixels = 0;  ///< of the largest value: taken for no return
  std::uint64_t pixels_left_out = 0;  ///< by depth.crop_m and depth.filter_voxel_m
  std::uint64_t pixels_fitted = 0;    ///< by depth.plane_fit_px
  HolesRecord holes;
  std::uint64_t occupied_forgotten = 0;  ///< occupied voxels that became unknown by age (map.occupied_max_age_s)
  [[nodiscard]] std::uint64_t frames_dropped() const {
    return std::accumulate(frames_refused.begin(), frames_refused.end(), std::uint64_t{0});
  }
};

struct StopRecord {
  double time_s = 0;
  std::string cause;
};

struct SafetyRecord {
  std::optional<ClearanceTerms> clearance;  ///< empty when no calibration gave one
  /// Least distance of the moving arm's body (surface points 25 mm apart) to space that was not free at that moment:
  /// voxels that were not known free (their nearest possible corner), where the zone counts its surface, keep-outs.
  /// Before the calibration is accepted (body with the camera's envelope) and after (with the camera where it is);
  /// empty without motion.
  std::optional<double> min_clearance_calibrating_m;
  std::optional<double> min_clearance_mapping_m;
  /// The smaller of the two.
  [[nodiscard]] std::optional<double> min_clearance_m() const {
    if (!min_clearance_calibrating_m || !min_clearance_mapping_m) {
      return min_clearance_calibrating_m ? min_clearance_calibrating_m : min_clearance_mapping_m;
    }
    return std::min(*min_clearance_calibrating_m, *min_clearance_mapping_m);
  }
  std::vector<StopRecord> stops;
};

/// One row of the memory page.
struct PoolRecord {
  std::string name;
  std::uint64_t reserved_bytes = 0;
  std::uint64_t peak_bytes = 0;
  bool declared = false;  ///< counted whole whatever is used of it; WallRecord has what was measured
};

struct MemoryRecord {
  std::uint64_t budget_bytes = 0;
  std::uint64_t peak_bytes = 0;
  std::uint64_t loop_allocations_after_seal = 0;
  std::vector<PoolRecord> pools;
};

/// What the jobs of one kind took by the computer's clock.
struct JobTimesRecord {
  std::string name;
  std::uint64_t count = 0;
  double total_s = 0;
  double longest_s = 0;
};

/// What differs from run to run. Only result.json's `wall` and the report's last section show it.
struct WallRecord {
  std::string started;  ///< UTC, ISO 8601
  double total_s = 0;
  /// Time of the job in which the arm stood still and waited for a job's result. In virtual time jobs take their
  /// declared durations, so the figure is declared, too; with --real-time it is what the computer took.
  double stall_s = 0;
  bool real_time = false;
  std::uint64_t rss_bytes = 0;
  std::uint64_t boot_heap_bytes = 0;      ///< what boot took from the heap and kept; measured by the allocator
  std::uint64_t job_heap_peak_bytes = 0;  ///< the largest of all jobs; measured by the allocator
  std::uint64_t library_bytes = 0;        ///< resident pages of files: program and shared libraries
  std::string folder;
  int workers = 0;
  std::vector<JobTimesRecord> jobs;  ///< those that ran
};

/// The simulator's grade. Null in result.json without a simulated cell; a member is null when it was not determined.
struct TruthRecord {
  std::optional<double> hand_eye_error_mm;
  std::optional<double> hand_eye_error_mrad;
  std::optional<double> hand_eye_mahalanobis2;
  std::optional<double> depth_camera_error_mm;  ///< of its place on the colour camera
  std::optional<double> depth_camera_error_mrad;
  std::optional<double> color_stamps_error_s;  ///< after correction: positive when they are still ahead of the arm
  std::optional<double> depth_stamps_error_s;
  std::uint64_t contacts = 0;
  std::uint64_t unknown_entries = 0;
  std::optional<double> coverage_of_observable;  ///< 0..1
  struct Way {
    double time_s = 0;  ///< since mapping began
    int views = 0;      ///< stops
  };
  std::optional<Way> to_95, to_99;                 ///< until so many hundredths of the observable were known
  std::optional<std::uint64_t> false_free_voxels;  ///< known free for motion, their middle in matter
  std::optional<double> false_occupied_fraction;   ///< 0..1, of the reach zone; no matter within a voxel
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

/// The robot on the network, as it told of itself, and how it answered.
struct RobotRecord {
  std::string model;     ///< as ArmModel names it
  std::string software;  ///< "3.15.8"
  std::string serial;    ///< empty: the controller is too old to tell
  std::array<std::uint32_t, 6> kinematics_checksums{};
  std::string calibration_hash;  ///< of these kinematics, as ROS's ur_calibration writes it
  /// `robot.calibration_file`, where the arm model comes from it.
  struct CalibrationFile {
    std::string path;
    std::string hash;          ///< that stands in it; empty: none
    bool hash_agrees = false;  ///< with the controller's
    double flange_off_m = 0;   ///< the largest difference to the controller's kinematics
  };
  std::optional<CalibrationFile> calibration_file;
  std::array<DhRow, 6> dh{};  ///< with the factory's correction: the arm model of the run
  double consent_s = 0;       ///< the longest from the program's connection until it could be moved
  double accept_s = 0;        ///< and from a segment's command until the program had begun it
  double stop_s = 0;          ///< and from a command to stop until the arm stood
  /// And from a stop or pause of the controller, or from the last report of a lost link, until the segment that was
  /// under way was withdrawn; empty: that did not happen.
  std::optional<double> react_s, lost_s;
  std::uint64_t reports = 0;  ///< of the joints
  std::uint64_t broken = 0;   ///< streams of reports that were given up
};

/// Where the run came from, as far as it does not change from machine to machine.
struct Provenance {
  std::string version;
  std::string arm_model;
  std::uint64_t kinematics = 0;  ///< kinematics_checksum of the arm in this run; 0: as published
  std::string sensor;            ///< "full" or "fast"
  std::string config_yaml;       ///< print_config of what the run used
  std::string journal_hash;
};

/// Where a value came from that the cart can find out or take as given.
enum class ValueSource : std::uint8_t { kGiven, kEstimated, kStored };

/// Where the depth camera sits on the colour camera, as the job took it.
struct DepthCameraRecord {
  ValueSource source = ValueSource::kGiven;
  std::string reason;  ///< why it was not estimated although that was asked for
  Transform<Camera, Depth> stated;
  DepthMount mount;  ///< as used; a given one is exact
  int views = 0;     ///< calibration views that showed the board's plane
  std::optional<DepthToColor> estimate;
};

/// What was added to a camera's stamps.
struct StampRecord {
  ValueSource source = ValueSource::kGiven;
  std::string reason;
  double offset_s = 0;
  double sigma_s = 0;
  std::optional<TimeOffset> estimate;
  bool contradicted = false;  ///< frames on the way fit no offset that is looked for
};

/// How the sensors stand to each other in space and time.
struct AlignmentRecord {
  DepthCameraRecord depth_camera;
  StampRecord color_stamps, depth_stamps;
};

/// A calibration of an earlier job, and what its test on this one's views of the board said.
struct VerifiedCalibration {
  StoredCalibration calibration;             ///< `accepted` as of the test
  int looks = 0;                             ///< at the board, with those that did not show it
  std::optional<Verification> verification;  ///< empty when there were too few views to test it
};

struct RunRecord {
  Outcome outcome = Outcome::kFaulted;
  std::string reason;  ///< one sentence; for `done`, too
  std::string remedy;  ///< what to do about it; empty when nothing is to be done
  std::int64_t seed = 0;
  std::string cell;
  std::vector<PhaseRecord> phases;
  std::string decisions_hash;

  std::optional<HandEyeResult> hand_eye;
  std::optional<VerifiedCalibration> verified;  ///< where hand_eye came from, when not solved in this run
  std::string solver;                           ///< closed form that started it
  std::optional<SolverComparison> comparison;   ///< of recorded data alone
  std::vector<std::string> target_names;        ///< by HandEyeResult::targets; empty when there is but one target
  CameraIntrinsics intrinsics;                  ///< of the colour camera; width 0: unknown, no camera_info.yaml
  std::optional<AlignmentRecord> alignment;     ///< empty: recorded data
  std::vector<CalibrationViewRecord> calibration_views;

  std::optional<MappingRecord> mapping;
  std::vector<MapPicture> map_pictures;
  std::optional<SafetyRecord> safety;
  std::optional<RobotRecord> robot;  ///< empty: the arm of the simulated cell, or recorded data
  std::optional<MemoryRecord> memory;
  std::vector<FaultRecord> faults;
  Provenance provenance;
  WallRecord wall;
  std::optional<TruthRecord> truth;
};

}  // namespace firstlook
