#include "algorithms/vision/saddle_points.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

namespace firstlook {
namespace {

struct Picture {
  int width = 0;
  int height = 0;
  std::vector<int> values;  ///< 16 times the grey value after smoothing
  [[nodiscard]] const int* row(int v) const { return values.data() + static_cast<std::ptrdiff_t>(v) * width; }
  [[nodiscard]] int at(int u, int v) const { return row(v)[u]; }
};

/// Binomial 3x3 smoothing; the border keeps its values.
Picture smoothed(GrayImage image) {
  Picture p{image.width, image.height, std::vector<int>(image.size())};
  for (int v = 0; v < p.height; ++v) {
    int* out = p.values.data() + static_cast<std::ptrdiff_t>(v) * p.width;
    const std::uint8_t* b = &image.at(0, v);
    const std::uint8_t* a = v > 0 ? b - p.width : b;
    const std::uint8_t* c = v + 1 < p.height ? b + p.width : b;
    out[0] = 16 * b[0];
    out[p.width - 1] = 16 * b[p.width - 1];
    for (int u = 1; u + 1 < p.width; ++u) {
      out[u] = a[u - 1] + 2 * a[u] + a[u + 1] + 2 * (b[u - 1] + 2 * b[u] + b[u + 1]) + c[u - 1] + 2 * c[u] + c[u + 1];
    }
  }
  return p;
}

std::vector<std::uint8_t> halved(GrayImage image) {
  const int width = image.width / 2, height = image.height / 2;
  std::vector<std::uint8_t> half(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      const int sum = image.at(2 * u, 2 * v) + image.at(2 * u + 1, 2 * v) + image.at(2 * u, 2 * v + 1) +
                      image.at(2 * u + 1, 2 * v + 1);
      half[static_cast<std::size_t>(v) * static_cast<std::size_t>(width) + static_cast<std::size_t>(u)] =
          static_cast<std::uint8_t>((sum + 2) / 4);
    }
  }
  return half;
}

/// Minus the determinant of the Hessian over differences of two pixels; positive at saddles. Row `v` of the picture.
void saddle_response(const Picture& p, int v, std::vector<float>& out) {
  const int *a = p.row(v - 2), *b = p.row(v), *c = p.row(v + 2);
  for (int u = 2; u + 2 < p.width; ++u) {
    const auto xx = static_cast<float>(b[u - 2] + b[u + 2] - 2 * b[u]);
    const auto yy = static_cast<float>(a[u] + c[u] - 2 * b[u]);
    const auto xy = static_cast<float>(a[u - 2] + c[u + 2] - a[u + 2] - c[u - 2]) / 4;
    out[static_cast<std::size_t>(u)] = xy * xy - xx * yy;
  }
}

SaddlePoint saddle_at(const Picture& p, int u, int v) {
  SaddlePoint s{static_cast<float>(u), static_cast<float>(v)};
  s.xx = static_cast<float>(p.at(u - 2, v) + p.at(u + 2, v) - 2 * p.at(u, v));
  s.yy = static_cast<float>(p.at(u, v - 2) + p.at(u, v + 2) - 2 * p.at(u, v));
  s.xy = static_cast<float>(p.at(u - 2, v - 2) + p.at(u + 2, v + 2) - p.at(u + 2, v - 2) - p.at(u - 2, v + 2)) / 4;
  return s;
}

/// Black and white alternate exactly four times on a ring around the point (Bennett and Lasenby 2014 in idea).
bool alternates(const Picture& p, int u, int v) {
  constexpr int kReach = 4;
  constexpr std::array<std::array<int, 2>, 16> kRing = {{{4, 0},
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
  if (u < kReach || v < kReach || u + kReach >= p.width || v + kReach >= p.height) return false;
  std::array<int, kRing.size()> ring{};
  for (std::size_t i = 0; i < ring.size(); ++i) ring[i] = p.at(u + kRing[i][0], v + kRing[i][1]);
  const auto [low, high] = std::minmax_element(ring.begin(), ring.end());
  constexpr int kContrastMin = 16 * 10;  // ten grey levels
  if (*high - *low < kContrastMin) return false;
  const int middle = (*low + *high) / 2;
  int changes = 0;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    changes += (ring[i] > middle) != (ring[(i + 1) % ring.size()] > middle) ? 1 : 0;
  }
  return changes == 4;
}

/// `values` is consumed.
std::array<int, 2> percentiles(std::vector<int>& values) {
  const auto at = [&](std::size_t percent) {
    const auto nth = values.begin() + static_cast<std::ptrdiff_t>(values.size() * percent / 100);
    std::nth_element(values.begin(), nth, values.end());
    return *nth;
  };
  return {at(2), at(98)};
}

SaddlePoints find_at_this_size(GrayImage image) {
  if (image.width < 16 || image.height < 16) return {};
  const Picture p = smoothed(image);
  constexpr float kResponseMin = 16 * 16 * 5 * 5;  // curvature of five grey levels each way
  std::array<std::vector<float>, 3> rows;          // responses of the rows v-1, v, v+1
  for (auto& row : rows) row.assign(static_cast<std::size_t>(p.width), 0.0F);
  saddle_response(p, 2, rows[1]);
  saddle_response(p, 3, rows[2]);
  std::vector<int> columns, lines;
  SaddlePoints points;
  for (int v = 3; v + 3 < p.height; ++v) {
    std::rotate(rows.begin(), rows.begin() + 1, rows.end());
    saddle_response(p, v + 1, rows[2]);
    for (std::size_t u = 3; u + 3 < static_cast<std::size_t>(p.width); ++u) {
      const float here = rows[1][u];
      if (here < kResponseMin) continue;
      const float before = std::max({rows[0][u - 1], rows[0][u], rows[0][u + 1], rows[1][u - 1]});
      const float after = std::max({rows[1][u + 1], rows[2][u - 1], rows[2][u], rows[2][u + 1]});
      // Not >= on both sides: two equal neighbours count once.
      if (here > before && here >= after && alternates(p, static_cast<int>(u), v)) {
        columns.push_back(static_cast<int>(u));
        lines.push_back(v);
        points.points.push_back(saddle_at(p, static_cast<int>(u), v));
      }
    }
  }
  points.count = static_cast<int>(columns.size());
  if (columns.empty()) return points;
  const auto [left, right] = percentiles(columns);
  const auto [top, bottom] = percentiles(lines);
  points.left = left;
  points.right = right;
  points.top = top;
  points.bottom = bottom;
  return points;
}

}  // namespace

SaddlePoints find_saddle_points_full(GrayImage image) { return find_at_this_size(image); }

SaddlePoints find_saddle_points_halved(GrayImage image) {
  const std::vector<std::uint8_t> pixels = halved(image);
  SaddlePoints found = find_at_this_size({pixels.data(), image.width / 2, image.height / 2});
  found.left *= 2, found.top *= 2, found.right *= 2, found.bottom *= 2;
  // The middle of a pixel of the half-size picture lies between two of the full one.
  for (SaddlePoint& s : found.points) s.u = 2 * s.u + 0.5F, s.v = 2 * s.v + 0.5F;
  return found;
}

SaddlePoints find_saddle_points(GrayImage image) {
  const SaddlePoints full = find_at_this_size(image);
  SaddlePoints half = find_saddle_points_halved(image);
  return full.count >= half.count ? full : half;
}

}  // namespace firstlook
