/// The process as Linux sees it: its memory, its signals, the date.
#pragma once

#include <cstddef>
#include <string>

#include "platform/core/result.hpp"

namespace firstlook {

/// Resident set size from /proc/self/statm; 0 when it cannot be read. Does not allocate.
[[nodiscard]] std::size_t resident_bytes();
/// The part of it that is pages of files: the program and its shared libraries; 0 when it cannot be read.
[[nodiscard]] std::size_t resident_file_bytes();
/// Locks all pages in memory, present and future. Error: kOutOfMemory when the system does not allow it: go on without.
[[nodiscard]] Status lock_memory();

/// From now on SIGINT and SIGTERM set a flag (a second one of the same kind ends the process at once); SIGPIPE is
/// ignored.
void catch_stop_signals();
[[nodiscard]] bool stop_signal_received();

/// The date in UTC: "2026-01-31T12:00:00Z".
[[nodiscard]] std::string utc_date_text();
/// The date in UTC for a folder's name: "20260131-120000".
[[nodiscard]] std::string utc_date_for_name();

}  // namespace firstlook
