#include "algorithms/vision/lattice.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>

namespace firstlook {
namespace {

constexpr int kSideMax = 64;  // steps from the start each way; no target has as many

/// Cells of the plane of integers around the start.
class Field {
 public:
  Field() : node_(static_cast<std::size_t>((2 * kSideMax + 1) * (2 * kSideMax + 1)), -1) {}
  [[nodiscard]] static bool holds(int i, int j) { return std::abs(i) <= kSideMax && std::abs(j) <= kSideMax; }
  [[nodiscard]] int at(int i, int j) const { return holds(i, j) ? node_[cell(i, j)] : -1; }
  void set(int i, int j, int node) { node_[cell(i, j)] = node; }

 private:
  [[nodiscard]] static std::size_t cell(int i, int j) {
    return static_cast<std::size_t>((j + kSideMax) * (2 * kSideMax + 1) + i + kSideMax);
  }
  std::vector<int> node_;
};

struct Node {
  LatticePoint place;
  Eigen::Vector2d px;
  std::array<Eigen::Vector2d, 2> step;  ///< along i and j here
};

std::optional<std::size_t> best_near(const PointIndex& index, const Eigen::Vector2d& at, double radius_px,
                                     const std::vector<bool>& used, std::span<const float> strengths) {
  constexpr double kAtTheRim = 0.3;  // how much a candidate counts there, against one in the middle
  std::optional<std::size_t> best;
  double best_score = 0;
  index.near(at, radius_px, [&](std::size_t p) {
    const double share2 = (index.points()[p] - at).squaredNorm() / (radius_px * radius_px);
    if (used[p] || share2 > 1) return;
    const double score = (strengths.empty() ? 1.0 : strengths[p]) * (1 - (1 - kAtTheRim) * share2);
    if (score > best_score) best = p, best_score = score;
  });
  return best;
}

/// The place after `quarter_turns` of the lattice.
LatticePlace turned(int i, int j, int quarter_turns) {
  for (int t = 0; t < quarter_turns; ++t) {
    const int old_i = i;
    i = -j, j = old_i;
  }
  return {i, j};
}

struct Range {
  int low = 0, high = 0;
};

template <typename Places>
std::array<Range, 2> range_of(const Places& places) {
  std::array<Range, 2> r{Range{places[0].i, places[0].i}, Range{places[0].j, places[0].j}};
  for (const auto& p : places) {
    r[0] = {std::min(r[0].low, p.i), std::max(r[0].high, p.i)};
    r[1] = {std::min(r[1].low, p.j), std::max(r[1].high, p.j)};
  }
  return r;
}

/// A larger target holds a smaller one many times: its rows go on beyond the edge.
bool goes_on_beyond(const std::vector<LatticePlace>& taken, const std::array<Range, 2>& want, int di, int dj,
                    std::size_t found) {
  std::array<std::size_t, 4> beyond{};
  for (const LatticePlace& t : taken) {
    const int i = t.i - di, j = t.j - dj;
    const bool in_i = i >= want[0].low && i <= want[0].high, in_j = j >= want[1].low && j <= want[1].high;
    if (in_j && i == want[0].low - 1) ++beyond[0];
    if (in_j && i == want[0].high + 1) ++beyond[1];
    if (in_i && j == want[1].low - 1) ++beyond[2];
    if (in_i && j == want[1].high + 1) ++beyond[3];
  }
  const auto columns = static_cast<std::size_t>(want[0].high - want[0].low + 1);
  const auto rows = static_cast<std::size_t>(want[1].high - want[1].low + 1);
  return 4 * std::max(beyond[0], beyond[1]) >= rows + 3 || 4 * std::max(beyond[2], beyond[3]) >= columns + 3 ||
         taken.size() > found + (found + 3) / 4;
}

}  // namespace

PointIndex::PointIndex(std::span<const Eigen::Vector2d> points, double bucket_px)
    : points_(points), bucket_px_(std::max(1.0, bucket_px)) {
  if (!points.empty()) {
    Eigen::Vector2d high = points[0];
    low_ = points[0];
    for (const auto& p : points) low_ = low_.cwiseMin(p), high = high.cwiseMax(p);
    columns_ = static_cast<int>((high.x() - low_.x()) / bucket_px_) + 1;
    rows_ = static_cast<int>((high.y() - low_.y()) / bucket_px_) + 1;
  }
  buckets_.resize(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_));
  for (std::size_t p = 0; p < points.size(); ++p) {
    buckets_[static_cast<std::size_t>(row(points[p].y()) * columns_ + column(points[p].x()))].push_back(p);
  }
}

int PointIndex::column(double x) const {
  return static_cast<int>(std::clamp((x - low_.x()) / bucket_px_, 0.0, columns_ - 1.0));
}

int PointIndex::row(double y) const {
  return static_cast<int>(std::clamp((y - low_.y()) / bucket_px_, 0.0, rows_ - 1.0));
}

std::vector<LatticePoint> grow_lattice(const PointIndex& index, const LatticeSeed& seed, const LatticeGrowth& how) {
  std::vector<bool> used(index.points().size(), false);
  Field field;
  std::vector<Node> nodes{{{0, 0, seed.point}, index.points()[seed.point], {seed.step_i, seed.step_j}}};
  field.set(0, 0, 0);
  used[seed.point] = true;
  constexpr std::array<std::array<int, 2>, 4> kWays = {{{1, 0}, {0, 1}, {-1, 0}, {0, -1}}};
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    for (const auto& [di, dj] : kWays) {
      const Node from = nodes[n];  // a copy: the list grows
      const int i = from.place.i + di, j = from.place.j + dj;
      if (!Field::holds(i, j) || field.at(i, j) >= 0) continue;
      const std::size_t axis = di != 0 ? 0 : 1;
      const double sign = di + dj;
      Eigen::Vector2d step = sign * from.step[axis];
      // The step that led here along the same line, else the one beside it, is the better guide.
      const int behind = field.at(from.place.i - di, from.place.j - dj);
      if (behind >= 0) {
        step = from.px - nodes[static_cast<std::size_t>(behind)].px;
        // Perspective makes the steps of a row grow or shrink by nearly the same factor each time.
        const int further = field.at(from.place.i - 2 * di, from.place.j - 2 * dj);
        if (further >= 0) {
          const double before =
              (nodes[static_cast<std::size_t>(behind)].px - nodes[static_cast<std::size_t>(further)].px).norm();
          step *= std::clamp(step.norm() / std::max(1e-9, before), 0.75, 1.33);
        }
      } else {
        for (const int side : {1, -1}) {
          const int beside = field.at(from.place.i + side * dj, from.place.j + side * di);
          const int ahead = field.at(i + side * dj, j + side * di);
          if (beside < 0 || ahead < 0) continue;
          step = nodes[static_cast<std::size_t>(ahead)].px - nodes[static_cast<std::size_t>(beside)].px;
          break;
        }
      }
      const auto found = best_near(index, from.px + step, how.tolerance * step.norm(), used, how.strengths);
      if (!found || !how.fits(from.place.point, *found)) continue;
      Node next{{i, j, *found}, index.points()[*found], from.step};
      next.step[axis] = sign * (next.px - from.px);
      used[*found] = true;
      field.set(i, j, static_cast<int>(nodes.size()));
      nodes.push_back(next);
    }
  }
  std::vector<LatticePoint> grown;
  grown.reserve(nodes.size());
  for (const Node& node : nodes) grown.push_back(node.place);
  return grown;
}

std::vector<LatticeMatch> match_lattice(std::span<const LatticePoint> grown, std::span<const LatticePlace> places,
                                        int quarter_turns, std::size_t missing_max) {
  std::vector<LatticeMatch> matches;
  // Too small, or so large that it goes on beyond the edge wherever the places lie in it.
  if (grown.size() + missing_max < places.size() || grown.size() > places.size() + (places.size() + 3) / 4) {
    return matches;
  }
  std::vector<LatticePlace> taken;
  std::map<std::pair<int, int>, std::size_t> point_at;
  for (const LatticePoint& p : grown) {
    const LatticePlace t = turned(p.i, p.j, quarter_turns);
    taken.push_back(t);
    point_at[{t.i, t.j}] = p.point;
  }
  const auto have = range_of(taken), want = range_of(places);
  const int slack = missing_max > 0 ? 2 : 0;  // rows or columns that may be missing at an edge
  for (int dj = have[1].low - want[1].low - slack; dj <= have[1].high - want[1].high + slack; ++dj) {
    for (int di = have[0].low - want[0].low - slack; di <= have[0].high - want[0].high + slack; ++di) {
      LatticeMatch match;
      for (const LatticePlace& place : places) {
        const auto found = point_at.find({place.i + di, place.j + dj});
        if (found == point_at.end() && ++match.found > missing_max) break;
        match.points.push_back(found == point_at.end() ? std::nullopt : std::optional(found->second));
      }
      if (match.points.size() < places.size()) continue;
      match.found = places.size() - match.found;
      if (goes_on_beyond(taken, want, di, dj, match.found)) continue;
      matches.push_back(std::move(match));
    }
  }
  std::stable_sort(matches.begin(), matches.end(),
                   [](const LatticeMatch& a, const LatticeMatch& b) { return a.found > b.found; });
  return matches;
}

}  // namespace firstlook
