/// The folder of a run.
#pragma once

#include <string>
#include <vector>

#include "algorithms/mapping/voxel_map.hpp"
#include "app/dataset/hand_eye_file.hpp"
#include "app/report/run_record.hpp"
#include "platform/core/result.hpp"

namespace firstlook {

/// Files of the map, made elsewhere; an empty one is not written.
struct MapFiles {
  std::string collision_map_bt;
  std::string map_ot;
  std::string map_ply;
  std::string color_map_ot;
  std::string fine_map_bt;
  std::vector<AxisBox> occupied;  ///< merge_occupied of the map, base frame: becomes ros/*.scene, once for each frame
};

/// A run's calibration as hand_eye.yaml says it; of a stored one the same again, with the verdict of its test.
/// `record.hand_eye` is set.
[[nodiscard]] StoredCalibration calibration_of_run(const RunRecord& record);

/// Whether a run may write there; makes nothing, so that a run that does not start leaves nothing behind.
/// @return kOutputNotEmpty when it exists and is not empty, kDiskWrite when it is no folder or cannot be read
[[nodiscard]] Status check_run_folder(const std::string& folder);

/// Writes result.json, views.csv, report.html and, as far as the run got, hand_eye.yaml, camera_info.yaml, the map's
/// files and ros/, each whole or not at all; result.json last, so that its presence means that the others are there.
/// @return kDiskWrite with the file's name
[[nodiscard]] Status write_run_files(const std::string& folder, const RunRecord& record, const MapFiles& map);

/// views.csv: one row for each look of sweep and exploration.
[[nodiscard]] std::string views_csv(const RunRecord& record);

}  // namespace firstlook
