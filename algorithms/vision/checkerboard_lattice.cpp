#include "algorithms/vision/checkerboard_lattice.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "algorithms/vision/gray_sampling.hpp"
#include "algorithms/vision/homography.hpp"
#include "algorithms/vision/lattice.hpp"

namespace firstlook {
namespace {

/// Unit vectors along the two edges that cross at a saddle: where the second derivative vanishes.
std::array<Eigen::Vector2d, 2> edge_directions(const SaddlePoint& s) {
  // In the frame of the main curvatures k1 > 0 > k2 the edges lie at +- atan(sqrt(-k1 / k2)) from the first.
  const double mean = (s.xx + s.yy) / 2.0, half = (s.xx - s.yy) / 2.0, xy = s.xy;
  const double radius = std::hypot(half, xy);
  const double main_angle = std::atan2(xy, half) / 2, k1 = mean + radius, k2 = mean - radius;
  const double beside = std::atan(std::sqrt(std::max(0.0, k1) / std::max(1e-9, -k2)));
  return {Eigen::Vector2d(std::cos(main_angle + beside), std::sin(main_angle + beside)),
          Eigen::Vector2d(std::cos(main_angle - beside), std::sin(main_angle - beside))};
}

/// Twice the angle of the main curvature as a unit vector: the diagonal on which the dark squares lie.
Eigen::Vector2d dark_diagonal(const SaddlePoint& s) { return Eigen::Vector2d(s.xx - s.yy, 2 * s.xy).normalized(); }

class Search {
 public:
  Search(GrayImage image, const SaddlePoints& saddles, const BoardSpec& board)
      : image_(image),
        saddles_(saddles),
        board_(board),
        points_(points_of(saddles)),
        index_(points_, kBucket_px),
        grower_(index_) {
    for (const SaddlePoint& s : saddles_) {
      strengths_.push_back(s.xy * s.xy - s.xx * s.yy);
      diagonals_.push_back(dark_diagonal(s));
    }
    for (int row = 0; row < board.inner_rows; ++row) {
      for (int column = 0; column < board.inner_columns; ++column) places_.push_back({column, row});
    }
  }

  std::vector<Eigen::Vector2d> run() {
    std::vector<bool> tried(points_.size(), false);
    int fruitless = 0;
    for (std::size_t p = 0; p < points_.size() && fruitless < kFruitlessMax; ++p) {
      if (tried[p]) continue;
      const auto seed = seed_at(p);
      if (!seed) continue;
      const auto alternate = [this](std::size_t a, std::size_t b) { return colours_alternate(a, b); };
      const auto grown = grower_.grow(*seed, {kTolerance, alternate, strengths_});
      const int size = static_cast<int>(grown.size());
      // Points of a good lattice need not be tried again; those of a small one may have had a bad start.
      if (size >= kGoodLattice) {
        for (const LatticePoint& g : grown) tried[g.point] = true;
      }
      if (size >= board_.corners() / 2) ++fruitless;
      for (int turns = 0; turns < 4; ++turns) {
        const auto missing_max = static_cast<std::size_t>(board_.corners() / 4);
        std::vector<LatticeMatch> matches = match_lattice(grown, places_, turns, missing_max);
        matches.resize(std::min(matches.size(), kMatchesMax));
        for (LatticeMatch& match : matches) {
          auto corners_px = complete(std::move(match));
          if (!corners_px.empty()) return corners_px;
        }
      }
    }
    return {};
  }

 private:
  static constexpr double kBucket_px = 12;
  static constexpr double kTolerance = 0.3;  // of a step
  static constexpr int kGoodLattice = 9;
  static constexpr int kFruitlessMax = 4;  // large lattices that were not the board
  static constexpr std::size_t kMatchesMax = 4, kStraysMax = 8;

  static std::vector<Eigen::Vector2d> points_of(const SaddlePoints& saddles) {
    std::vector<Eigen::Vector2d> points;
    points.reserve(saddles.size());
    for (const SaddlePoint& s : saddles) points.emplace_back(s.u, s.v);
    return points;
  }

  /// Neighbouring corners have their dark squares on crossed diagonals.
  [[nodiscard]] bool colours_alternate(std::size_t a, std::size_t b) const {
    return diagonals_[a].dot(diagonals_[b]) < -0.2;
  }

  /// The corners of a match, missing ones where the others put them; empty when there is no corner at such a place.
  [[nodiscard]] std::vector<Eigen::Vector2d> complete(LatticeMatch match) const {
    drop_strays(match);
    std::vector<Eigen::Vector2d> corners(match.points.size());
    for (std::size_t i = 0; i < corners.size(); ++i) {
      if (match.points[i]) corners[i] = points_[*match.points[i]];
    }
    if (match.found == corners.size()) return corners;
    for (std::size_t i = 0; i < corners.size(); ++i) {
      if (match.points[i]) continue;
      const auto h = homography_around(match, i);
      if (!h || !looks_like_corner(*h, places_[i])) return {};
      corners[i] = apply_homography(*h, Eigen::Vector2d(places_[i].i, places_[i].j));
    }
    return corners;
  }

  /// How far a corner lies from the middle of its two neighbours in a row or column, the worst of both, in their
  /// spacings; 0 at the board's edge.
  [[nodiscard]] double bend_at(const LatticeMatch& match, std::size_t i) const {
    const int columns = board_.inner_columns, column = places_[i].i, row = places_[i].j;
    double bend = 0;
    const auto check = [&](std::size_t before, std::size_t after) {
      if (!match.points[before] || !match.points[i] || !match.points[after]) return;
      const Eigen::Vector2d a = points_[*match.points[before]], c = points_[*match.points[after]];
      bend = std::max(bend, ((a + c) / 2 - points_[*match.points[i]]).norm() / std::max(1e-9, (c - a).norm() / 2));
    };
    const auto width = static_cast<std::size_t>(columns);
    if (column > 0 && column + 1 < columns) check(i - 1, i + 1);
    if (row > 0 && row + 1 < board_.inner_rows) check(i - width, i + width);
    return bend;
  }

  /// Distance of a found corner from where its neighbours' homography puts it, in spacings.
  [[nodiscard]] double off_neighbours(const LatticeMatch& match, std::size_t i) const {
    if (!match.points[i]) return 0;
    const auto h = homography_around(match, i);
    if (!h) return 0;
    const Eigen::Vector2d place(places_[i].i, places_[i].j), here = apply_homography(*h, place);
    const double spacing = std::min((apply_homography(*h, place + Eigen::Vector2d(1, 0)) - here).norm(),
                                    (apply_homography(*h, place + Eigen::Vector2d(0, 1)) - here).norm());
    return (here - points_[*match.points[i]]).norm() / std::max(1e-9, spacing);
  }

  /// Takes out saddle points beside the true corners: those that lie off the homography of their neighbours, worst
  /// first. Looked for only where rows or columns bend.
  void drop_strays(LatticeMatch& match) const {
    constexpr double kBendMax = 0.15, kStrayMin = 0.15;  // spacings
    constexpr std::size_t kSuspectsMax = 40;
    for (std::size_t dropped = 0; dropped < kStraysMax; ++dropped) {
      std::vector<bool> suspect(match.points.size(), false);
      std::size_t suspects = 0;
      for (std::size_t i = 0; i < match.points.size(); ++i) {
        if (bend_at(match, i) <= kBendMax) continue;
        const auto columns = static_cast<std::ptrdiff_t>(board_.inner_columns);
        // The bend may be the fault of any corner of the two triples.
        for (const std::ptrdiff_t k : {std::ptrdiff_t{0}, std::ptrdiff_t{-1}, std::ptrdiff_t{1}, -columns, columns}) {
          const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(i) + k;
          if (at < 0 || at >= static_cast<std::ptrdiff_t>(match.points.size())) continue;
          suspects += suspect[static_cast<std::size_t>(at)] ? 0 : 1;
          suspect[static_cast<std::size_t>(at)] = true;
        }
      }
      // A board with as many is none, and would cost too much time.
      if (suspects == 0 || suspects > kSuspectsMax) return;
      std::optional<std::size_t> worst;
      double worst_off = kStrayMin;
      for (std::size_t i = 0; i < match.points.size(); ++i) {
        const double off = suspect[i] ? off_neighbours(match, i) : 0;
        if (off > worst_off) worst = i, worst_off = off;
      }
      if (!worst) return;
      match.points[*worst].reset();
      --match.found;
    }
  }

  /// Squares to pixels from the dozen found corners nearest to a place: lens distortion bends little over them.
  [[nodiscard]] std::optional<Eigen::Matrix3d> homography_around(const LatticeMatch& match, std::size_t i) const {
    std::vector<std::pair<int, std::size_t>> nearest;
    for (std::size_t k = 0; k < match.points.size(); ++k) {
      const int di = places_[k].i - places_[i].i, dj = places_[k].j - places_[i].j;
      if (match.points[k] && k != i) nearest.emplace_back(di * di + dj * dj, k);
    }
    constexpr std::size_t kNearest = 12;
    std::sort(nearest.begin(), nearest.end());
    nearest.resize(std::min(kNearest, nearest.size()));
    std::vector<Eigen::Vector2d> squares, pixels;
    for (const auto& [distance, k] : nearest) {
      squares.emplace_back(places_[k].i, places_[k].j);
      pixels.push_back(points_[*match.points[k]]);
    }
    return fit_homography(squares, pixels);
  }

  /// Black and white alternate in the four squares around a place, a third of a square away from it.
  [[nodiscard]] bool looks_like_corner(const Eigen::Matrix3d& h, const LatticePlace& place) const {
    constexpr double kContrastMin = 8;  // grey levels
    const auto gray = [&](double di, double dj) {
      double sum = 0;
      for (const double scale : {0.25, 0.35, 0.45}) {
        const Eigen::Vector2d at = apply_homography(h, {place.i + scale * di, place.j + scale * dj});
        if (at.x() < 0 || at.y() < 0 || at.x() > image_.width - 1 || at.y() > image_.height - 1) return -1e3;
        sum += gray_between(image_, at) / 3;
      }
      return sum;
    };
    const double a = gray(1, 1), b = gray(-1, -1), c = gray(1, -1), d = gray(-1, 1);
    if (std::min({a, b, c, d}) < 0) return false;
    return std::min(a, b) - std::max(c, d) > kContrastMin || std::min(c, d) - std::max(a, b) > kContrastMin;
  }

  /// The nearest neighbours with crossed colours along both edges of a point, either way, with x cross y away from the
  /// viewer (clockwise in the picture).
  [[nodiscard]] std::optional<LatticeSeed> seed_at(std::size_t p) const {
    constexpr double kCone = 0.94;  // cosine of 20 degrees
    constexpr double kStepMin_px = 3;
    constexpr double kRatioMax = 3.5;  // tilt shortens one of them
    const auto directions = edge_directions(saddles_[p]);
    std::array<std::optional<Eigen::Vector2d>, 2> steps;
    for (double radius = 2 * kBucket_px; radius <= 16 * kBucket_px && !(steps[0] && steps[1]); radius *= 2) {
      std::array<double, 2> nearest2{};
      for (std::size_t k = 0; k < 2; ++k) nearest2[k] = steps[k] ? steps[k]->squaredNorm() : radius * radius;
      index_.near(points_[p], radius, [&](std::size_t q, const Eigen::Vector2d& at) {
        const Eigen::Vector2d step = at - points_[p];
        const double length2 = step.squaredNorm();
        if (length2 >= std::max(nearest2[0], nearest2[1]) || length2 < kStepMin_px * kStepMin_px) return;
        for (std::size_t k = 0; k < 2; ++k) {
          const double along = step.dot(directions[k]);
          if (length2 >= nearest2[k] || along * along < kCone * kCone * length2) continue;
          if (!colours_alternate(p, q)) return;
          nearest2[k] = length2;
          steps[k] = along > 0 ? step : Eigen::Vector2d(-step);
        }
      });
      const auto& found = steps[0] ? steps[0] : steps[1];
      if (found && radius > kRatioMax * found->norm()) break;  // one that is farther would not do
    }
    if (!steps[0] || !steps[1]) return std::nullopt;
    const Eigen::Vector2d &a = *steps[0], &b = *steps[1];
    const double ratio = a.norm() / b.norm();
    if (ratio > kRatioMax || ratio < 1 / kRatioMax) return std::nullopt;
    const double turn = a.x() * b.y() - a.y() * b.x();
    if (std::abs(turn) < 0.25 * a.norm() * b.norm()) return std::nullopt;
    return turn > 0 ? LatticeSeed{p, a, b} : LatticeSeed{p, b, a};
  }

  GrayImage image_;
  const SaddlePoints& saddles_;
  const BoardSpec& board_;
  std::vector<Eigen::Vector2d> points_;
  PointIndex index_;
  LatticeGrower grower_;
  std::vector<float> strengths_;
  std::vector<Eigen::Vector2d> diagonals_;
  std::vector<LatticePlace> places_;
};

}  // namespace

std::vector<Eigen::Vector2d> find_checkerboard_lattice(GrayImage image, const SaddlePoints& saddles,
                                                       const BoardSpec& board) {
  if (saddles.empty()) return {};
  return Search(image, saddles, board).run();
}

}  // namespace firstlook
