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
#include "app/dataset/picture_file.hpp"

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
/// Of several targets, which one; numbers count row by row for every type.
constexpr std::array<std::string_view, 5> kTargetPointColumns = {"image", "point", "u_px", "v_px", "target"};
constexpr std::array<std::string_view, 6> kTargetCornerColumns = {"image", "column", "row", "u_px", "v_px", "target"};
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

/// A corner as read: of which image and target, which one, and where.
struct CornerRow {
  std::string image;
  std::size_t target = 0;
  int index = 0;
  Eigen::Vector2d pixel;
};

/// corners.csv with what its columns mean.
struct CornerTable {
  CsvTable csv;
  bool numbered = false;       ///< one number for each point instead of column and row
  bool names_targets = false;  ///< the last column is the target's name
};

Result<CornerTable> read_corner_table(const fs::path& file, std::span<const NamedTarget> targets) {
  const auto with = [&](std::span<const std::string_view> columns, bool numbered,
                        bool names_targets) -> Result<CornerTable> {
    auto table = read_csv(file, columns);
    if (!table) return std::unexpected(table.error());
    return CornerTable{std::move(*table), numbered, names_targets};
  };
  const auto has_numbers = [](const NamedTarget& t) { return t.board.has_marker_corners(); };
  if (targets.size() == 1) {
    return has_numbers(targets[0]) ? with(kPointColumns, true, false) : with(kCornerColumns, false, false);
  }
  auto numbered = with(kTargetPointColumns, true, true);
  if (numbered || std::any_of(targets.begin(), targets.end(), has_numbers)) return numbered;
  return with(kTargetCornerColumns, false, true);
}

Result<std::size_t> target_of(const CornerTable& table, const CsvRow& row, std::span<const NamedTarget> targets) {
  if (!table.names_targets) return 0;
  const std::string& name = row.fields.back();
  const auto found = std::find_if(targets.begin(), targets.end(), [&](const auto& t) { return t.name == name; });
  if (found != targets.end()) return static_cast<std::size_t>(found - targets.begin());
  return failure(Fault::kDataMalformed, "{}: no target '{:.40}' in board.yaml", table.csv.place(row), name);
}

/// The point that a row means by its number, or by column and row, which stand from column `first` on.
Result<int> point_in_row(const CornerTable& table, const CsvRow& row, std::size_t first, const BoardSpec& board) {
  const auto in_range = [](double x, int count) { return x >= 0 && x < count && x == std::floor(x); };
  const auto number = table.csv.number(row, first);
  if (!number) return std::unexpected(number.error());
  if (table.numbered) {
    if (in_range(*number, board.corners())) return static_cast<int>(*number);
    return failure(Fault::kDataMalformed, "{}: point {} on a board with {}", table.csv.place(row), *number,
                   board.corners());
  }
  const auto line = table.csv.number(row, first + 1);
  if (!line) return std::unexpected(line.error());
  if (!in_range(*number, board.inner_columns) || !in_range(*line, board.inner_rows)) {
    return failure(Fault::kDataMalformed, "{}: corner column {} row {} on a board of {}x{}", table.csv.place(row),
                   *number, *line, board.inner_columns, board.inner_rows);
  }
  return static_cast<int>(*line) * board.inner_columns + static_cast<int>(*number);
}

Result<CornerRow> corner_from(const CornerTable& table, const CsvRow& row, std::span<const NamedTarget> targets,
                              const std::optional<CameraIntrinsics>& camera) {
  const std::string place = table.csv.place(row);
  const auto target = target_of(table, row, targets);
  if (!target) return std::unexpected(target.error());
  const auto point = point_in_row(table, row, 1, targets[*target].board);
  if (!point) return std::unexpected(point.error());
  const std::size_t pixel = table.numbered ? 2 : 3;
  const auto u_px = table.csv.number(row, pixel), v_px = table.csv.number(row, pixel + 1);
  if (!u_px) return std::unexpected(u_px.error());
  if (!v_px) return std::unexpected(v_px.error());
  constexpr double kOutside_px = 1.0;  // refined corners may lie a little outside
  if (camera && (*u_px < -kOutside_px || *v_px < -kOutside_px || *u_px > camera->width - 1 + kOutside_px ||
                 *v_px > camera->height - 1 + kOutside_px)) {
    return failure(Fault::kDataMalformed, "{}: corner at ({}, {}) px lies outside the {}x{} image of camera_info.yaml",
                   place, *u_px, *v_px, camera->width, camera->height);
  }
  return CornerRow{row.fields[0], *target, *point, {*u_px, *v_px}};
}

/// "images/1.png", and with several targets "images/1.png, door".
std::string view_name(std::span<const NamedTarget> targets, const std::string& image, std::size_t target) {
  return targets.size() == 1 ? image : fmt::format("{}, {}", image, targets[target].name);
}

/// Corners by image and target that has all of them, or enough where the board allows a part; others are noted.
using CornersFound = std::map<std::pair<std::string, std::size_t>, CornerSet>;

Result<CornersFound> read_corners(const fs::path& file, std::span<const NamedTarget> targets,
                                  const std::optional<CameraIntrinsics>& camera, std::vector<std::string>& notes) {
  const auto table = read_corner_table(file, targets);
  if (!table) return std::unexpected(table.error());
  std::map<std::pair<std::string, std::size_t>, std::vector<std::optional<Eigen::Vector2d>>> found;
  for (const CsvRow& row : table->csv.rows) {
    const auto corner = corner_from(*table, row, targets, camera);
    if (!corner) return std::unexpected(corner.error());
    auto& corners = found[{corner->image, corner->target}];
    corners.resize(static_cast<std::size_t>(targets[corner->target].board.corners()));
    auto& place = corners[static_cast<std::size_t>(corner->index)];
    if (place) {
      return failure(Fault::kDataMalformed, "{}: this corner of '{}' a second time", table->csv.place(row),
                     corner->image);
    }
    place = corner->pixel;
  }
  constexpr std::size_t kPointsMin = 4;
  CornersFound usable;
  for (const auto& [key, corners] : found) {
    const auto present = static_cast<std::size_t>(
        std::count_if(corners.begin(), corners.end(), [](const auto& c) { return c.has_value(); }));
    if (present < (targets[key.second].board.allows_partial_views() ? kPointsMin : corners.size())) {
      notes.push_back(fmt::format("{}: left out, {} of {} corners", view_name(targets, key.first, key.second), present,
                                  corners.size()));
      continue;
    }
    CornerSet& set = usable[key];
    for (std::size_t i = 0; i < corners.size(); ++i) {
      if (!corners[i]) continue;
      set.corners_px.push_back(*corners[i]);
      if (present < corners.size()) set.ids.push_back(static_cast<int>(i));
    }
  }
  return usable;
}

/// What a picture shows of one target. With several targets the pictures are the stations.
void add_view(const RecordedPose& pose, std::size_t picture, std::size_t target, CornerSet points,
              CalibrationDataset& data) {
  const int station = data.targets.size() > 1 ? static_cast<int>(picture) : -1;
  data.views.push_back(
      {pose.base_T_flange, std::move(points.corners_px), std::move(points.ids), static_cast<int>(target), station});
  data.names.push_back(view_name(data.targets, pose.image, target));
  data.images.push_back(pose.image);
}

Status add_views_from_corners(const fs::path& folder, const std::vector<RecordedPose>& poses,
                              const std::optional<CameraIntrinsics>& camera, CalibrationDataset& data) {
  auto corners = read_corners(folder / "corners.csv", data.targets, camera, data.notes);
  if (!corners) return std::unexpected(corners.error());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const std::size_t before = data.views.size();
    for (std::size_t k = 0; k < data.targets.size(); ++k) {
      const auto found = corners->find({poses[i].image, k});
      if (found == corners->end()) continue;
      add_view(poses[i], i, k, std::move(found->second), data);
      corners->erase(found);
    }
    if (data.views.size() > before) continue;
    data.notes.push_back(fmt::format("{}: left out, no whole board in corners.csv", poses[i].image));
  }
  for (const auto& [key, unused] : *corners) {
    data.notes.push_back(
        fmt::format("{}: left out, no row in poses.csv", view_name(data.targets, key.first, key.second)));
  }
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

/// One target or more; the error says why there is none.
Result<std::vector<TargetSighting>> sightings_of(GrayImage image, const std::vector<BoardSpec>& boards,
                                                 const DetectionOptions& detection) {
  if (boards.size() == 1) {  // what the detector of the one target says is worth reading
    auto corners = detect_target(image, boards.front(), detection);
    if (!corners) return std::unexpected(corners.error());
    std::vector<TargetSighting> seen;
    seen.push_back({0, std::move(*corners)});
    return seen;
  }
  auto seen = detect_targets(image, boards, detection);
  if (seen && seen->empty()) return failure(Fault::kBoardNotFound, "it shows none of {} targets", boards.size());
  return seen;
}

Status add_views_from_images(const fs::path& folder, const std::vector<RecordedPose>& poses,
                             const std::optional<CameraIntrinsics>& camera, const DetectionOptions& detection,
                             CalibrationDataset& data) {
  const std::vector<BoardSpec> boards = boards_of(data.targets);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const RecordedPose& pose = poses[i];
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
    auto seen = sightings_of(picture->view(), boards, detection);
    if (!seen) {
      data.notes.push_back(fmt::format("{}: left out, {}", pose.image, seen.error().detail()));
      continue;
    }
    for (TargetSighting& sighting : *seen) {
      add_view(pose, i, static_cast<std::size_t>(sighting.target), std::move(sighting.points), data);
    }
  }
  if (data.views.empty()) {
    return failure(Fault::kBoardNotFound, "in none of {} images of {}", poses.size(), folder.string());
  }
  return {};
}

/// The corners that the arm's tip was led onto. Columns as in corners.csv, the flange's pose as in poses.csv.
Result<TouchRecord> read_touches(const fs::path& folder, std::span<const NamedTarget> targets) {
  const bool numbered = targets.size() > 1 || targets.front().board.has_marker_corners();
  std::vector<std::string_view> columns = {"x", "y", "z", "qx", "qy", "qz", "qw"};
  if (numbered) columns.emplace_back("point");
  if (!numbered) columns.insert(columns.end(), {"column", "row"});
  if (targets.size() > 1) columns.emplace_back("target");
  const auto csv = read_csv(folder / "touches.csv", columns);
  if (!csv) return std::unexpected(csv.error());
  const CornerTable table{*csv, numbered, targets.size() > 1};
  TouchRecord record;
  std::optional<std::size_t> touched;
  for (const CsvRow& row : csv->rows) {
    const auto target = target_of(table, row, targets);
    if (!target) return std::unexpected(target.error());
    if (touched.value_or(*target) != *target) {
      return failure(Fault::kDataMalformed, "{}: a second target; the touch test takes one", csv->place(row));
    }
    touched = *target;
    const auto pose = pose_from(*csv, row, 0);
    if (!pose) return std::unexpected(pose.error());
    const auto corner = point_in_row(table, row, 7, targets[*target].board);
    if (!corner) return std::unexpected(corner.error());
    record.touches.push_back({Transform<Base, Flange>(*pose), *corner});
  }
  if (record.touches.empty()) return failure(Fault::kDataMalformed, "{}: no touches", csv->file);
  if (record.touches.size() > kTouchesMax) {
    return failure(Fault::kDataMalformed, "{}: {} touches, at most {} are taken", csv->file, record.touches.size(),
                   kTouchesMax);
  }
  record.target = static_cast<int>(*touched);
  if (is_there(folder / "tip.yaml")) {
    const auto tip = read_tip(folder / "tip.yaml");
    if (!tip) return std::unexpected(tip.error());
    record.tip = *tip;
  }
  return record;
}

/// touches.csv, when there is one.
Status add_touches(const fs::path& folder, std::span<const NamedTarget> targets, CalibrationDataset& data) {
  if (!is_there(folder / "touches.csv")) {
    if (is_there(folder / "tip.yaml")) data.notes.emplace_back("tip.yaml: not used, there is no touches.csv");
    return {};
  }
  auto touched = read_touches(folder, targets);
  if (!touched) return std::unexpected(touched.error());
  data.touched = std::move(*touched);
  return {};
}

Result<CalibrationDataset> read_pair_dataset(const fs::path& folder) {
  CalibrationDataset data;
  data.source = CalibrationSource::kPairs;
  if (is_there(folder / "board.yaml")) {
    const auto board = read_board(folder / "board.yaml");
    if (!board) return std::unexpected(board.error());
    data.board = *board;
    const std::vector<NamedTarget> alone = {{std::string(), *board}};
    if (const Status added = add_touches(folder, alone, data); !added) return std::unexpected(added.error());
  } else if (is_there(folder / "touches.csv")) {
    return failure(Fault::kDataMissing, "{}: touches.csv needs it, for the board's size",
                   (folder / "board.yaml").string());
  }
  auto pairs = read_pairs(folder / "pairs.csv");
  if (!pairs) return std::unexpected(pairs.error());
  data.pairs = std::move(*pairs);
  for (std::size_t i = 0; i < data.pairs.size(); ++i) data.names.push_back(fmt::format("pair {}", i + 1));
  return data;
}

Status calibrate_camera(CalibrationDataset& data) {
  const auto estimate = estimate_intrinsics(data.camera.width, data.camera.height, boards_of(data.targets), data.views);
  if (!estimate) return std::unexpected(estimate.error());
  data.camera = estimate->camera;
  data.intrinsics_estimated = true;
  data.intrinsics_rms_px = estimate->reprojection_rms_px;
  data.notes.push_back(
      fmt::format("no camera_info.yaml: intrinsics are estimated together with the rest, from those that the pictures "
                  "say by themselves (fx {:.1f} fy {:.1f} cx {:.1f} cy {:.1f}, RMS {:.2f} px) on",
                  estimate->camera.fx, estimate->camera.fy, estimate->camera.cx, estimate->camera.cy,
                  estimate->reprojection_rms_px));
  return {};
}

/// Found corners of a board that looks the same upside down may begin at either end: the arm's motion tells.
void settle_flips(CalibrationDataset& data) {
  std::vector<OpenView> open;
  for (const CalibrationView& view : data.views) {
    const BoardSpec& board = data.targets[static_cast<std::size_t>(view.target)].board;
    const auto pose = estimate_board_pose(data.camera, board, view.points());
    if (!pose) return;
    open.push_back(open_view(board, view, *pose));
  }
  const auto choices = settle_choices(open);
  std::vector<int> turned(data.targets.size()), seen(data.targets.size());
  for (std::size_t i = 0; i < choices.size(); ++i) {
    const auto target = static_cast<std::size_t>(data.views[i].target);
    ++seen[target];
    if (!open[i].choices[choices[i]].reversed) continue;
    std::reverse(data.views[i].corners_px.begin(), data.views[i].corners_px.end());
    ++turned[target];
  }
  for (std::size_t k = 0; k < data.targets.size(); ++k) {
    const NamedTarget& target = data.targets[k];
    if (target.board.is_orientation_unique()) continue;
    data.notes.push_back(fmt::format(
        "{}a {}x{} board looks the same upside down: {} of {} views turned so that they agree with the arm's motion; a "
        "board of odd x even corners needs no guess",
        target.name.empty() ? "" : target.name + ": ", target.board.inner_columns, target.board.inner_rows, turned[k],
        seen[k]));
  }
}

/// Targets that tell little or nothing.
void note_rare_targets(CalibrationDataset& data) {
  for (std::size_t k = 0; k < data.targets.size() && data.targets.size() > 1; ++k) {
    const auto views = std::count_if(data.views.begin(), data.views.end(),
                                     [&](const auto& v) { return v.target == static_cast<int>(k); });
    if (views == 0) data.notes.push_back(fmt::format("{}: dropped, no view shows it", data.targets[k].name));
    if (views == 1) {
      data.notes.push_back(fmt::format("{}: seen in one view, which tells where it is and nothing of the hand-eye",
                                       data.targets[k].name));
    }
  }
}

}  // namespace

Result<CalibrationDataset> read_calibration_dataset(const fs::path& folder, const DetectionOptions& detection) {
  std::error_code ignored;
  if (!fs::is_directory(folder, ignored)) return failure(Fault::kDataMissing, "{}: no such folder", folder.string());
  if (!is_there(folder / "poses.csv") && is_there(folder / "pairs.csv")) return read_pair_dataset(folder);
  CalibrationDataset data;
  auto targets = read_targets(folder / "board.yaml");
  if (!targets) return std::unexpected(targets.error());
  data.targets = std::move(*targets);
  data.board = data.targets.front().board;
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
  const bool any_flips = std::any_of(data.targets.begin(), data.targets.end(),
                                     [](const NamedTarget& t) { return !t.board.is_orientation_unique(); });
  if (!with_corners && any_flips) settle_flips(data);
  note_rare_targets(data);
  if (const Status touched = add_touches(folder, data.targets, data); !touched) {
    return std::unexpected(touched.error());
  }
  return data;
}

}  // namespace firstlook
