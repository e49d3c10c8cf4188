/// `firstlook calibrate`: a hand-eye calibration from recorded data, offline.
#pragma once

#include <string>

namespace firstlook {

struct CalibrateCommandOptions {
  std::string dataset;      ///< folder
  std::string solver = {};  ///< a name of solver_table(); empty: park-martin
  bool strict = false;      ///< a rejected calibration is an error
  bool json = false;
  std::string detector = "default";  ///< find_detector_preset
  std::string out = {};              ///< folder for the files; empty: none
  std::string intrinsics = {};       ///< given | estimate; empty: given where there is a camera_info.yaml
  std::string arm = {};              ///< find_arm_model; empty: not known, and no job takes hand_eye.yaml up
};

/// Prints the result on stdout (the hand_eye object of result.json when asked) and narrates on stderr; with `out`
/// writes report.html and result.json (with every solver on parts of the views), the files of calibration_files, and
/// camera_info.yaml when a camera is known. The folder must be new or empty.
/// @return the process's exit code: 0 solved, 2 usage, 3 data, 5 rejected and strict
int run_calibrate_command(const CalibrateCommandOptions& options);

}  // namespace firstlook
