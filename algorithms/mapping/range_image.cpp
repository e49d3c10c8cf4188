#include "algorithms/mapping/range_image.hpp"

#include <algorithm>
#include <bit>

#include "platform/core/ensure.hpp"
#include "platform/core/processor.hpp"

namespace firstlook {
namespace {

constexpr int kReadBeyond = 8;

unsigned to_unsigned(int n) { return static_cast<unsigned>(n); }
int level_max_for(int width, int height) {
  return std::countr_zero(std::bit_ceil(to_unsigned(std::max(width, height))));
}
int cells(int pixels, int level) { return (pixels + (1 << level) - 1) >> level; }
int stride_for(int width, int first_level) { return cells(width, first_level) + kReadBeyond; }
/// A power of two: half of what is left for each level, and a row for the last.
int rows_for(int width, int height, int first_level) {
  const int w = cells(width, first_level), h = cells(height, first_level);
  return static_cast<int>(std::max(2 * std::bit_ceil(to_unsigned(h)), std::bit_ceil(to_unsigned(std::max(w, h)))));
}

struct Rows {
  const float* above;
  const float* middle;
  const float* below;
};

/// Cells of a level from two rows of the one under it.
template <typename Better>
[[gnu::always_inline]] inline void join_cells(const Rows& r, float* __restrict out, int count, Better better) {
  for (int x = 0; x < count; ++x)
    out[x] = better(better(r.above[2 * x], r.above[2 * x + 1]), better(r.below[2 * x], r.below[2 * x + 1]));
}
/// Each cell with the eight around it; scratch[0] and scratch[count + 1] lie beside the image.
template <typename Better>
[[gnu::always_inline]] inline void join_around(const Rows& r, float* __restrict scratch, float* __restrict out,
                                               int count, Better better) {
  for (int x = 0; x < count; ++x) scratch[x + 1] = better(better(r.above[x], r.middle[x]), r.below[x]);
  scratch[count + 1] = RangeImage::kNoRay;
  for (int x = 0; x < count; ++x) out[x] = better(better(scratch[x], scratch[x + 1]), scratch[x + 2]);
}
constexpr auto kFarther = [](float a, float b) { return a > b ? a : b; };
constexpr auto kNearer = [](float a, float b) { return a < b ? a : b; };

FIRSTLOOK_AVX2 void farthest_avx2(const Rows& far, float* out, int count) { join_cells(far, out, count, kFarther); }
void farthest_portable(const Rows& far, float* out, int count) { join_cells(far, out, count, kFarther); }
FIRSTLOOK_AVX2 void cells_avx2(const Rows& far, const Rows& near, float* far_out, float* near_out, int count) {
  join_cells(far, far_out, count, kFarther);
  join_cells(near, near_out, count, kNearer);
}
void cells_portable(const Rows& far, const Rows& near, float* far_out, float* near_out, int count) {
  join_cells(far, far_out, count, kFarther);
  join_cells(near, near_out, count, kNearer);
}
FIRSTLOOK_AVX2 void around_avx2(const Rows& far, const Rows& near, float* scratch, float* far_out, float* near_out,
                                int count) {
  join_around(far, scratch, far_out, count, kFarther);
  join_around(near, scratch, near_out, count, kNearer);
}
void around_portable(const Rows& far, const Rows& near, float* scratch, float* far_out, float* near_out, int count) {
  join_around(far, scratch, far_out, count, kFarther);
  join_around(near, scratch, near_out, count, kNearer);
}

}  // namespace

Pyramid::Pyramid(int width, int height, int first_level)
    : stride_(stride_for(width, first_level)), rows_(rows_for(width, height, first_level)), first_level_(first_level) {
  values_.assign(static_cast<std::size_t>(stride_) * static_cast<std::size_t>(rows_), RangeImage::kNoRay);
}

std::size_t Pyramid::required_bytes(int width, int height, int first_level) {
  return sizeof(float) * static_cast<std::size_t>(stride_for(width, first_level)) *
         static_cast<std::size_t>(rows_for(width, height, first_level));
}

RangeImage::RangeImage(int width, int height)
    : width_(width),
      height_(height),
      level_max_(std::max(1, level_max_for(width, height))),
      farthest_(width, height, 0),
      nearest_(width, height, 1),
      around_farthest_(width, height, 1),
      around_nearest_(width, height, 1) {
  ENSURE(3046, width > 0 && height > 0);
  nothing_.assign(static_cast<std::size_t>(width + kReadBeyond), kNoRay);
  scratch_.assign(static_cast<std::size_t>(width + kReadBeyond), kNoRay);
}

std::size_t RangeImage::required_bytes(int width, int height) {
  return Pyramid::required_bytes(width, height, 0) + 3 * Pyramid::required_bytes(width, height, 1) +
         2 * sizeof(float) * static_cast<std::size_t>(width + kReadBeyond);
}

void RangeImage::set_row(int v, std::span<const float> reach_m) {
  std::copy(reach_m.begin(), reach_m.end(), farthest_.row(0, v));
}

void RangeImage::build_levels() {
  for (int level = 1; level <= level_max_; ++level) {
    const int columns = cells(width_, level), rows = cells(height_, level), rows_under = cells(height_, level - 1);
    for (int y = 0; y < rows; ++y) {
      const bool both = 2 * y + 1 < rows_under;
      const Rows far{farthest_.row(level - 1, 2 * y), nullptr,
                     both ? farthest_.row(level - 1, 2 * y + 1) : nothing_.data()};
      if (level == 1) {
        (has_avx2() ? farthest_avx2 : farthest_portable)(far, farthest_.row(1, y), columns);
        std::copy_n(farthest_.row(1, y), columns, nearest_.row(1, y));
        continue;
      }
      const Rows near{nearest_.row(level - 1, 2 * y), nullptr,
                      both ? nearest_.row(level - 1, 2 * y + 1) : nothing_.data()};
      (has_avx2() ? cells_avx2 : cells_portable)(far, near, farthest_.row(level, y), nearest_.row(level, y), columns);
    }
    for (int y = 0; y < rows; ++y) {
      const auto rows_of = [&](const Pyramid& p) {
        return Rows{y > 0 ? p.row(level, y - 1) : nothing_.data(), p.row(level, y),
                    y + 1 < rows ? p.row(level, y + 1) : nothing_.data()};
      };
      (has_avx2() ? around_avx2 : around_portable)(rows_of(farthest_), rows_of(nearest_), scratch_.data(),
                                                   around_farthest_.row(level, y), around_nearest_.row(level, y),
                                                   columns);
    }
  }
}

}  // namespace firstlook
