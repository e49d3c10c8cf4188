/// What the jobs work with: the arm, the observations of the board, the calibration, the map. Jobs of the map strand
/// run one after the other, so nothing here is locked; what the loop thread needs is published (published_space.hpp).
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "algorithms/calibration/verdict.hpp"
#include "algorithms/calibration/view_design.hpp"
#include "algorithms/kinematics/arm_model.hpp"
#include "algorithms/kinematics/speed.hpp"
#include "algorithms/mapping/color_registration.hpp"
#include "algorithms/mapping/depth_filter.hpp"
#include "algorithms/mapping/distance_field.hpp"
#include "algorithms/mapping/frame_gate.hpp"
#include "algorithms/mapping/insertion.hpp"
#include "algorithms/mapping/map_change.hpp"
#include "algorithms/mapping/open_rays.hpp"
#include "algorithms/mapping/plane_fit.hpp"
#include "algorithms/motion/body.hpp"
#include "algorithms/motion/clearance.hpp"
#include "algorithms/motion/planner.hpp"
#include "algorithms/view_planning/calibration_views.hpp"
#include "algorithms/view_planning/explore.hpp"
#include "algorithms/view_planning/remaining_reason.hpp"
#include "algorithms/view_planning/sweep.hpp"
#include "algorithms/vision/board_pose.hpp"
#include "algorithms/vision/standing_picture.hpp"
#include "app/config/config.hpp"
#include "app/dataset/hand_eye_file.hpp"
#include "app/jobs/published_space.hpp"
#include "app/machine/job_types.hpp"
#include "app/report/map_pictures.hpp"
#include "app/report/run_record.hpp"
#include "hal/api/cameras.hpp"
#include "hal/api/repeated_picture.hpp"
#include "platform/loop/worker_pool.hpp"
#include "platform/memory/pool_buffer.hpp"

namespace firstlook {

/// What the program knows of its cell besides the configuration: the integrator's data sheet.
struct CellFacts {
  JointVector start_rad;                    ///< where the sweep turns around, and where the job parks
  Transform<Camera, Depth> camera_T_depth;  ///< as its maker states it
  std::optional<StoredCalibration> stored;  ///< of an earlier job; for scopes that verify it
  std::optional<ArmModel> arm{};  ///< as measured, or from a file; empty: the one that the configuration names
};

/// A target as it was seen from one stop of the calibration. Those of one stop have the same number of it, their
/// `view.station`, and stand together.
struct Observation {
  JointVector joints_rad;
  double time_s = 0;
  CalibrationView view;
  BoardPose pose;
  double residual_rms_px = 0;
  SettlingRecord settling;
  std::optional<BoardPlane> plane;  ///< of the target in depth frames of this stop
  std::vector<CornerSet> frames;    ///< that `view` is the mean of
};

/// What was seen of a target on the way between two stops.
struct WaySight {
  int target = 0;
  std::vector<JointSample> joints;
  double color_stamp_s = 0;  ///< as the camera has it
  CornerSet corners;
  double depth_stamp_s = 0;
  std::optional<BoardPlane> plane;
  int motion = 0;
};

/// What the frames of one look show.
struct BoardSight {
  struct Target {
    int target = 0;
    StandingPicture picture;
    std::vector<CornerSet> frames;  ///< those that show it
  };
  std::vector<Target> targets;  ///< empty: no board to be used
  bool still = true;
  double moved_px = 0;
};

/// Where a target was seen before the calibration: places it as soon as the camera's place is roughly known.
struct LocatedTarget {
  Transform<Base, Flange> base_T_flange;
  Transform<Camera, Board> camera_T_board;
};

/// Around the arm in depth images: the thesis's self filter.
inline constexpr double kSelfPadding_m = 0.02;

class Workbench {
 public:
  /// Takes all memory that the job needs. Errors: kMapTooLarge and kOutOfMemory with the numbers, kConfigBadValue.
  [[nodiscard]] static Result<std::unique_ptr<Workbench>> make(const Config& config, const CellFacts& facts,
                                                               hal::ColorCamera& color, hal::DepthCamera& depth,
                                                               WorkerPool& workers);

  // ---- the jobs, one for each JobKind. `now_s` is the loop's time of the request.
  [[nodiscard]] ViewList locate_views(const FromHere& here);
  [[nodiscard]] ViewList identify_motions(const FromHere& here);
  [[nodiscard]] PlanResult plan(const PlanArguments& arguments);
  [[nodiscard]] PlanResult certify_path(const PlanArguments& arguments);
  [[nodiscard]] DetectResult detect_board(const DetectArguments& arguments);
  [[nodiscard]] WayResult see_on_the_way(const WayArguments& arguments);
  [[nodiscard]] CalibrationViewResult next_calibration_view(const FromHere& here);
  [[nodiscard]] SolveResult solve();
  [[nodiscard]] ValidateResult validate();
  [[nodiscard]] TouchTestResult touch_test(const TouchTestArguments& arguments);
  [[nodiscard]] VerificationViewResult next_verification_view(const FromHere& here);
  [[nodiscard]] VerifyResult verify_calibration();
  [[nodiscard]] IntegrateResult integrate(const IntegrateArguments& arguments);
  [[nodiscard]] ColorResult color_look(const ColorArguments& arguments);
  [[nodiscard]] NextViewResult next_sweep_view(const FromHere& here);
  [[nodiscard]] NextViewResult next_view(const FromHere& here);
  [[nodiscard]] CheckBoardResult check_board(const DetectArguments& arguments);
  [[nodiscard]] SummarizeResult summarize();

  // ---- what the report is made of; after the loop has ended
  /// The colour camera as everything that follows takes it: as it states, or as a calibration estimated it.
  [[nodiscard]] const CameraIntrinsics& camera() const;
  [[nodiscard]] const std::optional<HandEyeResult>& hand_eye() const { return hand_eye_; }
  /// How depth camera, colour camera and arm stand to each other in space and time.
  [[nodiscard]] const AlignmentRecord& alignment() const { return alignment_; }
  [[nodiscard]] const std::optional<ClearanceTerms>& clearance_terms() const { return mapping_terms_; }
  [[nodiscard]] std::vector<CalibrationViewRecord> calibration_records() const;
  /// With the row "end" when frames went into the map after the last look.
  [[nodiscard]] std::vector<MappingViewRecord> mapping_views() const;
  /// Voxels of the reach zone.
  [[nodiscard]] VoxelCounts zone_counts() const;
  [[nodiscard]] const std::optional<VerifiedCalibration>& verified() const { return verified_; }
  [[nodiscard]] const CellFacts& facts() const { return facts_; }
  [[nodiscard]] const std::vector<RemainingRecord>& remaining() const { return remaining_; }
  [[nodiscard]] const VoxelMap& map() const { return map_; }
  /// With map.planes.
  [[nodiscard]] const MapPlanes& planes() const { return planes_; }
  /// After the last job. @param objects  of map()
  void label_objects(const MapObjects& objects) {
    if (planes_.label) planes_.label->write(objects);
  }
  [[nodiscard]] std::uint64_t looks_colored() const { return looks_colored_; }
  /// Of a part of the cell (map.fine_resolution_m); nothing moves by it. Null when there is none.
  [[nodiscard]] const VoxelMap* fine_map() const { return fine_map_ ? &*fine_map_ : nullptr; }
  [[nodiscard]] bool swept() const { return !sweeping_; }
  /// The classes of the map as the sweep left it; all unknown when the sweep did not end.
  [[nodiscard]] VoxelMap map_after_sweep() const;
  [[nodiscard]] std::span<const std::uint8_t> zone() const { return zone_; }
  /// What became of the prior map in the reach zone; empty without one.
  [[nodiscard]] std::optional<MapChange> change_since_prior() const;
  [[nodiscard]] bool mapped() const { return frames_integrated_ > 0; }
  [[nodiscard]] std::uint64_t frames_integrated() const { return frames_integrated_; }
  [[nodiscard]] const FlawCounts& frames_refused() const { return frames_refused_; }
  [[nodiscard]] std::uint64_t infinite_pixels() const { return gate_.infinite_pixels(); }
  [[nodiscard]] const HolesRecord& holes() const { return holes_record_; }
  [[nodiscard]] std::uint64_t occupied_forgotten() const { return occupied_forgotten_; }
  [[nodiscard]] std::uint64_t pixels_left_out() const { return pixels_left_out_; }
  [[nodiscard]] std::uint64_t pixels_fitted() const { return pixels_fitted_; }
  /// Where the camera stood at each of `mapping_views()`; the outermost corners of each board. For pictures.
  [[nodiscard]] std::vector<CameraPlace> camera_places() const;
  [[nodiscard]] std::vector<std::array<Eigen::Vector3d, 4>> board_outlines_m() const;
  [[nodiscard]] const std::vector<NamedTarget>& targets() const { return targets_; }
  [[nodiscard]] const ArmModel& arm() const { return arm_; }
  [[nodiscard]] PublishedSpace& published() { return published_; }
  [[nodiscard]] double last_stamp_s() const { return last_stamp_s_; }
  /// What was in the way when a motion job last found the arm blocked where it stood; empty: none did.
  [[nodiscard]] std::string_view blocked_by() const { return blocked_.detail(); }

  /// Safety rule 7: nothing is known free until it is seen again.
  void forget_known_free();

 private:
  Workbench(const Config& config, const CellFacts& facts, const ArmModel& arm, hal::ColorCamera& color,
            hal::DepthCamera& depth, WorkerPool& workers, const GridGeometry& geometry);
  [[nodiscard]] Status take_memory();
  void take_options();

  [[nodiscard]] const Body& body_of(MotionPhase phase) const;
  [[nodiscard]] FreeSpace space_of(MotionPhase phase) const;
  /// How a mapping motion is asked for: first with room to spare, so that voxels that flicker do not block it; then
  /// with the clearance of safety rule 5; then slowly, which needs less room to stop.
  struct Pace {
    Clearance plan;      ///< to choose and plan with
    Clearance in_force;  ///< that the path must keep while it is driven
    SpeedLimits limits;
  };
  [[nodiscard]] std::array<Pace, 3> mapping_paces() const;
  void revoke_zone();
  void take_prior(VoxelMap prior);
  void note_trail(const Path& path);
  void note_blocked(const Error& error);
  [[nodiscard]] Route route_of(const Path& path, const Body& body, const SpeedLimits& limits) const;
  [[nodiscard]] bool route_is_certified(const JointVector& from, const Route& route, double* margin_m = nullptr) const;
  [[nodiscard]] bool route_is_certified(const Body& body, const FreeSpace& space, const Clearance& clearance,
                                        const JointVector& from, const Route& route, double* margin_m) const;
  void spread_over_workers(int n, IndexedBody body) const {
    workers_.parallel_for(n, [&body](int index, int worker) { body(index, worker); });
  }
  /// Unknown voxels that make a view worth it.
  [[nodiscard]] std::uint32_t gain_min() const {
    return static_cast<std::uint32_t>(config_.explore.cluster_voxels_min);
  }
  [[nodiscard]] ViewContext context(const Clearance& clearance) const;
  [[nodiscard]] NextViewResult sweep_at(const Pace& pace, const FromHere& here);
  [[nodiscard]] bool exploring_is_faster(const ViewContext& view_context, const SweepStep& step, const Pace& pace,
                                         const FromHere& here);
  [[nodiscard]] ViewTiming view_timing(const Pace& pace) const;
  [[nodiscard]] Result<ViewChoice> choose_view(const ViewContext& view_context, const Pace& pace, const FromHere& here);
  [[nodiscard]] NextViewResult explore_at(const Pace& pace, const FromHere& here);

  void begin_alignment();
  void align_sensors();
  void align_depth_camera();
  void align_stamps();
  [[nodiscard]] int target_on_the_way() const;
  [[nodiscard]] Matrix12d covariance_with(int target) const;
  [[nodiscard]] DepthMount stated_mount() const;
  [[nodiscard]] const Transform<Camera, Depth>& camera_T_depth() const {
    return alignment_.depth_camera.mount.camera_T_depth;
  }
  [[nodiscard]] StampOffsets stamp_offsets() const {
    return {alignment_.color_stamps.offset_s, alignment_.depth_stamps.offset_s};
  }
  [[nodiscard]] Result<BoardPlane> plane_of(const hal::Frame& frame, int target,
                                            const Transform<Camera, Board>& camera_T_board);
  [[nodiscard]] std::optional<BoardPlane> plane_beside(const DetectArguments& arguments, int target,
                                                       const BoardPose& pose);
  [[nodiscard]] std::optional<SeenPose> seen_pose(const WaySight& sight) const;
  /// Reads the frame's pixels, unless the camera finds the corners itself.
  [[nodiscard]] Status read_picture(const hal::Frame& frame);
  using GrayPixels = std::vector<std::uint8_t>;
  [[nodiscard]] std::vector<GrayPixels> read_after(std::span<const PosedFrame> frames, std::size_t f);
  [[nodiscard]] Result<CornerSet> corners_of(const hal::Frame& frame, int target);
  [[nodiscard]] BoardSight sight_of(const DetectArguments& arguments);
  void keep_picture(std::size_t stop);
  void observe(std::size_t stop, const DetectArguments& arguments, const BoardSight& sight,
               const BoardSight::Target& seen, const BoardPose& pose);
  void settle_observations(BoardLook purpose);
  void note_collect_look(const JointVector& at_rad, TargetMask seen);
  /// How many stops showed a target, and how many may: with those that Validate asks for.
  [[nodiscard]] std::size_t stops() const;
  [[nodiscard]] std::size_t stops_max() const {
    return static_cast<std::size_t>(config_.calibration.views_max + kSecondLooks);
  }
  [[nodiscard]] const BoardSpec& board(int target) const { return boards_[static_cast<std::size_t>(target)]; }
  [[nodiscard]] TargetMask solved_targets() const;
  struct BoardShift {
    double shift_m = 0;
    double limit_m = 0;
  };
  [[nodiscard]] BoardShift shift_of(int target, const BoardPose& pose,
                                    const Transform<Base, Flange>& base_T_flange) const;
  /// What the views taken so far say; the covariance only where intrinsics are estimated and could be.
  struct RoughModel {
    std::vector<ViewDesignModel> models;  ///< one for each target whose place is known or likely
    std::vector<int> targets;             ///< that they are of
    std::optional<Matrix6d> covariance;
  };
  [[nodiscard]] std::vector<BoardLookOutcome> look_outcomes(const RoughModel& rough) const;
  void place_targets(const ViewDesignModel& common, const std::vector<PosePair>& pairs,
                     std::span<const TargetPose> refined, RoughModel& rough) const;
  /// Information of the observations named, about the targets of the models.
  [[nodiscard]] Eigen::MatrixXd information_of(const RoughModel& rough,
                                               std::span<const std::size_t> observations) const;
  /// Of the models, those whose targets want more views than the observations named.
  [[nodiscard]] std::uint32_t wanted_targets(const RoughModel& rough, std::span<const std::size_t> observations) const;
  [[nodiscard]] std::optional<RoughModel> rough_model() const;
  [[nodiscard]] bool estimates_intrinsics() const { return config_.calibration.intrinsics == "estimate"; }
  [[nodiscard]] CalibrationViewResult next_bootstrap_view(const FromHere& here);
  [[nodiscard]] CalibrationViewResult calibration_view_after_look(const FromHere& here);
  [[nodiscard]] std::vector<JointVector> places_of(std::span<const std::size_t> counted) const;
  void note_sigma(const RoughModel& rough, const Eigen::MatrixXd& information, CalibrationViewResult& result) const;
  [[nodiscard]] CalibrationViewOptions calibration_view_options(const FromHere& here) const;
  [[nodiscard]] ArmSigma arm_sigma_expected() const;
  [[nodiscard]] HandEyeOptions solve_options() const;
  [[nodiscard]] std::vector<std::size_t> independent_observations() const;
  void reproject(const CalibrationView& view, CalibrationViewRecord& record) const;
  [[nodiscard]] std::vector<CalibrationView> views() const;
  [[nodiscard]] bool tests_by_touch() const { return config_.calibration.touch_test == "yes"; }
  [[nodiscard]] TouchRecord touch_record(const TouchTestArguments& arguments) const;
  [[nodiscard]] std::vector<PosePair> repeated_looks(int target) const;
  [[nodiscard]] HandEyeClaim claim() const;
  [[nodiscard]] RoughModel claimed_model(const HandEyeClaim& stated) const;
  [[nodiscard]] std::optional<Path> best_verification_view(const FromHere& here, const RoughModel& rough,
                                                           const Eigen::MatrixXd& information);
  [[nodiscard]] std::optional<Path> next_turn(const FromHere& here);
  [[nodiscard]] std::optional<FrameFlaw> insert_frame(const PosedFrame& posed);
  [[nodiscard]] double pose_sigma_m(const PosedFrame& posed, const LinkFrames& frames) const;
  void begin_mapping();
  void rebuild_free_space(double now_s);
  void publish_blind(double now_s, MotionPhase phase);
  /// While the board is looked for and the camera's link is found.
  [[nodiscard]] MotionPhase searching_phase() const {
    return facts_.stored ? MotionPhase::kBeforeCalibration : MotionPhase::kLinkUnknown;
  }
  void note_frame(const IntegrateArguments& arguments, const VoxelCounts& counts);
  [[nodiscard]] NextViewResult found_view(const Path& path, double gain, const Pace& pace) const;
  void take_choice(const Path& path, double gain, const Pace& pace);

  Config config_;
  CellFacts facts_;
  ArmModel arm_;
  hal::ColorCamera& color_;
  hal::DepthCamera& depth_;
  WorkerPool& workers_;
  std::vector<NamedTarget> targets_;
  std::vector<BoardSpec> boards_;  ///< of them
  SpeedLimits limits_;
  SafeZone zone_cylinder_;

  Planner planner_;
  Body searching_body_;  ///< a camera envelope on every link, or at the flange alone
  Body envelope_body_;   ///< one at the flange
  /// The safe zone has room for an envelope on every link where the arm starts. Without it (a UR10 in a zone of 0.5 m)
  /// a camera is expected at the flange, and the inner joints are not turned for one on another link.
  bool searches_inner_links_ = false;
  Body camera_body_;
  ClearanceTerms blind_terms_;  ///< before the calibration: no measurement is involved
  std::optional<ClearanceTerms> mapping_terms_;
  ClearanceTerms slow_terms_;     ///< mapping at kSlowSpeed: less room to stop
  Clearance clearance_in_force_;  ///< what the path under way was certified with

  memory::PoolBuffer<std::uint8_t> gray_;
  memory::PoolBuffer<std::uint16_t> depth_pixels_;
  memory::PoolBuffer<float> self_depth_;
  memory::PoolBuffer<std::uint8_t> pictures_;  ///< one for each observation
  std::vector<memory::PoolShare> shares_;

  std::vector<std::optional<BoardPose>> identify_reference_;  ///< by target, where a board was seen first
  std::vector<std::optional<LocatedTarget>> located_;         ///< by target
  std::vector<int> sought_;  ///< by target: views that were to show it for its own sake
  std::vector<Observation> observations_;
  std::vector<WaySight> way_sights_;
  AlignmentRecord alignment_;
  /// A look of the collection at boards, the latest last.
  struct CollectLook {
    JointVector at_rad;
    TargetMask expected, seen;
  };
  FixedVector<CollectLook, 128> collect_looks_;
  TargetMask targets_expected_ = 0;  ///< of the view that the arm is sent to
  Turns bootstrap_;
  std::size_t bootstrap_next_ = 0;
  int fixed_next_ = 0;                 ///< of next_fixed_view
  std::size_t bootstrap_centers_ = 0;  ///< views around which bootstrap views were made
  std::optional<HandEyeResult> hand_eye_;
  std::uint32_t verification_looks_ = 0;  ///< with or without the board
  std::optional<Turns> turns_;            ///< around the first view, when the board was not where it should be seen
  std::size_t turns_next_ = 0;
  std::optional<VerifiedCalibration> verified_;

  VoxelMap map_;
  Inserter inserter_;
  FrameGate gate_;
  std::optional<OpenRays> open_rays_;  ///< with map.holes: clear_when_corroborated
  std::optional<DepthFilter> filter_;  ///< with depth.crop_m or depth.filter_voxel_m
  std::optional<PlaneFit> plane_fit_;  ///< with depth.plane_fit_px
  std::optional<VoxelMap> fine_map_;   ///< with map.fine_resolution_m
  std::optional<Inserter> fine_inserter_;
  MapPlanes planes_;                                     ///< with map.planes
  std::optional<ColorRegistration> color_registration_;  ///< with colours
  memory::PoolBuffer<Rgb> colors_;                       ///< with colours: a picture
  std::uint64_t looks_colored_ = 0;
  /// The frame that went into the map last, as it did; its pixels are in depth_pixels_ and self_depth_.
  struct InsertedFrame {
    std::uint32_t sequence = 0;
    Transform<Base, Depth> base_T_depth;
    double units_per_m = 1000;
  };
  std::optional<InsertedFrame> inserted_;
  DistanceField field_;
  std::vector<std::uint8_t> free_mask_;
  std::vector<std::uint8_t> zone_;
  DistanceField revoked_field_;  ///< of the safe zone's voxels that a hit took away
  bool any_revoked_ = false;
  FreeSpace mapping_space_;  ///< as rebuilt last
  ViewChooser chooser_;
  std::optional<VoxelMap> prior_;  ///< a hint for views; never for motion
  FixedVector<JointVector, 512> trail_;
  std::optional<SweepProgress> sweep_;
  std::vector<std::int8_t> swept_log_odds_;  ///< when the sweep ended
  PublishedSpace published_;
  hal::RepeatedPicture last_picture_;  ///< of depth
  double last_stamp_s_ = 0;
  bool sweeping_ = true;
  /// The view that was chosen for after a look that is still to come.
  struct ForeseenView {
    Path path;
    ViewGain gain;
    Pace pace;
  };
  std::optional<ForeseenView> foreseen_;
  double expected_gain_ = 0;
  Error blocked_;  ///< the latest kStartBlocked
  std::uint64_t frames_integrated_ = 0;
  FlawCounts frames_refused_{};
  HolesRecord holes_record_;
  std::uint64_t occupied_forgotten_ = 0;
  std::uint64_t pixels_left_out_ = 0;
  std::uint64_t pixels_fitted_ = 0;
  std::uint64_t unknown_before_ = 0;   ///< the last frame
  std::uint64_t unknown_at_view_ = 0;  ///< after the last view
  std::vector<MappingViewRecord> mapping_views_;
  std::optional<MappingViewRecord> after_views_;  ///< the last frame, when it was none of a view
  std::vector<RemainingRecord> remaining_;
};

}  // namespace firstlook
