#include "app/cli/exit_codes.hpp"

#include <cstdio>

#include "platform/linux/terminal.hpp"

namespace firstlook {

int exit_code_of(const Error& error) {
  switch (error.fault) {
    case Fault::kUsage:
      return kExitUsage;
    case Fault::kDeviceMissing:
      return kExitDevice;
    case Fault::kInternal:
      return kExitInternal;
    default:
      return kExitData;
  }
}

int exit_code_of(const Ending& ending) {
  switch (ending.outcome) {
    case Outcome::kDone:
      return kExitDone;
    case Outcome::kCalibrationRejected:
      return kExitRejected;
    case Outcome::kSafelyStopped:
      return kExitStopped;
    case Outcome::kFaulted:
      return ending.fault == Fault::kDeviceMissing ? kExitDevice : kExitInternal;
  }
  return kExitInternal;
}

int fail(const Error& error) {
  std::fprintf(stderr, "%sfirstlook: %s\n", is_system_journal(2) ? "<3>" : "", describe(error).c_str());
  return exit_code_of(error);
}

}  // namespace firstlook
