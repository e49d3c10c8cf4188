/// What the camera looks at: the geometry of every printed calibration target, and what one image shows of it.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "algorithms/vision/marker_codes.hpp"
#include "platform/core/image_view.hpp"
#include "platform/core/result.hpp"

namespace firstlook {

/// Points that one target may have (hal::CornerObservation holds as many): a checkerboard of 25x18 inner corners has
/// 450.
inline constexpr int kBoardCornersMax = 512;

enum class TargetType : std::uint8_t {
  kCheckerboard,
  kCircles,            ///< rows and columns of dark discs
  kAsymmetricCircles,  ///< every second row shifted by half the distance of neighbours in a row
  kCharuco,            ///< a checkerboard with a marker in each white square; its points are the inner corners
  kMarkerGrid,         ///< rows and columns of square markers, each with its number; its points are their corners
  kPatternMarker,      ///< one square with a picture instead of a code, as ARToolKit has them
};

/// Side of a pattern marker's picture as part of the marker's side, and its cells each way (ARToolKit's 16x16).
inline constexpr double kPatternShare = 0.5;
inline constexpr int kPatternCells = 16;

/// A target of any type. Board frame: x along the columns, y along the rows, z = x cross y away from the viewer. The
/// origin is point 0: the first inner corner of a checkerboard or ChArUco board, the first circle's centre, the upper
/// left corner of the first marker (of its black square).
///
/// Checkerboard: (inner_columns + 1) x (inner_rows + 1) squares; the square spanned by the first four inner corners
/// (0,0) (1,0) (0,1) (1,1) is BLACK (so is the square at the board's outer corner beyond the origin): that makes the
/// order of the corners unique when one of the two counts is odd and the other even.
struct BoardSpec {
  int inner_columns = 9;         ///< inner corners, circles or markers in a row
  int inner_rows = 6;            ///< the same in a column
  double square_size_m = 0.030;  ///< distance of neighbours; asymmetric circles: of rows, half of neighbours in a row
  TargetType type = TargetType::kCheckerboard;
  double mark_size_m = 0;  ///< side of a marker's black square, or a circle's diameter; unused by checkerboards
  MarkerDictionary dictionary = MarkerDictionary::k4x4_50;
  int first_id = 0;     ///< of the markers, which count up row by row
  bool legacy = false;  ///< ChArUco boards as OpenCV drew them before 4.6: with an even number of rows of squares the
                        ///< upper left square is white

  [[nodiscard]] bool has_marker_corners() const {
    return type == TargetType::kMarkerGrid || type == TargetType::kPatternMarker;
  }
  /// Number of points.
  [[nodiscard]] int corners() const { return inner_columns * inner_rows * (has_marker_corners() ? 4 : 1); }
  /// Point number `i` in the board frame: row * inner_columns + column, for markers 4 * marker + 0..3 clockwise from
  /// the upper left corner.
  [[nodiscard]] Eigen::Vector3d corner(int i) const {
    if (type == TargetType::kAsymmetricCircles || has_marker_corners()) return other_corner(i);
    const int row = i / inner_columns;
    return {square_size_m * (i % inner_columns), square_size_m * row, 0.0};
  }
  /// The middle of the points, in the board frame.
  [[nodiscard]] Eigen::Vector3d center() const {
    if (type == TargetType::kAsymmetricCircles || has_marker_corners()) return other_center();
    return {square_size_m * (inner_columns - 1) / 2, square_size_m * (inner_rows - 1) / 2, 0.0};
  }
  /// False when a turn by 180 degrees maps the target onto itself: the order of its points cannot be known from one
  /// image.
  [[nodiscard]] bool is_orientation_unique() const;
  /// True when an image that shows a part of the target is of use: every point found has a number of its own.
  [[nodiscard]] bool allows_partial_views() const {
    return type == TargetType::kCharuco || type == TargetType::kMarkerGrid;
  }

  /// The four outermost points, around the target.
  [[nodiscard]] std::array<int, 4> outer_corners() const;
  /// The neighbours of an outer point in its row and column.
  [[nodiscard]] std::array<int, 2> neighbours_of_outer(int corner) const;
  /// How many times finer than the distance of neighbours the detail is that a detector must resolve: 1 for
  /// checkerboards and circles, more for markers.
  [[nodiscard]] double detail_ratio() const;

  /// Markers on the target: those of a grid, one in each white square of a ChArUco board; 0 without.
  [[nodiscard]] int markers() const;
  /// Upper left corner of marker number `m` (0 to markers() - 1) in the board frame.
  [[nodiscard]] Eigen::Vector2d marker_origin(int m) const;

  bool operator==(const BoardSpec&) const = default;

 private:
  [[nodiscard]] Eigen::Vector3d other_corner(int i) const;
  [[nodiscard]] Eigen::Vector3d other_center() const;
};

/// kConfigBadValue for counts that the type does not allow, more than kBoardCornersMax points, sizes that are not in
/// (0, 10] m or do not fit into each other, and marker numbers beyond the dictionary's end.
[[nodiscard]] Status check_board(const BoardSpec& board);

/// kDataMalformed for an image below 32x32 or above 8192x8192 pixels.
[[nodiscard]] Status check_image(GrayImage image);

/// Number of the i-th point of an observation: `ids[i]`, or i itself when `ids` is empty (all points, in order).
[[nodiscard]] inline int point_of(std::span<const int> ids, std::size_t i) {
  return ids.empty() ? static_cast<int>(i) : ids[i];
}

/// Image points of a target. Pixel centres at integers.
struct CornerSet {
  std::vector<Eigen::Vector2d> corners_px;
  double residual_rms_px = 0;  ///< of a homography through them: lens distortion and detection errors
  std::vector<int> ids{};      ///< the point that each of them is, ascending; empty: all points of the target, in order
};

/// Points that somebody else holds, as functions take them.
struct SeenPoints {
  std::span<const Eigen::Vector2d> corners_px;
  std::span<const int> ids;  ///< as in CornerSet

  // Implicit on purpose: all that holds points can be passed as it is.
  SeenPoints(std::span<const Eigen::Vector2d> px, std::span<const int> numbers = {})  // NOLINT
      : corners_px(px), ids(numbers) {}
  SeenPoints(const std::vector<Eigen::Vector2d>& px) : corners_px(px) {}          // NOLINT
  SeenPoints(const CornerSet& set) : corners_px(set.corners_px), ids(set.ids) {}  // NOLINT
  [[nodiscard]] std::size_t size() const { return corners_px.size(); }
  [[nodiscard]] int point(std::size_t i) const { return point_of(ids, i); }
};

/// Says why the points cannot be points of the board: wrong number, an unknown or repeated number. kDataMalformed.
[[nodiscard]] Status check_points(const BoardSpec& board, const SeenPoints& points);

inline constexpr double kFramesAgree_px = 1.0;

/// Mean of the same points in several frames of a standing camera. A frame whose points lie farther than
/// `agreement_max_px` (RMS) from the median of all frames is left out, and so is a point that less than half of the
/// frames show.
/// @return kBoardNotFound for no frame, frames of different targets, or when not more than half of the frames agree
[[nodiscard]] Result<CornerSet> average_corners(std::span<const CornerSet> frames,
                                                double agreement_max_px = kFramesAgree_px);

}  // namespace firstlook
