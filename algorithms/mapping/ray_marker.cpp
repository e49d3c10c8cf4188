#include "algorithms/mapping/ray_marker.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "platform/core/fixed_vector.hpp"
#include "platform/core/processor.hpp"

namespace firstlook {
namespace {

constexpr int kFieldBits = 21;
constexpr std::int64_t kFieldBias = 1 << 18;  // more than OctoMap's 65536 keys on either side of the grid
constexpr std::uint64_t kGuard = 1ULL << (kFieldBits - 1);
constexpr std::uint64_t kGuards = kGuard | (kGuard << kFieldBits) | (kGuard << (2 * kFieldBits));

std::uint64_t pack(std::int64_t x, std::int64_t y, std::int64_t z) {
  return static_cast<std::uint64_t>(x) + (static_cast<std::uint64_t>(y) << kFieldBits) +
         (static_cast<std::uint64_t>(z) << (2 * kFieldBits));
}

std::uint64_t pack_biased(const Eigen::Vector3i& v) {
  return pack(v.x() + kFieldBias, v.y() + kFieldBias, v.z() + kFieldBias);
}

// The walk may step past the end by one voxel of rounding: a ray stays inside when its ends keep this far from the
// faces.
bool well_inside(const GridGeometry& geometry, const Eigen::Vector3i& v) {
  return (v.array() >= 1).all() && ((geometry.size - v).array() >= 2).all();
}

// Four rays side by side: AVX2 registers, or what the compiler makes of them elsewhere; the same bits.
constexpr std::size_t kTogether = 4;
using Doubles [[gnu::vector_size(32)]] = double;
using Longs [[gnu::vector_size(32)]] = std::int64_t;
struct Walks {
  Doubles next[3], delta[3], length;
  Longs index, index_step[3], index_end, steps;
};

[[gnu::always_inline]] inline void set_bits(const Longs& index, std::uint64_t* plane) {
  for (std::size_t i = 0; i < kTogether; ++i) {
    const auto bit = static_cast<std::uint64_t>(index[i]);
    plane[bit >> 6] |= 1ULL << (bit & 63);
  }
}
/// RayMarker::walk without its branches.
[[gnu::always_inline]] inline void walk_four(const Walks& w, std::uint64_t* plane) {
  Doubles x = w.next[0], y = w.next[1], z = w.next[2];
  Longs index = w.index, last = w.index, step = {}, active = step - 1;
  set_bits(last, plane);
  while (true) {
    const Longs along_x = (x < y) & (x < z), along_y = ~(x < y) & (y < z), along_z = ~along_x & ~along_y;
    x += along_x ? w.delta[0] : Doubles{};
    y += along_y ? w.delta[1] : Doubles{};
    z += along_z ? w.delta[2] : Doubles{};
    index += (along_x & w.index_step[0]) | (along_y & w.index_step[1]) | (along_z & w.index_step[2]);
    step += 1;
    active &= ~((step == w.steps) & (index == w.index_end)) & ((x <= w.length) | (y <= w.length) | (z <= w.length));
    if ((active[0] | active[1] | active[2] | active[3]) == 0) return;
    last = active ? index : last;
    set_bits(last, plane);
  }
}
FIRSTLOOK_AVX2 void walk_four_avx2(const Walks& w, std::uint64_t* plane) { walk_four(w, plane); }
void walk_four_portable(const Walks& w, std::uint64_t* plane) { walk_four(w, plane); }

}  // namespace

RayMarker::RayMarker(const GridGeometry& geometry, const Eigen::Vector3f& origin_m, std::span<std::uint64_t> plane)
    : geometry_(geometry), plane_(plane), origin_m_(origin_m), origin_(octomap_voxel(geometry, origin_m)) {
  const double half_m = static_cast<double>(static_cast<float>(geometry.resolution_m * 0.5));
  for (int axis = 0; axis < 3; ++axis) {
    const double center_m = (static_cast<double>(origin_[axis] + geometry.first[axis]) + 0.5) * geometry.resolution_m;
    to_lower_m_[axis] = (center_m - half_m) - static_cast<double>(origin_m[axis]);
    to_upper_m_[axis] = (center_m + half_m) - static_cast<double>(origin_m[axis]);
  }
  origin_index_ =
      (static_cast<std::int64_t>(origin_.z()) * geometry.size.y() + origin_.y()) * geometry.size.x() + origin_.x();
  packed_origin_ = pack_biased(origin_);
  const auto guard = static_cast<std::int64_t>(kGuard);
  over_low_ = pack(guard - kFieldBias, guard - kFieldBias, guard - kFieldBias);
  over_high_ = pack(guard - kFieldBias - geometry.size.x(), guard - kFieldBias - geometry.size.y(),
                    guard - kFieldBias - geometry.size.z());
  origin_inside_ = well_inside(geometry, origin_);
}

// Outside the grid it is no index, but steps lead from it to one.
std::int64_t RayMarker::index_of(const Eigen::Vector3i& v) const {
  return (static_cast<std::int64_t>(v.z()) * geometry_.size.y() + v.y()) * geometry_.size.x() + v.x();
}

// A field plus `over` carries into its guard bit when the coordinate is at least 0 (low) or at least the size (high).
bool RayMarker::in_grid(std::uint64_t packed) const {
  return ((packed + over_low_) & ~(packed + over_high_) & kGuards) == kGuards;
}

RayMarker::Walk RayMarker::start(const Eigen::Vector3f& end_m, const Eigen::Vector3i& end) const {
  Eigen::Vector3f direction = end_m - origin_m_;
  const float norm_squared =
      direction.x() * direction.x() + direction.y() * direction.y() + direction.z() * direction.z();
  const float length = static_cast<float>(std::sqrt(static_cast<double>(norm_squared)));
  for (int axis = 0; axis < 3; ++axis) direction[axis] /= length;

  const std::array<std::int64_t, 3> index_stride = {1, geometry_.size.x(),
                                                    static_cast<std::int64_t>(geometry_.size.x()) * geometry_.size.y()};
  Walk w;
  w.length = static_cast<double>(length);
  w.steps = (end - origin_).cwiseAbs().sum();
  w.packed_end = pack_biased(end);
  w.index_end = index_of(end);
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    const auto along = static_cast<double>(direction[axis]);
    w.next[i] = w.delta[i] = std::numeric_limits<double>::max();
    if (along == 0) continue;
    w.next[i] = (along > 0 ? to_upper_m_[axis] : to_lower_m_[axis]) / along;
    w.delta[i] = geometry_.resolution_m / std::abs(along);
    w.index_step[i] = along > 0 ? index_stride[i] : -index_stride[i];
    const std::uint64_t one = 1ULL << (static_cast<unsigned>(axis) * kFieldBits);
    w.packed_step[i] = along > 0 ? one : 0 - one;
  }
  return w;
}

void RayMarker::mark_passed(const Eigen::Vector3f& end_m) {
  const Eigen::Vector3i end = octomap_voxel(geometry_, end_m);
  if (end == origin_) return;
  const Walk w = start(end_m, end);
  if (origin_inside_ && well_inside(geometry_, end))
    walk<false>(w);
  else
    walk<true>(w);
}

void RayMarker::mark_all_passed(std::span<const Eigen::Vector3f> ends_m) {
  FixedVector<Walk, kTogether> together;
  for (const Eigen::Vector3f& end_m : ends_m) {
    const Eigen::Vector3i end = octomap_voxel(geometry_, end_m);
    if (end == origin_) continue;
    if (!origin_inside_ || !well_inside(geometry_, end)) {
      walk<true>(start(end_m, end));
      continue;
    }
    together.push_back(start(end_m, end));
    if (!together.full()) continue;
    walk_together({together.begin(), together.size()});
    together.clear();
  }
  if (!together.empty()) walk_together({together.begin(), together.size()});
}

void RayMarker::walk_together(std::span<const Walk> walks) {
  Walks all;
  for (std::size_t lane = 0; lane < kTogether; ++lane) {
    const Walk& w = walks[std::min(lane, walks.size() - 1)];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      all.next[axis][lane] = w.next[axis];
      all.delta[axis][lane] = w.delta[axis];
      all.index_step[axis][lane] = w.index_step[axis];
    }
    all.length[lane] = w.length;
    all.index[lane] = origin_index_;
    all.index_end[lane] = w.index_end;
    all.steps[lane] = w.steps;
  }
  has_avx2() ? walk_four_avx2(all, plane_.data()) : walk_four_portable(all, plane_.data());
}

bool RayMarker::passes(const Eigen::Vector3f& end_m, const Eigen::Vector3i& voxel) const {
  const Eigen::Vector3i end = octomap_voxel(geometry_, end_m);
  if (end == origin_) return false;
  Walk w = start(end_m, end);
  Eigen::Vector3i at = origin_;
  // Every step leads away from the origin: so many steps lead to the voxel, or past it.
  const int needed = (voxel - origin_).cwiseAbs().sum();
  for (int step = 1; step <= needed; ++step) {
    const auto& [x, y, z] = w.next;
    const std::size_t axis = x < y && x < z ? 0 : !(x < y) && y < z ? 1 : 2;
    w.next[axis] += w.delta[axis];
    at[static_cast<int>(axis)] += w.index_step[axis] > 0 ? 1 : -1;
    if (at == end || std::min({w.next[0], w.next[1], w.next[2]}) > w.length) return false;
  }
  return at == voxel;
}

// OctoMap stops at the end's voxel, or where the next boundary lies beyond the ray's length (rounding can lead past the
// end's voxel). The end's voxel can only be met after as many steps as it is voxels away along the axes together.
template <bool kClip>
void RayMarker::walk(Walk w) {
  std::int64_t index = origin_index_;
  std::uint64_t packed = packed_origin_;
  double x = w.next[0], y = w.next[1], z = w.next[2];
  const auto mark = [&] {
    plane_[static_cast<std::size_t>(index) >> 6] |= 1ULL << (static_cast<std::uint64_t>(index) & 63);
  };
  const auto advance = [&](std::size_t axis, double& next) {
    next += w.delta[axis];
    index += w.index_step[axis];
    if constexpr (kClip) packed += w.packed_step[axis];
  };
  bool was_inside = !kClip || in_grid(packed);
  if (was_inside) mark();
  for (int step = 1;; ++step) {
    // Ties as OctoMap breaks them.
    if (x < y && x < z) {
      advance(0, x);
    } else if (!(x < y) && y < z) {
      advance(1, y);
    } else {
      advance(2, z);
    }
    if (step == w.steps && (kClip ? packed == w.packed_end : index == w.index_end)) return;
    if (std::min(std::min(x, y), z) > w.length) return;
    if constexpr (kClip) {
      const bool is_inside = in_grid(packed);
      if (was_inside && !is_inside) return;  // a straight line leaves a box once
      was_inside = is_inside;
      if (!is_inside) continue;
    }
    mark();
  }
}

}  // namespace firstlook
