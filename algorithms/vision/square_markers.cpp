#include "algorithms/vision/square_markers.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <optional>
#include <unordered_map>
#include <utility>

#include "algorithms/vision/gray_sampling.hpp"
#include "algorithms/vision/homography.hpp"
#include "algorithms/vision/target_pattern.hpp"

namespace firstlook {
namespace {

constexpr double kContrastMin = 15;  // grey levels between the border and the paper around it

double side_px(const Quad& quad) {
  return ((quad[1] - quad[0]).norm() + (quad[2] - quad[1]).norm() + (quad[3] - quad[2]).norm() +
          (quad[0] - quad[3]).norm()) /
         4;
}

/// Grey values of the cells of a candidate, border included, and of the paper around it.
struct CellGrays {
  int cells = 0;
  std::vector<double> gray;        ///< row by row; 0 where none was read
  double paper = 0;                ///< mean of all sides
  std::array<double, 4> beside{};  ///< the paper along each side
  [[nodiscard]] double at(int column, int row) const {
    return gray[static_cast<std::size_t>(row) * static_cast<std::size_t>(cells) + static_cast<std::size_t>(column)];
  }
};

/// Reads the cells of one quadrangle after the other.
class CellReader {
 public:
  /// Of `cells` each way; of the outer `unread` only the upper left one is.
  CellReader(int cells, int unread) : cells_(cells), unread_(unread) {
    for (int i = 0; i < cells; ++i) {
      for (const auto& [x, y] :
           {std::pair{i + 0.5, -0.4}, {i + 0.5, cells + 0.4}, {-0.4, i + 0.5}, {cells + 0.4, i + 0.5}})
        x_.push_back(x), y_.push_back(y);
    }
    if (unread > 0) add_cell(0, 0);
    for (int row = unread; row < cells - unread; ++row) {
      for (int column = unread; column < cells - unread; ++column) add_cell(column, row);
    }
    u_.resize(x_.size()), v_.resize(x_.size()), grays_.resize(x_.size());
  }

  /// False when the cells in the middle, beyond those that are not read, would all be as grey as each other: no cell is
  /// darker or brighter than its pixels.
  [[nodiscard]] bool may_have_contrast(GrayImage image, const Quad& quad) const {
    const auto h = square_to_quad(cells_, quad);
    if (!h) return false;
    const double low = unread_, high = cells_ - unread_;
    Eigen::AlignedBox2d box;
    for (const double x : {low, high}) {
      for (const double y : {low, high}) box.extend(apply_homography(*h, {x, y}));
    }
    const auto pixel = [](double x, int count) { return static_cast<int>(std::clamp(x, 0.0, count - 1.0)); };
    const int right = pixel(box.max().x() + 1, image.width), bottom = pixel(box.max().y() + 1, image.height);
    std::uint8_t darkest = 255, brightest = 0;
    for (int v = pixel(box.min().y(), image.height); v <= bottom; ++v) {
      for (int u = pixel(box.min().x(), image.width); u <= right; ++u) {
        darkest = std::min(darkest, image.at(u, v)), brightest = std::max(brightest, image.at(u, v));
      }
    }
    return brightest - darkest >= kContrastMin;
  }

  [[nodiscard]] std::optional<CellGrays> read(GrayImage image, const Quad& quad) {
    const auto h = square_to_quad(cells_, quad);
    if (!h) return std::nullopt;
    project(*h);
    grays_between(image, u_, v_, grays_);
    CellGrays result{cells_, std::vector<double>(static_cast<std::size_t>(cells_ * cells_)), 0, {}};
    auto gray = grays_.cbegin();
    for (int i = 0; i < cells_; ++i) {
      for (double& side : result.beside) side += *gray++ / cells_;
    }
    for (const double side : result.beside) result.paper += side / 4;
    for (const std::size_t cell : order_) {
      result.gray[cell] = std::accumulate(gray, gray + kSamples, 0.0) / kSamples;
      gray += kSamples;
    }
    return result;
  }

 private:
  static constexpr int kSamples = 9;  // of a cell

  void add_cell(int column, int row) {
    order_.push_back(static_cast<std::size_t>(row * cells_ + column));
    for (const double dy : {0.3, 0.5, 0.7}) {
      for (const double dx : {0.3, 0.5, 0.7}) x_.push_back(column + dx), y_.push_back(row + dy);
    }
  }

  void project(const Eigen::Matrix3d& h) {
    for (std::size_t k = 0; k < x_.size(); ++k) {
      const double x = x_[k], y = y_[k], scale = 1 / (h(2, 0) * x + h(2, 1) * y + h(2, 2));
      u_[k] = (h(0, 0) * x + h(0, 1) * y + h(0, 2)) * scale;
      v_[k] = (h(1, 0) * x + h(1, 1) * y + h(1, 2)) * scale;
    }
  }

  int cells_, unread_;
  std::vector<double> x_, y_;          ///< samples, in cells from the quadrangle's first corner
  std::vector<std::size_t> order_;     ///< cells that are read
  std::vector<double> u_, v_, grays_;  ///< samples in the picture
};

/// False where something else than paper begins at a side: what is taken for that side may be the edge of a thing that
/// hides a part of the marker.
bool paper_all_around(const CellGrays& cells, double border) {
  constexpr double kShareMin = 0.7;  // of the brightest side's contrast
  const auto [darkest, brightest] = std::minmax_element(cells.beside.begin(), cells.beside.end());
  return *darkest - border >= kShareMin * (*brightest - border);
}

/// The code of a candidate whose border is black all around; empty when it is not.
std::optional<std::uint64_t> read_code(const CellGrays& cells) {
  const int n = cells.cells;
  double border = 0;
  for (int i = 0; i + 1 < n; ++i)
    border += cells.at(i, 0) + cells.at(n - 1, i) + cells.at(i + 1, n - 1) + cells.at(0, i + 1);
  border /= 4 * (n - 1);
  if (cells.paper - border < kContrastMin || !paper_all_around(cells, border)) return std::nullopt;
  const double middle = (border + cells.paper) / 2;
  for (int i = 0; i < n; ++i) {
    for (const double gray : {cells.at(i, 0), cells.at(i, n - 1), cells.at(0, i), cells.at(n - 1, i)}) {
      if (gray > middle) return std::nullopt;
    }
  }
  std::uint64_t code = 0;
  for (int row = 1; row + 1 < n; ++row) {
    for (int column = 1; column + 1 < n; ++column) code = code << 1U | (cells.at(column, row) > middle ? 1U : 0U);
  }
  return code;
}

/// What a candidate was recognised as.
struct Reading {
  int marker = -1;
  std::size_t turns = 0;  ///< quarter turns clockwise that the marker was turned by
  int wrong_cells = 0;
};

/// Codes of all markers of a target in their four turns.
class CodeBook {
 public:
  explicit CodeBook(const BoardSpec& board) : family_(marker_family(board.dictionary)) {
    for (int m = 0; m < board.markers(); ++m) {
      std::uint64_t code = marker_code(board.dictionary, board.first_id + m);
      for (std::uint64_t& turned : codes_.emplace_back()) {
        turned = code;
        code = turned_code(code, family_.bits);
      }
    }
    for (std::size_t m = 0; m < codes_.size(); ++m) {
      for (std::size_t turns = 0; turns < 4; ++turns) {
        const auto [place, is_new] = exact_.try_emplace(codes_[m][turns], Reading{static_cast<int>(m), turns, 0});
        if (!is_new) place->second.marker = -1;  // two are as near
      }
    }
  }
  /// The marker that differs in the fewest cells; empty when none is near enough, or two are as near.
  [[nodiscard]] std::optional<Reading> read(std::uint64_t code) const {
    if (const auto found = exact_.find(code); found != exact_.end()) {
      return found->second.marker >= 0 ? std::optional(found->second) : std::nullopt;
    }
    if (family_.correctable == 0) return std::nullopt;
    Reading best{-1, 0, family_.correctable + 1};
    bool alone = false;
    for (std::size_t m = 0; m < codes_.size(); ++m) {
      for (std::size_t turns = 0; turns < 4; ++turns) {
        const int wrong = std::popcount(codes_[m][turns] ^ code);
        if (wrong > best.wrong_cells) continue;
        alone = wrong < best.wrong_cells;
        best = {static_cast<int>(m), turns, wrong};
      }
    }
    if (best.wrong_cells > family_.correctable || !alone) return std::nullopt;
    return best;
  }

 private:
  const MarkerFamily& family_;
  std::vector<std::array<std::uint64_t, 4>> codes_;
  std::unordered_map<std::uint64_t, Reading> exact_;
};

/// Correlation of the picture's cells with the pattern in each turn, as ARToolKit compares them; empty below its
/// confidence of 0.7 or when another turn fits nearly as well.
std::optional<Reading> read_picture(const BoardSpec& board, const CellGrays& cells) {
  constexpr double kConfidenceMin = 0.7, kLead = 0.2;
  const int n = cells.cells, border = (n - kPatternCells) / 2;
  double darkest = 255, brightest = 0, mean = 0;
  for (int row = border; row < n - border; ++row) {
    for (int column = border; column < n - border; ++column) {
      const double gray = cells.at(column, row);
      darkest = std::min(darkest, gray), brightest = std::max(brightest, gray);
      mean += gray / (kPatternCells * kPatternCells);
    }
  }
  if (brightest - darkest < kContrastMin || cells.paper - cells.at(0, 0) < kContrastMin ||
      !paper_all_around(cells, cells.at(0, 0))) {
    return std::nullopt;
  }
  std::array<double, 4> fit{};
  for (std::size_t turns = 0; turns < 4; ++turns) {
    double product = 0, own = 0, seen = 0;
    for (int row = border; row < n - border; ++row) {
      for (int column = border; column < n - border; ++column) {
        int x = column, y = row;  // where the cell stands on the marker that was turned clockwise
        for (std::size_t t = 0; t < turns; ++t) {
          const int old_x = x;
          x = y, y = n - 1 - old_x;
        }
        const double ink = is_marker_cell_dark(board, 0, x, y) ? -1 : 1, gray = cells.at(column, row) - mean;
        product += ink * gray, own += ink * ink, seen += gray * gray;
      }
    }
    fit[turns] = product / std::sqrt(own * seen);
  }
  const auto best = static_cast<std::size_t>(std::max_element(fit.begin(), fit.end()) - fit.begin());
  for (std::size_t turns = 0; turns < 4; ++turns) {
    if (turns != best && fit[turns] > fit[best] - kLead) return std::nullopt;
  }
  if (fit[best] < kConfidenceMin) return std::nullopt;
  return Reading{0, best, 0};
}

/// Cells from a marker's side to its code or picture.
int border_cells(const BoardSpec& board) {
  return board.type == TargetType::kPatternMarker ? (marker_cells(board) - kPatternCells) / 2 : 1;
}

std::optional<SquareMarker> recognise(GrayImage image, const BoardSpec& board, const CodeBook& book, CellReader& cells,
                                      Quad quad) {
  const double border_px = border_cells(board) * side_px(quad) / marker_cells(board);
  if (!refine_quad(image, border_px, QuadFit::kToRead, quad)) return std::nullopt;
  if (board.type == TargetType::kPatternMarker && !cells.may_have_contrast(image, quad)) return std::nullopt;
  const auto grays = cells.read(image, quad);
  if (!grays) return std::nullopt;
  std::optional<Reading> reading;
  if (board.type == TargetType::kPatternMarker) {
    reading = read_picture(board, *grays);
  } else if (const auto code = read_code(*grays)) {
    reading = book.read(*code);
  }
  if (!reading) return std::nullopt;
  // A ChArUco board's markers only say where its squares are.
  if (board.type != TargetType::kCharuco && !refine_quad(image, border_px, QuadFit::kToMeasure, quad)) {
    return std::nullopt;
  }
  SquareMarker found{reading->marker, {}, reading->wrong_cells};
  for (std::size_t i = 0; i < 4; ++i) found.corners_px[i] = quad[(i + reading->turns) % 4];
  return found;
}

/// Sorted by number; of readings of one quadrangle the best stays, of readings at different places none.
std::vector<SquareMarker> only_once(std::vector<SquareMarker> found) {
  std::stable_sort(found.begin(), found.end(), [](const SquareMarker& a, const SquareMarker& b) {
    return a.marker != b.marker ? a.marker < b.marker : a.wrong_cells < b.wrong_cells;
  });
  std::vector<SquareMarker> kept;
  for (std::size_t i = 0; i < found.size();) {
    std::size_t end = i + 1;
    bool apart = false;
    for (; end < found.size() && found[end].marker == found[i].marker; ++end) {
      apart = apart || (found[end].corners_px[0] - found[i].corners_px[0]).norm() > side_px(found[i].corners_px) / 4;
    }
    if (!apart) kept.push_back(found[i]);
    i = end;
  }
  return kept;
}

std::array<Eigen::Vector2d, 4> marker_on_board(const BoardSpec& board, int marker) {
  const Eigen::Vector2d o = board.marker_origin(marker);
  const double s = board.mark_size_m;
  return {{o, {o.x() + s, o.y()}, {o.x() + s, o.y() + s}, {o.x(), o.y() + s}}};
}

std::optional<Eigen::Matrix3d> homography_of(const BoardSpec& board, const std::vector<SquareMarker>& markers) {
  std::vector<Eigen::Vector2d> plane, image;
  for (const SquareMarker& m : markers) {
    const auto on_board = marker_on_board(board, m.marker);
    plane.insert(plane.end(), on_board.begin(), on_board.end());
    image.insert(image.end(), m.corners_px.begin(), m.corners_px.end());
  }
  return fit_homography(plane, image);
}

/// Takes out the markers that do not stand where the others say, worst first. Lens distortion bends a board by a small
/// part of a marker; a wrong number moves a marker by a whole place.
void drop_contradictions(const BoardSpec& board, std::vector<SquareMarker>& markers) {
  constexpr double kOffMax = 0.35;  // of a side
  while (markers.size() > 1) {
    const auto h = homography_of(board, markers);
    if (!h) return markers.clear();
    std::size_t worst = 0;
    double worst_off = 0;
    for (std::size_t i = 0; i < markers.size(); ++i) {
      const auto on_board = marker_on_board(board, markers[i].marker);
      double off = 0;
      for (std::size_t k = 0; k < 4; ++k) {
        off = std::max(off, (apply_homography(*h, on_board[k]) - markers[i].corners_px[k]).norm());
      }
      off /= side_px(markers[i].corners_px);
      if (off > worst_off) worst = i, worst_off = off;
    }
    if (worst_off <= kOffMax) return;
    if (markers.size() == 2) return markers.clear();  // which of the two is wrong?
    markers.erase(markers.begin() + static_cast<std::ptrdiff_t>(worst));
  }
}

/// Smallest width of a set of points over its largest: 0 on a line.
double flatness(const std::vector<Eigen::Vector2d>& points) {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const auto& p : points) mean += p / static_cast<double>(points.size());
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
  for (const auto& p : points) spread += (p - mean) * (p - mean).transpose();
  const double trace = spread.trace(), determinant = spread.determinant();
  const double root = std::sqrt(std::max(0.0, trace * trace / 4 - determinant));
  return std::sqrt(std::max(0.0, trace / 2 - root) / std::max(1e-12, trace / 2 + root));
}

Result<CornerSet> finished(const BoardSpec& board, CornerSet set) {
  constexpr double kShareMin = 0.25, kFlatnessMin = 0.08;
  if (static_cast<double>(set.ids.size()) < std::max(4.0, kShareMin * board.corners())) {
    return failure(Fault::kBoardNotFound, "{} of {} points seen", set.ids.size(), board.corners());
  }
  std::vector<Eigen::Vector2d> plane;
  for (const int id : set.ids) plane.emplace_back(board.corner(id).head<2>());
  if (flatness(plane) < kFlatnessMin) {
    return failure(Fault::kBoardNotFound, "the {} points seen lie nearly on a line", set.ids.size());
  }
  const auto h = fit_homography(plane, set.corners_px);
  if (!h) return failure(Fault::kBoardNotFound, "the points do not span a plane");
  for (std::size_t i = 0; i < plane.size(); ++i) {
    set.residual_rms_px += (apply_homography(*h, plane[i]) - set.corners_px[i]).squaredNorm();
  }
  set.residual_rms_px = std::sqrt(set.residual_rms_px / static_cast<double>(plane.size()));
  if (static_cast<int>(set.ids.size()) == board.corners()) set.ids.clear();
  return set;
}

/// A square of a ChArUco board by its place; (-1, -1) is the upper left one.
Eigen::Vector2d square_corner(const BoardSpec& board, int column, int row, std::size_t k) {
  return board.square_size_m * Eigen::Vector2d(column + (k == 1 || k == 2 ? 1 : 0), row + (k >= 2 ? 1 : 0));
}

/// A marker that was found, and where it says that points near it are seen.
struct MarkerPlane {
  Eigen::Vector2d origin_m;   ///< the marker's first corner on the board
  Eigen::Matrix3d px_from_m;  ///< of points seen from there
};

std::vector<MarkerPlane> planes_of(const BoardSpec& board, const std::vector<SquareMarker>& markers) {
  std::vector<MarkerPlane> planes;
  for (const SquareMarker& m : markers) {
    if (const auto h = square_to_quad(board.mark_size_m, m.corners_px)) {
      planes.push_back({board.marker_origin(m.marker), *h});
    }
  }
  return planes;
}

/// Where the markers beside a black square say that its corners are seen; empty when none of them was found.
std::optional<Quad> predicted_square(const BoardSpec& board, const std::vector<MarkerPlane>& planes, int column,
                                     int row) {
  Quad sum{};
  for (auto& corner : sum) corner.setZero();
  int count = 0;
  const Eigen::Vector2d middle_m = board.square_size_m * Eigen::Vector2d(column + 0.5, row + 0.5);
  for (const MarkerPlane& plane : planes) {
    const Eigen::Vector2d marker_m = plane.origin_m.array() + board.mark_size_m / 2;
    if ((marker_m - middle_m).norm() > 1.1 * board.square_size_m) continue;
    for (std::size_t k = 0; k < 4; ++k) {
      sum[k] += apply_homography(plane.px_from_m, square_corner(board, column, row, k) - plane.origin_m);
    }
    ++count;
  }
  if (count == 0) return std::nullopt;
  for (auto& corner : sum) corner /= count;
  return sum;
}

/// Inner corners as the corners of the black squares that touch there, each from the four long edges of its square: a
/// window around the corner would be too small beside the markers' ink (and OpenCV 4.6's own corners are half a pixel
/// off, opencv#25539).
Result<CornerSet> charuco_corners(GrayImage image, const BoardSpec& board, const std::vector<SquareMarker>& markers) {
  constexpr double kAgreement_px = 1.0;
  const std::vector<MarkerPlane> planes = planes_of(board, markers);
  std::vector<std::vector<Eigen::Vector2d>> seen(static_cast<std::size_t>(board.corners()));
  for (int row = -1; row < board.inner_rows; ++row) {
    for (int column = -1; column < board.inner_columns; ++column) {
      const Eigen::Vector2d middle = board.square_size_m * Eigen::Vector2d(column + 0.5, row + 0.02);
      if (!is_dark(board, middle.x(), middle.y())) continue;
      auto square = predicted_square(board, planes, column, row);
      if (!square) continue;
      const Quad start = *square;
      const double side = side_px(start);
      if (!refine_quad(image, side * (1 - board.mark_size_m / board.square_size_m) / 2, QuadFit::kToMeasure, *square))
        continue;
      for (std::size_t k = 0; k < 4; ++k) {
        const int c = column + (k == 1 || k == 2 ? 1 : 0), r = row + (k >= 2 ? 1 : 0);
        if (c < 0 || r < 0 || c >= board.inner_columns || r >= board.inner_rows) continue;
        if (((*square)[k] - start[k]).norm() > std::max(2.0, 0.15 * side)) continue;
        seen[static_cast<std::size_t>(r) * static_cast<std::size_t>(board.inner_columns) + static_cast<std::size_t>(c)]
            .push_back((*square)[k]);
      }
    }
  }
  CornerSet set;
  for (std::size_t id = 0; id < seen.size(); ++id) {
    if (seen[id].empty()) continue;
    if (seen[id].size() == 2 && (seen[id][0] - seen[id][1]).norm() > kAgreement_px) continue;
    set.corners_px.emplace_back(seen[id].size() == 2 ? Eigen::Vector2d((seen[id][0] + seen[id][1]) / 2) : seen[id][0]);
    set.ids.push_back(static_cast<int>(id));
  }
  return finished(board, std::move(set));
}

}  // namespace

Result<std::vector<SquareMarker>> find_square_markers(GrayImage image, const BoardSpec& board) {
  const auto quads = find_dark_quads(image);
  if (!quads) return std::unexpected(quads.error());
  const CodeBook book(board);
  // Of a pattern marker's border one cell is compared with the paper, all of a code's.
  CellReader cells(marker_cells(board), board.type == TargetType::kPatternMarker ? border_cells(board) : 0);
  std::vector<SquareMarker> found;
  for (const Quad& quad : *quads) {
    if (auto marker = recognise(image, board, book, cells, quad)) found.push_back(*marker);
  }
  return only_once(std::move(found));
}

Result<CornerSet> detect_marker_target(GrayImage image, const BoardSpec& board) {
  if (const Status fine = check_board(board); !fine) return std::unexpected(fine.error());
  if (const Status fine = check_image(image); !fine) return std::unexpected(fine.error());
  auto markers = find_square_markers(image, board);
  if (!markers) return std::unexpected(markers.error());
  drop_contradictions(board, *markers);
  if (board.type == TargetType::kCharuco) return charuco_corners(image, board, *markers);
  CornerSet set;
  for (const SquareMarker& m : *markers) {
    for (int k = 0; k < 4; ++k) {
      set.corners_px.push_back(m.corners_px[static_cast<std::size_t>(k)]);
      set.ids.push_back(4 * m.marker + k);
    }
  }
  return finished(board, std::move(set));
}

}  // namespace firstlook
