#include "app/shell/replay.hpp"

#include <algorithm>
#include <cstdio>
#include <optional>
#include <vector>

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
  explicit Comparison(const std::vector<JournalRecord>& expected) : expected_(expected) {}

  void decision(DecisionKind kind, Instant now, std::span<const std::byte> bytes) override {
    hash_.add(static_cast<std::uint16_t>(kind), now, bytes);
    const std::size_t at = made_++;
    if (difference_) return;
    if (at >= expected_.size()) {
      difference_ = failure(Fault::kReplayDiffers, "decision {} at {:.3f} s is not in the record", at, now.seconds());
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
    if (made_ != expected_.size()) {
      return failure(Fault::kReplayDiffers, "{} decisions were recorded, {} made now", expected_.size(), made_);
    }
    return {};
  }
  [[nodiscard]] std::uint64_t made() const { return made_; }
  [[nodiscard]] std::uint64_t hash() const { return hash_.value(); }

 private:
  const std::vector<JournalRecord>& expected_;
  std::uint64_t made_ = 0;
  DecisionsHash hash_;
  std::optional<std::unexpected<Error>> difference_;
};

}  // namespace

Result<ReplaySummary> replay_journal(const std::string& path) {
  auto reader = JournalReader::open(path);
  if (!reader) return std::unexpected(reader.error());
  const auto settings = settings_from_journal(reader->header().config);
  if (!settings) return std::unexpected(settings.error());

  std::vector<JournalRecord> events, decisions;
  for (;;) {
    const auto record = reader->next();
    if (!record) return std::unexpected(record.error());
    if (!*record) break;
    if ((*record)->type == RecordType::kEvent) events.push_back(**record);
    if ((*record)->type == RecordType::kDecision) decisions.push_back(**record);
  }
  if (decisions.empty()) return failure(Fault::kJournalBroken, "{}: no decision is recorded", path);

  Comparison comparison(decisions);
  LoggedDecisions sink(comparison, nullptr);
  Machine machine(*settings, sink);
  machine.start(decisions.front().time);
  for (const JournalRecord& event : events) {
    const auto decoded = decode_event(event.kind, event.payload);
    if (decoded) machine.on_event(event.time, *decoded);
  }
  if (const Status same = comparison.verdict(); !same) return std::unexpected(same.error());
  return ReplaySummary{events.size(), comparison.made(), comparison.hash()};
}

int run_replay_command(const std::string& path) {
  const auto replayed = replay_journal(path);
  if (!replayed) {
    std::fprintf(stderr, "firstlook replay: %s\n", describe(replayed.error()).c_str());
    return 3;
  }
  std::printf("%llu events, %llu decisions: all agree (%s)\n", static_cast<unsigned long long>(replayed->events),
              static_cast<unsigned long long>(replayed->decisions), hash_text(replayed->decisions_hash).c_str());
  return 0;
}

}  // namespace firstlook
