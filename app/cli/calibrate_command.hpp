/// `firstlook calibrate`: a hand-eye calibration from recorded data, offline.
#pragma once

#include <string>

namespace firstlook {

struct CalibrateCommandOptions {
  std::string dataset;  ///< folder
  std::string solver;   ///< a name of solver_table(); empty: park-martin
  bool strict = false;  ///< a rejected calibration is an error
  bool json = false;
  std::string detector = "default";  ///< find_detector_preset
};

/// Prints the result on stdout (the hand_eye object of result.json when asked) and narrates on stderr.
/// @return the process's exit code: 0 solved, 2 usage, 3 data, 5 rejected and strict
int run_calibrate_command(const CalibrateCommandOptions& options);

}  // namespace firstlook
