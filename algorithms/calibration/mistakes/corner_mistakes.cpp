#include "algorithms/calibration/mistakes/corner_mistakes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "algorithms/calibration/intrinsics.hpp"
#include "algorithms/vision/board_pose.hpp"

namespace firstlook::mistakes {
namespace {

using Pixels = std::vector<Eigen::Vector2d>;

Pixels in_columns(const Pixels& given, const BoardSpec& board, const CameraIntrinsics&) {
  Pixels pixels;
  for (int i = 0; i < board.corners(); ++i) {
    const int row = i / board.inner_columns, column = i % board.inner_columns;
    const int at = column * board.inner_rows + row;
    pixels.push_back(given[static_cast<std::size_t>(at)]);
  }
  return pixels;
}

Pixels there_and_back(const Pixels& given, const BoardSpec& board, const CameraIntrinsics&) {
  Pixels pixels;
  for (int i = 0; i < board.corners(); ++i) {
    const int row = i / board.inner_columns, column = i % board.inner_columns;
    const int in_row = row % 2 == 0 ? column : board.inner_columns - 1 - column;
    const int at = row * board.inner_columns + in_row;
    pixels.push_back(given[static_cast<std::size_t>(at)]);
  }
  return pixels;
}

Pixels mirrored(const Pixels& given, const BoardSpec&, const CameraIntrinsics& camera) {
  Pixels pixels = given;
  for (Eigen::Vector2d& p : pixels) p.x() = camera.width - 1 - p.x();
  return pixels;
}

Pixels upside_down(const Pixels& given, const BoardSpec&, const CameraIntrinsics& camera) {
  Pixels pixels = given;
  for (Eigen::Vector2d& p : pixels) p.y() = camera.height - 1 - p.y();
  return pixels;
}

Pixels exchanged(const Pixels& given, const BoardSpec&, const CameraIntrinsics&) {
  Pixels pixels = given;
  for (Eigen::Vector2d& p : pixels) std::swap(p.x(), p.y());
  return pixels;
}

struct CornerChange {
  Mistake mistake;
  Pixels (*change)(const Pixels&, const BoardSpec&, const CameraIntrinsics&);
  bool of_grid;  ///< needs all points of rows and columns
  const char* text;
};
constexpr std::array<CornerChange, 5> kChanges = {{
    {Mistake::kCornerOrder, in_columns, true, "the corners are counted down the columns instead of along the rows"},
    {Mistake::kCornerOrder, there_and_back, true, "every second row of corners is counted backwards"},
    {Mistake::kImageAxes, mirrored, false, "the images are mirrored left to right (or u is counted from the right)"},
    {Mistake::kImageAxes, upside_down, false,
     "the images are mirrored top to bottom (or v is counted from the bottom)"},
    {Mistake::kImageAxes, exchanged, false, "u and v of the corners are exchanged"},
}};

std::optional<Trial> intrinsics_trial(const CameraIntrinsics& camera, const BoardSpec& board,
                                      std::span<const CalibrationView> views) {
  constexpr std::size_t kViewsMin = 6, kViewsMax = 25;
  if (views.size() < kViewsMin) return std::nullopt;
  const auto estimate =
      estimate_intrinsics(camera.width, camera.height, board, views.first(std::min(views.size(), kViewsMax)));
  if (!estimate) return std::nullopt;
  const CameraIntrinsics& seen = estimate->camera;
  const bool same = std::abs(seen.fx / camera.fx - 1) < 0.01 && std::abs(seen.fy / camera.fy - 1) < 0.01 &&
                    std::abs(seen.cx - camera.cx) < 0.02 * camera.width &&
                    std::abs(seen.cy - camera.cy) < 0.02 * camera.width;
  if (same) return std::nullopt;
  return Trial{
      Mistake::kIntrinsics,
      fmt::format("the intrinsics are not those of these images (another camera, lens or picture size): the "
                  "views say fx {:.0f} fy {:.0f} cx {:.0f} cy {:.0f} px, given are {:.0f} {:.0f} {:.0f} {:.0f}",
                  seen.fx, seen.fy, seen.cx, seen.cy, camera.fx, camera.fy, camera.cx, camera.cy),
      pairs_of(seen, board, views).pairs};
}

}  // namespace

ViewPairs pairs_of(const CameraIntrinsics& camera, const BoardSpec& board, std::span<const CalibrationView> views) {
  ViewPairs result;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const auto pose = estimate_board_pose_robust(camera, board, views[i].points());
    if (!pose) continue;
    result.pairs.push_back({views[i].base_T_flange, pose->pose.camera_T_board});
    result.views.push_back(i);
  }
  return result;
}

std::vector<Trial> corner_trials(const CameraIntrinsics& camera, const BoardSpec& board,
                                 std::span<const CalibrationView> views) {
  const bool all_points =
      !board.has_marker_corners() && board.type != TargetType::kAsymmetricCircles &&
      std::all_of(views.begin(), views.end(), [&](const CalibrationView& view) {
        return view.ids.empty() && view.corners_px.size() == static_cast<std::size_t>(board.corners());
      });
  std::vector<Trial> trials;
  const auto add = [&](Trial trial) {
    if (10 * trial.pairs.size() >= 7 * views.size()) trials.push_back(std::move(trial));
  };
  for (const CornerChange& change : kChanges) {
    if (change.of_grid && !all_points) continue;
    std::vector<CalibrationView> changed(views.begin(), views.end());
    for (CalibrationView& view : changed) view.corners_px = change.change(view.corners_px, board, camera);
    add({change.mistake, change.text, pairs_of(camera, board, changed).pairs});
  }
  if (auto trial = intrinsics_trial(camera, board, views)) add(std::move(*trial));
  return trials;
}

}  // namespace firstlook::mistakes
