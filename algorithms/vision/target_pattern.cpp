#include "algorithms/vision/target_pattern.hpp"

#include <array>
#include <cmath>

namespace firstlook {
namespace {

/// The picture of the pattern marker, 1 is dark; our own, since ARToolKit's "Hiro" is not ours to copy. Not symmetric
/// under any turn, as much dark as white.
constexpr std::array<std::uint16_t, kPatternCells> kPicture = {
    0b1111111110000000, 0b1111111110000000, 0b1111111110000110, 0b1110000000001111,
    0b1110000000001111, 0b1110000000000110, 0b1111111000000000, 0b1111111000011110,
    0b1111111000011110, 0b1110000000000000, 0b1110000001111111, 0b1110000001111111,
    0b1110000001110000, 0b1110000001110111, 0b1110011111110111, 0b0000011111110111};

int floor_int(double x) { return static_cast<int>(std::floor(x)); }

/// The square that a point lies in: column and row of its right lower inner corner.
struct Square {
  int column = 0, row = 0;
};
Square square_at(const BoardSpec& board, double x_m, double y_m) {
  return {floor_int(x_m / board.square_size_m), floor_int(y_m / board.square_size_m)};
}

bool is_square_dark(const BoardSpec& board, const Square& s) {
  const bool on_pattern = s.column >= -1 && s.row >= -1 && s.column < board.inner_columns && s.row < board.inner_rows;
  const bool turned = board.type == TargetType::kCharuco && board.legacy && (board.inner_rows + 1) % 2 == 0;
  return on_pattern && ((s.column + s.row) % 2 == 0) != turned;
}

bool is_in_marker_dark(const BoardSpec& board, int marker, double x_m, double y_m) {
  const int cells = marker_cells(board);
  const double cell_m = board.mark_size_m / cells;
  const Eigen::Vector2d origin = board.marker_origin(marker);
  const int column = floor_int((x_m - origin.x()) / cell_m), row = floor_int((y_m - origin.y()) / cell_m);
  return column >= 0 && row >= 0 && column < cells && row < cells && is_marker_cell_dark(board, marker, column, row);
}

/// Which of a ChArUco board's markers stands in a white square: the white squares before it, row by row.
int marker_in_square(const BoardSpec& board, const Square& s) {
  const int before = (s.row + 1) * (board.inner_columns + 1) + s.column + 1;
  const bool first_is_white = !is_square_dark(board, {-1, -1});
  // With an odd number of columns the colours run on from row to row; with an even one each row has as many.
  if ((board.inner_columns + 1) % 2 == 0) return before / 2;
  return first_is_white ? (before + 1) / 2 : before / 2;
}

bool is_charuco_dark(const BoardSpec& board, double x_m, double y_m) {
  const Square s = square_at(board, x_m, y_m);
  if (is_square_dark(board, s)) return true;
  if (s.column < -1 || s.row < -1 || s.column >= board.inner_columns || s.row >= board.inner_rows) return false;
  return is_in_marker_dark(board, marker_in_square(board, s), x_m, y_m);
}

bool is_disc_dark(const BoardSpec& board, double x_m, double y_m) {
  const double pitch = board.square_size_m, radius = board.mark_size_m / 2;
  // Asymmetric discs may be larger than their rows are apart: the nearest of three rows decides.
  const int nearest_row = floor_int(y_m / pitch + 0.5);
  for (int row = nearest_row - 1; row <= nearest_row + 1; ++row) {
    if (row < 0 || row >= board.inner_rows) continue;
    const bool asymmetric = board.type == TargetType::kAsymmetricCircles;
    const double first = asymmetric ? pitch * (row % 2) : 0, step = asymmetric ? 2 * pitch : pitch;
    const int column = floor_int((x_m - first) / step + 0.5);
    if (column < 0 || column >= board.inner_columns) continue;
    if (std::hypot(x_m - first - column * step, y_m - row * pitch) < radius) return true;
  }
  return false;
}

bool is_marker_grid_dark(const BoardSpec& board, double x_m, double y_m) {
  const bool single = board.corners() == 4;
  const int column = single ? 0 : floor_int(x_m / board.square_size_m);
  const int row = single ? 0 : floor_int(y_m / board.square_size_m);
  if (column < 0 || row < 0 || column >= board.inner_columns || row >= board.inner_rows) return false;
  return is_in_marker_dark(board, row * board.inner_columns + column, x_m, y_m);
}

void add_squares(const BoardSpec& board, std::vector<InkShape>& shapes) {
  for (int row = -1; row < board.inner_rows; ++row) {
    for (int column = -1; column < board.inner_columns; ++column) {
      if (!is_square_dark(board, {column, row})) continue;
      const Eigen::Vector2d low = board.square_size_m * Eigen::Vector2d(column, row);
      shapes.push_back({InkShape::Kind::kRectangle, low, low.array() + board.square_size_m});
    }
  }
}

void add_marker(const BoardSpec& board, int marker, std::vector<InkShape>& shapes) {
  const int cells = marker_cells(board);
  const double cell_m = board.mark_size_m / cells;
  const Eigen::Vector2d origin = board.marker_origin(marker);
  for (int row = 0; row < cells; ++row) {
    int first = -1;  // of the dark cells that stand side by side
    for (int column = 0; column <= cells; ++column) {
      const bool dark = column < cells && is_marker_cell_dark(board, marker, column, row);
      if (dark && first < 0) first = column;
      if (dark || first < 0) continue;
      shapes.push_back({InkShape::Kind::kRectangle, origin + cell_m * Eigen::Vector2d(first, row),
                        origin + cell_m * Eigen::Vector2d(column, row + 1)});
      first = -1;
    }
  }
}

}  // namespace

int marker_cells(const BoardSpec& board) {
  if (board.type == TargetType::kPatternMarker) return static_cast<int>(kPatternCells / kPatternShare);
  return marker_family(board.dictionary).bits + 2;
}

bool is_marker_cell_dark(const BoardSpec& board, int marker, int column, int row) {
  const int cells = marker_cells(board);
  const int border = board.type == TargetType::kPatternMarker ? (cells - kPatternCells) / 2 : 1;
  const int bits = cells - 2 * border, x = column - border, y = row - border;
  if (x < 0 || y < 0 || x >= bits || y >= bits) return true;
  if (board.type == TargetType::kPatternMarker) {
    return ((kPicture[static_cast<std::size_t>(y)] >> (kPatternCells - 1 - x)) & 1U) != 0;
  }
  return ((marker_code(board.dictionary, board.first_id + marker) >> (bits * bits - 1 - (y * bits + x))) & 1U) == 0;
}

InkExtent ink_extent(const BoardSpec& board) {
  const Eigen::Vector2d center = board.center().head<2>();
  switch (board.type) {
    case TargetType::kCheckerboard:
    case TargetType::kCharuco:
      return {center, board.square_size_m * Eigen::Vector2d(board.inner_columns + 1, board.inner_rows + 1)};
    case TargetType::kCircles:
    case TargetType::kAsymmetricCircles:
      return {center, 2 * center.array() + board.mark_size_m};
    default:
      return {center, 2 * center};
  }
}

double quiet_zone_m(const BoardSpec& board) {
  if (board.has_marker_corners()) return board.mark_size_m / std::min(marker_cells(board), 8);
  return board.square_size_m / 2;
}

bool is_dark(const BoardSpec& board, double x_m, double y_m) {
  switch (board.type) {
    case TargetType::kCheckerboard:
      return is_square_dark(board, square_at(board, x_m, y_m));
    case TargetType::kCharuco:
      return is_charuco_dark(board, x_m, y_m);
    case TargetType::kCircles:
    case TargetType::kAsymmetricCircles:
      return is_disc_dark(board, x_m, y_m);
    default:
      return is_marker_grid_dark(board, x_m, y_m);
  }
}

std::vector<InkShape> ink_shapes(const BoardSpec& board) {
  std::vector<InkShape> shapes;
  if (board.type == TargetType::kCheckerboard || board.type == TargetType::kCharuco) add_squares(board, shapes);
  if (board.type == TargetType::kCircles || board.type == TargetType::kAsymmetricCircles) {
    for (int i = 0; i < board.corners(); ++i) {
      const Eigen::Vector2d center = board.corner(i).head<2>();
      shapes.push_back(
          {InkShape::Kind::kDisc, center.array() - board.mark_size_m / 2, center.array() + board.mark_size_m / 2});
    }
  }
  if (board.type == TargetType::kPatternMarker) add_marker(board, 0, shapes);
  for (int m = 0; m < board.markers(); ++m) add_marker(board, m, shapes);
  return shapes;
}

}  // namespace firstlook
