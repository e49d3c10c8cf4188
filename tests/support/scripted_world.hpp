/// A world for the state machine without devices, map or solver: it carries out decisions in the simplest way and
/// answers each job with what the script says.
#pragma once

#include <algorithm>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "app/machine/machine.hpp"

namespace firstlook::test {

class ScriptedWorld : public DecisionSink {
 public:
  explicit ScriptedWorld(MachineSettings settings = default_settings()) : machine(settings, *this) {}

  static MachineSettings default_settings() {
    MachineSettings s;
    s.parking_rad = JointVector{0, -1.5, 1.5, 0, 0, 0};
    s.calibration_views_min = 2;
    s.calibration_views_max = 4;
    s.explore_views_max = 3;
    return s;
  }

  // ---- the script; change before run_until
  std::function<DetectResult(const DetectArguments&)> detect = [](const DetectArguments& a) {
    DetectResult r;
    r.found = true;
    r.targets = 1;
    r.changed = a.purpose == BoardLook::kIdentify;
    return r;
  };
  std::function<PlanResult(const PlanArguments&)> plan = [](const PlanArguments& a) {
    PlanResult r;
    r.found = true;
    r.path.push_back({a.to_rad, 0.5, 1.0});
    return r;
  };
  std::function<NextViewResult(const FromHere&)> next_view = [](const FromHere& a) {
    NextViewResult r;
    r.found = a.step % 3 != 2;
    JointVector to = a.at_rad;
    to[0] += 0.05;
    r.path.push_back({to, 0.5, 1.0});
    return r;
  };
  std::function<CalibrationViewResult(const FromHere&)> calibration_view = [](const FromHere& a) {
    CalibrationViewResult r;
    r.found = true;
    r.path = beside(a);
    return r;
  };
  std::function<PlanResult(const PlanArguments&)> certify = [](const PlanArguments&) {
    PlanResult r;
    r.found = true;
    return r;
  };
  SolveResult solve = [] {
    SolveResult r;
    r.solved = true;
    r.targets = 1;
    return r;
  }();
  ValidateResult validate{.accepted = true};
  std::function<ValidateResult()> validating;  ///< what it says instead; may be empty
  std::function<TouchTestResult(const TouchTestArguments&)> touch_test = [](const TouchTestArguments&) {
    TouchTestResult r;
    r.usable = r.agrees = true;
    return r;
  };
  VerificationViewResult verification_view = [] {
    VerificationViewResult r;
    r.found = r.target_met = true;
    return r;
  }();
  VerifyResult verify = [] {
    VerifyResult r;
    r.accepted = true;
    r.targets = 1;
    return r;
  }();
  IntegrateResult integrated{.used = true, .path_free = true};
  std::function<void(IntegrateResult&)> integrating;  ///< what else a frame's integration says; may be empty
  CheckBoardResult check{.seen = 1, .moved = 0};
  int locate_views = 4;
  Fault no_views_because = Fault::kNothingReachable;
  bool devices = true;
  bool consent = true;
  bool arm_reports = true;
  bool depth_frames = true;
  Duration frame_age = milliseconds(4);  ///< of a frame's stamp when it comes; negative: its clock runs ahead
  std::optional<JobKind> failing;        ///< jobs of this kind run out of memory
  hal::ArmSafety safety = hal::ArmSafety::kNormal;
  double guardian_margin_m = 0.1;

  // ---- what happened
  Machine machine;
  std::vector<StateId> visited;
  std::vector<std::string> shown;
  std::vector<hal::Light> lights;
  std::vector<Fault> stops;
  std::vector<hal::Segment> segments;
  std::size_t segments_after_stop = 0;
  int forgotten = 0;
  mutable int seen_on_the_way = 0;  ///< frames of moving cameras that were looked at
  mutable int looks = 0;            ///< at depth
  mutable int colored = 0;          ///< of them, those that colours were asked of
  bool ended = false;
  Ending ending;
  Instant now{};

  /// Whatever comes to the machine comes this way; a world that records notes it before.
  virtual void happen(const MachineEvent& event) { machine.on_event(now, event); }
  void press(hal::OperatorAction action, OperatorDevice device = OperatorDevice::kPendant) {
    happen(OperatorActed{device, action});
  }
  /// A person leads the arm by hand, half a radian a second.
  void lead(int joint, double by_rad) {
    const int steps = static_cast<int>(std::ceil(std::abs(by_rad) / 0.004));
    for (int i = 0; i < steps && !ended; ++i) {
      position_[joint] += by_rad / steps;
      tick();
    }
  }
  void wait(double for_s) {
    const Instant end = now + seconds(for_s);
    while (now < end && !ended) tick();
  }
  [[nodiscard]] bool has_shown(const std::string& words) const {
    return std::any_of(shown.begin(), shown.end(),
                       [&](const std::string& line) { return line.find(words) != std::string::npos; });
  }
  /// Steps of 8 ms until the state is entered, the job ends, or the time is over. Returns whether the state was
  /// reached.
  bool run_until(StateId state, double limit_s = 600) {
    if (visited.empty()) machine.start(now);
    const Instant end = now + seconds(limit_s);
    while (now < end && !ended && machine.state() != state) tick();
    return machine.state() == state;
  }
  bool run_to_end(double limit_s = 4000) {
    const Instant end = now + seconds(limit_s);
    if (visited.empty()) machine.start(now);
    while (now < end && !ended) tick();
    return ended;
  }
  /// How many paths of this phase were asked for.
  [[nodiscard]] int plans_for(MotionPhase phase) const {
    const auto found = plans_.find(phase);
    return found == plans_.end() ? 0 : found->second;
  }
  [[nodiscard]] bool was_in(StateId state) const {
    return std::find(visited.begin(), visited.end(), state) != visited.end();
  }
  [[nodiscard]] const JointVector& position_rad() const { return position_; }
  void tick() {
    now = now + milliseconds(8);
    if (!devices) {
      fire_timers();
      return;
    }
    move_on();
    if (arm_reports) happen(report());
    if (++ticks_ % 8 == 0) happen(ColorFrameArrived{{now - frame_age, ++frames_, frames_ % 32}});
    if (ticks_ % 4 == 0 && depth_frames) {
      happen(DepthFrameArrived{{now - frame_age, ++frames_, frames_ % 32}});
    }
    answer_jobs();
    fire_timers();
  }

  /// A view beside where the arm stands.
  static Route beside(const FromHere& here) {
    JointVector to = here.at_rad;
    to[4] += 0.05;
    Route route;
    route.push_back({to, 0.5, 1.0});
    return route;
  }

  /// What the script says to a job: its packed result; the size is returned.
  std::size_t pack_answer(JobKind kind, std::span<const std::byte> arguments, std::span<std::byte> result) const {
    switch (kind) {
      case JobKind::kLocateViews:
        return pack(views_to_locate(arguments_of<FromHere>(arguments).at_rad), result);
      case JobKind::kIdentifyMotions:
        return pack(views_around(arguments_of<FromHere>(arguments).at_rad, 6), result);
      case JobKind::kPlan:
        return pack(plan(arguments_of<PlanArguments>(arguments)), result);
      case JobKind::kCertifyPath:
        return pack(certify(arguments_of<PlanArguments>(arguments)), result);
      case JobKind::kDetectBoard:
        return pack(detected(arguments_of<DetectArguments>(arguments)), result);
      case JobKind::kNextCalibrationView:
        return pack(calibration_view(arguments_of<FromHere>(arguments)), result);
      case JobKind::kNextVerificationView: {
        VerificationViewResult r = verification_view;
        r.path = beside(arguments_of<FromHere>(arguments));
        return pack(r, result);
      }
      case JobKind::kVerifyCalibration:
        return pack(verify, result);
      case JobKind::kSolve:
        return pack(solve, result);
      case JobKind::kValidate:
        return pack(validating ? validating() : validate, result);
      case JobKind::kIntegrate: {
        IntegrateResult r = integrated;
        looks += arguments_of<IntegrateArguments>(arguments).at_view ? 1 : 0;
        r.at_view = arguments_of<IntegrateArguments>(arguments).at_view;
        if (integrating) integrating(r);
        return pack(r, result);
      }
      case JobKind::kNextSweepView:
      case JobKind::kNextView:
        return pack(next_view(arguments_of<FromHere>(arguments)), result);
      case JobKind::kCheckBoard:
        return pack(check, result);
      case JobKind::kSummarize:
        return pack(SummarizeResult{}, result);
      case JobKind::kForgetKnownFree:
        return pack(NoArguments{}, result);
      case JobKind::kTouchTest:
        return pack(touch_test(arguments_of<TouchTestArguments>(arguments)), result);
      case JobKind::kColorLook:
        ++colored;
        return pack(ColorResult{}, result);
      case JobKind::kSeeOnTheWay:
        ++seen_on_the_way;
        return pack(WayResult{true, true}, result);
    }
    ENSURE(9002, false);
    return 0;
  }

  // ---- DecisionSink
  void state_entered(Instant, StateId state) override { visited.push_back(state); }
  void move_arm(Instant, const hal::Segment& segment) override {
    if (!stops.empty()) ++segments_after_stop;
    segments.push_back(segment);
    if (!consent) {
      machine_refusal_ = true;
      return;
    }
    target_ = segment.target_rad;
    start_ = position_;
    segment_ = segment.number;
    fraction_ = 0;
  }
  void stop_arm(Instant) override { fraction_ = 1; }
  void start_job(Instant, JobKind kind, std::uint32_t number, std::span<const std::byte> arguments) override {
    jobs_.push_back({kind, number, {arguments.begin(), arguments.end()}});
  }
  void set_timer(Instant, MachineTimer timer, Instant due) override { timers_[timer] = due; }
  void cancel_timer(Instant, MachineTimer timer) override { timers_.erase(timer); }
  void show(Instant, std::string_view line) override { shown.emplace_back(line); }
  void light(Instant, hal::Light light) override { lights.push_back(light); }
  void forget_known_free(Instant) override { ++forgotten; }
  void stop_recorded(Instant, Fault cause) override { stops.push_back(cause); }
  void finished(Instant, const Ending& how) override {
    ended = true;
    ending = how;
  }

 private:
  struct Job {
    JobKind kind;
    std::uint32_t number;
    std::vector<std::byte> arguments;
  };

  void move_on() {
    if (fraction_ < 1) {
      fraction_ = std::min(1.0, fraction_ + 0.1);
      position_ = interpolate(start_, target_, fraction_);
    }
  }
  ArmReported report() const {
    ArmReported r;
    r.state.stamp = now;
    r.state.position_rad = position_;
    r.state.velocity_rad_s = JointVector::zero(6);
    r.state.safety = safety;
    r.state.program_running = consent;
    r.state.moving = fraction_ < 1;
    r.state.segment = segment_;
    r.guardian_margin_m = guardian_margin_m;
    return r;
  }
  template <typename T>
  static T arguments_of(std::span<const std::byte> arguments) {
    T value;
    ENSURE(9001, unpack(arguments, value));
    return value;
  }
  /// Who looks for one board has seen that one.
  [[nodiscard]] DetectResult detected(const DetectArguments& arguments) const {
    DetectResult r = detect(arguments);
    if (r.found && r.targets == 0) r.targets = 1;
    return r;
  }
  static ViewList views_around(const JointVector& at, int count) {
    ViewList list;
    for (int i = 0; i < count; ++i) {
      JointVector q = at;
      q[5 - i % 6] += 0.1;
      list.views_rad.push_back(q);
    }
    return list;
  }
  ViewList views_to_locate(const JointVector& at) const {
    ViewList list = views_around(at, locate_views);
    list.fault = no_views_because;
    return list;
  }
  void answer_jobs() {
    std::vector<std::byte> bytes(16384);
    while (!jobs_.empty() && !ended) {
      const Job job = jobs_.front();
      jobs_.pop_front();
      if (failing == job.kind) {
        happen(JobCompleted{job.kind, job.number, {}, Fault::kOutOfMemory});
        continue;
      }
      if (job.kind == JobKind::kForgetKnownFree) continue;  // the shell's own
      if (job.kind == JobKind::kPlan) ++plans_[arguments_of<PlanArguments>(job.arguments).phase];
      const std::size_t size = pack_answer(job.kind, job.arguments, bytes);
      happen(JobCompleted{job.kind, job.number, std::span<const std::byte>(bytes.data(), size), {}});
    }
  }
  void fire_timers() {
    std::vector<MachineTimer> due;
    for (const auto& [timer, at] : timers_) {
      if (at <= now) due.push_back(timer);
    }
    for (const MachineTimer timer : due) {
      timers_.erase(timer);
      happen(TimerFired{timer});
    }
    if (machine_refusal_) {
      machine_refusal_ = false;
      happen(CommandRefused{Fault::kProgramStopped});
    }
  }

  std::deque<Job> jobs_;
  std::map<MachineTimer, Instant> timers_;
  JointVector position_{0, -1.5, 1.5, 0, 0, 0};
  JointVector start_ = position_, target_ = position_;
  double fraction_ = 1;
  std::uint32_t segment_ = 0;
  std::uint32_t frames_ = 0;
  int ticks_ = 0;
  std::map<MotionPhase, int> plans_;
  bool machine_refusal_ = false;
};

}  // namespace firstlook::test
