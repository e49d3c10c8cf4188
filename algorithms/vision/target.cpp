#include "algorithms/vision/target.hpp"

#include <algorithm>
#include <cmath>
#include <map>

namespace firstlook {
namespace {

Status check_size(const char* what, double size_m) {
  if (size_m > 0 && size_m <= 10) return {};
  return failure(Fault::kConfigBadValue, "a {} of {} m", what, size_m);
}

Status check_counts(const BoardSpec& board, int least) {
  if (board.inner_columns < least || board.inner_rows < least || board.inner_columns > kBoardCornersMax ||
      board.inner_rows > kBoardCornersMax || board.corners() > kBoardCornersMax) {
    return failure(Fault::kConfigBadValue, "a board of {}x{}: {} at least each way, {} points at most in all",
                   board.inner_columns, board.inner_rows, least, kBoardCornersMax);
  }
  return {};
}

Status check_markers(const BoardSpec& board) {
  const MarkerFamily& family = marker_family(board.dictionary);
  if (board.first_id < 0 || board.first_id + board.markers() > family.count) {
    return failure(Fault::kConfigBadValue, "markers {} to {}, but dictionary {} ends with {}", board.first_id,
                   board.first_id + board.markers() - 1, family.name, family.count - 1);
  }
  return {};
}

/// A mark within its place in the lattice, with white around it.
Status check_mark(const BoardSpec& board, const char* what, double size_max_m) {
  if (const Status fine = check_size(what, board.mark_size_m); !fine) return fine;
  if (board.mark_size_m < size_max_m) return {};
  return failure(Fault::kConfigBadValue, "a {} of {} m must be smaller than {:.4g} m, or it touches its neighbours",
                 what, board.mark_size_m, size_max_m);
}

/// White squares of a ChArUco board begin every row with the second square, or with the first in every second row.
bool first_square_is_white(const BoardSpec& board, int row) {
  const bool corner_is_white = board.legacy && (board.inner_rows + 1) % 2 == 0;
  return (row % 2 == 0) == corner_is_white;
}

/// Where the values of one point over the frames have their median.
Eigen::Vector2d median_of(std::span<const Eigen::Vector2d> points) {
  Eigen::Vector2d median;
  std::vector<double> values(points.size());
  for (int axis = 0; axis < 2; ++axis) {
    for (std::size_t f = 0; f < points.size(); ++f) values[f] = points[f][axis];
    std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
    median[axis] = values[values.size() / 2];
  }
  return median;
}

/// What the frames show of each point, keyed by its number.
using Sightings = std::map<int, std::vector<Eigen::Vector2d>>;

}  // namespace

bool BoardSpec::is_orientation_unique() const {
  switch (type) {
    case TargetType::kCheckerboard:
      return (inner_columns + inner_rows) % 2 == 1;
    case TargetType::kCircles:
      return false;
    case TargetType::kAsymmetricCircles:
      return inner_rows % 2 == 1;
    default:
      return true;
  }
}

std::array<int, 4> BoardSpec::outer_corners() const {
  const int last = inner_columns * inner_rows - 1;
  if (!has_marker_corners()) return {0, inner_columns - 1, last, last - inner_columns + 1};
  return {0, 4 * (inner_columns - 1) + 1, 4 * last + 2, 4 * (last - inner_columns + 1) + 3};
}

std::array<int, 2> BoardSpec::neighbours_of_outer(int corner) const {
  if (has_marker_corners()) {
    const int marker = corner / 4, k = corner % 4;
    return {4 * marker + (k + 1) % 4, 4 * marker + (k + 3) % 4};
  }
  const int column = corner % inner_columns, row = corner / inner_columns;
  return {row * inner_columns + (column == 0 ? 1 : column - 1), (row == 0 ? 1 : row - 1) * inner_columns + column};
}

double BoardSpec::detail_ratio() const {
  // A cell of a marker needs about 2.5 pixels where a square needs 8.
  constexpr double kCellOfSquare = 2.5 / 8;
  switch (type) {
    case TargetType::kMarkerGrid:
      return kCellOfSquare * (marker_family(dictionary).bits + 2);
    case TargetType::kCharuco:
      return kCellOfSquare * (marker_family(dictionary).bits + 2) * square_size_m / mark_size_m;
    case TargetType::kPatternMarker:
      return kCellOfSquare * kPatternCells / 2 / kPatternShare;
    default:
      return 1;
  }
}

int BoardSpec::markers() const {
  if (type == TargetType::kMarkerGrid) return inner_columns * inner_rows;
  if (type != TargetType::kCharuco) return 0;
  const int squares = (inner_columns + 1) * (inner_rows + 1);
  return first_square_is_white(*this, 0) ? (squares + 1) / 2 : squares / 2;
}

Eigen::Vector2d BoardSpec::marker_origin(int m) const {
  if (type != TargetType::kCharuco) {
    return square_size_m * Eigen::Vector2d(m % inner_columns, m / inner_columns);
  }
  const int columns = inner_columns + 1;
  int row = 0;
  for (;; ++row) {
    const int in_row = first_square_is_white(*this, row) ? (columns + 1) / 2 : columns / 2;
    if (m < in_row) break;
    m -= in_row;
  }
  const int column = 2 * m + (first_square_is_white(*this, row) ? 0 : 1);
  return (square_size_m * Eigen::Vector2d(column - 1, row - 1)).array() + (square_size_m - mark_size_m) / 2;
}

Eigen::Vector3d BoardSpec::other_corner(int i) const {
  if (type == TargetType::kAsymmetricCircles) {
    const int row = i / inner_columns;
    return {square_size_m * (2 * (i % inner_columns) + row % 2), square_size_m * row, 0.0};
  }
  const int marker = i / 4, k = i % 4;
  const Eigen::Vector2d origin = square_size_m * Eigen::Vector2d(marker % inner_columns, marker / inner_columns);
  return {origin.x() + (k == 1 || k == 2 ? mark_size_m : 0), origin.y() + (k >= 2 ? mark_size_m : 0), 0.0};
}

Eigen::Vector3d BoardSpec::other_center() const {
  if (type == TargetType::kAsymmetricCircles) {
    return {square_size_m * (2 * (inner_columns - 1) + 1) / 2, square_size_m * (inner_rows - 1) / 2, 0.0};
  }
  return {(square_size_m * (inner_columns - 1) + mark_size_m) / 2, (square_size_m * (inner_rows - 1) + mark_size_m) / 2,
          0.0};
}

Status check_board(const BoardSpec& board) {
  const bool markers = board.has_marker_corners();
  if (const Status fine = check_counts(board, markers ? 1 : 3); !fine) return fine;
  if (const Status fine = check_size(markers ? "distance of markers" : "square size", board.square_size_m); !fine) {
    return fine;
  }
  switch (board.type) {
    case TargetType::kCheckerboard:
      return {};
    case TargetType::kCircles:
      if (board.inner_columns == board.inner_rows) {
        return failure(Fault::kConfigBadValue, "a circle grid of {0}x{0} looks the same at every quarter turn",
                       board.inner_rows);
      }
      return check_mark(board, "circle", board.square_size_m);
    case TargetType::kAsymmetricCircles:
      return check_mark(board, "circle", std::sqrt(2.0) * board.square_size_m);
    case TargetType::kPatternMarker:
      if (board.corners() != 4) return failure(Fault::kConfigBadValue, "a pattern marker stands alone");
      return check_size("marker", board.mark_size_m);
    case TargetType::kCharuco:
      if (const Status fine = check_mark(board, "marker", board.square_size_m); !fine) return fine;
      return check_markers(board);
    case TargetType::kMarkerGrid:
      // A single marker has no neighbours that its distance could be too small for.
      if (const Status fine = check_mark(board, "marker", board.corners() == 4 ? 10.1 : board.square_size_m); !fine) {
        return fine;
      }
      return check_markers(board);
  }
  return {};
}

Status check_image(GrayImage image) {
  if (image.data != nullptr && image.width >= 32 && image.height >= 32 && image.width <= 8192 && image.height <= 8192) {
    return {};
  }
  return failure(Fault::kDataMalformed, "an image of {}x{} pixels", image.width, image.height);
}

Status check_points(const BoardSpec& board, const SeenPoints& points) {
  constexpr std::size_t kPointsMin = 4;  // fewer determine no pose
  if (points.ids.empty()) {
    if (points.size() == static_cast<std::size_t>(board.corners())) return {};
    return failure(Fault::kDataMalformed, "{} corners instead of {}", points.size(), board.corners());
  }
  if (points.ids.size() != points.size()) {
    return failure(Fault::kDataMalformed, "{} corners with {} numbers", points.size(), points.ids.size());
  }
  if (points.size() < kPointsMin) {
    return failure(Fault::kDataMalformed, "{} corners, {} are the least", points.size(), kPointsMin);
  }
  for (std::size_t i = 0; i < points.size(); ++i) {
    const int before = i == 0 ? -1 : points.ids[i - 1];
    if (points.ids[i] <= before || points.ids[i] >= board.corners()) {
      return failure(Fault::kDataMalformed, "corner number {} of a board with {}: they must ascend", points.ids[i],
                     board.corners());
    }
  }
  return {};
}

Result<CornerSet> average_corners(std::span<const CornerSet> frames, double agreement_max_px) {
  if (frames.empty()) return failure(Fault::kBoardNotFound, "no frame");
  const bool whole = frames[0].ids.empty();
  Sightings all;
  for (const CornerSet& frame : frames) {
    if (frame.ids.empty() != whole || (whole && frame.corners_px.size() != frames[0].corners_px.size())) {
      return failure(Fault::kBoardNotFound, "frames with different boards");
    }
    for (std::size_t i = 0; i < frame.corners_px.size(); ++i) {
      all[point_of(frame.ids, i)].push_back(frame.corners_px[i]);
    }
  }
  std::map<int, Eigen::Vector2d> median;
  for (const auto& [id, points] : all) median[id] = median_of(points);
  Sightings agreeing;
  CornerSet mean;
  std::size_t frames_agreeing = 0;
  for (const CornerSet& frame : frames) {
    double distance2 = 0;
    const std::size_t count = frame.corners_px.size();
    for (std::size_t i = 0; i < count; ++i) {
      distance2 += (frame.corners_px[i] - median[point_of(frame.ids, i)]).squaredNorm();
    }
    if (!(distance2 <= agreement_max_px * agreement_max_px * static_cast<double>(count))) continue;
    for (std::size_t i = 0; i < count; ++i) agreeing[point_of(frame.ids, i)].push_back(frame.corners_px[i]);
    mean.residual_rms_px += frame.residual_rms_px;
    ++frames_agreeing;
  }
  if (frames_agreeing * 2 <= frames.size()) {
    return failure(Fault::kBoardNotFound, "only {} of {} frames agree: the arm or the board moves", frames_agreeing,
                   frames.size());
  }
  for (const auto& [id, points] : agreeing) {
    if (points.size() * 2 < frames_agreeing) continue;
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    for (const Eigen::Vector2d& p : points) sum += p;
    mean.corners_px.emplace_back(sum / static_cast<double>(points.size()));
    if (!whole) mean.ids.push_back(id);
  }
  mean.residual_rms_px /= static_cast<double>(frames_agreeing);
  return mean;
}

}  // namespace firstlook
