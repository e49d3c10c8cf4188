#include "algorithms/vision/lattice.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

namespace firstlook {
namespace {

constexpr int kSideMax = 64;  // steps from the start each way; no target has as many

constexpr bool is_in_field(int i, int j) { return std::abs(i) <= kSideMax && std::abs(j) <= kSideMax; }

constexpr std::size_t field_cell(int i, int j) {
  return static_cast<std::size_t>((j + kSideMax) * (2 * kSideMax + 1) + i + kSideMax);
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
    : points_(points), per_px_(1 / std::max(1.0, bucket_px)), entries_(points.size()) {
  if (!points.empty()) {
    Eigen::Vector2d high = points[0];
    low_ = points[0];
    for (const auto& p : points) low_ = low_.cwiseMin(p), high = high.cwiseMax(p);
    columns_ = static_cast<int>((high.x() - low_.x()) * per_px_) + 1;
    rows_ = static_cast<int>((high.y() - low_.y()) * per_px_) + 1;
  }
  // Sorted by counting.
  first_.assign(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_) + 1, 0);
  for (const auto& p : points) ++first_[bucket(column(p.x()), row(p.y())) + 1];
  std::partial_sum(first_.begin(), first_.end(), first_.begin());
  std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
  for (std::size_t p = 0; p < points.size(); ++p) {
    entries_[next[bucket(column(points[p].x()), row(points[p].y()))]++] = {points[p], static_cast<std::uint32_t>(p)};
  }
}

LatticeGrower::LatticeGrower(const PointIndex& index)
    : index_(index), used_(index.points().size(), 0), field_(field_cell(kSideMax, kSideMax) + 1, -1) {}

int LatticeGrower::node_at(int i, int j) const { return is_in_field(i, j) ? field_[field_cell(i, j)] : -1; }

const Eigen::Vector2d& LatticeGrower::px(int node) const {
  return index_.points()[nodes_[static_cast<std::size_t>(node)].point];
}

void LatticeGrower::add(const LatticePoint& point, const Steps& steps) {
  used_[point.point] = 1;
  field_[field_cell(point.i, point.j)] = static_cast<int>(nodes_.size());
  nodes_.push_back(point);
  steps_.push_back(steps);
}

void LatticeGrower::clear() {
  for (const LatticePoint& node : nodes_) {
    used_[node.point] = 0;
    field_[field_cell(node.i, node.j)] = -1;
  }
  nodes_.clear();
  steps_.clear();
}

std::optional<std::size_t> LatticeGrower::best_near(const Eigen::Vector2d& at, double radius_px,
                                                    std::span<const float> strengths) const {
  constexpr double kAtTheRim = 0.3;  // how much a candidate counts there, against one in the middle
  const double radius2 = radius_px * radius_px;
  std::optional<std::size_t> best;
  double best_score = 0;
  index_.near(at, radius_px, [&](std::size_t p, const Eigen::Vector2d& place) {
    const double distance2 = (place - at).squaredNorm();
    if ((distance2 > radius2) | (used_[p] != 0)) return;
    const double score = (strengths.empty() ? 1.0 : strengths[p]) * (1 - (1 - kAtTheRim) * (distance2 / radius2));
    if (score > best_score) best = p, best_score = score;
  });
  return best;
}

/// Where the next point is looked for, from node `n` one place along (di, dj).
Eigen::Vector2d LatticeGrower::step_from(std::size_t n, int di, int dj) const {
  const LatticePoint& from = nodes_[n];
  // The step that led here along the same line, else the one beside it, is the better guide.
  const int behind = node_at(from.i - di, from.j - dj);
  if (behind >= 0) {
    Eigen::Vector2d step = px(static_cast<int>(n)) - px(behind);
    const int further = node_at(from.i - 2 * di, from.j - 2 * dj);
    if (further < 0) return step;
    // Perspective makes the steps of a row grow or shrink by nearly the same factor each time.
    const double before = (px(behind) - px(further)).norm();
    return step * std::clamp(step.norm() / std::max(1e-9, before), 0.75, 1.33);
  }
  for (const int side : {1, -1}) {
    const int beside = node_at(from.i + side * dj, from.j + side * di);
    const int ahead = node_at(from.i + di + side * dj, from.j + dj + side * di);
    if (beside >= 0 && ahead >= 0) return px(ahead) - px(beside);
  }
  return (di + dj) * steps_[n][di != 0 ? 0 : 1];
}

std::span<const LatticePoint> LatticeGrower::grow(const LatticeSeed& seed, const LatticeGrowth& how) {
  constexpr std::array<std::array<int, 2>, 4> kWays = {{{1, 0}, {0, 1}, {-1, 0}, {0, -1}}};
  clear();
  add({0, 0, seed.point}, {seed.step_i, seed.step_j});
  for (std::size_t n = 0; n < nodes_.size() && nodes_.size() <= how.size_max; ++n) {
    for (const auto& [di, dj] : kWays) {
      const LatticePoint from = nodes_[n];  // a copy: the list grows
      const int i = from.i + di, j = from.j + dj;
      if (!is_in_field(i, j) || node_at(i, j) >= 0) continue;
      const Eigen::Vector2d step = step_from(n, di, dj);
      const Eigen::Vector2d& from_px = index_.points()[from.point];
      const auto found = best_near(from_px + step, how.tolerance * step.norm(), how.strengths);
      if (!found || !how.fits(from.point, *found)) continue;
      Steps steps = steps_[n];
      steps[di != 0 ? 0 : 1] = (di + dj) * (index_.points()[*found] - from_px);
      add({i, j, *found}, steps);
    }
  }
  return nodes_;
}

std::vector<LatticeMatch> match_lattice(std::span<const LatticePoint> grown, std::span<const LatticePlace> places,
                                        int quarter_turns, std::size_t missing_max) {
  std::vector<LatticeMatch> matches;
  // Too small, or so large that it goes on beyond the edge wherever the places lie in it.
  if (grown.size() + missing_max < places.size() || grown.size() > lattice_size_max(places.size())) {
    return matches;
  }
  std::vector<LatticePlace> taken;
  taken.reserve(grown.size());
  for (const LatticePoint& p : grown) taken.push_back(turned(p.i, p.j, quarter_turns));
  const auto have = range_of(taken), want = range_of(places);
  // The lattice's points by their places, row by row.
  constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();
  const auto width = static_cast<std::size_t>(have[0].high - have[0].low + 1);
  const auto height = static_cast<std::size_t>(have[1].high - have[1].low + 1);
  std::vector<std::size_t> point_at(width * height, kNone);
  const auto cell = [&](int i, int j) {
    return static_cast<std::size_t>(j - have[1].low) * width + static_cast<std::size_t>(i - have[0].low);
  };
  const auto find = [&](int i, int j) {
    const bool in = i >= have[0].low && i <= have[0].high && j >= have[1].low && j <= have[1].high;
    return in ? point_at[cell(i, j)] : kNone;
  };
  for (std::size_t k = 0; k < taken.size(); ++k) point_at[cell(taken[k].i, taken[k].j)] = grown[k].point;
  const int slack = missing_max > 0 ? 2 : 0;  // rows or columns that may be missing at an edge
  for (int dj = have[1].low - want[1].low - slack; dj <= have[1].high - want[1].high + slack; ++dj) {
    for (int di = have[0].low - want[0].low - slack; di <= have[0].high - want[0].high + slack; ++di) {
      LatticeMatch match;
      for (const LatticePlace& place : places) {
        const std::size_t found = find(place.i + di, place.j + dj);
        if (found == kNone && ++match.found > missing_max) break;
        match.points.push_back(found == kNone ? std::nullopt : std::optional(found));
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
