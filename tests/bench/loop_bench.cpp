/// One turn of the event loop: devices polled, guardian asked, events journalled, the machine run, decisions recorded.
/// Jobs are answered by a script, because on the cart they run on other threads.
#include <fmt/format.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <optional>

#include "app/shell/decision_log.hpp"
#include "app/shell/device_sources.hpp"
#include "app/shell/event_codec.hpp"
#include "tests/bench/bench.hpp"
#include "tests/support/mock_color_camera.hpp"
#include "tests/support/mock_depth_camera.hpp"
#include "tests/support/mock_panel.hpp"
#include "tests/support/mock_pendant.hpp"
#include "tests/support/mock_robot_arm.hpp"
#include "tests/support/scripted_world.hpp"

namespace firstlook::bench {
namespace {

/// Answers of the tests' scripted world, as a job.
class ScriptedJobs final : public JobExecutor {
 public:
  std::size_t execute(const JobRequest& request, std::span<std::byte> result) noexcept override {
    result[0] = std::byte{1};  // done, as CartJobs says it
    return 1 + script_.pack_answer(static_cast<JobKind>(request.kind), request.bytes(), result.subspan(1));
  }

 private:
  test::ScriptedWorld script_;
};

/// A floor and nothing else: what the guardian looks up.
struct OpenSpace {
  GridGeometry geometry = GridGeometry::covering({-1.5, -1.5, -0.3}, {1.5, 1.5, 1.5}, 0.05);
  DistanceField field{geometry, 0.6};
  ArmModel arm = *find_arm_model("ur5");
  PublishedSpace published{geometry, 0.6};

  OpenSpace() {
    std::vector<std::uint8_t> free(geometry.count());
    for (std::size_t i = 0; i < free.size(); ++i) free[i] = geometry.center_m(geometry.voxel_at(i)).z() > -0.2 ? 1 : 0;
    field.update(free);
    FreeSpace space;
    space.field = &field;
    published.publish(space, body_with_camera(arm, Transform<Flange, Camera>()), Clearance{0.05, 0.01}, free);
    published.take();
  }
};

/// The cart's loop with scripted devices and jobs; put together as app/shell/cart.cpp does it.
class ScriptedCart final : private DecisionSink, private EventHandler, private DecisionLog {
 public:
  explicit ScriptedCart(const std::string& journal_path)
      : arm_(settings().parking_rad), runner_(jobs_, clock_, JobMode::kVirtual) {
    auto journal = JournalWriter::create_file(journal_path, {"bench", ""});
    if (!journal) {
      fmt::print(stderr, "firstlook_bench: {}\n", describe(journal.error()));
      std::exit(3);
    }
    journal_ = std::move(*journal);
    arm_.set_running(true);
    pendant_.keys.press(Instant{} + milliseconds(500), hal::OperatorAction::kPlay);
    loop_.reset(new EventLoop(clock_, journal_.get(), *this, timers_, runner_));  // *this is a private base here
    for (EventSource* source : {static_cast<EventSource*>(&arm_source_), static_cast<EventSource*>(&color_source_),
                                static_cast<EventSource*>(&depth_source_), static_cast<EventSource*>(&pendant_source_),
                                static_cast<EventSource*>(&panel_source_)}) {
      loop_->add_source(*source);
    }
    machine_.start(clock_.now());
  }

  /// Turns until the job has ended; seconds of each turn on the thread and on the wall.
  void run(std::vector<double>& thread_s, std::vector<double>& wall_s) {
    constexpr std::uint64_t kTurnsMax = 2'000'000;  // four hours at 125 Hz: the job hangs
    while (!ended_ && loop_->turns() < kTurnsMax) {
      const double wall = wall_seconds();
      Instant next{};
      thread_s.push_back(seconds_of([&] { next = loop_->turn(); }));
      wall_s.push_back(wall_seconds() - wall);
      clock_.sleep_until(next);
    }
  }
  [[nodiscard]] bool done() const { return ended_ && ending_.outcome == Outcome::kDone; }
  [[nodiscard]] std::uint64_t events() const { return loop_->events(); }

 private:
  static MachineSettings settings() { return test::ScriptedWorld::default_settings(); }

  void on_event(const Event& event) override {
    if (const auto decoded = decode_event(event.kind, event.bytes())) machine_.on_event(event.time, *decoded);
  }
  void end_of_turn(Instant) override {}
  void decision(DecisionKind kind, Instant now, std::span<const std::byte> bytes) override {
    journal_->decision(static_cast<std::uint16_t>(kind), now, bytes);
  }
  void state_entered(Instant, StateId) override {}
  void move_arm(Instant now, const hal::Segment& segment) override { ENSURE(9211, arm_.move(segment, now)); }
  void stop_arm(Instant now) override { arm_.stop(now); }
  void start_job(Instant now, JobKind kind, std::uint32_t number, std::span<const std::byte> arguments) override {
    request_.kind = static_cast<std::uint16_t>(kind);
    request_.number = number;
    request_.on_map_strand = true;
    request_.virtual_duration = milliseconds(50);
    request_.size = static_cast<std::uint32_t>(arguments.size());
    std::copy(arguments.begin(), arguments.end(), request_.arguments.begin());
    ENSURE(9212, runner_.submit(request_, now).has_value());
  }
  void set_timer(Instant, MachineTimer timer, Instant due) override {
    timers_.set(static_cast<std::uint32_t>(timer), due);
  }
  void cancel_timer(Instant, MachineTimer timer) override { timers_.cancel(static_cast<std::uint32_t>(timer)); }
  void show(Instant, std::string_view line) override { pendant_.show(line); }
  void light(Instant, hal::Light light) override { panel_.light(light); }
  void forget_known_free(Instant) override {}
  void stop_recorded(Instant, Fault) override {}
  void finished(Instant, const Ending& ending) override {
    ended_ = true;
    ending_ = ending;
  }

  OpenSpace space_;
  VirtualClock clock_;
  TimerQueue timers_;
  ScriptedJobs jobs_;
  mock::MockRobotArm arm_;
  mock::MockColorCamera color_;
  mock::MockDepthCamera depth_;
  mock::MockPendant pendant_;
  mock::MockPanel panel_;
  JobRunner runner_;
  std::unique_ptr<JournalWriter> journal_;
  std::unique_ptr<EventLoop> loop_;
  ArmSource arm_source_{arm_, space_.arm, space_.published};
  FrameSource<ColorFrameArrived> color_source_{color_};
  FrameSource<DepthFrameArrived> depth_source_{depth_};
  OperatorSource<hal::Pendant> pendant_source_{pendant_, OperatorDevice::kPendant};
  OperatorSource<hal::Panel> panel_source_{panel_, OperatorDevice::kPanel};
  LoggedDecisions decisions_{*this, this};
  Machine machine_{settings(), decisions_};
  JobRequest request_;
  bool ended_ = false;
  Ending ending_;
};

}  // namespace

void bench_loop(const Options& options, Report& report) {
  constexpr double kCycle_us = 2000;  // an e-Series controller reports at 500 Hz: a turn must fit between two reports
  const auto journal = std::filesystem::temp_directory_path() / fmt::format("firstlook_bench_{}.flj", getpid());
  std::vector<double> thread_s, wall_s;
  bool done = true;
  std::uint64_t events = 0;
  for (int job = 0; job < options.amount(1, 20, 100); ++job) {
    ScriptedCart cart(journal.string());
    cart.run(thread_s, wall_s);
    done = done && cart.done();
    events += cart.events();
  }
  std::filesystem::remove(journal);
  const auto add = [&](const char* name, double seconds, const Goal& goal) {
    Row row = timed(name, 1e6 * seconds, "us", "", std::nullopt, goal);
    if (!done) row.void_because = "the job did not end";
    report.add(row);
  };
  add("loop/turn", median(thread_s), Goal::none());
  add("loop/turn/p999", quantile(thread_s, 0.999), Goal::ours_at_most(kCycle_us));
  add("loop/turn/p999_on_the_wall", quantile(wall_s, 0.999), Goal::ours_at_most(kCycle_us));
  const auto per_turn = static_cast<double>(events) / static_cast<double>(thread_s.size());
  report.add(measured("loop/events_per_turn", per_turn, "", "", std::nullopt, Goal::none()));
}

}  // namespace firstlook::bench
