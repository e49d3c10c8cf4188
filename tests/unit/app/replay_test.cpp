#include "app/shell/replay.hpp"

#include <unistd.h>

#include <catch2/catch.hpp>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>

#include "app/cli/small_commands.hpp"
#include "app/machine/machine.hpp"
#include "app/shell/decision_log.hpp"
#include "app/shell/job_settings.hpp"
#include "platform/journal/journal.hpp"

namespace firstlook {
namespace {

using Catch::Matchers::Contains;

/// Hands decisions to a journal, after a change if the test wants one.
class JournalLog final : public DecisionLog {
 public:
  /// Returns how often the decision with this number is recorded; may change its bytes.
  using Change = std::function<int(std::size_t number, std::vector<std::byte>& bytes)>;
  JournalLog(JournalWriter& journal, Change change) : journal_(journal), change_(std::move(change)) {}
  void decision(DecisionKind kind, Instant now, std::span<const std::byte> bytes) override {
    std::vector<std::byte> recorded(bytes.begin(), bytes.end());
    const int times = change_ ? change_(number_, recorded) : 1;
    ++number_;
    for (int i = 0; i < times; ++i) journal_.decision(static_cast<std::uint16_t>(kind), now, recorded);
  }
  [[nodiscard]] std::size_t made() const { return number_; }

 private:
  JournalWriter& journal_;
  Change change_;
  std::size_t number_ = 0;
};

/// A short job, recorded: boot, Play, a list of views without any view, and the end.
class RecordedJob {
 public:
  explicit RecordedJob(JournalLog::Change change = {}, std::size_t bytes_max = kJournalBytesMax,
                       const std::string& version = version_text()) {
    path =
        (std::filesystem::temp_directory_path() / ("firstlook-replay-" + std::to_string(getpid()) + ".flj")).string();
    const Config config;
    auto journal =
        JournalWriter::create_file(path, {version, journal_config(config, RunScope::kEverything)}, bytes_max);
    REQUIRE(journal);
    journal_ = std::move(*journal);
    log_.emplace(*journal_, std::move(change));
    sink_.emplace(*log_, nullptr);
    machine_.emplace(machine_settings(config, RunScope::kEverything), *sink_);
    machine_->start(now_);
    ArmReported report;
    report.state.position_rad = JointVector::zero(6);
    report.state.velocity_rad_s = JointVector::zero(6);
    feed(report);
    feed(ColorFrameArrived{});
    feed(DepthFrameArrived{});
    report.state.stamp = now_;
    feed(report);
    feed(OperatorActed{});
    report.state.program_running = true;
    report.state.stamp = now_;
    feed(report);
    feed(ShutdownAsked{});
  }
  ~RecordedJob() {
    journal_.reset();
    std::filesystem::remove(path);
  }
  RecordedJob(const RecordedJob&) = delete;
  RecordedJob& operator=(const RecordedJob&) = delete;

  void close() {
    REQUIRE(journal_->close(now_));
    journal_.reset();
  }
  /// Ends without a closing record, as a killed process does.
  void abandon() { journal_.reset(); }
  [[nodiscard]] Result<ReplaySummary> replay() const { return replay_journal(path); }
  [[nodiscard]] std::size_t decisions() const { return log_->made(); }

  std::string path;

 private:
  template <typename AppEvent>
  void feed(const AppEvent& event) {
    std::array<std::byte, 512> bytes;
    const std::size_t size = pack(event, std::span<std::byte>(bytes));
    journal_->event(AppEvent::kKind, now_, std::span<const std::byte>(bytes).first(size));
    machine_->on_event(now_, event);
    now_ = now_ + milliseconds(8);
  }

  Instant now_{};
  std::unique_ptr<JournalWriter> journal_;
  std::optional<JournalLog> log_;
  std::optional<LoggedDecisions> sink_;
  std::optional<Machine> machine_;
};

std::vector<char> bytes_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

void write_bytes(const std::string& path, const std::vector<char>& bytes) {
  std::ofstream(path, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

}  // namespace

TEST_CASE("a record of the same program replays to its end", "[replay]") {
  RecordedJob job;
  job.close();
  const auto replayed = job.replay();
  REQUIRE(replayed);
  CHECK(replayed->events == 7);
  CHECK(replayed->decisions == job.decisions());
  CHECK(replayed->decisions > 10);
  CHECK_FALSE(replayed->stopped_early);
}

TEST_CASE("every decision that differs is found, with its number", "[replay]") {
  std::size_t decisions = 0;
  {
    RecordedJob whole;
    decisions = whole.decisions();
  }
  for (std::size_t changed = 0; changed < decisions; ++changed) {
    INFO(changed);
    for (const int times : {0, 2}) {
      RecordedJob job([&](std::size_t number, std::vector<std::byte>&) { return number == changed ? times : 1; });
      job.close();
      CHECK(job.replay().error().fault == Fault::kReplayDiffers);
    }
    RecordedJob job([&](std::size_t number, std::vector<std::byte>& bytes) {
      if (number == changed) bytes.push_back(std::byte{1});
      return 1;
    });
    job.close();
    const auto replayed = job.replay();
    REQUIRE_FALSE(replayed);
    CHECK_THAT(std::string(replayed.error().detail()), Contains("decision " + std::to_string(changed) + " "));
  }
}

TEST_CASE("a difference names the version that recorded", "[replay]") {
  RecordedJob job([](std::size_t number, std::vector<std::byte>&) { return number == 5 ? 2 : 1; }, kJournalBytesMax,
                  "0.0.1");
  job.close();
  CHECK_THAT(std::string(job.replay().error().detail()),
             Contains("recorded by version 0.0.1, this is " + version_text()));
}

TEST_CASE("a record that was never closed agrees up to its end", "[replay]") {
  RecordedJob job;
  job.abandon();
  const auto replayed = job.replay();
  REQUIRE_FALSE(replayed);
  CHECK(replayed.error().fault == Fault::kJournalBroken);
  CHECK_THAT(std::string(replayed.error().detail()), Contains("cut short") && Contains("the 7 events"));
}

TEST_CASE("a record cut anywhere is named as such, never as a difference", "[replay]") {
  RecordedJob job;
  job.close();
  const std::vector<char> whole = bytes_of(job.path);
  for (std::size_t size = 0; size < whole.size(); size += 7) {
    INFO(size);
    write_bytes(job.path, {whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size)});
    const auto replayed = job.replay();
    REQUIRE_FALSE(replayed);
    CHECK(replayed.error().fault == Fault::kJournalBroken);
  }
}

TEST_CASE("a recording that reached its cap agrees as far as it goes", "[replay]") {
  std::size_t bytes = 0;
  {
    RecordedJob whole;
    whole.close();
    bytes = bytes_of(whole.path).size();
  }
  RecordedJob job({}, bytes - 300);
  job.close();
  const auto replayed = job.replay();
  REQUIRE(replayed);
  CHECK(replayed->stopped_early);
  CHECK(replayed->decisions < job.decisions());
}

TEST_CASE("the hash at the end is compared, too", "[replay]") {
  RecordedJob job;
  job.close();
  std::vector<char> bytes = bytes_of(job.path);
  // The last record: head of 15 bytes, u64 records, u64 hash, u32 CRC that goes on from the one before it.
  constexpr std::size_t kEndBytes = 15 + 16 + 4;
  const std::size_t end = bytes.size() - kEndBytes;
  bytes[bytes.size() - 5] = static_cast<char>(bytes[bytes.size() - 5] ^ 1);
  std::uint32_t crc = 0;
  std::memcpy(&crc, &bytes[end - 4], 4);
  crc = crc32(crc, std::as_bytes(std::span(bytes)).subspan(end, kEndBytes - 4));
  std::memcpy(&bytes[bytes.size() - 4], &crc, 4);
  write_bytes(job.path, bytes);
  const auto replayed = job.replay();
  REQUIRE_FALSE(replayed);
  CHECK_THAT(std::string(replayed.error().detail()), Contains("another hash"));
}

TEST_CASE("a stored calibration is not looked up again: its file may be gone", "[replay]") {
  Config config;
  config.calibration.stored = "/nowhere/hand_eye.yaml";
  config.calibration.verify_views = 5;
  config.parking_rad = JointVector{0, -1.5, 1.5, 0, 0, 0};
  const auto settings = settings_from_journal(journal_config(config, RunScope::kMap));
  REQUIRE(settings);
  CHECK(settings->scope == RunScope::kMap);
  CHECK(settings->verify_views == 5);
}

TEST_CASE("what is not a job's record is refused", "[replay]") {
  CHECK(replay_journal("/nowhere/journal.flj").error().fault == Fault::kDataMissing);
  const std::string path =
      (std::filesystem::temp_directory_path() / ("firstlook-replay-none-" + std::to_string(getpid()))).string();
  for (const char* config :
       {"", "seed: 1\n", "# only: everything", "# only: dancing\nseed: 1\n", "# only: everything\nsede: 1\n"}) {
    INFO(config);
    {
      auto journal = JournalWriter::create_file(path, {version_text(), config});
      REQUIRE(journal);
      REQUIRE((*journal)->close(Instant{}));
    }
    CHECK_FALSE(replay_journal(path));
  }
  {
    auto journal = JournalWriter::create_file(path, {version_text(), journal_config(Config{}, RunScope::kCalibrate)});
    REQUIRE(journal);
    REQUIRE((*journal)->close(Instant{}));
  }
  CHECK_THAT(std::string(replay_journal(path).error().detail()), Contains("no decision is recorded"));
  std::filesystem::remove(path);
}

}  // namespace firstlook
