/// The adapter to OpenCV's resizing and corner refinement: its types and exceptions end here.
#include "algorithms/vision/checkerboard.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "algorithms/vision/checkerboard_lattice.hpp"
#include "algorithms/vision/corner_refinement.hpp"
#include "algorithms/vision/homography.hpp"
#include "algorithms/vision/saddle_points.hpp"

namespace firstlook {
namespace {

using Corners = std::vector<Eigen::Vector2d>;

/// The corners as a grid of columns x rows.
struct Grid {
  const BoardSpec& board;
  const Corners& px;
  [[nodiscard]] const Eigen::Vector2d& at(int column, int row) const {
    return px[static_cast<std::size_t>(row * board.inner_columns + column)];
  }
};

double smallest_spacing_px(const Grid& g) {
  double smallest = std::numeric_limits<double>::infinity();
  for (int row = 0; row < g.board.inner_rows; ++row) {
    for (int column = 0; column < g.board.inner_columns; ++column) {
      if (column > 0) smallest = std::min(smallest, (g.at(column, row) - g.at(column - 1, row)).norm());
      if (row > 0) smallest = std::min(smallest, (g.at(column, row) - g.at(column, row - 1)).norm());
    }
  }
  return smallest;
}

/// How far corners lie from the middle of their two neighbours in a row or column. Perspective and lens distortion bend
/// little over three corners, and all of a board alike; a wrong corner stands out.
struct LocalResiduals {
  double largest_spacings = 0;
  double largest_px = 0;
  double median_px = 0;
};

LocalResiduals local_residuals(const Grid& g) {
  LocalResiduals result;
  std::vector<double> all_px;
  const auto check = [&](const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
    const double off_px = ((a + c) / 2 - b).norm();
    all_px.push_back(off_px);
    result.largest_px = std::max(result.largest_px, off_px);
    result.largest_spacings = std::max(result.largest_spacings, off_px / std::max(1e-9, (c - a).norm() / 2));
  };
  for (int row = 0; row < g.board.inner_rows; ++row) {
    for (int column = 0; column < g.board.inner_columns; ++column) {
      if (column > 1) check(g.at(column - 2, row), g.at(column - 1, row), g.at(column, row));
      if (row > 1) check(g.at(column, row - 2), g.at(column, row - 1), g.at(column, row));
    }
  }
  const auto middle = all_px.begin() + static_cast<std::ptrdiff_t>(all_px.size() / 2);
  std::nth_element(all_px.begin(), middle, all_px.end());
  result.median_px = *middle;
  return result;
}

cv::Mat smoothed(const cv::Mat& image) {
  cv::Mat result;
  cv::GaussianBlur(image, result, cv::Size(5, 5), 1.0);
  return result;
}

/// The search in the picture scaled to `scale`; corners in full-size pixels.
Corners search_scaled(const cv::Mat& image, const BoardSpec& board, double scale) {
  cv::Mat scaled = image;
  if (scale < 1) cv::resize(image, scaled, cv::Size(), scale, scale, cv::INTER_AREA);
  const GrayImage picture{scaled.data, scaled.cols, scaled.rows};
  // More saddle points than one in a hundred pixels are noise, not a scene.
  const std::size_t saddles_max = picture.size() / 100;
  const auto search = [&](const SaddlePoints& saddles) -> Corners {
    if (saddles.size() < saddle_points_min(board.corners()) || saddles.size() > saddles_max) return {};
    return find_checkerboard_lattice(picture, saddles, board);
  };
  Corners corners = search(find_saddle_points(picture, saddles_max));
  if (corners.empty()) corners = search(find_saddle_points_halved(picture, saddles_max));
  if (corners.empty()) {  // a small board in noise: its corners are too near for half the size
    const cv::Mat quiet = smoothed(scaled);
    corners = search(find_saddle_points({quiet.data, quiet.cols, quiet.rows}, saddles_max));
  }
  for (Eigen::Vector2d& p : corners) p = ((p.array() + 0.5) / scale - 0.5).matrix();
  return corners;
}

void refine(const cv::Mat& image, const BoardSpec& board, const DetectionOptions& options, Corners& corners) {
  const double spacing = smallest_spacing_px({board, corners});
  int half = std::clamp(static_cast<int>(std::lround(options.window_of_spacing * spacing)), 2, 40);
  if (options.fixed_half_window_px > 0) half = options.fixed_half_window_px;
  half = std::min(half, (std::min(image.cols, image.rows) - 6) / 2);  // OpenCV asks for a larger image
  refine_corners({image.data, image.cols, image.rows},
                 {half, options.refinement_iterations, options.refinement_step_px}, corners);
}

/// Board coordinates in squares -> pixels.
std::optional<Eigen::Matrix3d> board_homography(const BoardSpec& board, const Corners& corners) {
  Corners squares;
  for (int i = 0; i < board.corners(); ++i) {
    squares.emplace_back(i % board.inner_columns, i / board.inner_columns);
  }
  return fit_homography(squares, corners);
}

double grey_at(const cv::Mat& image, const Eigen::Vector2d& px) {
  const int u = std::clamp(static_cast<int>(std::lround(px.x())), 0, image.cols - 1);
  const int v = std::clamp(static_cast<int>(std::lround(px.y())), 0, image.rows - 1);
  return image.at<std::uint8_t>(v, u);
}

/// How much darker the squares are that have the colour of the first one, mean in grey levels.
double first_square_darkness(const cv::Mat& image, const Grid& g) {
  double even = 0, odd = 0;
  int evens = 0, odds = 0;
  for (int row = 0; row + 1 < g.board.inner_rows; ++row) {
    for (int column = 0; column + 1 < g.board.inner_columns; ++column) {
      const Eigen::Vector2d middle =
          (g.at(column, row) + g.at(column + 1, row) + g.at(column, row + 1) + g.at(column + 1, row + 1)) / 4;
      if ((column + row) % 2 == 0) {
        even += grey_at(image, middle);
        ++evens;
      } else {
        odd += grey_at(image, middle);
        ++odds;
      }
    }
  }
  return odd / odds - even / evens;
}

/// Makes x cross y point away from the viewer: mirrors the columns when the search went the other way round.
void make_right_handed(const BoardSpec& board, Corners& corners) {
  const Grid g{board, corners};
  const Eigen::Vector2d x = g.at(board.inner_columns - 1, 0) - g.at(0, 0);
  const Eigen::Vector2d y = g.at(0, board.inner_rows - 1) - g.at(0, 0);
  if (x.x() * y.y() - x.y() * y.x() > 0) return;
  for (int row = 0; row < board.inner_rows; ++row) {
    const auto first = corners.begin() + row * board.inner_columns;
    std::reverse(first, first + board.inner_columns);
  }
}

/// Puts the first corner where the board's frame says. A turn by 180 degrees is the only choice left; the colours
/// decide when they can, else the columns run to the right of the picture.
void make_unique(const cv::Mat& image, const BoardSpec& board, Corners& corners) {
  make_right_handed(board, corners);
  const bool turn = board.is_orientation_unique() ? first_square_darkness(image, {board, corners}) < 0
                                                  : (corners.back() - corners.front()).sum() < 0;
  if (turn) std::reverse(corners.begin(), corners.end());
}

Result<CornerSet> check_corners(const cv::Mat& image, const BoardSpec& board, const DetectionOptions& options,
                                const Corners& corners) {
  const Grid grid{board, corners};
  constexpr double kContrastMin = 8;  // grey levels between black and white squares
  if (std::abs(first_square_darkness(image, grid)) < kContrastMin) {
    return failure(Fault::kBoardNotFound, "the squares have no contrast");
  }
  const LocalResiduals local = local_residuals(grid);
  if (!(local.largest_spacings <= options.local_residual_max)) {
    return failure(Fault::kBoardNotFound, "a corner lies {:.2f} squares off its neighbours", local.largest_spacings);
  }
  constexpr double kMediansMax = 12, kSlack_px = 2;  // four at most on tilted boards in a lens as the thesis's
  if (local.largest_px > kMediansMax * local.median_px + kSlack_px) {
    return failure(Fault::kBoardNotFound, "a corner lies {:.1f} px off its neighbours, the others {:.1f} px",
                   local.largest_px, local.median_px);
  }
  const auto h = board_homography(board, corners);
  if (!h) return failure(Fault::kBoardNotFound, "the corners do not span a plane");
  CornerSet set{corners, 0, {}};
  for (int i = 0; i < board.corners(); ++i) {
    const Eigen::Vector2d square(i % board.inner_columns, i / board.inner_columns);
    set.residual_rms_px +=
        (apply_homography(*h, square) - corners[static_cast<std::size_t>(i)]).squaredNorm() / board.corners();
  }
  set.residual_rms_px = std::sqrt(set.residual_rms_px);
  return set;
}

Result<CornerSet> detect(const cv::Mat& image, const BoardSpec& board, const DetectionOptions& options) {
  // Scaled down first: most boards are large enough, and the search is many times faster. Then once in twice the size.
  Corners corners;
  for (const int width : {options.search_width_max_px, 2 * options.search_width_max_px}) {
    const double scale = std::min(1.0, static_cast<double>(width) / std::max(image.cols, image.rows));
    corners = search_scaled(image, board, scale);
    if (!corners.empty() || scale == 1) break;
  }
  if (corners.empty())
    return failure(Fault::kBoardNotFound, "no {}x{} board seen whole", board.inner_columns, board.inner_rows);
  make_unique(image, board, corners);
  Corners refined = corners;
  refine(image, board, options, refined);
  auto result = check_corners(image, board, options, refined);
  if (result) return result;
  // Small windows in strong noise send a corner astray: once more in a quieter picture.
  refined = corners;
  refine(smoothed(image), board, options, refined);
  return check_corners(image, board, options, refined);
}

}  // namespace

Result<CornerSet> detect_checkerboard(GrayImage image, const BoardSpec& board, const DetectionOptions& options) {
  if (const Status fine = check_board(board); !fine) return std::unexpected(fine.error());
  if (const Status fine = check_image(image); !fine) return std::unexpected(fine.error());
  try {
    cv::setNumThreads(1);  // results and memory must not depend on the number of cores
    // OpenCV has no read-only header for foreign pixels; nothing below writes to it.
    const cv::Mat header(image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.data));
    return detect(header, board, options);
  } catch (const cv::Exception& e) {
    return failure(Fault::kBoardNotFound, "OpenCV: {}", e.err);
  } catch (const std::bad_alloc&) {
    return failure(Fault::kOutOfMemory, "searching the board in {}x{} pixels", image.width, image.height);
  }
}

}  // namespace firstlook
