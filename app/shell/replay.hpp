/// Runs recorded events through a fresh machine and compares every decision with the record.
#pragma once

#include <cstdint>
#include <string>

#include "platform/core/result.hpp"

namespace firstlook {

struct ReplaySummary {
  std::uint64_t events = 0;
  std::uint64_t decisions = 0;
  std::uint64_t decisions_hash = 0;  ///< of all decisions of the run, as its record ends with
  bool stopped_early = false;        ///< the recording reached its cap; what came later is not compared
  double end_s = 0;                  ///< time of the last event
};

/// Errors: kDataMissing; kReplayDiffers with the first decision that differs; kJournalBroken with the place where the
/// journal is cut short or altered, and how much before it agrees.
[[nodiscard]] Result<ReplaySummary> replay_journal(const std::string& path);

/// `firstlook replay JOURNAL`. @return 0 when all decisions agree, 3 otherwise
int run_replay_command(const std::string& path);

}  // namespace firstlook
