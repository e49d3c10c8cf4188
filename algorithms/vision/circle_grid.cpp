/// The adapter to OpenCV's filters and moments for discs: its types and exceptions end here.
#include "algorithms/vision/circle_grid.hpp"

#include <Eigen/Geometry>
#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <new>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "algorithms/vision/dark_outlines.hpp"
#include "algorithms/vision/gray_sampling.hpp"
#include "algorithms/vision/homography.hpp"
#include "algorithms/vision/lattice.hpp"
#include "algorithms/vision/point_buckets.hpp"

namespace firstlook {
namespace {

struct Disc {
  Eigen::Vector2d center;
  double radius_px = 0;  ///< of the circle with the same area
};

constexpr double kAreaMin_px2 = 20;  ///< within the outline of a disc

/// A dark ellipse from its outline; empty when that is none.
std::optional<Disc> disc_of(Outline outline) {
  constexpr double kElongationMax = 3.2, kAreaOfEllipseMin = 0.85, kAreaOfEllipseMax = 1.15;
  static_assert(sizeof(Pixel) == sizeof(cv::Point));
  const cv::Mat contour(static_cast<int>(outline.size()), 1, CV_32SC2, const_cast<Pixel*>(outline.data()));
  const cv::Moments m = cv::moments(contour);
  if (m.m00 < kAreaMin_px2) return std::nullopt;
  const double xx = m.mu20 / m.m00, yy = m.mu02 / m.m00, xy = m.mu11 / m.m00;
  const double mean = (xx + yy) / 2, root = std::hypot((xx - yy) / 2, xy);
  const double large = mean + root, small = mean - root;
  if (small <= 0 || std::sqrt(large / small) > kElongationMax) return std::nullopt;
  // An ellipse with these moments has the area 4 pi sqrt(large small).
  const double share = m.m00 / (4 * M_PI * std::sqrt(large * small));
  if (share < kAreaOfEllipseMin || share > kAreaOfEllipseMax) return std::nullopt;
  return Disc{{m.m10 / m.m00, m.m01 / m.m00}, std::sqrt(m.m00 / M_PI)};
}

/// Found with another window. A disc in the middle of the paper is not the paper, which is "round" enough, too.
bool is_same(const Disc& a, const Disc& b) {
  const double small_px = std::min(a.radius_px, b.radius_px), large_px = std::max(a.radius_px, b.radius_px);
  return large_px < 2 * small_px && (a.center - b.center).norm() < small_px / 2;
}

/// Discs, none twice.
class DiscSet {
 public:
  DiscSet(int width, int height) : centers_(width, height, kBucket_px) {}
  [[nodiscard]] const std::vector<Disc>& discs() const { return discs_; }
  void add(const Disc& disc) {
    // The same disc has its centre within half of the smaller radius.
    const auto same = [&](std::size_t d) { return is_same(discs_[d], disc); };
    if (centers_.any_near(disc.center, disc.radius_px / 2, same)) return;
    centers_.add(disc.center);
    discs_.push_back(disc);
  }

 private:
  static constexpr double kBucket_px = 16;
  PointBuckets centers_;
  std::vector<Disc> discs_;
};

void add_discs(DarkOutlines& outlines, int window_px, DiscSet& discs) {
  // The outline runs through the outermost pixels' centres.
  const auto may_be = [](int width, int height) { return (width - 1) * (height - 1) >= kAreaMin_px2; };
  outlines.for_each(window_px, may_be, [&](Outline outline) {
    if (const auto disc = disc_of(outline)) discs.add(*disc);
  });
}

/// Centre of the darkness in a window around the disc: each pixel counts with the part of it that ink covers.
std::optional<Eigen::Vector2d> darkness_center(GrayImage image, const Disc& disc, double reach_px) {
  constexpr double kContrastMin = 15;
  const double ink = gray_between(image, disc.center);
  double paper = 0;
  constexpr int kAround = 24;
  for (int k = 0; k < kAround; ++k) {
    const double angle = 2 * M_PI * k / kAround;
    paper += gray_between(image, disc.center + reach_px * Eigen::Vector2d(std::cos(angle), std::sin(angle))) / kAround;
  }
  if (paper - ink < kContrastMin) return std::nullopt;
  const int r = static_cast<int>(std::ceil(reach_px));
  const int cu = static_cast<int>(std::lround(disc.center.x())), cv = static_cast<int>(std::lround(disc.center.y()));
  if (cu < r || cv < r || cu + r >= image.width || cv + r >= image.height) return std::nullopt;
  double sum = 0;
  Eigen::Vector2d moment = Eigen::Vector2d::Zero();
  for (int v = cv - r; v <= cv + r; ++v) {
    for (int u = cu - r; u <= cu + r; ++u) {
      const Eigen::Vector2d at(u, v);
      if ((at - disc.center).squaredNorm() > reach_px * reach_px) continue;
      const double share = std::clamp((paper - image.at(u, v)) / (paper - ink), 0.0, 1.0);
      constexpr double kNoise = 0.08;  // paper that noise made a little darker
      if (share < kNoise) continue;
      sum += share;
      moment += share * at;
    }
  }
  if (sum <= 0) return std::nullopt;
  return Eigen::Vector2d(moment / sum);
}

/// Places on the lattice of nearest neighbours: rows and columns, or the two diagonals of an asymmetric grid.
std::vector<LatticePlace> places_of(const BoardSpec& board) {
  std::vector<LatticePlace> places;
  for (int row = 0; row < board.inner_rows; ++row) {
    for (int column = 0; column < board.inner_columns; ++column) {
      const int x = 2 * column + row % 2;
      // Diagonal neighbours are (1, 1) and (-1, 1) apart.
      places.push_back(board.type == TargetType::kCircles ? LatticePlace{column, row}
                                                          : LatticePlace{(x + row) / 2, (row - x) / 2});
    }
  }
  return places;
}

/// Discs of one target are as large as their neighbours, or nearly so.
bool alike(const Disc& a, const Disc& b) {
  const double ratio = b.radius_px / a.radius_px;
  return ratio > 0.6 && ratio < 1.7;
}

/// The nearest discs like this one and their distances, nearest first; fewer where the picture has no more.
std::vector<std::pair<double, std::size_t>> nearest_alike(const std::vector<Disc>& discs, const PointIndex& index,
                                                          std::size_t p, std::size_t count) {
  std::vector<std::pair<double, std::size_t>> others;
  constexpr double kFirst_px = 32, kAll_px = 16384;  // check_image allows no picture with such a diagonal
  for (double radius = kFirst_px; radius <= kAll_px && others.size() < count; radius *= 2) {
    others.clear();
    index.near(discs[p].center, radius, [&](std::size_t q, const Eigen::Vector2d& center) {
      if (q == p || !alike(discs[p], discs[q])) return;
      const double distance = (center - discs[p].center).norm();
      if (distance <= radius) others.emplace_back(distance, q);
    });
  }
  count = std::min(count, others.size());
  std::partial_sort(others.begin(), others.begin() + static_cast<std::ptrdiff_t>(count), others.end());
  others.resize(count);
  return others;
}

/// Steps to the nearest disc and to the nearest one in another direction, clockwise.
std::optional<LatticeSeed> seed_at(const std::vector<Disc>& discs, const PointIndex& index, std::size_t p) {
  constexpr std::size_t kNeighbours = 6;
  const auto others = nearest_alike(discs, index, p, kNeighbours);
  if (others.size() < 3) return std::nullopt;
  const Eigen::Vector2d a = discs[others[0].second].center - discs[p].center;
  for (std::size_t k = 1; k < others.size(); ++k) {
    const Eigen::Vector2d b = discs[others[k].second].center - discs[p].center;
    const double turn = a.x() * b.y() - a.y() * b.x();
    if (std::abs(turn) < 0.5 * a.norm() * b.norm()) continue;
    return turn > 0 ? LatticeSeed{p, a, b} : LatticeSeed{p, b, a};
  }
  return std::nullopt;
}

/// Discs in the order of the target's points; empty when the grid is not there.
std::vector<std::size_t> find_grid(const std::vector<Disc>& discs, const BoardSpec& board) {
  std::vector<Eigen::Vector2d> centers;
  for (const Disc& d : discs) centers.push_back(d.center);
  const PointIndex index(centers, 16);
  LatticeGrower grower(index);
  const auto places = places_of(board);
  constexpr int kSeedsMax = 300;
  int seeds = 0;
  std::vector<std::size_t> best;
  for (std::size_t p = 0; p < discs.size() && seeds < kSeedsMax && best.empty(); ++p) {
    const auto seed = seed_at(discs, index, p);
    if (!seed) continue;
    ++seeds;
    const auto fits = [&](std::size_t a, std::size_t b) { return alike(discs[a], discs[b]); };
    // A larger one is matched with no target, wherever its growth would end.
    const auto grown = grower.grow(*seed, {0.3, fits, {}, lattice_size_max(places.size())});
    double first_sum = 0;
    for (int turns = 0; turns < 4; ++turns) {
      const auto matches = match_lattice(grown, places, turns);
      if (matches.size() != 1) continue;
      std::vector<std::size_t> grid;
      for (const auto& point : matches[0].points) grid.push_back(*point);
      // Where the target looks the same upside down, the first circle is the upper left one of the picture.
      const double sum = centers[grid.front()].sum() - centers[grid.back()].sum();
      if (best.empty() || sum < first_sum) best = grid, first_sum = sum;
    }
  }
  return best;
}

/// Board plane to image: a homography, and what the lens bends as a polynomial of degree 3 (2 with few points).
class SmoothMap {
 public:
  static std::optional<SmoothMap> fit(const std::vector<Eigen::Vector2d>& plane,
                                      const std::vector<Eigen::Vector2d>& image) {
    const auto h = fit_homography(plane, image);
    if (!h) return std::nullopt;
    SmoothMap map;
    map.h_ = *h;
    const auto n = static_cast<Eigen::Index>(plane.size());
    for (const auto& p : plane) map.middle_ += p / static_cast<double>(n);
    for (const auto& p : plane) map.reach_ = std::max(map.reach_, (p - map.middle_).norm());
    constexpr Eigen::Index kPointsForCubic = 20;
    map.terms_ = n < kPointsForCubic ? 6 : 10;
    Eigen::MatrixXd terms(n, map.terms_), bent(n, 2);
    for (Eigen::Index i = 0; i < n; ++i) {
      const Eigen::Vector2d& at = plane[static_cast<std::size_t>(i)];
      terms.row(i) = map.terms_at(at).head(map.terms_).transpose();
      bent.row(i) = (image[static_cast<std::size_t>(i)] - apply_homography(*h, at)).transpose();
    }
    map.bend_ = terms.colPivHouseholderQr().solve(bent);
    return map;
  }
  [[nodiscard]] Eigen::Vector2d operator()(const Eigen::Vector2d& at) const {
    return apply_homography(h_, at) + bend_.transpose() * terms_at(at).head(terms_);
  }
  [[nodiscard]] Eigen::Vector2d straight(const Eigen::Vector2d& at) const { return apply_homography(h_, at); }

 private:
  [[nodiscard]] Eigen::Matrix<double, 10, 1> terms_at(const Eigen::Vector2d& at) const {
    const double x = (at.x() - middle_.x()) / reach_, y = (at.y() - middle_.y()) / reach_;
    Eigen::Matrix<double, 10, 1> t;
    t << 1, x, y, x * x, x * y, y * y, x * x * x, x * x * y, x * y * y, y * y * y;
    return t;
  }
  Eigen::Matrix3d h_ = Eigen::Matrix3d::Identity();
  Eigen::Vector2d middle_ = Eigen::Vector2d::Zero();
  double reach_ = 0;
  Eigen::Index terms_ = 0;
  Eigen::MatrixXd bend_;
};

/// Where the image of a disc has its centre of area, less where the disc's centre is seen: perspective and lens draw it
/// aside (Heikkila 2000 for perspective alone). By the area of its outline's image.
Eigen::Vector2d center_shift(const SmoothMap& map, const Eigen::Vector2d& at, double radius_m) {
  constexpr int kOutline = 48;
  const Eigen::Vector2d center = map(at);
  const auto point = [&](int k) {
    const double angle = 2 * M_PI * k / kOutline;
    return Eigen::Vector2d(map(at + radius_m * Eigen::Vector2d(std::cos(angle), std::sin(angle))) - center);
  };
  double area = 0;
  Eigen::Vector2d moment = Eigen::Vector2d::Zero();
  Eigen::Vector2d before = point(kOutline - 1);
  for (int k = 0; k < kOutline; ++k) {
    const Eigen::Vector2d here = point(k);
    const double triangle = before.x() * here.y() - before.y() * here.x();
    area += triangle;
    moment += triangle * (before + here) / 3;
    before = here;
  }
  return moment / area;
}

Result<CornerSet> detect(GrayImage image, const BoardSpec& board) {
  // OpenCV has no read-only header for foreign pixels; nothing writes to it.
  const cv::Mat header(image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.data));
  cv::Mat smooth;  // noise that is as deep as the threshold would fray the discs
  cv::GaussianBlur(header, smooth, cv::Size(3, 3), 0);
  DarkOutlines outlines({smooth.data, smooth.cols, smooth.rows});
  constexpr std::array<int, 2> kWindows_px = {31, 91};
  std::vector<std::size_t> grid;
  DiscSet found(image.width, image.height);
  const std::vector<Disc>& discs = found.discs();
  for (const int window : kWindows_px) {
    const std::size_t before = discs.size();
    add_discs(outlines, window, found);
    if (discs.size() == before) continue;  // they were no grid
    grid = find_grid(discs, board);
    if (!grid.empty()) break;
  }
  if (grid.empty()) {
    return failure(Fault::kBoardNotFound, "no grid of {}x{} circles seen whole", board.inner_columns, board.inner_rows);
  }
  CornerSet set;
  std::vector<Eigen::Vector2d> plane;
  for (std::size_t i = 0; i < grid.size(); ++i) {
    const Disc& disc = discs[grid[i]];
    double neighbour = std::numeric_limits<double>::infinity();
    for (const std::size_t other : grid) {
      if (other != grid[i]) neighbour = std::min(neighbour, (discs[other].center - disc.center).norm());
    }
    const auto center = darkness_center(image, disc, std::min(neighbour / 2, 1.9 * disc.radius_px + 2));
    if (!center || (*center - disc.center).norm() > 1.5) {
      return failure(Fault::kBoardNotFound, "circle {} is not whole", i + 1);
    }
    set.corners_px.push_back(*center);
    plane.emplace_back(board.corner(static_cast<int>(i)).head<2>());
  }
  const auto map = SmoothMap::fit(plane, set.corners_px);
  if (!map) return failure(Fault::kBoardNotFound, "the circles do not span a plane");
  for (std::size_t i = 0; i < plane.size(); ++i) {
    set.corners_px[i] -= center_shift(*map, plane[i], board.mark_size_m / 2);
    set.residual_rms_px += (map->straight(plane[i]) - set.corners_px[i]).squaredNorm();
  }
  set.residual_rms_px = std::sqrt(set.residual_rms_px / static_cast<double>(plane.size()));
  return set;
}

}  // namespace

Result<CornerSet> detect_circle_grid(GrayImage image, const BoardSpec& board) {
  if (const Status fine = check_board(board); !fine) return std::unexpected(fine.error());
  if (const Status fine = check_image(image); !fine) return std::unexpected(fine.error());
  try {
    cv::setNumThreads(1);  // results and memory must not depend on the number of cores
    return detect(image, board);
  } catch (const cv::Exception& e) {
    return failure(Fault::kBoardNotFound, "OpenCV: {}", e.err);
  } catch (const std::bad_alloc&) {
    return failure(Fault::kOutOfMemory, "searching circles in {}x{} pixels", image.width, image.height);
  }
}

}  // namespace firstlook
