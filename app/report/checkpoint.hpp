/// What a power cut must not lose: the calibration of a run that goes on to map, as a file in the run's folder.
#pragma once

#include <optional>
#include <string>

#include "app/dataset/hand_eye_file.hpp"
#include "platform/core/result.hpp"

namespace firstlook {

inline constexpr std::string_view kCheckpointName = "checkpoint.yaml";

/// Writes folder/checkpoint.yaml, whole or not at all and on the disk when it returns: a first line with the checksum
/// of what follows, then the text of hand_eye.yaml. Error: kDiskWrite.
[[nodiscard]] Status write_checkpoint(const std::string& folder, const StoredCalibration& calibration);

/// Reads one. Errors: kDataMissing; kDataMalformed when the checksum is another; those of read_hand_eye.
[[nodiscard]] Result<StoredCalibration> read_checkpoint(const std::string& file);

/// A run that was cut off after its calibration.
struct CutOffRun {
  std::string folder;
  std::string file;  ///< its checkpoint
  StoredCalibration calibration;
};

/// Of the runs in the folders of `runs` that have a checkpoint but no result.json, the newest (by time of the
/// checkpoint, then by name) whose checkpoint is whole and was accepted. Broken ones are passed over: what is older and
/// valid wins.
[[nodiscard]] std::optional<CutOffRun> newest_cut_off_run(const std::string& runs);

/// After the files of the run are written, or when nobody shall be offered it again. One that is not there is fine.
void remove_checkpoint(const std::string& folder);

}  // namespace firstlook
