#include "algorithms/vision/saddle_points.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

namespace firstlook {
namespace {

/// Binomial 3x3 smoothing, row by row as far as somebody looks; the border keeps its values. 16 times the grey values.
class SmoothPicture {
 public:
  explicit SmoothPicture(GrayImage image)
      : image_(image), values_(image.size()), sums_(static_cast<std::size_t>(image.width)) {}

  [[nodiscard]] int width() const { return image_.width; }
  [[nodiscard]] int height() const { return image_.height; }
  [[nodiscard]] const std::int16_t* row(int v) const {
    return values_.data() + static_cast<std::ptrdiff_t>(v) * image_.width;
  }

  /// Makes the rows up to `v`, as far as the picture has them.
  void smooth_to(int v) {
    for (; rows_ <= std::min(v, image_.height - 1); ++rows_) smooth(rows_);
  }

 private:
  void smooth(int v) {
    std::int16_t* const out = values_.data() + static_cast<std::ptrdiff_t>(v) * image_.width;
    std::int16_t* const sums = sums_.data();
    const std::uint8_t* const b = &image_.at(0, v);
    const std::uint8_t* const a = v > 0 ? b - image_.width : b;
    const std::uint8_t* const c = v + 1 < image_.height ? b + image_.width : b;
    const int last = image_.width - 1;
    for (int u = 0; u <= last; ++u) sums[u] = static_cast<std::int16_t>(a[u] + 2 * b[u] + c[u]);
    for (int u = 1; u < last; ++u) out[u] = static_cast<std::int16_t>(sums[u - 1] + 2 * sums[u] + sums[u + 1]);
    out[0] = static_cast<std::int16_t>(16 * b[0]);
    out[last] = static_cast<std::int16_t>(16 * b[last]);
  }

  GrayImage image_;
  std::vector<std::int16_t> values_;
  std::vector<std::int16_t> sums_;  ///< of three rows
  int rows_ = 0;                    ///< that have been made
};

std::vector<std::uint8_t> halved(GrayImage image) {
  const int width = image.width / 2, height = image.height / 2;
  std::vector<std::uint8_t> half(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (int v = 0; v < height; ++v) {
    const std::uint8_t* const a = &image.at(0, 2 * v);
    const std::uint8_t* const b = &image.at(0, 2 * v + 1);
    std::uint8_t* const out = half.data() + static_cast<std::ptrdiff_t>(v) * width;
    for (int u = 0; u < width; ++u) {
      out[u] = static_cast<std::uint8_t>((a[2 * u] + a[2 * u + 1] + b[2 * u] + b[2 * u + 1] + 2) / 4);
    }
  }
  return half;
}

/// Minus the determinant of the Hessian over differences of two pixels; positive at saddles. Row `v` of the picture.
void saddle_response(const SmoothPicture& p, int v, std::vector<float>& out) {
  const std::int16_t *a = p.row(v - 2), *b = p.row(v), *c = p.row(v + 2);
  for (int u = 2; u + 2 < p.width(); ++u) {
    const auto xx = static_cast<float>(b[u - 2] + b[u + 2] - 2 * b[u]);
    const auto yy = static_cast<float>(a[u] + c[u] - 2 * b[u]);
    const auto xy = static_cast<float>(a[u - 2] + c[u + 2] - a[u + 2] - c[u - 2]) / 4;
    out[static_cast<std::size_t>(u)] = xy * xy - xx * yy;
  }
}

/// Where the middle one of three rows of responses is largest among its neighbours: 1, else 0.
void mark_peaks(const std::array<std::vector<float>, 3>& rows, std::vector<std::uint8_t>& peaks) {
  constexpr float kResponseMin = 16 * 16 * 5 * 5;  // curvature of five grey levels each way
  const float *a = rows[0].data(), *b = rows[1].data(), *c = rows[2].data();
  std::uint8_t* const out = peaks.data();
  for (std::size_t u = 3; u + 3 < peaks.size(); ++u) {
    const float here = b[u];
    // Not >= on both sides: two equal neighbours count once.
    const bool above_those_before = (here > a[u - 1]) & (here > a[u]) & (here > a[u + 1]) & (here > b[u - 1]);
    const bool not_below_those_after = (here >= b[u + 1]) & (here >= c[u - 1]) & (here >= c[u]) & (here >= c[u + 1]);
    out[u] = ((here >= kResponseMin) & above_those_before & not_below_those_after) ? 1 : 0;
  }
}

SaddlePoint saddle_at(const SmoothPicture& p, int u, int v) {
  const std::int16_t *a = p.row(v - 2) + u, *b = p.row(v) + u, *c = p.row(v + 2) + u;
  SaddlePoint s{static_cast<float>(u), static_cast<float>(v)};
  s.xx = static_cast<float>(b[-2] + b[2] - 2 * b[0]);
  s.yy = static_cast<float>(a[0] + c[0] - 2 * b[0]);
  s.xy = static_cast<float>(a[-2] + c[2] - a[2] - c[-2]) / 4;
  return s;
}

/// Black and white alternate exactly four times on a ring around a point (Bennett and Lasenby 2014 in idea).
class Ring {
 public:
  static constexpr int kReach = 4;
  explicit Ring(int width) {
    for (std::size_t i = 0; i < kPlaces.size(); ++i) steps_[i] = kPlaces[i][0] + kPlaces[i][1] * width;
  }

  [[nodiscard]] bool alternates(const std::int16_t* middle_pixel) const {
    constexpr std::size_t kSize = kPlaces.size();
    std::array<std::int16_t, kSize + 1> ring{};
    for (std::size_t i = 0; i < kSize; ++i) ring[i] = middle_pixel[steps_[i]];
    ring[kSize] = ring[0];
    std::int16_t low = ring[0], high = ring[0];
    for (std::size_t i = 0; i < kSize; ++i) low = std::min(low, ring[i]), high = std::max(high, ring[i]);
    constexpr int kContrastMin = 16 * 10;  // ten grey levels
    if (high - low < kContrastMin) return false;
    const auto middle = static_cast<std::int16_t>((low + high) / 2);
    std::int16_t changes = 0;
    for (std::size_t i = 0; i < kSize; ++i) {
      changes = static_cast<std::int16_t>(changes + ((ring[i] > middle) != (ring[i + 1] > middle) ? 1 : 0));
    }
    return changes == 4;
  }

 private:
  static constexpr std::array<std::array<int, 2>, 16> kPlaces = {{{4, 0},
                                                                  {4, 2},
                                                                  {3, 3},
                                                                  {2, 4},
                                                                  {0, 4},
                                                                  {-2, 4},
                                                                  {-3, 3},
                                                                  {-4, 2},
                                                                  {-4, 0},
                                                                  {-4, -2},
                                                                  {-3, -3},
                                                                  {-2, -4},
                                                                  {0, -4},
                                                                  {2, -4},
                                                                  {3, -3},
                                                                  {4, -2}}};
  std::array<std::ptrdiff_t, kPlaces.size()> steps_{};
};

}  // namespace

SaddlePoints find_saddle_points(GrayImage image, std::size_t count_max) {
  SaddlePoints points;
  if (image.width < 16 || image.height < 16) return points;
  SmoothPicture p(image);
  const Ring ring(image.width);
  const auto width = static_cast<std::size_t>(image.width);
  std::vector<std::uint8_t> peaks(width, 0);
  std::array<std::vector<float>, 3> rows;  // responses of the rows v-1, v, v+1
  for (auto& row : rows) row.assign(width, 0.0F);
  p.smooth_to(Ring::kReach + 2);
  saddle_response(p, Ring::kReach - 1, rows[1]);
  saddle_response(p, Ring::kReach, rows[2]);
  for (int v = Ring::kReach; v + Ring::kReach < image.height; ++v) {
    p.smooth_to(v + Ring::kReach);
    std::rotate(rows.begin(), rows.begin() + 1, rows.end());
    saddle_response(p, v + 1, rows[2]);
    mark_peaks(rows, peaks);
    const std::uint8_t* const first = peaks.data();
    const std::uint8_t* const end = first + width - Ring::kReach;
    for (const std::uint8_t* at = first + Ring::kReach;; ++at) {
      at = static_cast<const std::uint8_t*>(std::memchr(at, 1, static_cast<std::size_t>(end - at)));
      if (at == nullptr) break;
      const auto u = static_cast<int>(at - first);
      if (!ring.alternates(p.row(v) + u)) continue;
      points.push_back(saddle_at(p, u, v));
      if (points.size() > count_max) return points;
    }
  }
  return points;
}

SaddlePoints find_saddle_points_halved(GrayImage image, std::size_t count_max) {
  const std::vector<std::uint8_t> pixels = halved(image);
  SaddlePoints found = find_saddle_points({pixels.data(), image.width / 2, image.height / 2}, count_max);
  // The middle of a pixel of the half-size picture lies between two of the full one.
  for (SaddlePoint& s : found) s.u = 2 * s.u + 0.5F, s.v = 2 * s.v + 0.5F;
  return found;
}

}  // namespace firstlook
