/// Recorded calibration views: a folder with board.yaml and poses with images, corners, or pose pairs.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "algorithms/calibration/verdict.hpp"
#include "algorithms/vision/target_set.hpp"
#include "platform/core/camera_intrinsics.hpp"
#include "platform/core/result.hpp"

namespace firstlook {

enum class CalibrationSource : std::uint8_t { kImages, kCorners, kPairs };

/// One row of poses.csv.
struct RecordedPose {
  std::string image;
  Transform<Base, Flange> base_T_flange;
};

/// What a calibration is solved from. `views` for images and corners, `pairs` for pairs.csv.
struct CalibrationDataset {
  CalibrationSource source = CalibrationSource::kImages;
  BoardSpec board;                   ///< the first target; with pairs.csv: what board.yaml says, or unset without one
  std::vector<NamedTarget> targets;  ///< all of them; a board.yaml of one target gives it no name
  /// As camera_info.yaml says; without one as the same images say by themselves (Zhang 2000), which is a start for a
  /// solve that estimates them.
  CameraIntrinsics camera;
  bool intrinsics_estimated = false;  ///< no camera_info.yaml
  double intrinsics_rms_px = 0;       ///< of that calibration
  std::vector<CalibrationView> views;
  std::vector<std::string> names;   ///< one for each view
  std::vector<std::string> images;  ///< the picture that each view is of; those of one picture are one station
  std::vector<PosePair> pairs;
  std::optional<TouchRecord> touched;  ///< touches.csv with tip.yaml
  std::vector<std::string> notes;      ///< for people: images left out and why
};

/// Reads the folder; corners.csv is preferred to images, pairs.csv is used when there is no poses.csv. Images in which
/// the board is not found are left out with a note. With several targets (board.yaml with a list `boards`) each picture
/// gives a view of each target that it shows, and corners.csv has a column `target` with the name. Quaternions within
/// 1e-3 of unit length are normalised, others refused. touches.csv, when it is there, has a row for each corner that
/// the arm's tip was led onto: `column,row` (or `point`, and with several targets `target`) and base_T_flange; tip.yaml
/// says where the tip is on the flange, without it that is estimated.
/// @return kDataMissing or kDataMalformed, naming file and line
[[nodiscard]] Result<CalibrationDataset> read_calibration_dataset(const std::filesystem::path& folder,
                                                                  const DetectionOptions& detection = {});

/// board.yaml alone: one target without a name, or those of its list `boards`, each the same keys and a `name`, of
/// which none can be taken for another (check_distinct). @return kDataMissing, kDataMalformed
[[nodiscard]] Result<std::vector<NamedTarget>> read_targets(const std::filesystem::path& file);
/// The same for a file of one target. @return also kDataMalformed for several
[[nodiscard]] Result<BoardSpec> read_board(const std::filesystem::path& file);

/// tip.yaml: `flange_p_tip_m: [x, y, z]`, and `sigma_m`, for each axis, when it is not the usual one.
/// @return kDataMissing, kDataMalformed
[[nodiscard]] Result<TipOffset> read_tip(const std::filesystem::path& file);

/// The text of a board.yaml.
[[nodiscard]] std::string board_yaml(const BoardSpec& board);

/// camera_info.yaml as ROS writes it. @return kDataMissing, kDataMalformed
[[nodiscard]] Result<CameraIntrinsics> read_camera_info(const std::filesystem::path& file);

}  // namespace firstlook
