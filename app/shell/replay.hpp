/// Runs recorded events through a fresh machine and compares every decision with the record.
#pragma once

#include <cstdint>
#include <string>

#include "platform/core/result.hpp"

namespace firstlook {

struct ReplaySummary {
  std::uint64_t events = 0;
  std::uint64_t decisions = 0;
  std::uint64_t decisions_hash = 0;
};

/// Errors: kDataMissing, kJournalBroken (cut short or altered), kReplayDiffers with the first decision that differs.
[[nodiscard]] Result<ReplaySummary> replay_journal(const std::string& path);

/// `firstlook replay JOURNAL`. @return 0 when all decisions agree, 3 otherwise
int run_replay_command(const std::string& path);

}  // namespace firstlook
