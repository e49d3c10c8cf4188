/// Runs the program as a user does: a process of its own with arguments, captured output and a hard time limit.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tests/support/sanitized_builds.hpp"

namespace firstlook::test {

struct ProgramOptions {
  std::filesystem::path folder = ".";           ///< working directory
  std::optional<std::uint64_t> file_bytes_max;  ///< no file may grow beyond it, as on a disk that is full
  std::string stdout_to;                        ///< a path; empty: captured
  std::string signal_at;                        ///< when this stands on stderr, `signal` is sent, once
  int signal = 0;
  double limit_s = 300 * kSlowdown;  ///< then the program is killed
};

struct ProgramResult {
  int exit_code = -1;  ///< 128 + the signal's number when a signal ended it, as a shell has it
  bool timed_out = false;
  std::string out, err;
};

/// Runs `program` with `arguments` and without any FIRSTLOOK_ variable in its environment, and waits for its end.
[[nodiscard]] ProgramResult run_program(const std::string& program, const std::vector<std::string>& arguments,
                                        const ProgramOptions& options = {});

}  // namespace firstlook::test
