/// Puts scattered image points into rows and columns, as corners or circles of a target stand.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "platform/core/function_ref.hpp"

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
  /// Calls `visit(index, place)` for every point within `radius_px` of `at` (and some beyond), in a fixed order.
  template <typename Visit>
  void near(const Eigen::Vector2d& at, double radius_px, Visit visit) const {
    const int c0 = column(at.x() - radius_px), c1 = column(at.x() + radius_px);
    const int r0 = row(at.y() - radius_px), r1 = row(at.y() + radius_px);
    for (int r = r0; r <= r1; ++r) {
      for (std::uint32_t k = first_[bucket(c0, r)]; k < first_[bucket(c1, r) + 1]; ++k) {
        visit(std::size_t{entries_[k].point}, entries_[k].at);
      }
    }
  }

 private:
  struct Entry {
    Eigen::Vector2d at;
    std::uint32_t point = 0;
  };
  [[nodiscard]] int column(double x) const {
    return static_cast<int>(std::clamp((x - low_.x()) * per_px_, 0.0, columns_ - 1.0));
  }
  [[nodiscard]] int row(double y) const {
    return static_cast<int>(std::clamp((y - low_.y()) * per_px_, 0.0, rows_ - 1.0));
  }
  [[nodiscard]] std::size_t bucket(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(column);
  }
  std::span<const Eigen::Vector2d> points_;
  Eigen::Vector2d low_ = Eigen::Vector2d::Zero();
  double per_px_;  ///< buckets
  int columns_ = 1, rows_ = 1;
  std::vector<Entry> entries_;        ///< bucket by bucket
  std::vector<std::uint32_t> first_;  ///< entry of each bucket, and the end
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
  FunctionRef<bool(std::size_t a, std::size_t b)> fits;
  /// Of several candidates the stronger wins over the nearer one; empty: all are alike.
  std::span<const float> strengths;
  /// A lattice of more points is not grown any further: it is too large already.
  std::size_t size_max = std::numeric_limits<std::size_t>::max();
};

/// Grows lattices among the same points, one after the other.
class LatticeGrower {
 public:
  /// Keeps a reference to the index.
  explicit LatticeGrower(const PointIndex& index);

  /// Grows from the seed, neighbour by neighbour, each looked for where the steps before it lead, so that perspective
  /// and lens distortion may bend the rows. No place is taken twice and no point used twice. Valid until the next call.
  [[nodiscard]] std::span<const LatticePoint> grow(const LatticeSeed& seed, const LatticeGrowth& how);

 private:
  /// Along i and j.
  using Steps = std::array<Eigen::Vector2d, 2>;
  [[nodiscard]] Eigen::Vector2d step_from(std::size_t n, int di, int dj) const;
  [[nodiscard]] std::optional<std::size_t> best_near(const Eigen::Vector2d& at, double radius_px,
                                                     std::span<const float> strengths) const;
  [[nodiscard]] int node_at(int i, int j) const;
  [[nodiscard]] const Eigen::Vector2d& px(int node) const;
  void add(const LatticePoint& point, const Steps& steps);
  void clear();

  const PointIndex& index_;
  std::vector<std::uint8_t> used_;  ///< 1 for points that have a place
  std::vector<int> field_;          ///< node at each place, or -1
  std::vector<LatticePoint> nodes_;
  std::vector<Steps> steps_;  ///< at each node
};

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

/// The largest lattice that match_lattice matches with so many places: a larger one goes on beyond the target's edge.
[[nodiscard]] constexpr std::size_t lattice_size_max(std::size_t places) { return places + (places + 3) / 4; }

/// All ways of laying the places over the grown lattice, turned by `quarter_turns`, that leave at most `missing_max`
/// places empty and have hardly any of the lattice's points beyond the target's edge (less than a quarter of a row or
/// column beside it); the fullest first. The image's y goes down, so turns keep x cross y away from the viewer.
[[nodiscard]] std::vector<LatticeMatch> match_lattice(std::span<const LatticePoint> grown,
                                                      std::span<const LatticePlace> places, int quarter_turns,
                                                      std::size_t missing_max = 0);

}  // namespace firstlook
