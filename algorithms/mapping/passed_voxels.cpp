#include "algorithms/mapping/passed_voxels.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "platform/core/fixed_vector.hpp"
#include "platform/core/processor.hpp"

namespace firstlook {
namespace {

constexpr int kLanes = 8;  // voxels of a row, pixels of a tile's row
const Eigen::Vector3i kBrick(kLanes, 4, 4);
const Eigen::Vector3i kRow(kLanes, 1, 1);
constexpr double kNear_m = 1e-3;  // boxes that come nearer than this to the camera's plane have no footprint

// Eight numbers side by side: one AVX2 register, or what the compiler makes of it elsewhere; the same bits.
using Floats [[gnu::vector_size(32)]] = float;
using Ints [[gnu::vector_size(32)]] = std::int32_t;
const Floats kCounting = {0, 1, 2, 3, 4, 5, 6, 7};

/// The sign bits of eight comparisons, the first one lowest.
[[gnu::always_inline]] inline unsigned bits_of(const Ints& mask) {
  unsigned bits = 0;
  for (int i = 0; i < kLanes; ++i) bits |= static_cast<unsigned>(mask[i] & 1) << i;
  return bits;
}
[[gnu::always_inline]] inline bool any(const Ints& mask) {
  std::int64_t halves[4];
  std::memcpy(halves, &mask, sizeof(halves));
  return (halves[0] | halves[1] | halves[2] | halves[3]) != 0;
}

/// A row of eight voxels against the pixels at their middles.
struct MiddleTest {
  float center_m[3];  // of the first voxel, camera coordinates
  float step_m[3];    // from one to the next
  float fx, fy, cx, cy;
  float width, height;
  std::int32_t tiles_x;
  const float* reach_m;
  float beyond_m;  // from a voxel's middle to behind it
  float near_m, far_m;
};

/// One bit for each voxel that the ray of the pixel nearest to its middle leaves before it ends.
[[gnu::always_inline]] inline unsigned middles_passed(const MiddleTest& t) {
  const Floats z = t.center_m[2] + kCounting * t.step_m[2];
  const Floats over_z = 1.0F / z;
  Floats u = (t.center_m[0] + kCounting * t.step_m[0]) * over_z * t.fx + (t.cx + 0.5F);
  Floats v = (t.center_m[1] + kCounting * t.step_m[1]) * over_z * t.fy + (t.cy + 0.5F);
  const Ints inside = (z > t.near_m) & (z < t.far_m) & (u >= 0.0F) & (u < t.width) & (v >= 0.0F) & (v < t.height);
  if (!any(inside)) return 0;
  u = inside ? u : Floats{};
  v = inside ? v : Floats{};
  const Ints column = __builtin_convertvector(u, Ints);
  const Ints row = __builtin_convertvector(v, Ints);
  const Ints at = (((row >> 3) * t.tiles_x + (column >> 3)) << 6) + ((row & 7) << 3) + (column & 7);
  Floats reach;
  for (int i = 0; i < kLanes; ++i) reach[i] = t.reach_m[at[i]];
  return bits_of(inside & (reach > z + t.beyond_m));
}
FIRSTLOOK_AVX2 unsigned middles_passed_avx2(const MiddleTest& t) { return middles_passed(t); }
unsigned middles_passed_portable(const MiddleTest& t) { return middles_passed(t); }

/// 8 x 8 rays against a box. Depths along the optical axis count the way along a ray.
struct RayTest {
  const float* reach_m;
  Floats slope_x;          // of the columns
  float slope_y[kLanes];   // of the rows
  float rotation[3][3];    // base_R_depth
  float to_center_m[3];    // from the camera to the box's middle, base axes
  float inner_m, outer_m;  // half edges of the box, less and more than the rounding
  float rounding_m;
  int row_low, row_high;  // rows asked about
};

/// Where each ray of a row enters and leaves the box of half edge `half_m`.
struct Crossing {
  Floats in, out;
};
struct Axis {
  Floats middle, per_m;
};
[[gnu::always_inline]] inline Axis axis_of(const RayTest& t, int axis, int row) {
  const float row_part = t.rotation[axis][1] * t.slope_y[row] + t.rotation[axis][2];
  const Floats along = t.rotation[axis][0] * t.slope_x + row_part;
  const Ints backwards = along < 0.0F;
  const Floats size = backwards ? -along : along;
  const Floats per_m = 1.0F / (size > 1e-12F ? size : Floats{} + 1e-12F);
  const Floats way = t.to_center_m[axis] * per_m;
  return {backwards ? -way : way, per_m};
}
[[gnu::always_inline]] inline Crossing cross(const Axis& x, const Axis& y, const Axis& z, float half_m) {
  Crossing c{x.middle - half_m * x.per_m, x.middle + half_m * x.per_m};
  for (const Axis* axis : {&y, &z}) {
    const Floats in = axis->middle - half_m * axis->per_m, out = axis->middle + half_m * axis->per_m;
    c.in = in > c.in ? in : c.in;
    c.out = out < c.out ? out : c.out;
  }
  return c;
}

struct TileAnswer {
  bool passed = false;        // a ray certainly passes
  std::uint64_t perhaps = 0;  // rays that rounding could decide
};
/// Pixels of a tile against a voxel: it is passed by a ray that leaves it before the ray ends.
[[gnu::always_inline]] inline TileAnswer test_tile(const RayTest& t) {
  TileAnswer answer;
  for (int row = t.row_low; row <= t.row_high; ++row) {
    Floats reach;
    std::memcpy(&reach, t.reach_m + row * kLanes, sizeof(reach));
    const Axis x = axis_of(t, 0, row), y = axis_of(t, 1, row), z = axis_of(t, 2, row);
    const Crossing outer = cross(x, y, z, t.outer_m);
    const Ints meets =
        (outer.in <= outer.out) & (outer.out >= -t.rounding_m) & (outer.in <= reach + t.rounding_m) & (reach > 0.0F);
    if (!any(meets)) continue;
    const Crossing inner = cross(x, y, z, t.inner_m);
    const Ints sure = meets & (inner.in < inner.out) & (inner.out > t.rounding_m) & (outer.out < reach - t.rounding_m);
    if (any(sure)) return {true, 0};
    const Floats leaves = inner.out < outer.out ? inner.out : outer.out;
    answer.perhaps |= static_cast<std::uint64_t>(bits_of(meets & (leaves <= reach + t.rounding_m))) << (row * kLanes);
  }
  return answer;
}
FIRSTLOOK_AVX2 TileAnswer test_tile_avx2(const RayTest& t) { return test_tile(t); }
TileAnswer test_tile_portable(const RayTest& t) { return test_tile(t); }

/// The middles of tiles against a box that is larger by how far a tile's other rays are from its middle: one bit for
/// each tile whose rays could enter the voxel before they end.
[[gnu::always_inline]] inline std::uint64_t test_block(const RayTest& t) {
  std::uint64_t tiles = 0;
  for (int row = t.row_low; row <= t.row_high; ++row) {
    Floats reach;
    std::memcpy(&reach, t.reach_m + row * kLanes, sizeof(reach));
    const Crossing outer = cross(axis_of(t, 0, row), axis_of(t, 1, row), axis_of(t, 2, row), t.outer_m);
    const Ints meets =
        (outer.in <= outer.out) & (outer.out >= -t.rounding_m) & (outer.in <= reach + t.rounding_m) & (reach > 0.0F);
    tiles |= static_cast<std::uint64_t>(bits_of(meets)) << (row * kLanes);
  }
  return tiles;
}
FIRSTLOOK_AVX2 std::uint64_t test_block_avx2(const RayTest& t) { return test_block(t); }
std::uint64_t test_block_portable(const RayTest& t) { return test_block(t); }

/// Eight bits of a plane from `index` on; bits beyond the plane read as 0.
unsigned read_bits(std::span<const std::uint64_t> plane, std::size_t index) {
  const std::size_t word = index >> 6, shift = index & 63;
  std::uint64_t bits = plane[word] >> shift;
  if (shift > 56 && word + 1 < plane.size()) bits |= plane[word + 1] << (64 - shift);
  return static_cast<unsigned>(bits & 0xFF);
}
void set_bits(std::span<std::uint64_t> plane, std::size_t index, unsigned bits) {
  const std::size_t word = index >> 6, shift = index & 63;
  plane[word] |= static_cast<std::uint64_t>(bits) << shift;
  if (shift > 56 && (bits >> (64 - shift)) != 0) plane[word + 1] |= static_cast<std::uint64_t>(bits) >> (64 - shift);
}

Eigen::Vector3d half_extents(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& half) {
  return rotation.cwiseAbs() * half;
}

}  // namespace

/// One voxel and what is found out about it.
struct PassedVoxels::Question {
  Eigen::Vector3i voxel;
  Box box;
  PixelRect rect;  // of its footprint
  RayTest test;
  FixedVector<Pixel, 256> perhaps;  // rays that rounding could decide: walked when no other one passes
};

PassedVoxels::PassedVoxels(const GridGeometry& geometry, DepthRays& rays, const RangeImage& image,
                           const DepthImage& depth, const Transform<Base, Depth>& base_T_depth,
                           std::span<const std::uint64_t> hits, std::span<std::uint64_t> plane)
    : geometry_(geometry),
      rays_(rays),
      image_(image),
      depth_(depth),
      base_T_depth_(base_T_depth),
      hits_(hits),
      plane_(plane),
      marker_(geometry, base_T_depth.translation().cast<float>(), plane),
      camera_(rays.sensor().intrinsics),
      depth_R_base_(base_T_depth.rotation().transpose()),
      origin_m_(base_T_depth.translation().cast<float>().cast<double>()) {
  half_m_ = geometry.resolution_m / 2;
  voxel_half_m_ = half_extents(depth_R_base_, Eigen::Vector3d::Constant(half_m_));
  row_half_m_ = half_extents(depth_R_base_, kRow.cast<double>() * half_m_);
  brick_half_m_ = half_extents(depth_R_base_, kBrick.cast<double>() * half_m_);
  // Floats hold 6e-8 of their size: some ten such errors add up in a ray's ends, direction and crossings.
  rounding_m_ = 4e-6 * rays.range_m() + 1e-6 * origin_m_.cwiseAbs().maxCoeff();
  pixel_diagonal_ = std::hypot(1 / camera_.fx, 1 / camera_.fy);
  middle_far_m_ = (half_m_ - 2 * rounding_m_) / (0.501 * pixel_diagonal_);
}

/// From coordinates in voxels of the grid.
Eigen::Vector3d PassedVoxels::in_camera(const Eigen::Vector3d& voxel) const {
  return depth_R_base_ * ((geometry_.first.cast<double>() + voxel) * geometry_.resolution_m - origin_m_);
}

/// Pixels whose rays could meet a box in front of the camera.
PixelRect PassedVoxels::footprint(const Box& box) const {
  constexpr double kSlack_px = 0.01;
  const auto low = [&](double x) { return x / (x < 0 ? box.near_m() : box.far_m()); };
  const auto high = [&](double x) { return x / (x > 0 ? box.near_m() : box.far_m()); };
  const Eigen::Vector3d a = box.center_m - box.half_m, b = box.center_m + box.half_m;
  const auto clamp = [](double pixel, int size) { return static_cast<int>(std::clamp<double>(pixel, -1, size)); };
  PixelRect rect;
  rect.u_low = std::max(0, clamp(std::ceil(low(a.x()) * camera_.fx + camera_.cx - kSlack_px), camera_.width));
  rect.u_high =
      std::min(camera_.width - 1, clamp(std::floor(high(b.x()) * camera_.fx + camera_.cx + kSlack_px), camera_.width));
  rect.v_low = std::max(0, clamp(std::ceil(low(a.y()) * camera_.fy + camera_.cy - kSlack_px), camera_.height));
  rect.v_high = std::min(camera_.height - 1,
                         clamp(std::floor(high(b.y()) * camera_.fy + camera_.cy + kSlack_px), camera_.height));
  return rect;
}

/// Whether a box lies wholly outside one side of the pyramid of all rays, or behind the camera.
bool PassedVoxels::beside_image(const Box& box) const {
  const Eigen::Vector3d& c = box.center_m;
  const Eigen::Vector3d& h = box.half_m;
  if (box.far_m() < -rounding_m_) return true;
  const auto outside = [&](double at, double half, double slope) {
    return at - slope * c.z() + half + std::abs(slope) * h.z() < -rounding_m_;
  };
  return outside(c.x(), h.x(), -camera_.cx / camera_.fx) ||
         outside(-c.x(), h.x(), -(camera_.width - 1 - camera_.cx) / camera_.fx) ||
         outside(c.y(), h.y(), -camera_.cy / camera_.fy) ||
         outside(-c.y(), h.y(), -(camera_.height - 1 - camera_.cy) / camera_.fy);
}

void PassedVoxels::mark() {
  const double far_m = static_cast<double>(image_.farthest()) + rounding_m_;
  if (far_m <= rounding_m_) return;
  // The box around the pyramid of rays up to the farthest end.
  Eigen::Vector3d low_m = origin_m_, high_m = origin_m_;
  for (const double u : {0.0, camera_.width - 1.0}) {
    for (const double v : {0.0, camera_.height - 1.0}) {
      const Eigen::Vector3d corner((u - camera_.cx) / camera_.fx, (v - camera_.cy) / camera_.fy, 1);
      const Eigen::Vector3d end_m = origin_m_ + base_T_depth_.rotation() * corner * far_m;
      low_m = low_m.cwiseMin(end_m);
      high_m = high_m.cwiseMax(end_m);
    }
  }
  Eigen::Vector3i first, last;  // bricks
  for (int axis = 0; axis < 3; ++axis) {
    const double size = geometry_.size[axis];
    const double low = (low_m[axis] - rounding_m_) / geometry_.resolution_m - geometry_.first[axis];
    const double high = (high_m[axis] + rounding_m_) / geometry_.resolution_m - geometry_.first[axis];
    if (high < 0 || low >= size) return;
    first[axis] = static_cast<int>(std::max(0.0, std::floor(low))) / kBrick[axis];
    last[axis] = static_cast<int>(std::min(size - 1, std::floor(high))) / kBrick[axis];
  }
  for (int z = first.z(); z <= last.z(); ++z) {
    for (int y = first.y(); y <= last.y(); ++y) {
      for (int x = first.x(); x <= last.x(); ++x) mark_brick(kBrick.cwiseProduct(Eigen::Vector3i(x, y, z)));
    }
  }
}

void PassedVoxels::mark_brick(const Eigen::Vector3i& low) {
  const Box brick{in_camera(low.cast<double>() + kBrick.cast<double>() / 2), brick_half_m_};
  if (beside_image(brick) || brick.near_m() > static_cast<double>(image_.farthest()) + rounding_m_) return;
  const Eigen::Vector3i high = (low + kBrick).cwiseMin(geometry_.size);
  bool all = false;
  if (brick.near_m() > kNear_m) {
    const PixelRect rect = footprint(brick);
    const RangeImage::Bounds reach = image_.bounds(rect);
    if (brick.near_m() > static_cast<double>(reach.farthest) + rounding_m_) return;
    const bool whole =
        rect.u_low > 0 && rect.v_low > 0 && rect.u_high < camera_.width - 1 && rect.v_high < camera_.height - 1;
    all = whole && brick.far_m() < middle_far_m_ && brick.far_m() + rounding_m_ < static_cast<double>(reach.nearest);
  }
  for (int z = low.z(); z < high.z(); ++z) {
    for (int y = low.y(); y < high.y(); ++y) {
      const Eigen::Vector3i row(low.x(), y, z);
      if (all)
        set_bits(plane_, geometry_.index(row), (1U << (high.x() - low.x())) - 1);
      else
        mark_row(row);
    }
  }
}

void PassedVoxels::mark_row(const Eigen::Vector3i& low) {
  const std::size_t index = geometry_.index(low);
  const unsigned lanes = (1U << std::min(kLanes, geometry_.size.x() - low.x())) - 1;
  const Eigen::Vector3f center_m = in_camera(low.cast<double>().array() + 0.5).cast<float>();
  const Eigen::Vector3f step_m = (depth_R_base_.col(0) * geometry_.resolution_m).cast<float>();
  const MiddleTest test{.center_m = {center_m.x(), center_m.y(), center_m.z()},
                        .step_m = {step_m.x(), step_m.y(), step_m.z()},
                        .fx = static_cast<float>(camera_.fx),
                        .fy = static_cast<float>(camera_.fy),
                        .cx = static_cast<float>(camera_.cx),
                        .cy = static_cast<float>(camera_.cy),
                        .width = static_cast<float>(camera_.width),
                        .height = static_cast<float>(camera_.height),
                        .tiles_x = image_.tiles_x(),
                        .reach_m = image_.reach_m().data(),
                        .beyond_m = static_cast<float>(voxel_half_m_.z() + 2 * rounding_m_),
                        .near_m = static_cast<float>(kNear_m),
                        .far_m = static_cast<float>(middle_far_m_)};
  unsigned passed = (has_avx2() ? middles_passed_avx2(test) : middles_passed_portable(test)) & lanes;
  unsigned open = lanes & ~passed & ~read_bits(hits_, index);
  if (std::popcount(open) > 2 &&
      is_out_of_reach({in_camera(low.cast<double>() + kRow.cast<double>() / 2), row_half_m_}))
    open = 0;
  for (; open != 0; open &= open - 1) {
    const int lane = std::countr_zero(open);
    if (is_passed({low.x() + lane, low.y(), low.z()})) passed |= 1U << lane;
  }
  if (passed != 0) set_bits(plane_, index, passed);
}

/// Whether all rays that could meet a box end before it.
bool PassedVoxels::is_out_of_reach(const Box& box) const {
  if (beside_image(box)) return true;
  if (box.near_m() <= kNear_m) return false;
  return box.near_m() - rounding_m_ > static_cast<double>(image_.bounds(footprint(box)).farthest);
}

bool PassedVoxels::is_passed(const Eigen::Vector3i& voxel) const {
  const Eigen::Vector3d middle = voxel.cast<double>().array() + 0.5;
  const Box box{in_camera(middle), voxel_half_m_};
  if (beside_image(box)) return false;
  PixelRect rect{0, 0, camera_.width - 1, camera_.height - 1};
  if (box.near_m() > kNear_m) rect = footprint(box);
  const double near_m = box.near_m() - rounding_m_;
  if (rect.empty() || near_m > static_cast<double>(image_.bounds(rect).farthest)) return false;

  Question question{voxel, box, rect, {}, {}};
  RayTest& test = question.test;
  const Eigen::Matrix3d base_R_depth = depth_R_base_.transpose();
  const Eigen::Vector3d to_center_m = (geometry_.first.cast<double>() + middle) * geometry_.resolution_m - origin_m_;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) test.rotation[i][j] = static_cast<float>(base_R_depth(i, j));
    test.to_center_m[i] = static_cast<float>(to_center_m[i]);
  }
  test.rounding_m = static_cast<float>(rounding_m_);
  constexpr int kBlock = RangeImage::kTile * RangeImage::kTile;  // pixels
  for (int y = rect.v_low / kBlock; y <= rect.v_high / kBlock; ++y) {
    for (int x = rect.u_low / kBlock; x <= rect.u_high / kBlock; ++x) {
      for (std::uint64_t tiles = tiles_of_block(question, x, y); tiles != 0; tiles &= tiles - 1) {
        const int tile = std::countr_zero(tiles);
        if (is_passed_in_tile(question, x * kLanes + tile % kLanes, y * kLanes + tile / kLanes)) return true;
      }
    }
  }
  return std::any_of(question.perhaps.begin(), question.perhaps.end(),
                     [&](const Pixel& pixel) { return is_walked(pixel, voxel); });
}

std::uint64_t PassedVoxels::tiles_of_block(Question& q, int x, int y) const {
  RayTest& t = q.test;
  constexpr int kTile = RangeImage::kTile;
  constexpr double kToMiddle_px = (kTile - 1) / 2.0;
  const double spread_m = kToMiddle_px * pixel_diagonal_ * std::max(0.0, q.box.far_m());
  t.outer_m = static_cast<float>(half_m_ + 2 * rounding_m_ + spread_m);
  t.reach_m = image_.block(x, y).data();
  for (int i = 0; i < kLanes; ++i) {
    t.slope_x[i] = static_cast<float>(((x * kLanes + i) * kTile + kToMiddle_px - camera_.cx) / camera_.fx);
    t.slope_y[i] = static_cast<float>(((y * kLanes + i) * kTile + kToMiddle_px - camera_.cy) / camera_.fy);
  }
  t.row_low = std::max(0, q.rect.v_low / kTile - y * kLanes);
  t.row_high = std::min(kLanes - 1, q.rect.v_high / kTile - y * kLanes);
  return has_avx2() ? test_block_avx2(t) : test_block_portable(t);
}

bool PassedVoxels::is_passed_in_tile(Question& q, int x, int y) const {
  RayTest& t = q.test;
  t.inner_m = static_cast<float>(half_m_ - rounding_m_);
  t.outer_m = static_cast<float>(half_m_ + rounding_m_);
  t.reach_m = image_.tile(x, y).data();
  for (int i = 0; i < kLanes; ++i) {
    t.slope_x[i] = static_cast<float>((x * kLanes + i - camera_.cx) / camera_.fx);
    t.slope_y[i] = static_cast<float>((y * kLanes + i - camera_.cy) / camera_.fy);
  }
  t.row_low = std::max(0, q.rect.v_low - y * kLanes);
  t.row_high = std::min(kLanes - 1, q.rect.v_high - y * kLanes);
  TileAnswer answer = has_avx2() ? test_tile_avx2(t) : test_tile_portable(t);
  if (answer.passed) return true;
  for (; answer.perhaps != 0; answer.perhaps &= answer.perhaps - 1) {
    const int i = std::countr_zero(answer.perhaps);
    const Pixel pixel{x * kLanes + i % kLanes, y * kLanes + i / kLanes};
    if (!q.perhaps.full()) {
      q.perhaps.push_back(pixel);
    } else if (is_walked(pixel, q.voxel)) {
      return true;
    }
  }
  return false;
}

bool PassedVoxels::is_walked(const Pixel& pixel, const Eigen::Vector3i& voxel) const {
  return marker_.passes(rays_.ray(depth_, base_T_depth_, pixel.u, pixel.v).end_m, voxel);
}

}  // namespace firstlook
