#include "app/cli/exit_codes.hpp"

#include <cstdio>

#include "platform/linux/terminal.hpp"

namespace firstlook {

int exit_code_of(const Error& error) {
  switch (error.fault) {
    case Fault::kUsage:
      return kUsage;
    case Fault::kDeviceMissing:
      return kDevice;
    case Fault::kInternal:
      return kInternal;
    default:
      return kData;
  }
}

int exit_code_of(const Ending& ending) {
  switch (ending.outcome) {
    case Outcome::kDone:
      return kDone;
    case Outcome::kCalibrationRejected:
      return kRejected;
    case Outcome::kSafelyStopped:
      return kStopped;
    case Outcome::kFaulted:
      return ending.fault == Fault::kDeviceMissing ? kDevice : kInternal;
  }
  return kInternal;
}

int fail(const Error& error) {
  std::fprintf(stderr, "%sfirstlook: %s\n", is_system_journal(2) ? "<3>" : "", describe(error).c_str());
  return exit_code_of(error);
}

}  // namespace firstlook
