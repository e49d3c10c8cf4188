#include "app/dataset/calibration_dataset.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "algorithms/calibration/board_ambiguity.hpp"
#include "algorithms/calibration/intrinsics.hpp"
#include "algorithms/vision/board_pose.hpp"
#include "algorithms/vision/target_detection.hpp"
#include "algorithms/vision/target_names.hpp"
#include "app/dataset/csv_table.hpp"
#include "app/dataset/gray_image_file.hpp"

namespace firstlook {
namespace {

namespace fs = std::filesystem;

constexpr double kQuaternionTolerance = 1e-3;
constexpr std::size_t kViewsMax = 500;    // work and memory of a solve grow with the square of the number of views
constexpr double kTranslationMax_m = 10;  // no arm that carries a camera reaches farther

constexpr std::array<std::string_view, 8> kPoseColumns = {"image", "x", "y", "z", "qx", "qy", "qz", "qw"};
constexpr std::array<std::string_view, 5> kCornerColumns = {"image", "column", "row", "u_px", "v_px"};
/// For boards whose points have no column and row: corners of markers, number 4 * marker + 0..3 clockwise.
constexpr std::array<std::string_view, 4> kPointColumns = {"image", "point", "u_px", "v_px"};
constexpr std::array<std::string_view, 14> kPairColumns = {
    "flange_x", "flange_y", "flange_z", "flange_qx", "flange_qy", "flange_qz", "flange_qw",
    "board_x",  "board_y",  "board_z",  "board_qx",  "board_qy",  "board_qz",  "board_qw"};

bool is_there(const fs::path& file) {
  std::error_code ignored;
  return fs::exists(file, ignored);
}

/// Position and quaternion from seven columns.
Result<Pose> pose_from(const CsvTable& table, const CsvRow& row, std::size_t first) {
  std::array<double, 7> v{};
  for (std::size_t i = 0; i < v.size(); ++i) {
    const auto number = table.number(row, first + i);
    if (!number) return std::unexpected(number.error());
    v[i] = *number;
  }
  const Eigen::Vector3d position(v[0], v[1], v[2]);
  if (position.norm() > kTranslationMax_m) {
    return failure(Fault::kDataMalformed, "{}: a position {:.0f} m away: that looks like millimetres", table.place(row),
                   position.norm());
  }
  const Eigen::Quaterniond rotation(v[6], v[3], v[4], v[5]);
  if (std::abs(rotation.norm() - 1) > kQuaternionTolerance) {
    return failure(Fault::kDataMalformed, "{}: a quaternion of length {:.4f} instead of 1", table.place(row),
                   rotation.norm());
  }
  Pose pose = Pose::Identity();
  pose.linear() = rotation.normalized().toRotationMatrix();
  pose.translation() = position;
  return pose;
}

Result<std::vector<RecordedPose>> read_poses(const fs::path& file) {
  const auto table = read_csv(file, kPoseColumns);
  if (!table) return std::unexpected(table.error());
  std::vector<RecordedPose> poses;
  for (const CsvRow& row : table->rows) {
    const auto pose = pose_from(*table, row, 1);
    if (!pose) return std::unexpected(pose.error());
    const std::string& image = row.fields[0];
    const auto same = [&](const RecordedPose& other) { return other.image == image; };
    if (image.empty()) return failure(Fault::kDataMalformed, "{}: no image named", table->place(row));
    if (std::any_of(poses.begin(), poses.end(), same)) {
      return failure(Fault::kDataMalformed, "{}: image '{}' a second time", table->place(row), image);
    }
    poses.push_back({image, Transform<Base, Flange>(*pose)});
  }
  if (poses.empty()) return failure(Fault::kDataMalformed, "{}: no poses", table->file);
  if (poses.size() > kViewsMax) {
    return failure(Fault::kDataMalformed, "{}: {} poses, at most {} are solved", table->file, poses.size(), kViewsMax);
  }
  return poses;
}

Result<std::vector<PosePair>> read_pairs(const fs::path& file) {
  const auto table = read_csv(file, kPairColumns);
  if (!table) return std::unexpected(table.error());
  if (table->rows.size() > kViewsMax) {
    return failure(Fault::kDataMalformed, "{}: {} pairs, at most {} are solved", table->file, table->rows.size(),
                   kViewsMax);
  }
  std::vector<PosePair> pairs;
  for (const CsvRow& row : table->rows) {
    const auto same = [&](const CsvRow& other) { return other.line < row.line && other.fields == row.fields; };
    if (std::any_of(table->rows.begin(), table->rows.end(), same)) {
      return failure(Fault::kDataMalformed, "{}: the same pair a second time", table->place(row));
    }
    const auto flange = pose_from(*table, row, 0);
    if (!flange) return std::unexpected(flange.error());
    const auto board = pose_from(*table, row, 7);
    if (!board) return std::unexpected(board.error());
    pairs.push_back({Transform<Base, Flange>(*flange), Transform<Camera, Board>(*board)});
  }
  if (pairs.empty()) return failure(Fault::kDataMalformed, "{}: no pairs", table->file);
  return pairs;
}

/// A corner as read: which one of its image, and where.
struct CornerRow {
  std::string image;
  int index = 0;
  Eigen::Vector2d pixel;
};

Result<CornerRow> corner_from(const CsvTable& table, const CsvRow& row, const BoardSpec& board,
                              const std::optional<CameraIntrinsics>& camera) {
  std::array<double, 4> v{};
  const std::size_t skipped = board.has_marker_corners() ? 1 : 0;  // one number instead of column and row
  for (std::size_t i = skipped; i < v.size(); ++i) {
    const auto number = table.number(row, 1 + i - skipped);
    if (!number) return std::unexpected(number.error());
    v[i] = *number;
  }
  const auto in_range = [](double x, int count) { return x >= 0 && x < count && x == std::floor(x); };
  if (board.has_marker_corners() && !in_range(v[1], board.corners())) {
    return failure(Fault::kDataMalformed, "{}: point {} on a board with {}", table.place(row), v[1], board.corners());
  }
  if (!board.has_marker_corners() && (!in_range(v[0], board.inner_columns) || !in_range(v[1], board.inner_rows))) {
    return failure(Fault::kDataMalformed, "{}: corner column {} row {} on a board of {}x{}", table.place(row), v[0],
                   v[1], board.inner_columns, board.inner_rows);
  }
  constexpr double kOutside_px = 1.0;  // refined corners may lie a little outside
  if (camera && (v[2] < -kOutside_px || v[3] < -kOutside_px || v[2] > camera->width - 1 + kOutside_px ||
                 v[3] > camera->height - 1 + kOutside_px)) {
    return failure(Fault::kDataMalformed, "{}: corner at ({}, {}) px lies outside the {}x{} image of camera_info.yaml",
                   table.place(row), v[2], v[3], camera->width, camera->height);
  }
  const int lines = board.has_marker_corners() ? 1 : board.inner_columns;
  return CornerRow{row.fields[0], static_cast<int>(v[1]) * lines + static_cast<int>(v[0]), {v[2], v[3]}};
}

/// Corners of each image that has all of them, or enough where the board allows a part; images that have not are noted.
Result<std::map<std::string, CornerSet>> read_corners(const fs::path& file, const BoardSpec& board,
                                                      const std::optional<CameraIntrinsics>& camera,
                                                      std::vector<std::string>& notes) {
  const auto table = board.has_marker_corners() ? read_csv(file, kPointColumns) : read_csv(file, kCornerColumns);
  if (!table) return std::unexpected(table.error());
  const auto count = static_cast<std::size_t>(board.corners());
  std::map<std::string, std::vector<std::optional<Eigen::Vector2d>>> found;
  for (const CsvRow& row : table->rows) {
    const auto corner = corner_from(*table, row, board, camera);
    if (!corner) return std::unexpected(corner.error());
    auto& corners = found[corner->image];
    corners.resize(count);
    auto& place = corners[static_cast<std::size_t>(corner->index)];
    if (place)
      return failure(Fault::kDataMalformed, "{}: this corner of '{}' a second time", table->place(row), corner->image);
    place = corner->pixel;
  }
  constexpr std::size_t kPointsMin = 4;
  std::map<std::string, CornerSet> usable;
  for (const auto& [image, corners] : found) {
    const auto present = static_cast<std::size_t>(
        std::count_if(corners.begin(), corners.end(), [](const auto& c) { return c.has_value(); }));
    if (present < (board.allows_partial_views() ? kPointsMin : count)) {
      notes.push_back(fmt::format("{}: left out, {} of {} corners", image, present, count));
      continue;
    }
    CornerSet& set = usable[image];
    for (std::size_t i = 0; i < corners.size(); ++i) {
      if (!corners[i]) continue;
      set.corners_px.push_back(*corners[i]);
      if (present < count) set.ids.push_back(static_cast<int>(i));
    }
  }
  return usable;
}

Status add_views_from_corners(const fs::path& folder, const std::vector<RecordedPose>& poses,
                              const std::optional<CameraIntrinsics>& camera, CalibrationDataset& data) {
  auto corners = read_corners(folder / "corners.csv", data.board, camera, data.notes);
  if (!corners) return std::unexpected(corners.error());
  for (const RecordedPose& pose : poses) {
    const auto found = corners->find(pose.image);
    if (found == corners->end()) {
      data.notes.push_back(fmt::format("{}: left out, no whole board in corners.csv", pose.image));
      continue;
    }
    data.views.push_back({pose.base_T_flange, found->second.corners_px, found->second.ids});
    data.names.push_back(pose.image);
    corners->erase(found);
  }
  for (const auto& [image, unused] : *corners)
    data.notes.push_back(fmt::format("{}: left out, no row in poses.csv", image));
  if (!camera) {
    // Only where the search for the camera's centre begins: the corners are taken to fill the picture evenly.
    Eigen::Vector2d low = Eigen::Vector2d::Constant(1e9), high = Eigen::Vector2d::Zero();
    for (const CalibrationView& view : data.views) {
      for (const Eigen::Vector2d& p : view.corners_px) {
        low = low.cwiseMin(p);
        high = high.cwiseMax(p);
      }
    }
    data.camera.width = static_cast<int>(std::clamp(low.x() + high.x() + 1, 1.0, 8192.0));
    data.camera.height = static_cast<int>(std::clamp(low.y() + high.y() + 1, 1.0, 8192.0));
  }
  return {};
}

Status add_views_from_images(const fs::path& folder, const std::vector<RecordedPose>& poses,
                             const std::optional<CameraIntrinsics>& camera, const DetectionOptions& detection,
                             CalibrationDataset& data) {
  for (const RecordedPose& pose : poses) {
    const auto picture = read_gray_image(folder / pose.image);
    if (!picture) return std::unexpected(picture.error());
    if (data.camera.width == 0) {
      data.camera.width = picture->width;
      data.camera.height = picture->height;
    }
    if (picture->width != data.camera.width || picture->height != data.camera.height) {
      return failure(Fault::kDataMalformed, "{}: {}x{} pixels, but {} has {}x{}", pose.image, picture->width,
                     picture->height, camera ? "camera_info.yaml" : "the first image", data.camera.width,
                     data.camera.height);
    }
    const auto corners = detect_target(picture->view(), data.board, detection);
    if (!corners) {
      data.notes.push_back(fmt::format("{}: left out, {}", pose.image, corners.error().detail()));
      continue;
    }
    data.views.push_back({pose.base_T_flange, corners->corners_px, corners->ids});
    data.names.push_back(pose.image);
  }
  if (data.views.empty()) {
    return failure(Fault::kBoardNotFound, "in none of {} images of {}", poses.size(), folder.string());
  }
  return {};
}

Result<CalibrationDataset> read_pair_dataset(const fs::path& folder) {
  CalibrationDataset data;
  data.source = CalibrationSource::kPairs;
  if (is_there(folder / "board.yaml")) {
    const auto board = read_board(folder / "board.yaml");
    if (!board) return std::unexpected(board.error());
    data.board = *board;
  }
  auto pairs = read_pairs(folder / "pairs.csv");
  if (!pairs) return std::unexpected(pairs.error());
  data.pairs = std::move(*pairs);
  for (std::size_t i = 0; i < data.pairs.size(); ++i) data.names.push_back(fmt::format("pair {}", i + 1));
  return data;
}

Status calibrate_camera(CalibrationDataset& data) {
  const auto estimate = estimate_intrinsics(data.camera.width, data.camera.height, data.board, data.views);
  if (!estimate) return std::unexpected(estimate.error());
  data.camera = estimate->camera;
  data.intrinsics_estimated = true;
  data.intrinsics_rms_px = estimate->reprojection_rms_px;
  data.notes.push_back(
      fmt::format("no camera_info.yaml: intrinsics calibrated from the same views (fx {:.1f} fy {:.1f} cx {:.1f} cy "
                  "{:.1f}, RMS {:.2f} "
                  "px); their uncertainty is not in the hand-eye covariance",
                  estimate->camera.fx, estimate->camera.fy, estimate->camera.cx, estimate->camera.cy,
                  estimate->reprojection_rms_px));
  return {};
}

/// Found corners of a board that looks the same upside down may begin at either end: the arm's motion tells.
void settle_flips(CalibrationDataset& data) {
  std::vector<OpenView> open;
  for (const CalibrationView& view : data.views) {
    const auto pose = estimate_board_pose(data.camera, data.board, view.corners_px);
    if (!pose) return;
    open.push_back(open_view(data.board, view, *pose));
  }
  const auto choices = settle_choices(open);
  int turned = 0;
  for (std::size_t i = 0; i < choices.size(); ++i) {
    if (!open[i].choices[choices[i]].reversed) continue;
    std::reverse(data.views[i].corners_px.begin(), data.views[i].corners_px.end());
    ++turned;
  }
  data.notes.push_back(fmt::format(
      "a {}x{} board looks the same upside down: {} of {} views turned so that they agree with the arm's motion; a "
      "board "
      "of odd x even corners needs no guess",
      data.board.inner_columns, data.board.inner_rows, turned, choices.size()));
}

}  // namespace

Result<CalibrationDataset> read_calibration_dataset(const fs::path& folder, const DetectionOptions& detection) {
  std::error_code ignored;
  if (!fs::is_directory(folder, ignored)) return failure(Fault::kDataMissing, "{}: no such folder", folder.string());
  if (!is_there(folder / "poses.csv") && is_there(folder / "pairs.csv")) return read_pair_dataset(folder);
  CalibrationDataset data;
  const auto board = read_board(folder / "board.yaml");
  if (!board) return std::unexpected(board.error());
  data.board = *board;
  std::optional<CameraIntrinsics> camera;
  if (is_there(folder / "camera_info.yaml")) {
    const auto info = read_camera_info(folder / "camera_info.yaml");
    if (!info) return std::unexpected(info.error());
    camera = *info;
    data.camera = *info;
  }
  const auto poses = read_poses(folder / "poses.csv");
  if (!poses) return std::unexpected(poses.error());
  const bool with_corners = is_there(folder / "corners.csv");
  data.source = with_corners ? CalibrationSource::kCorners : CalibrationSource::kImages;
  const Status added = with_corners ? add_views_from_corners(folder, *poses, camera, data)
                                    : add_views_from_images(folder, *poses, camera, detection, data);
  if (!added) return std::unexpected(added.error());
  if (!camera) {
    if (const Status calibrated = calibrate_camera(data); !calibrated) return std::unexpected(calibrated.error());
  }
  if (!with_corners && !data.board.is_orientation_unique()) settle_flips(data);
  return data;
}

}  // namespace firstlook
