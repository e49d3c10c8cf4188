/// Puts scattered image points into rows and columns, as corners or circles of a target stand.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <span>
#include <vector>

namespace firstlook {

/// A point that has found its place.
struct LatticePoint {
  int i = 0, j = 0;       ///< steps along the first and the second direction from the start
  std::size_t point = 0;  ///< index of the image point
};

/// Image points in buckets, to ask for the nearest one.
class PointIndex {
 public:
  /// Keeps a reference to the points. `bucket_px` is about the distance of neighbours.
  PointIndex(std::span<const Eigen::Vector2d> points, double bucket_px);
  [[nodiscard]] std::span<const Eigen::Vector2d> points() const { return points_; }
  /// Calls `visit(index)` for every point within `radius_px` of `at` (and some beyond), in a fixed order.
  template <typename Visit>
  void near(const Eigen::Vector2d& at, double radius_px, Visit visit) const {
    const int c0 = column(at.x() - radius_px), c1 = column(at.x() + radius_px);
    const int r0 = row(at.y() - radius_px), r1 = row(at.y() + radius_px);
    for (int r = r0; r <= r1; ++r) {
      for (int c = c0; c <= c1; ++c) {
        for (const std::size_t p :
             buckets_[static_cast<std::size_t>(r) * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(c)])
          visit(p);
      }
    }
  }

 private:
  [[nodiscard]] int column(double x) const;
  [[nodiscard]] int row(double y) const;
  std::span<const Eigen::Vector2d> points_;
  Eigen::Vector2d low_ = Eigen::Vector2d::Zero();
  double bucket_px_;
  int columns_ = 1, rows_ = 1;
  std::vector<std::vector<std::size_t>> buckets_;
};

/// Where to begin: a point and the steps to its neighbours in both directions.
struct LatticeSeed {
  std::size_t point = 0;
  Eigen::Vector2d step_i, step_j;
};

/// How a lattice grows.
struct LatticeGrowth {
  double tolerance = 0.3;  ///< how far from where it is looked for a neighbour may lie, in lengths of the step
  /// Whether point b can be a direct neighbour of point a.
  std::function<bool(std::size_t a, std::size_t b)> fits;
  /// Of several candidates the stronger wins over the nearer one; empty: all are alike.
  std::span<const float> strengths;
};

/// Grows from the seed, neighbour by neighbour, each looked for where the steps before it lead, so that perspective and
/// lens distortion may bend the rows. No place is taken twice and no point used twice.
[[nodiscard]] std::vector<LatticePoint> grow_lattice(const PointIndex& index, const LatticeSeed& seed,
                                                     const LatticeGrowth& how);

/// A place of a target: integer coordinates of one of its points.
struct LatticePlace {
  int i = 0, j = 0;
  bool operator==(const LatticePlace&) const = default;
};

/// One way of laying a target over a lattice.
struct LatticeMatch {
  std::vector<std::optional<std::size_t>> points;  ///< image point of each place; empty where the lattice has none
  std::size_t found = 0;                           ///< places that have one
};

/// All ways of laying the places over the grown lattice, turned by `quarter_turns`, that leave at most `missing_max`
/// places empty and have hardly any of the lattice's points beyond the target's edge (less than a quarter of a row or
/// column beside it); the fullest first. The image's y goes down, so turns keep x cross y away from the viewer.
[[nodiscard]] std::vector<LatticeMatch> match_lattice(std::span<const LatticePoint> grown,
                                                      std::span<const LatticePlace> places, int quarter_turns,
                                                      std::size_t missing_max = 0);

}  // namespace firstlook
