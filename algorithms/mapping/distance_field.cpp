#include "algorithms/mapping/distance_field.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "platform/core/ensure.hpp"

namespace firstlook {
namespace {

// values_ are floats, cut off at most this far from the exact root for any grid of metres: taken off the bound.
constexpr double kRounding_m = 1e-6;

std::size_t to_size(int n) { return static_cast<std::size_t>(n); }

}  // namespace

DistanceField::DistanceField(const GridGeometry& geometry, double distance_max_m)
    : geometry_(geometry), distance_max_m_(distance_max_m), per_m_(1 / geometry.resolution_m) {
  ENSURE(3011, geometry.resolution_m > 0 && (geometry.size.array() > 0).all() && distance_max_m > 0);
  squared_.assign(geometry.count(), 0);
  values_.assign(geometry.count(), 0);
  const std::size_t line = to_size(geometry.size.maxCoeff()) + 2;
  line_.assign(line, 0);
  site_.assign(line, 0);
  start_.assign(line, 0);
}

std::size_t DistanceField::required_bytes(const GridGeometry& geometry) {
  return geometry.count() * (sizeof(std::int32_t) + sizeof(float)) +
         3 * sizeof(std::int32_t) * (to_size(geometry.size.maxCoeff()) + 2);
}

void DistanceField::rebuild(std::span<const std::uint8_t> free_mask) {
  ENSURE(3012, free_mask.size() == squared_.size());
  scan_rows(free_mask);
  scan_lines(1);
  scan_lines(2);
  const auto cut = static_cast<float>(distance_max_m_);
  const auto resolution = static_cast<float>(geometry_.resolution_m);
  for (std::size_t i = 0; i < values_.size(); ++i)
    values_[i] = std::min(cut, resolution * std::sqrt(static_cast<float>(squared_[i])));
}

// Distance along x to the nearest voxel that is not free; the voxels just outside the row are not free.
void DistanceField::scan_rows(std::span<const std::uint8_t> free_mask) {
  const std::size_t nx = to_size(geometry_.size.x());
  for (std::size_t row = 0; row < squared_.size(); row += nx) {
    std::int32_t run = 0;
    for (std::size_t x = 0; x < nx; ++x) {
      run = free_mask[row + x] != 0 ? run + 1 : 0;
      squared_[row + x] = run;
    }
    run = 0;
    for (std::size_t x = nx; x-- > 0;) {
      run = free_mask[row + x] != 0 ? run + 1 : 0;
      const std::int32_t nearer = std::min(run, squared_[row + x]);
      squared_[row + x] = nearer * nearer;
    }
  }
}

// Lower envelope of the parabolas of one line after another (Meijster et al. 2000, second phase). Position 0 and
// n + 1 of a line are the voxels outside the grid, at distance 0; so the first parabola is never replaced.
void DistanceField::scan_lines(int axis) {
  const auto n = static_cast<std::int32_t>(geometry_.size[axis]);
  const std::size_t nx = to_size(geometry_.size.x()), ny = to_size(geometry_.size.y());
  const std::size_t stride = axis == 1 ? nx : nx * ny;
  const std::size_t others = axis == 1 ? to_size(geometry_.size.z()) : ny;
  const std::size_t others_stride = axis == 1 ? nx * ny : nx;
  for (std::size_t other = 0; other < others; ++other) {
    for (std::size_t x = 0; x < nx; ++x) {
      const std::size_t first = other * others_stride + x;
      line_[0] = line_[to_size(n) + 1] = 0;
      for (std::int32_t i = 0; i < n; ++i) line_[to_size(i) + 1] = squared_[first + to_size(i) * stride];

      std::size_t top = 0;
      site_[0] = start_[0] = 0;
      const auto height = [&](std::int32_t at, std::int32_t site) {
        return (at - site) * (at - site) + line_[to_size(site)];
      };
      for (std::int32_t u = 1; u <= n + 1; ++u) {
        while (top > 0 && height(start_[top], site_[top]) > height(start_[top], u)) --top;
        const std::int32_t s = site_[top];
        const std::int32_t numerator = u * u - s * s + line_[to_size(u)] - line_[to_size(s)];
        const std::int32_t from = 1 + numerator / (2 * (u - s));
        if (from > n + 1) continue;
        ++top;
        site_[top] = u;
        start_[top] = from;
      }
      for (std::int32_t u = n + 1; u >= 0; --u) {
        if (u >= 1 && u <= n) squared_[first + to_size(u - 1) * stride] = height(u, site_[top]);
        if (u == start_[top] && top > 0) --top;
      }
    }
  }
}

double DistanceField::distance_m(const Eigen::Vector3d& point_m) const {
  std::array<int, 3> v{};     // the lower of the two centres around the point; -1 is outside the grid
  std::array<double, 3> f{};  // how far the point is from it towards the upper one
  double spread = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    // In voxels from the centre of the voxel before the first one, so that cutting off rounds down.
    const double p = point_m[axis] * per_m_ - geometry_.first[axis] + 0.5;
    if (!(p >= 0.5 && p < geometry_.size[axis] + 0.5)) return 0;
    const int whole = static_cast<int>(p);
    v[i] = whole - 1;
    f[i] = p - whole;
    spread += f[i] * (1 - f[i]);
  }
  double squared = 0;
  for (int dz = 0; dz < 2; ++dz) {
    const double wz = dz != 0 ? f[2] : 1 - f[2];
    for (int dy = 0; dy < 2; ++dy) {
      const double wy = wz * (dy != 0 ? f[1] : 1 - f[1]);
      for (int dx = 0; dx < 2; ++dx) {
        const int x = v[0] + dx, y = v[1] + dy, z = v[2] + dz;
        if (!geometry_.contains({x, y, z})) continue;  // outside the grid nothing is free
        const auto d = static_cast<double>(values_[geometry_.index({x, y, z})]);
        squared += wy * (dx != 0 ? f[0] : 1 - f[0]) * d * d;
      }
    }
  }
  squared -= spread * geometry_.resolution_m * geometry_.resolution_m;
  return squared > 0 ? std::max(0.0, std::sqrt(squared) - kRounding_m) : 0;
}

}  // namespace firstlook
