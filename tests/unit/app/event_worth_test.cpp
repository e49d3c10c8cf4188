/// What a journal leaves out while the machine waits for a person, and that a replay does not miss it.
#include "app/shell/event_worth.hpp"

#include <catch2/catch.hpp>
#include <variant>

#include "app/shell/decision_log.hpp"
#include "app/shell/event_codec.hpp"
#include "platform/journal/journal.hpp"
#include "platform/loop/event.hpp"
#include "tests/support/scripted_world.hpp"

namespace firstlook {
namespace {

constexpr std::size_t kJournalBytes = 4 << 20;

/// A world whose events and decisions go to a journal, as those of the loop do.
class RecordedWorld final : public test::ScriptedWorld, private DecisionLog {
 public:
  RecordedWorld() {
    auto made = JournalWriter::create_memory({"1", ""}, kJournalBytes);
    REQUIRE(made);
    journal_ = std::move(*made);
  }
  void happen(const MachineEvent& event) override {
    std::visit([this](const auto& e) { record(e); }, event);
    ScriptedWorld::happen(event);
  }

  /// Closes the journal; whether a machine that gets its events decides the same.
  [[nodiscard]] bool replays() {
    REQUIRE(journal_->recording());
    REQUIRE(journal_->close(now));
    const auto bytes = journal_->memory();
    auto reader = JournalReader::from_bytes({bytes.begin(), bytes.end()});
    REQUIRE(reader);
    HashLog hash;
    LoggedDecisions sink(hash, nullptr);
    Machine again(default_settings(), sink);
    again.start(Instant{});
    for (auto next = reader->next(); next && *next; next = reader->next()) {
      if ((*next)->type != RecordType::kEvent) continue;
      const auto event = decode_event((*next)->kind, (*next)->payload);
      REQUIRE(event);
      again.on_event((*next)->time, *event);
    }
    return hash.sum.value() == journal_->decisions_hash();
  }
  [[nodiscard]] std::uint64_t bytes() const { return journal_->bytes(); }

  void state_entered(Instant t, StateId state) override {
    logged_.state_entered(t, state);
    ScriptedWorld::state_entered(t, state);
  }
  void move_arm(Instant t, const hal::Segment& segment) override {
    logged_.move_arm(t, segment);
    ScriptedWorld::move_arm(t, segment);
  }
  void stop_arm(Instant t) override {
    logged_.stop_arm(t);
    ScriptedWorld::stop_arm(t);
  }
  void start_job(Instant t, JobKind kind, std::uint32_t number, std::span<const std::byte> arguments) override {
    logged_.start_job(t, kind, number, arguments);
    ScriptedWorld::start_job(t, kind, number, arguments);
  }
  void set_timer(Instant t, MachineTimer timer, Instant due) override {
    logged_.set_timer(t, timer, due);
    ScriptedWorld::set_timer(t, timer, due);
  }
  void cancel_timer(Instant t, MachineTimer timer) override {
    logged_.cancel_timer(t, timer);
    ScriptedWorld::cancel_timer(t, timer);
  }
  void show(Instant t, std::string_view line) override {
    logged_.show(t, line);
    ScriptedWorld::show(t, line);
  }
  void light(Instant t, hal::Light light) override {
    logged_.light(t, light);
    ScriptedWorld::light(t, light);
  }
  void forget_known_free(Instant t) override {
    logged_.forget_known_free(t);
    ScriptedWorld::forget_known_free(t);
  }
  void stop_recorded(Instant t, Fault cause) override {
    logged_.stop_recorded(t, cause);
    ScriptedWorld::stop_recorded(t, cause);
  }
  void finished(Instant t, const Ending& how) override {
    logged_.finished(t, how);
    ScriptedWorld::finished(t, how);
  }

 private:
  class HashLog final : public DecisionLog {
   public:
    void decision(DecisionKind kind, Instant t, std::span<const std::byte> bytes) override {
      sum.add(static_cast<std::uint16_t>(kind), t, bytes);
    }
    DecisionsHash sum;
  };

  void decision(DecisionKind kind, Instant t, std::span<const std::byte> bytes) override {
    journal_->decision(static_cast<std::uint16_t>(kind), t, bytes);
  }
  template <typename AppEvent>
  void record(const AppEvent& event) {
    if constexpr (requires { AppEvent::kKind; }) {
      note(AppEvent::kKind, pack(event, std::span<std::byte>(bytes_)));
    }
  }
  void record(const TimerFired& event) {
    ByteWriter writer(bytes_);
    writer(static_cast<std::uint32_t>(event.timer));
    note(kEventTimer, writer.size());
  }
  void record(const JobCompleted& event) {
    ByteWriter writer(bytes_);
    writer(static_cast<std::uint16_t>(event.kind), event.number, !event.failed.has_value());
    if (event.failed) writer(*event.failed);
    writer.raw(event.result.data(), event.result.size());
    note(kEventJobDone, writer.size());
  }
  void note(std::uint16_t kind, std::size_t size) {
    REQUIRE(size > 0);
    const std::span<const std::byte> payload(bytes_.data(), size);
    const Worth worth = worth_of(machine.state(), kind);
    if (worth == Worth::kRecord) {
      journal_->event(kind, now, payload);
    } else {
      journal_->hold(kind, now, payload, worth == Worth::kHoldAsBasis);
    }
  }

  std::unique_ptr<JournalWriter> journal_;
  LoggedDecisions logged_{*this, nullptr};
  std::array<std::byte, 20000> bytes_{};
};

void run_to(RecordedWorld& world, StateId state) {
  REQUIRE(world.run_until(StateId::kReady));
  world.press(hal::OperatorAction::kPlay);
  REQUIRE(world.run_until(state));
  world.consent = false;
  REQUIRE(world.run_until(StateId::kPaused));
}

/// The journal of a job that is paused for so long.
std::uint64_t bytes_with_pause(StateId state, double pause_s) {
  RecordedWorld world;
  world.frame_age = milliseconds(100);
  run_to(world, state);
  world.wait(pause_s);
  CHECK(world.machine.state() == StateId::kPaused);
  world.consent = true;
  REQUIRE(world.run_to_end());
  CHECK(world.ending.outcome == Outcome::kDone);
  CHECK(world.replays());
  return world.bytes();
}

}  // namespace

TEST_CASE("a pause of an hour takes as much of the journal as one of seconds, and replays", "[machine][replay]") {
  const StateId state = GENERATE(StateId::kLocateBoard, StateId::kCollect, StateId::kSweep, StateId::kMove);
  const std::uint64_t short_one = bytes_with_pause(state, 5);
  CHECK(bytes_with_pause(state, 3590) < short_one + 2048);  // behind it the surroundings are looked at again
}

TEST_CASE("how a pause ends is in the journal, whatever ended it", "[machine][replay]") {
  RecordedWorld world;
  run_to(world, StateId::kSweep);
  world.wait(30);
  SECTION("an hour") {
    REQUIRE(world.run_to_end(3601));
    CHECK(world.ending.fault == Fault::kPausedTooLong);
  }
  SECTION("silence of the arm") {
    world.arm_reports = false;
    REQUIRE(world.run_to_end(1));
    CHECK(world.ending.fault == Fault::kLinkLost);
  }
  SECTION("a protective stop") {
    world.safety = hal::ArmSafety::kProtectiveStop;
    REQUIRE(world.run_to_end(1));
    CHECK(world.ending.fault == Fault::kProtectiveStop);
  }
  SECTION("the loss of the panel") {
    world.press(hal::OperatorAction::kLost, OperatorDevice::kPanel);
    CHECK(world.ending.fault == Fault::kPanelLost);
  }
  CHECK(world.replays());
}

}  // namespace firstlook
