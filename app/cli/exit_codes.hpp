/// What the program's exit code tells scripts.
#pragma once

#include "app/machine/machine.hpp"
#include "platform/core/result.hpp"

namespace firstlook {

enum ExitCode : int {
  kExitDone = 0,
  kExitUsage = 2,
  kExitData = 3,
  kExitDevice = 4,
  kExitRejected = 5,
  kExitStopped = 6,
  kExitInternal = 70
};

[[nodiscard]] int exit_code_of(const Error& error);
[[nodiscard]] int exit_code_of(const Ending& ending);

/// Says on stderr what is wrong and what to do. @return exit_code_of
int fail(const Error& error);

}  // namespace firstlook
