/// `firstlook export`: what a run found, in the files of other programs.
#pragma once

#include <filesystem>
#include <string>

namespace firstlook {

struct ExportCommandOptions {
  std::filesystem::path run;  ///< folder of a run, or of `firstlook map --out`
  std::string to;             ///< ros2 | ros1 | moveit | ur | csv
  std::filesystem::path out;  ///< empty: RUN/export/TO
};

/// Writes what `to` can take of hand_eye.yaml, camera_info.yaml, collision_map.bt and map.ot in the run's folder, and
/// prints the path of each file on stdout. A calibration that its own run rejected is not exported.
/// @return the process's exit code: 0, 2 for a word that `to` does not know, 3 when there is nothing to export, a file
/// cannot be read or written
int run_export_command(const ExportCommandOptions& options);

}  // namespace firstlook
