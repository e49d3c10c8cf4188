/// The ink of a target: what is dark on the print.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "algorithms/vision/target.hpp"

namespace firstlook {

/// A dark shape in board coordinates.
struct InkShape {
  enum class Kind : std::uint8_t { kRectangle, kDisc } kind = Kind::kRectangle;
  Eigen::Vector2d low_m = Eigen::Vector2d::Zero();  ///< corners of the rectangle, or of the disc's bounding square
  Eigen::Vector2d high_m = Eigen::Vector2d::Zero();
};

/// Where the ink lies.
struct InkExtent {
  Eigen::Vector2d center_m = Eigen::Vector2d::Zero();
  Eigen::Vector2d size_m = Eigen::Vector2d::Zero();
};
[[nodiscard]] InkExtent ink_extent(const BoardSpec& board);

/// True where the print is dark at a point of the board's plane. Constant cost.
[[nodiscard]] bool is_dark(const BoardSpec& board, double x_m, double y_m);

/// All dark areas, without overlaps; rectangles of one marker's row that touch are one.
[[nodiscard]] std::vector<InkShape> ink_shapes(const BoardSpec& board);

/// White that must stay free around the ink so that the target is found: one square, or a cell of a marker.
[[nodiscard]] double quiet_zone_m(const BoardSpec& board);

/// True when cell (column, row) of a marker of the board is dark; cells count from the upper left, border included.
[[nodiscard]] bool is_marker_cell_dark(const BoardSpec& board, int marker, int column, int row);
/// Cells of a marker each way, border included.
[[nodiscard]] int marker_cells(const BoardSpec& board);

}  // namespace firstlook
