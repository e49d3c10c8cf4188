#include "algorithms/mapping/end_octants.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <numeric>

#include "algorithms/mapping/lanes.hpp"
#include "algorithms/mapping/octants.hpp"
#include "algorithms/mapping/ray_marker.hpp"
#include "platform/core/ensure.hpp"
#include "platform/core/processor.hpp"

namespace firstlook {
namespace {

using namespace lanes;  // pixels of a row

using Values [[gnu::vector_size(2 * kLanes)]] = std::uint16_t;
constexpr std::size_t kTerms = 4;  // of a direction: along the grid's axes in half voxels, and its length squared

/// What is the same for all rows of a frame. Coordinates are half voxels of the grid.
struct FrameTerms {
  float units_per_m, range_m, range_squared_m2;
  float origin[3], size[3];
  float rounding;     // no rounding of an end, here or in OctoMap's points, reaches this
  float rounding_m2;  // nor this one that of a squared length
  std::int32_t value_min, stride_y, stride_z;
};
/// One row, as plain arrays of whole vectors.
struct Row {
  const std::uint16_t* values;
  const float* self_m;  // null: no part of the arm is in sight
  const float* columns[kTerms];
  float terms[kTerms];
  int width;
  float* reach_m;
  std::int32_t* octants;  // gets those of hits, runs of equal ones once
  std::int32_t* doubted;  // gets the columns that rounding could decide
};
struct Found {
  std::size_t octants = 0, doubted = 0;
  std::array<std::uint32_t, kPixelKinds> pixels{};  // but for doubted and empty ones
};

[[gnu::always_inline]] inline Found find_ends(const FrameTerms& frame, const Row& row) {
  const FrameTerms f = frame;  // nothing that is written below lies in them
  const Row r = row;
  Found found;
  Ints last = Ints{} - 1;
  for (int u = 0; u < r.width; u += kLanes) {
    Values values;
    std::memcpy(&values, r.values + u, sizeof(values));
    const auto direction = [&](std::size_t term, Floats& out) {
      std::memcpy(&out, r.columns[term] + u, sizeof(out));
      out += r.terms[term];
    };
    const Ints value = __builtin_convertvector(values, Ints);
    const Floats z = __builtin_convertvector(value, Floats) / f.units_per_m;
    Floats squared;
    direction(3, squared);
    squared *= z * z;
    const Floats over = squared - f.range_squared_m2;

    const Ints empty = value == 0;
    Ints self{}, doubted{};
    if (r.self_m != nullptr) {
      Floats self_m;
      std::memcpy(&self_m, r.self_m + u, sizeof(self_m));
      self = ~empty & (z >= self_m);
      doubted = self & (z <= self_m);
    }
    const Ints near = ~empty & ~self & (value < f.value_min);
    const Ints ray = ~(empty | self | near);
    Ints beyond = ray & (over > 0.0F);
    doubted |= ray & (over < f.rounding_m2) & (over > -f.rounding_m2);

    Ints inside = ray & ~beyond, at[3], on_face{};
    for (std::size_t i = 0; i < 3; ++i) {
      Floats h;
      direction(i, h);
      h = h * z + f.origin[i];
      inside &= (h > -f.rounding) & (h < f.size[i] + f.rounding);
      at[i] = __builtin_convertvector(h, Ints);
      const Floats part = h - __builtin_convertvector(at[i], Floats);
      on_face |= (part < f.rounding) | (part > 1.0F - f.rounding);
    }
    doubted |= inside & on_face;
    inside &= ~doubted;
    beyond &= ~doubted;

    Floats reach = ray ? z : Floats{} + RangeImage::kNoRay;
    if (any(beyond)) {
      Floats length = beyond ? squared : Floats{} + 1.0F;
      for (int i = 0; i < kLanes; ++i) length[i] = std::sqrt(length[i]);
      reach = beyond ? z / length * f.range_m : reach;
    }
    std::memcpy(r.reach_m + u, &reach, sizeof(reach));

    const Ints index = (at[2] >> 1) * f.stride_z + (at[1] >> 1) * f.stride_y + (at[0] >> 1);
    const Ints octant = index << 3 | (at[2] & 1) << 2 | (at[1] & 1) << 1 | (at[0] & 1);
    const Ints here = inside ? octant : Ints{} - 1;
    const Ints before = __builtin_shufflevector(last, here, 7, 8, 9, 10, 11, 12, 13, 14);
    last = here;
    const unsigned changed = bits_of(inside & (here != before));
    pack(here, changed, r.octants + found.octants);
    found.octants += static_cast<std::size_t>(std::popcount(changed));
    for (unsigned bits = bits_of(doubted); bits != 0; bits &= bits - 1)
      r.doubted[found.doubted++] = u + std::countr_zero(bits);

    const auto count = [&](PixelKind kind, const Ints& which) {
      found.pixels[static_cast<std::size_t>(kind)] += static_cast<std::uint32_t>(std::popcount(bits_of(which)));
    };
    count(PixelKind::kHit, ray & ~beyond & ~doubted);
    if (any(beyond | near | self)) {
      count(PixelKind::kBeyond, beyond);
      count(PixelKind::kTooNear, near);
      count(PixelKind::kSelf, self & ~doubted);
    }
  }
  return found;
}
FIRSTLOOK_AVX2 Found find_ends_avx2(const FrameTerms& f, const Row& r) { return find_ends(f, r); }
Found find_ends_portable(const FrameTerms& f, const Row& r) { return find_ends(f, r); }

std::size_t whole_vectors(int width) {
  return static_cast<std::size_t>((width + kLanes - 1) / kLanes) * static_cast<std::size_t>(kLanes);
}

FrameTerms terms_of(const GridGeometry& g, const RayFrame& rays) {
  const double halves_per_m = 2 / g.resolution_m, range_m = rays.range_m;
  const Eigen::Vector3d translation_m(rays.translation_m[0], rays.translation_m[1], rays.translation_m[2]);
  const Eigen::Vector3d origin = translation_m * halves_per_m - 2 * g.first.cast<double>();
  FrameTerms f{};
  f.units_per_m = static_cast<float>(rays.units_per_m);
  f.range_m = static_cast<float>(range_m);
  f.range_squared_m2 = static_cast<float>(range_m * range_m);
  for (int i = 0; i < 3; ++i) {
    f.origin[i] = static_cast<float>(origin[i]);
    f.size[i] = static_cast<float>(2 * g.size[i]);
  }
  // Floats hold 6e-8 of their size: some ten such errors of a ray's length add up, one of each of the others. Ends of
  // hits are meant, which lie within the range and close to the grid.
  const double origin_m = translation_m.cwiseAbs().maxCoeff();
  const double size = 2 * g.size.maxCoeff();
  f.rounding = static_cast<float>(
      1e-7 * (10 * halves_per_m * range_m + halves_per_m * origin_m + size + origin.cwiseAbs().maxCoeff()));
  f.rounding_m2 = static_cast<float>(1e-6 * range_m * (range_m + origin_m));
  f.value_min = rays.value_min;
  f.stride_y = g.size.x();
  f.stride_z = g.size.x() * g.size.y();
  return f;
}

}  // namespace

EndOctants::EndOctants(const GridGeometry& geometry, const DepthSensor& sensor)
    : geometry_(geometry),
      pixels_(static_cast<std::size_t>(sensor.intrinsics.width)),
      width_(whole_vectors(sensor.intrinsics.width)) {
  columns_.resize(kTerms * width_);
  values_.resize(width_);
  self_m_.resize(width_);
  octants_.resize(width_ + kLanes);
  doubted_.resize(width_);
}

template <typename T>
const T* EndOctants::whole_vectors_of(const T* row, std::vector<T>& scratch) const {
  if (width_ == pixels_) return row;
  std::copy_n(row, pixels_, scratch.begin());
  return scratch.data();
}

std::size_t EndOctants::required_bytes(const DepthSensor& sensor) {
  return whole_vectors(sensor.intrinsics.width) *
             ((kTerms + 1) * sizeof(float) + sizeof(std::uint16_t) + 2 * sizeof(std::int32_t)) +
         kLanes * sizeof(std::int32_t);
}

void EndOctants::prepare_columns(const DepthRays& rays, const Eigen::Matrix3d& halves_R_depth) {
  for (int u = 0; u < rays.sensor().intrinsics.width; ++u) {
    const double x = rays.direction(u, 0).x();
    const auto column = static_cast<std::size_t>(u);
    for (int i = 0; i < 3; ++i)
      columns_[static_cast<std::size_t>(i) * width_ + column] = static_cast<float>(halves_R_depth(i, 0) * x);
    columns_[3 * width_ + column] = static_cast<float>(x * x);
  }
}

EndOctants::Decided EndOctants::decide(const DepthRays& rays, const RayFrame& frame, const DepthImage& depth,
                                       const float* self_m, int u, int v) const {
  const std::uint16_t value = depth.pixels.at(u, v);
  Decided decided;
  if (self_m != nullptr && value / frame.units_per_m >= static_cast<double>(*self_m)) {
    decided.kind = PixelKind::kSelf;
  } else if (value < frame.value_min) {
    decided.kind = PixelKind::kTooNear;
  } else {
    const RayEnd end = rays.ray(frame, depth, u, v);
    decided.kind = end.is_hit ? PixelKind::kHit : PixelKind::kBeyond;
    decided.reach_m = end.reach_m;
    const Eigen::Vector3i voxel = octomap_voxel(geometry_, end.end_m);
    if (end.is_hit && geometry_.contains(voxel))
      decided.octant = static_cast<std::int32_t>(geometry_.index(voxel) << 3 | octant_of(geometry_, end.end_m));
  }
  return decided;
}

PixelCounts EndOctants::find(const DepthRays& rays, const DepthImage& depth, const Transform<Base, Depth>& base_T_depth,
                             std::span<const float> self_depth_m, RangeImage& image,
                             FunctionRef<void(std::span<const std::int32_t>)> visit_row) {
  ENSURE(3048, rays.is_pinhole() && depth.units_per_m >= kUnitsPerMeterMin);
  const RayFrame exact = rays.frame(depth.units_per_m, base_T_depth);
  const FrameTerms frame = terms_of(geometry_, exact);
  const Eigen::Matrix3d halves_R_depth = base_T_depth.rotation() * (2 / geometry_.resolution_m);
  prepare_columns(rays, halves_R_depth);

  Row row{};
  row.width = depth.pixels.width;
  for (std::size_t i = 0; i < kTerms; ++i) row.columns[i] = columns_.data() + i * width_;
  row.octants = octants_.data();
  row.doubted = doubted_.data();
  std::array<std::uint32_t, kPixelKinds> counts{};
  for (int v = 0; v < depth.pixels.height; ++v) {
    const std::size_t first = static_cast<std::size_t>(v) * pixels_;
    const double y = rays.direction(0, v).y();
    for (int i = 0; i < 3; ++i) row.terms[i] = static_cast<float>(halves_R_depth(i, 1) * y + halves_R_depth(i, 2));
    row.terms[3] = static_cast<float>(1 + y * y);
    row.values = whole_vectors_of(depth.pixels.data + first, values_);
    row.self_m = self_depth_m.empty() ? nullptr : whole_vectors_of(self_depth_m.data() + first, self_m_);
    row.reach_m = image.row(v);
    Found found = has_avx2() ? find_ends_avx2(frame, row) : find_ends_portable(frame, row);
    for (const std::int32_t u : std::span(doubted_).first(found.doubted)) {
      const Decided decided = decide(rays, exact, depth, row.self_m == nullptr ? nullptr : row.self_m + u, u, v);
      ++found.pixels[static_cast<std::size_t>(decided.kind)];
      row.reach_m[u] = decided.reach_m;
      if (decided.octant >= 0) octants_[found.octants++] = decided.octant;
    }
    for (std::size_t kind = 0; kind < counts.size(); ++kind) counts[kind] += found.pixels[kind];
    visit_row({octants_.data(), found.octants});
  }
  const auto pixels = static_cast<std::uint32_t>(depth.pixels.size());
  counts[static_cast<std::size_t>(PixelKind::kEmpty)] = pixels - std::accumulate(counts.begin(), counts.end(), 0U);
  return counts_of(counts);
}

}  // namespace firstlook
