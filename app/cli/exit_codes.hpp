/// What the program's exit code tells scripts.
#pragma once

#include "app/machine/machine.hpp"
#include "platform/core/result.hpp"

namespace firstlook {

enum ExitCode : int { kDone = 0, kUsage = 2, kData = 3, kDevice = 4, kRejected = 5, kStopped = 6, kInternal = 70 };

[[nodiscard]] int exit_code_of(const Error& error);
[[nodiscard]] int exit_code_of(const Ending& ending);

/// Says on stderr what is wrong and what to do. @return exit_code_of
int fail(const Error& error);

}  // namespace firstlook
