/// Finds the inner corners of a checkerboard in a grey image.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "platform/core/image_view.hpp"
#include "platform/core/result.hpp"

namespace firstlook {

/// Corners that one board may have (hal::CornerObservation holds as many).
inline constexpr int kBoardCornersMax = 256;

/// A checkerboard of (inner_columns + 1) x (inner_rows + 1) squares. Board frame: origin at the first inner corner, x
/// along the columns, y along the rows, z = x cross y away from the viewer. The square spanned by the first four inner
/// corners (0,0) (1,0) (0,1) (1,1) is BLACK (so is the square at the board's outer corner beyond the origin): that
/// makes the order of the corners unique when one of the two counts is odd and the other even.
struct BoardSpec {
  int inner_columns = 9;
  int inner_rows = 6;
  double square_size_m = 0.030;

  [[nodiscard]] int corners() const { return inner_columns * inner_rows; }
  /// Corner number `i` = row * inner_columns + column, in the board frame.
  [[nodiscard]] Eigen::Vector3d corner(int i) const {
    const int row = i / inner_columns;
    return {square_size_m * (i % inner_columns), square_size_m * row, 0.0};
  }
  /// The middle of the corners, in the board frame.
  [[nodiscard]] Eigen::Vector3d center() const {
    return {square_size_m * (inner_columns - 1) / 2, square_size_m * (inner_rows - 1) / 2, 0.0};
  }
  /// False when a turn by 180 degrees maps the colours onto themselves: corner order cannot be known from one image.
  [[nodiscard]] bool is_orientation_unique() const { return (inner_columns + inner_rows) % 2 == 1; }
  bool operator==(const BoardSpec&) const = default;
};

/// kConfigBadValue for counts below 3, more than kBoardCornersMax corners, or a square size that is not in (0, 10] m.
[[nodiscard]] Status check_board(const BoardSpec& board);

/// Image points of all inner corners, row by row (corner i = row * inner_columns + column). Pixel centres at integers.
struct CornerSet {
  std::vector<Eigen::Vector2d> corners_px;
  double residual_rms_px = 0;  ///< of a homography through them: lens distortion and detection errors
};

struct DetectionOptions {
  int search_width_max_px = 640;  ///< the board is searched in a picture scaled down to this, refined in the full one
  /// Half window of the corner refinement in corner spacings: reaches no other corner up to 65 degrees of tilt, where a
  /// fixed window of 11 px breaks from 35 degrees on.
  double window_of_spacing = 0.4;
  double local_residual_max = 0.25;  ///< largest distance of a corner from where its neighbours put it, in spacings
};

/// Finds the whole board. Cost at 640x480: see algorithms/vision/README.md; a picture without enough strong corner-like
/// points is turned away before the costly search.
/// @return kBoardNotFound when the board is not seen whole or its corners do not fit a plane; kConfigBadValue for a bad
/// board; kDataMalformed for an image below 32x32 or above 8192x8192 pixels
[[nodiscard]] Result<CornerSet> detect_checkerboard(GrayImage image, const BoardSpec& board,
                                                    const DetectionOptions& options = {});

/// Mean of the same corners in several frames of a standing camera. A frame whose corners lie farther than
/// `agreement_max_px` (RMS) from the median of all frames is left out.
/// @return kBoardNotFound for no frame, frames of different size, or when less than half of the frames agree
[[nodiscard]] Result<CornerSet> average_corners(std::span<const CornerSet> frames, double agreement_max_px = 1.0);

}  // namespace firstlook
