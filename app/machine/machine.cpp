#include "app/machine/machine.hpp"

#include <algorithm>
#include <cmath>

namespace firstlook {
namespace {
constexpr double kArrivedWithin_rad = 2e-3;  // of the target, at standstill: 20 times the encoders' resolution
constexpr double kSupervisePeriod_s = 0.05;
constexpr double kArmStale_s = 0.1;               // 12 reports at 125 Hz
constexpr double kDepthStale_s = 0.5;             // 15 frames at 30 Hz
constexpr double kSegmentAcceptedWithin_s = 0.2;  // else the leg counts as interrupted
constexpr std::uint32_t kInterruptionsMax = 25;   // of one job; more means that the cell does not stand still
// Frames on the way: joints are kept from so much before to so much after them, the largest offset of stamps that is
// looked for (0.2 s) and two of the arm's reports.
constexpr Duration kJointsAround = milliseconds(216);
constexpr Duration kHistoryApart = milliseconds(7);  // an arm that reports more often is remembered as long
constexpr Duration kJointsApart = milliseconds(15);  // every second report at 125 Hz
constexpr Duration kWayFramesApart = milliseconds(250);
constexpr std::uint32_t kWayFramesOfMotion = 5;
constexpr std::uint32_t kWayFramesMax = 60;  // an offset known to 0.2 ms; each costs as much as a look

template <typename Frames>
void drop_first(Frames& frames) {
  for (std::size_t i = 1; i < frames.size(); ++i) frames[i - 1] = frames[i];
  frames.pop_back();
}
}  // namespace

Machine::Machine(const MachineSettings& settings, DecisionSink& sink) : settings_(settings), sink_(sink) {}

void Machine::start(Instant now) {
  now_ = now;
  transition(StateId::kBoot);
  run_transitions();
}

void Machine::on_event(Instant now, const MachineEvent& event) {
  now_ = now;
  if (finished_) return;
  if (const auto* report = std::get_if<ArmReported>(&event)) remember_arm(*report);
  if (const auto* frame = std::get_if<ColorFrameArrived>(&event)) {
    color_seen_ = true;
    if (pending_color_.full()) drop_first(pending_color_);
    pending_color_.push_back(frame->frame);
    pending_color_.back().stamp = frame->frame.stamp + color_offset_;
  }
  if (const auto* frame = std::get_if<DepthFrameArrived>(&event)) {
    depth_seen_ = true;
    last_depth_ = now;
    if (pending_depth_.full()) drop_first(pending_depth_);
    pending_depth_.push_back(frame->frame);
    pending_depth_.back().stamp = frame->frame.stamp + depth_offset_;
  }
  if (const auto* changed = std::get_if<DeviceChanged>(&event))
    absent_.set(static_cast<std::size_t>(changed->device), !changed->present);
  // What was seen on the way is of use, but nobody waits for it: without it the stamps stay as they are.
  if (const auto* done = std::get_if<JobCompleted>(&event); done != nullptr && done->number == way_job_) {
    way_job_ = 0;
    return;
  }
  if (const auto* done = std::get_if<JobCompleted>(&event);
      done != nullptr && foreseeing_job_ != 0 && done->number == foreseeing_job_) {
    remember_foreseen(*done);
    return;
  }
  note_way_frame(event);
  if (supervise(event)) return;
  dispatch(event);
  if (std::holds_alternative<ArmReported>(event)) {
    pose_pending_frames();
    see_way_frames();
  }
}

bool Machine::supervise(const MachineEvent& event) {
  if (is_within(state_, StateId::kBoot)) return false;
  const bool ended = state_ == StateId::kStopped || state_ == StateId::kFaulted;
  if (ended || std::holds_alternative<ArmReported>(event)) return false;
  if (now_ - arm_.stamp > seconds(kArmStale_s)) {
    stop_for(Fault::kLinkLost);
  } else if (const auto* done = std::get_if<JobCompleted>(&event);
             done != nullptr && done->failed &&
             (done->number == awaited_ || done->number == integrate_job_ || done->kind == JobKind::kForgetKnownFree)) {
    show("a job failed: {}", name_of(done->kind));
    stop_for(*done->failed);
  } else {
    return false;
  }
  run_transitions();
  return true;
}

void Machine::dispatch(const MachineEvent& event) {
  for (StateId at = state_; at != StateId::kNone; at = state_row(at).parent) {
    const StateRow& row = state_row(at);
    if (row.on_event != nullptr && row.on_event(*this, event) == Handled::kYes) {
      run_transitions();
      return;
    }
    if (pending_ != StateId::kNone) break;
  }
  run_transitions();
  // Reports, frames, timers of states already left and results of jobs that nobody waits for any more are expected
  // everywhere; a person's keys are handled by every outermost state. What is left has no place in the table.
  if (std::holds_alternative<OperatorActed>(event) || std::holds_alternative<CommandRefused>(event)) {
    if (!finished_ && state_ != StateId::kStopped && state_ != StateId::kFaulted) stop_for(Fault::kUnexpectedEvent);
    run_transitions();
  }
}

void Machine::transition(StateId target) { pending_ = target; }

void Machine::run_transitions() {
  while (pending_ != StateId::kNone) {
    const StateId target = pending_;
    pending_ = StateId::kNone;
    if (state_ != StateId::kNone) {
      bool allowed = false;
      for (StateId at = state_; at != StateId::kNone; at = state_row(at).parent) {
        for (const Transition& t : state_row(at).transitions) allowed = allowed || t.to == target;
      }
      ENSURE(7010, allowed);
    }
    enter_path_to(target);
  }
}

void Machine::enter_path_to(StateId target) {
  const StateId from = state_;
  while (state_ != StateId::kNone && (state_ == target || !is_within(target, state_))) {
    const StateRow& row = state_row(state_);
    if (row.exit != nullptr) row.exit(*this);
    state_ = row.parent;
  }
  awaited_ = 0;
  looking_ = false;
  way_color_.reset();
  if (travelling_) withdraw_trip();
  FixedVector<StateId, 8> chain;
  for (StateId at = target; at != StateId::kNone && at != state_; at = state_row(at).parent) chain.push_back(at);
  for (std::size_t i = chain.size(); i-- > 0;) {
    state_ = chain[i];
    if (chain[i] == target || from == StateId::kNone || !is_within(from, chain[i])) {
      sink_.state_entered(now_, state_);
      if (state_row(state_).enter != nullptr) state_row(state_).enter(*this);
    }
    if (pending_ != StateId::kNone) return;
  }
}

void Machine::conclude(Outcome outcome, std::optional<Fault> fault) {
  progress_.ending = {outcome, fault.has_value(), fault.value_or(Fault::kInternal)};
  transition(StateId::kPark);
}

void Machine::stop_for(Fault fault) {
  sink_.stop_arm(now_);
  sink_.stop_recorded(now_, fault);
  const bool internal = fault == Fault::kUnexpectedEvent || fault == Fault::kInternal;
  progress_.ending = {internal ? Outcome::kFaulted : Outcome::kSafelyStopped, true, fault};
  transition(internal ? StateId::kFaulted : StateId::kStopped);
}

void Machine::finish(const Ending& ending) {
  if (finished_) return;
  finished_ = true;
  sink_.finished(now_, ending);
}

// ---- the arm's reports and the frames' poses

void Machine::remember_arm(const ArmReported& report) {
  const bool dense = history_size_ >= 2 && report.state.stamp - history_[history_size_ - 2].stamp < kHistoryApart;
  if (dense) {
    --history_size_;
  } else if (history_size_ == kArmHistory) {
    std::copy(history_.begin() + 1, history_.end(), history_.begin());
    --history_size_;
  }
  history_[history_size_++] = report.state;
  arm_ = report.state;
  guardian_margin_m_ = report.guardian_margin_m;
  arm_known_ = true;
}

void Machine::forget_the_past() {
  history_size_ = 0;
  pending_color_.clear();
  pending_depth_.clear();
}

std::optional<PosedFrame> Machine::posed(const hal::Frame& frame) const {
  for (std::size_t i = history_size_; i-- > 1;) {
    const hal::ArmState& before = history_[i - 1];
    const hal::ArmState& after = history_[i];
    if (before.stamp <= frame.stamp && frame.stamp <= after.stamp && before.stamp < after.stamp) {
      const double apart_s = (after.stamp - before.stamp).seconds();
      const double t = (frame.stamp - before.stamp).seconds() / apart_s;
      return PosedFrame{frame, interpolate(before.position_rad, after.position_rad, t),
                        (after.position_rad - before.position_rad) * (1 / apart_s), apart_s};
    }
  }
  return std::nullopt;
}

std::optional<JointVector> Machine::stood_at(double for_s) const {
  constexpr double kStill_rad = 3e-4;  // 15 sigmas of an encoder; a hand that holds the arm moves it by more
  JointVector sum = JointVector::zero(arm_.position_rad.size());
  int count = 0;
  for (std::size_t i = history_size_; i-- > 0;) {
    const hal::ArmState& state = history_[i];
    if ((state.position_rad - arm_.position_rad).max_abs() > kStill_rad) return std::nullopt;
    sum = sum + state.position_rad;
    ++count;
    if (now_ - state.stamp >= seconds(for_s)) return sum * (1.0 / count);
  }
  return std::nullopt;
}

/// The oldest of the frames whose stamps the arm has reached, when its joints there are known.
template <typename Frames>
std::optional<PosedFrame> Machine::next_posed(Frames& pending, std::uint64_t& unposed) {
  while (!pending.empty() && pending.front().stamp <= arm_.stamp) {
    const hal::Frame frame = pending.front();
    drop_first(pending);
    if (const auto found = posed(frame)) return found;
    ++unposed;
  }
  return std::nullopt;
}

void Machine::pose_pending_frames() {
  std::uint64_t color_unposed = 0, depth_unposed = 0;
  while (const auto frame = next_posed(pending_color_, color_unposed)) dispatch(ColorPosed{*frame});
  while (const auto frame = next_posed(pending_depth_, depth_unposed)) dispatch(DepthPosed{*frame});
  const bool maps = (looking_ && look_depth_) || (travelling_ && on_the_way_ == OnTheWay::kMap);
  if (maps) depth_frames_unposed_ += depth_unposed;
}

void Machine::correct_stamps(const StampOffsets& offsets) {
  color_offset_ = seconds(offsets.color_s);
  depth_offset_ = seconds(offsets.depth_s);
}

// ---- frames on the way between calibration views

void Machine::note_way_frame(const MachineEvent& event) {
  if (!travelling_ || on_the_way_ != OnTheWay::kSeeBoard || !settings_.see_on_the_way) return;
  if (const auto* color = std::get_if<ColorFrameArrived>(&event)) {
    const bool wanted = !way_color_ && way_job_ == 0 && now_ - last_seen_on_the_way_ >= kWayFramesApart &&
                        seen_of_motion_ < kWayFramesOfMotion && seen_on_the_way_ < kWayFramesMax;
    if (!wanted) return;
    way_color_ = color->frame;
    way_depth_.reset();
    last_seen_on_the_way_ = now_;
  } else if (const auto* depth = std::get_if<DepthFrameArrived>(&event)) {
    if (way_color_ && !way_depth_) way_depth_ = depth->frame;
  }
}

/// Starts the job when the arm has reported for long enough after the frames; frames before what is remembered of the
/// arm are of no use.
void Machine::see_way_frames() {
  if (!way_color_) return;
  WayArguments way;
  way.color = *way_color_;
  way.has_depth = way_depth_.has_value();
  way.depth = way_depth_.value_or(hal::Frame{});
  const Instant first = way.has_depth ? std::min(way.color.stamp, way.depth.stamp) : way.color.stamp;
  const Instant last = way.has_depth ? std::max(way.color.stamp, way.depth.stamp) : way.color.stamp;
  if (arm_.stamp < last + kJointsAround) return;
  way_color_.reset();
  for (std::size_t i = 0; i < history_size_ && !way.joints.full(); ++i) {
    const hal::ArmState& state = history_[i];
    const bool begins = i + 1 < history_size_ && history_[i + 1].stamp > first - kJointsAround;
    const bool apart = way.joints.empty() || state.stamp - way.joints.back().stamp >= kJointsApart;
    if (begins && apart) way.joints.push_back({state.stamp, state.position_rad});
    if (state.stamp > last + kJointsAround) break;
  }
  way.motion = motion_;
  ++seen_of_motion_;
  ++seen_on_the_way_;
  const std::uint32_t awaited = awaited_;
  way_job_ = start_job(JobKind::kSeeOnTheWay, way);
  awaited_ = awaited;
}

// ---- what is chosen while the arm is under way

void Machine::foresee(JobKind kind) {
  if (path_.empty()) return;
  const std::uint32_t awaited = awaited_;
  foreseeing_job_ = start_job(kind, FromHere{path_.back().target_rad, progress_.steps++, now_.seconds(), true});
  awaited_ = awaited;
}

/// A job that failed has foreseen nothing: the choice is made when it is due, and fails then if it must.
void Machine::remember_foreseen(const JobCompleted& done) {
  foreseeing_job_ = 0;
  if (done.failed) return;
  if (done.kind == JobKind::kNextView) ENSURE(7004, unpack(done.result, foreseen_view_.emplace()));
  if (done.kind == JobKind::kNextCalibrationView)
    ENSURE(7005, unpack(done.result, foreseen_calibration_view_.emplace()));
}

void Machine::forget_foreseen() {
  foreseeing_job_ = 0;
  foreseen_view_.reset();
  foreseen_calibration_view_.reset();
}

// ---- trips

void Machine::start_trip(const Route& path, OnTheWay on_the_way) {
  forget_foreseen();
  path_ = path;
  leg_ = 0;
  travelling_ = true;
  on_the_way_ = on_the_way;
  ++motion_;
  seen_of_motion_ = 0;
  last_depth_ = now_;
  last_way_frame_ = now_;
  if (!path_.empty()) send_leg();
  set_timer(MachineTimer::kSupervise, kSupervisePeriod_s);
}

void Machine::send_leg() {
  const Leg& leg = path_[leg_];
  leg_start_ = arm_.position_rad;
  leg_sent_ = now_;
  sink_.move_arm(now_, {++segment_number_, leg.target_rad, leg.speed_rad_s, leg.acceleration_rad_s2});
}

void Machine::withdraw_trip() {
  if (!travelling_) return;
  forget_foreseen();
  travelling_ = false;
  cancel_timer(MachineTimer::kSupervise);
  sink_.stop_arm(now_);
}

Machine::Trip Machine::interrupt_trip(Fault cause) {
  withdraw_trip();
  sink_.stop_recorded(now_, cause);
  if (++progress_.interruptions > kInterruptionsMax) {
    stop_for(cause);
    return Trip::kNone;
  }
  return Trip::kInterrupted;
}

double Machine::deviation_m() const {
  const JointVector way = path_[leg_].target_rad - leg_start_;
  const JointVector here = arm_.position_rad - leg_start_;
  double along = 0, length = 0;
  for (int i = 0; i < way.size(); ++i) {
    along += way[i] * here[i];
    length += way[i] * way[i];
  }
  const double t = length > 0 ? std::clamp(along / length, 0.0, 1.0) : 0;
  double deviation = 0;
  for (int i = 0; i < way.size(); ++i) {
    deviation += std::abs(here[i] - t * way[i]) * settings_.lever_arm_m[static_cast<std::size_t>(i)];
  }
  return deviation;
}

Route Machine::legs_ahead() const {
  Route ahead;
  if (!travelling_) return ahead;
  for (std::size_t i = leg_; i < path_.size(); ++i) ahead.push_back(path_[i]);
  return ahead;
}

Machine::Trip Machine::follow_leg() {
  if (leg_ == path_.size()) {
    travelling_ = false;
    cancel_timer(MachineTimer::kSupervise);
    return Trip::kArrived;
  }
  if (guardian_margin_m_ < 0) return interrupt_trip(Fault::kGuardianStop);
  if (arm_.segment != segment_number_) {
    return now_ - leg_sent_ > seconds(kSegmentAcceptedWithin_s) ? interrupt_trip(Fault::kDeviation) : Trip::kUnderWay;
  }
  if (deviation_m() > settings_.path_deviation_max_m) {
    stop_for(Fault::kDeviation);
    return Trip::kNone;
  }
  if (arm_.moving) return Trip::kUnderWay;
  if ((arm_.position_rad - path_[leg_].target_rad).max_abs() > kArrivedWithin_rad) {
    return now_ - leg_sent_ > seconds(kSegmentAcceptedWithin_s) ? interrupt_trip(Fault::kDeviation) : Trip::kUnderWay;
  }
  if (++leg_ < path_.size()) {
    send_leg();
    return Trip::kUnderWay;
  }
  travelling_ = false;
  cancel_timer(MachineTimer::kSupervise);
  return Trip::kArrived;
}

Machine::Trip Machine::advance_trip(const MachineEvent& event) {
  if (!travelling_) return Trip::kNone;
  if (std::holds_alternative<ArmReported>(event)) return follow_leg();
  if (const auto* refused = std::get_if<CommandRefused>(&event)) return interrupt_trip(refused->fault);
  if (const auto* timer = std::get_if<TimerFired>(&event); timer && timer->timer == MachineTimer::kSupervise) {
    set_timer(MachineTimer::kSupervise, kSupervisePeriod_s);
    if (on_the_way_ == OnTheWay::kMap && now_ - last_depth_ > seconds(kDepthStale_s)) stop_for(Fault::kStreamStale);
    return Trip::kUnderWay;
  }
  if (const auto* posed = std::get_if<DepthPosed>(&event); posed && on_the_way_ == OnTheWay::kMap && !integrating()) {
    if (settings_.frames_while_moving_hz > 0 &&
        posed->frame.frame.stamp - last_way_frame_ >= seconds(1 / settings_.frames_while_moving_hz)) {
      last_way_frame_ = posed->frame.frame.stamp;
      integrate(posed->frame, false);
    }
  }
  if (const auto result = integrate_result(event); result && !result->path_free) {
    return interrupt_trip(Fault::kNoPath);
  }
  return Trip::kUnderWay;
}

// ---- looks

void Machine::start_look(bool depth, int count) {
  look_depth_ = depth;
  look_count_ = static_cast<std::size_t>(count);
  looks_ = 1;
  open_look(settings_.settle_time_s);
}

bool Machine::look_again(double moved_px) {
  if (looks_ >= kLooksMax) {
    if (moved_px > 0) {
      show("the picture does not stand still: {:.2f} px from frame to frame", moved_px);
    } else {
      show("pictures are gone before they are read: the computer is too slow for the camera");
    }
    return false;
  }
  ++looks_;
  open_look(0);
  return true;
}

void Machine::open_look(double wait_s) {
  looking_ = true;
  look_open_ = false;
  look_unposed_ = false;
  look_.clear();
  depth_beside_.clear();
  color_beside_.reset();
  set_timer(MachineTimer::kSettle, wait_s);
}

bool Machine::advance_look(const MachineEvent& event) {
  constexpr double kFramesWithin_s = 3;  // a stream of 10 Hz brings eight frames in a third of it
  if (!looking_) return false;
  if (const auto* timer = std::get_if<TimerFired>(&event); timer && timer->timer == MachineTimer::kSettle) {
    if (look_open_) {
      stop_for(look_unposed_ && look_.empty() ? Fault::kClockWrong : Fault::kStreamStale);
      return false;
    }
    look_open_ = true;
    look_from_ = now_;
    set_timer(MachineTimer::kSettle, kFramesWithin_s);
    return false;
  }
  if (look_depth_ ? std::holds_alternative<DepthFrameArrived>(event)
                  : std::holds_alternative<ColorFrameArrived>(event)) {
    look_unposed_ = look_open_;
  }
  const PosedFrame* posed = nullptr;
  if (const auto* color = std::get_if<ColorPosed>(&event); color && !look_depth_) posed = &color->frame;
  if (const auto* depth = std::get_if<DepthPosed>(&event); depth && look_depth_) posed = &depth->frame;
  if (const auto* depth = std::get_if<DepthPosed>(&event); depth && !look_depth_ && look_open_) {
    const bool wanted = settings_.depth_beside && !depth_beside_.full() && depth->frame.frame.stamp >= look_from_;
    if (wanted) depth_beside_.push_back(depth->frame);
  }
  if (const auto* color = std::get_if<ColorPosed>(&event); color && look_depth_ && settings_.color_at_looks)
    color_beside_ = color->frame;
  if (posed == nullptr || !look_open_) return false;
  look_unposed_ = false;
  if (posed->frame.stamp < look_from_) return false;
  look_.push_back(*posed);
  if (look_.size() < look_count_) return false;
  looking_ = false;
  cancel_timer(MachineTimer::kSettle);
  return true;
}

void Machine::integrate(const PosedFrame& frame, bool at_view) {
  const std::uint32_t awaited = awaited_;
  integrate_job_ = start_job(JobKind::kIntegrate,
                             IntegrateArguments{frame, now_.seconds(), at_view, arm_.position_rad, legs_ahead()});
  if (at_view && color_beside_) start_job(JobKind::kColorLook, ColorArguments{*color_beside_, frame});
  color_beside_.reset();
  awaited_ = awaited;
}

std::optional<IntegrateResult> Machine::integrate_result(const MachineEvent& event) {
  const auto* done = std::get_if<JobCompleted>(&event);
  if (done == nullptr || integrate_job_ == 0 || done->number != integrate_job_) return std::nullopt;
  integrate_job_ = 0;
  IntegrateResult result;
  ENSURE(7003, unpack(done->result, result));
  if (result.frozen) {
    stop_for(Fault::kStreamFrozen);
    return std::nullopt;
  }
  return result;
}

}  // namespace firstlook
