/// The hierarchical state machine of the job. Every decision is a function of the settings and the events, nothing
/// else: no clock, no device, no map. Allocates nothing.
#pragma once

#include <bitset>
#include <cstdint>
#include <optional>
#include <utility>

#include "app/machine/decisions.hpp"
#include "app/machine/events.hpp"
#include "app/machine/state_table.hpp"
#include "platform/core/fixed_vector.hpp"
#include "platform/journal/archive.hpp"

namespace firstlook {

enum class RunScope : std::uint8_t { kEverything, kCalibrate, kMap, kVerify };
enum class StartSource : std::uint8_t { kPendant, kPanel };

/// What of the configuration the machine decides by.
struct MachineSettings {
  RunScope scope = RunScope::kEverything;
  StartSource start_source = StartSource::kPendant;
  double settle_time_s = 0.2;
  int frames_per_view = 3;
  int targets = 1;  ///< that are looked for
  int calibration_views_min = 8;
  int calibration_views_max = 30;
  int verify_views = 3;         ///< views of the board that a stored calibration is tested on at least
  bool depth_beside = true;     ///< depth frames beside the colour frames of calibration views
  bool color_at_looks = false;  ///< colour frames beside the depth frames of looks, for the colours of the map
  bool see_on_the_way = true;   ///< frames between calibration views, for the offsets of the stamps
  int explore_views_max = 60;
  double frames_while_moving_hz = 2;
  FixedVector<std::int32_t, kTouchPointsMax> touch_points;  ///< of the board, for the touch test; empty: none
  std::int32_t touch_columns = 0;  ///< points in a row of the board; 0: they are called by their numbers
  double touch_time_max_s = 600;   ///< that a person may take for one corner
  double path_deviation_max_m = 0.02;
  std::array<double, kJointsMax> lever_arm_m{1.15, 1.15, 0.72, 0.32, 0.24, 0.14, 0.14};  ///< bound of FACTS for a UR5
  JointVector parking_rad;  ///< where the job ends; inside the safe zone
};

/// A place of the arm from which targets were seen.
struct TargetView {
  JointVector at_rad;
  TargetMask targets = 0;
};

/// What the machine remembers of the job, apart from the state itself.
struct Progress {
  ViewList views;                     ///< of LocateBoard, later of IdentifyLink
  std::uint32_t view = 0;             ///< position in `views`, in VerifyBoard in `target_views`
  std::uint32_t searches = 0;         ///< for the board that found none: all views of one list were in vain
  bool camera_on_flange = false;      ///< identified
  std::uint32_t observations = 0;     ///< views of the board taken for the calibration
  std::uint32_t views_asked_for = 0;  ///< by Validate, where the last view contradicts the others; 0: it did not ask
  std::uint32_t failed_looks = 0;     ///< in a row, at calibration views
  std::uint32_t still_images = 0;     ///< joints that moved without moving the image
  int still_joint = 0;                ///< the innermost of them
  std::uint32_t steps = 0;            ///< of the current state: seeds its candidates
  std::uint32_t sweep_views = 0;
  std::uint32_t explore_views = 0;
  std::uint32_t replans = 0;        ///< in a row, without a view between
  std::uint32_t interruptions = 0;  ///< of motions by the guardian or a new obstacle
  StampOffsets stamp_offsets;       ///< as solved, for the frames of the map
  bool stamps_wrong = false;        ///< frames on the way fit no offset that is looked for
  bool calibration_accepted = false;
  FixedVector<TouchedPoint, kTouchPointsMax> touches;
  JointVector board_view_rad;  ///< where a board was seen first
  /// Places from which targets were seen first, each target once: they are looked at again at the end.
  FixedVector<TargetView, kViewListMax> target_views;
  TargetMask located = 0;           ///< targets that `target_views` show
  TargetMask relevant = 0;          ///< those that the calibration rests on
  TargetMask standing = 0;          ///< those that stood at the end where they stood before
  StateId resume = StateId::kNone;  ///< where a pause came from
  Instant paused_at{};
  Instant played_at{};
  bool played = false;
  Ending ending;
  NextViewResult chosen;         ///< the view that Explore goes for
  bool chosen_ahead = false;     ///< before the look before it
  std::uint64_t unknown = 0;     ///< voxels after the latest look of Sweep or Explore
  CalibrationViewResult aiming;  ///< the view that Collect goes for
};

class Machine {
 public:
  Machine(const MachineSettings& settings, DecisionSink& sink);

  /// Enters Boot. Call once, before the first event.
  void start(Instant now);
  void on_event(Instant now, const MachineEvent& event);

  [[nodiscard]] StateId state() const { return state_; }
  [[nodiscard]] bool finished() const { return finished_; }
  /// Depth frames that the map would have taken, had the arm's joints at their stamps been known (safety rule 10).
  [[nodiscard]] std::uint64_t depth_frames_unposed() const { return depth_frames_unposed_; }

  // What the states use.
  [[nodiscard]] Instant now() const { return now_; }
  [[nodiscard]] const MachineSettings& settings() const { return settings_; }
  [[nodiscard]] Progress& progress() { return progress_; }
  [[nodiscard]] const hal::ArmState& arm() const { return arm_; }
  [[nodiscard]] double guardian_margin_m() const { return guardian_margin_m_; }
  [[nodiscard]] bool arm_known() const { return arm_known_; }
  /// Where the joints stood during the last `for_s` (below 1 s), their mean; empty when the arm moved or was silent.
  [[nodiscard]] std::optional<JointVector> stood_at(double for_s) const;
  /// Of what the arm did and the cameras saw nothing is remembered but where the arm is now.
  void forget_the_past();
  [[nodiscard]] bool color_seen() const { return color_seen_; }
  [[nodiscard]] bool depth_seen() const { return depth_seen_; }
  /// Devices that are not there, as far as they tell.
  [[nodiscard]] const std::bitset<kCartDevices>& absent() const { return absent_; }

  void transition(StateId target);
  /// Ends the job by way of Park and Report: what is known so far is kept.
  void conclude(Outcome outcome, std::optional<Fault> fault);
  /// Stops the arm now and ends the job; only a person can start the next one.
  void stop_for(Fault fault);

  template <typename Arguments>
  std::uint32_t start_job(JobKind kind, const Arguments& arguments) {
    const std::size_t size = pack(arguments, std::span<std::byte>(arguments_));
    ENSURE(7001, size > 0);
    awaited_ = ++job_number_;
    sink_.start_job(now_, kind, awaited_, std::span<const std::byte>(arguments_.data(), size));
    return awaited_;
  }
  /// The result of the job that the state waits for; empty for every other event.
  template <typename JobResult>
  [[nodiscard]] std::optional<JobResult> result_of(JobKind kind, const MachineEvent& event) {
    const auto* done = std::get_if<JobCompleted>(&event);
    if (done == nullptr || done->kind != kind || done->number != awaited_) return std::nullopt;
    awaited_ = 0;
    JobResult result;
    ENSURE(7002, unpack(done->result, result));
    return result;
  }
  void set_timer(MachineTimer timer, double after_s) { sink_.set_timer(now_, timer, now_ + seconds(after_s)); }
  void cancel_timer(MachineTimer timer) { sink_.cancel_timer(now_, timer); }
  template <typename... Args>
  void show(fmt::format_string<Args...> format, Args&&... args) {
    std::array<char, 96> line;
    const auto end = fmt::format_to_n(line.data(), line.size(), format, std::forward<Args>(args)...);
    sink_.show(now_, {line.data(), std::min(end.size, line.size())});
  }
  void light(hal::Light light) { sink_.light(now_, light); }
  void forget_known_free() { sink_.forget_known_free(now_); }
  void finish(const Ending& ending);

  /// The path being driven. Leg by leg: each is one segment without blend.
  enum class OnTheWay : std::uint8_t { kNothing, kMap, kSeeBoard };
  void start_trip(const Route& path, OnTheWay on_the_way);
  enum class Trip : std::uint8_t { kNone, kUnderWay, kArrived, kInterrupted };
  /// Feeds an event to the trip; kArrived and kInterrupted are reported once.
  [[nodiscard]] Trip advance_trip(const MachineEvent& event);
  void withdraw_trip();
  [[nodiscard]] bool travelling() const { return travelling_; }

  /// Starts a job for after the look that the arm is under way to. Nobody waits for it; foreseen() has its result,
  /// once, unless the trip came to nothing or another began.
  void foresee(JobKind kind);
  [[nodiscard]] std::optional<NextViewResult> foreseen_view() { return std::exchange(foreseen_view_, std::nullopt); }
  [[nodiscard]] std::optional<CalibrationViewResult> foreseen_calibration_view() {
    return std::exchange(foreseen_calibration_view_, std::nullopt);
  }

  /// Waits until the arm has settled, then collects `count` frames with their poses.
  void start_look(bool depth, int count);
  /// Looks at the board once more from the same stop, at once, because the picture moved. False: not again, that was
  /// the last look.
  [[nodiscard]] bool look_again(double moved_px);
  /// How often it was looked from this stop.
  [[nodiscard]] std::uint32_t looks() const { return looks_; }
  [[nodiscard]] bool advance_look(const MachineEvent& event);  ///< true once, when the frames are there
  [[nodiscard]] const FixedVector<PosedFrame, 8>& look() const { return look_; }
  /// Depth frames that came while colour frames were collected.
  [[nodiscard]] const FixedVector<PosedFrame, kDepthBesideMax>& depth_beside() const { return depth_beside_; }

  /// From now on frames are taken for that much later (or earlier) than their stamps say.
  void correct_stamps(const StampOffsets& offsets);

  /// Starts an integration of a depth frame; its result comes to whoever is in charge then. Of a look with a colour
  /// frame beside it the map takes its colours, and nobody waits for that.
  void integrate(const PosedFrame& frame, bool at_view);
  [[nodiscard]] bool integrating() const { return integrate_job_ != 0; }
  [[nodiscard]] std::optional<IntegrateResult> integrate_result(const MachineEvent& event);

 private:
  void open_look(double wait_s);
  /// What holds in every state: a silent arm, a job that failed. True when it ended the job.
  [[nodiscard]] bool supervise(const MachineEvent& event);
  void dispatch(const MachineEvent& event);
  void run_transitions();
  void enter_path_to(StateId target);
  void remember_arm(const ArmReported& report);
  template <typename Frames>
  [[nodiscard]] std::optional<PosedFrame> next_posed(Frames& pending, std::uint64_t& unposed);
  void pose_pending_frames();
  void remember_foreseen(const JobCompleted& done);
  void forget_foreseen();
  void note_way_frame(const MachineEvent& event);
  void see_way_frames();
  [[nodiscard]] std::optional<PosedFrame> posed(const hal::Frame& frame) const;
  void send_leg();
  [[nodiscard]] double deviation_m() const;
  [[nodiscard]] Route legs_ahead() const;
  [[nodiscard]] Trip follow_leg();
  [[nodiscard]] Trip interrupt_trip(Fault cause);

  MachineSettings settings_;
  DecisionSink& sink_;
  Instant now_{};
  StateId state_ = StateId::kNone;
  StateId pending_ = StateId::kNone;
  bool finished_ = false;
  Progress progress_;

  hal::ArmState arm_;
  double guardian_margin_m_ = 0;
  bool arm_known_ = false, color_seen_ = false, depth_seen_ = false;
  std::bitset<kCartDevices> absent_;
  /// A second at 125 Hz: what frames on the way need, whose stamps may be off by 0.2 s either way.
  static constexpr std::size_t kArmHistory = 128;
  std::array<hal::ArmState, kArmHistory> history_{};
  std::size_t history_size_ = 0;
  /// Frames whose stamps the arm has not reached yet: a clock that is 0.2 s ahead makes 30 Hz wait for six.
  using PendingFrames = FixedVector<hal::Frame, 8>;
  PendingFrames pending_color_, pending_depth_;
  Duration color_offset_{}, depth_offset_{};
  Instant last_depth_{};
  std::uint64_t depth_frames_unposed_ = 0;

  std::uint32_t job_number_ = 0;
  std::uint32_t awaited_ = 0;
  std::uint32_t integrate_job_ = 0;
  std::uint32_t foreseeing_job_ = 0;
  std::optional<NextViewResult> foreseen_view_;
  std::optional<CalibrationViewResult> foreseen_calibration_view_;
  std::array<std::byte, 8192> arguments_{};

  bool travelling_ = false;
  OnTheWay on_the_way_ = OnTheWay::kNothing;
  std::optional<hal::Frame> way_color_, way_depth_;  ///< wait until the arm's joints after them are known
  Instant last_seen_on_the_way_{};
  std::uint32_t motion_ = 0;
  std::uint32_t seen_of_motion_ = 0;  ///< frames, of this motion
  std::uint32_t seen_on_the_way_ = 0;
  std::uint32_t way_job_ = 0;
  Route path_;
  std::size_t leg_ = 0;
  JointVector leg_start_;
  std::uint32_t segment_number_ = 0;
  Instant leg_sent_{};
  Instant last_way_frame_{};

  bool looking_ = false, look_open_ = false, look_depth_ = false;
  bool look_unposed_ = false;  ///< frames came since the last one whose pose is known
  std::size_t look_count_ = 0;
  std::uint32_t looks_ = 0;
  Instant look_from_{};
  FixedVector<PosedFrame, 8> look_;
  FixedVector<PosedFrame, kDepthBesideMax> depth_beside_;
  std::optional<PosedFrame> color_beside_;  ///< the latest of a look at depth
};

}  // namespace firstlook
