#include "app/shell/replay.hpp"

#include <algorithm>
#include <cstdio>
#include <optional>
#include <vector>

#include "app/cli/small_commands.hpp"
#include "app/machine/machine.hpp"
#include "app/shell/decision_log.hpp"
#include "app/shell/event_codec.hpp"
#include "app/shell/job_settings.hpp"
#include "platform/journal/journal.hpp"

namespace firstlook {
namespace {

/// Compares each decision with the next one of the record; remembers the first difference.
class Comparison final : public DecisionLog {
 public:
  /// whole: false when the record ends before the run did; then decisions beyond its end are not compared.
  Comparison(const std::vector<JournalRecord>& expected, bool whole) : expected_(expected), whole_(whole) {}

  void decision(DecisionKind kind, Instant now, std::span<const std::byte> bytes) override {
    hash_.add(static_cast<std::uint16_t>(kind), now, bytes);
    const std::size_t at = made_++;
    if (difference_) return;
    if (at >= expected_.size()) {
      if (whole_) {
        difference_ = failure(Fault::kReplayDiffers, "decision {} at {:.3f} s is not in the record", at, now.seconds());
      }
      return;
    }
    const JournalRecord& record = expected_[at];
    const bool same = record.kind == static_cast<std::uint16_t>(kind) && record.time == now &&
                      std::equal(bytes.begin(), bytes.end(), record.payload.begin(), record.payload.end());
    if (!same) {
      difference_ =
          failure(Fault::kReplayDiffers,
                  "decision {} (record {}) at {:.3f} s: kind {} was recorded, kind {} of {} bytes decided now", at,
                  record.number, record.time.seconds(), record.kind, static_cast<int>(kind), bytes.size());
    }
  }

  [[nodiscard]] Status verdict() const {
    if (difference_) return *difference_;
    if (made_ < expected_.size()) {
      return failure(Fault::kReplayDiffers, "{} decisions were recorded, {} made now", expected_.size(), made_);
    }
    return {};
  }
  [[nodiscard]] std::uint64_t compared() const { return std::min<std::uint64_t>(made_, expected_.size()); }
  [[nodiscard]] std::uint64_t hash() const { return hash_.value(); }

 private:
  const std::vector<JournalRecord>& expected_;
  const bool whole_;
  std::uint64_t made_ = 0;
  DecisionsHash hash_;
  std::optional<std::unexpected<Error>> difference_;
};

/// The records of a journal up to its end, or to where it cannot be read any more.
struct Recording {
  std::vector<JournalRecord> events, decisions;
  bool stopped_early = false;   ///< the recording reached its cap, the job went on
  std::optional<Error> broken;  ///< cut short or altered
  [[nodiscard]] bool whole() const { return !stopped_early && !broken; }
};

Recording read_records(JournalReader& reader) {
  Recording recording;
  for (;;) {
    const auto record = reader.next();
    if (!record) {
      recording.broken = record.error();
      return recording;
    }
    if (!*record) return recording;
    if ((*record)->type == RecordType::kEvent) recording.events.push_back(**record);
    if ((*record)->type == RecordType::kDecision) recording.decisions.push_back(**record);
    recording.stopped_early =
        recording.stopped_early || ((*record)->type == RecordType::kNote && (*record)->kind == kNoteRecordingStopped);
  }
}

/// Says which other version wrote the journal, when the decisions differ because of it.
Error with_version(const Error& error, const std::string& recorded_by) {
  if (error.fault != Fault::kReplayDiffers || recorded_by == version_text()) return error;
  return failure(error.fault, "{}; recorded by version {}, this is {}", error.detail(), recorded_by, version_text())
      .error();
}

}  // namespace

Result<ReplaySummary> replay_journal(const std::string& path) {
  auto reader = JournalReader::open(path);
  if (!reader) return std::unexpected(reader.error());
  const auto settings = settings_from_journal(reader->header().config);
  if (!settings) return std::unexpected(settings.error());
  const Recording recording = read_records(*reader);
  if (recording.decisions.empty()) {
    if (recording.broken) return std::unexpected(*recording.broken);
    return failure(Fault::kJournalBroken, "{}: no decision is recorded", path);
  }

  Comparison comparison(recording.decisions, recording.whole());
  LoggedDecisions sink(comparison, nullptr);
  Machine machine(*settings, sink);
  machine.start(recording.decisions.front().time);
  for (const JournalRecord& event : recording.events) {
    const auto decoded = decode_event(event.kind, event.payload);
    if (decoded) machine.on_event(event.time, *decoded);
  }
  if (const Status same = comparison.verdict(); !same) {
    return std::unexpected(with_version(same.error(), reader->header().program_version));
  }
  const double end_s = recording.events.empty() ? 0 : recording.events.back().time.seconds();
  if (recording.broken) {
    return failure(Fault::kJournalBroken, "{}; the {} events and {} decisions before it agree, up to {:.3f} s",
                   recording.broken->detail(), recording.events.size(), comparison.compared(), end_s);
  }
  if (recording.whole() && reader->decisions_hash() != comparison.hash()) {
    return failure(Fault::kReplayDiffers, "the decisions agree, but the record ends with another hash of them");
  }
  return ReplaySummary{recording.events.size(), comparison.compared(), *reader->decisions_hash(),
                       recording.stopped_early, end_s};
}

int run_replay_command(const std::string& path) {
  const auto replayed = replay_journal(path);
  if (!replayed) {
    std::fprintf(stderr, "firstlook replay: %s\n", describe(replayed.error()).c_str());
    return 3;
  }
  fmt::print("{} events, {} decisions: all agree ({})\n", replayed->events, replayed->decisions,
             hash_text(replayed->decisions_hash));
  if (replayed->stopped_early) {
    fmt::print("The recording stopped at its cap of {} MiB, at {:.3f} s; what came later is not compared.\n",
               kJournalBytesMax >> 20, replayed->end_s);
  }
  return 0;
}

}  // namespace firstlook
