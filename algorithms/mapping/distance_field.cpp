#include "algorithms/mapping/distance_field.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "platform/core/ensure.hpp"
#include "platform/core/processor.hpp"

namespace firstlook {
namespace {

// values_ are floats, cut off at most this far from the exact root for any grid of metres: taken off the bound.
constexpr double kRounding_m = 1e-6;

std::size_t to_size(int n) { return static_cast<std::size_t>(n); }

/// One row among its neighbours along another axis.
struct Neighbours {
  const std::uint16_t* row;
  std::ptrdiff_t stride;  // to the next row along the axis
  int before, after;      // rows on either side; beyond them nothing is free
  int reach;
  std::size_t size;
};

/// out = min over k of row[k] + k², from the row itself outwards until nothing nearer can come.
[[gnu::always_inline]] inline void lower_envelope(const Neighbours& n, std::uint16_t* __restrict out) {
  const int edge = std::min({n.before + 1, n.after + 1, n.reach});
  const auto outside = static_cast<std::uint16_t>(edge * edge);
  for (std::size_t x = 0; x < n.size; ++x) out[x] = std::min(n.row[x], outside);
  std::uint16_t farthest = outside;
  for (int k = 1; k < edge && k * k < farthest; ++k) {
    const auto square = static_cast<std::uint16_t>(k * k);
    const std::uint16_t* before = n.row - k * n.stride;
    const std::uint16_t* after = n.row + k * n.stride;
    farthest = 0;
    for (std::size_t x = 0; x < n.size; ++x) {
      const auto through = static_cast<std::uint16_t>(std::min(before[x], after[x]) + square);
      out[x] = std::min(out[x], through);
      farthest = std::max(farthest, out[x]);
    }
  }
}
FIRSTLOOK_AVX2 void lower_envelope_avx2(const Neighbours& n, std::uint16_t* out) { lower_envelope(n, out); }
void lower_envelope_portable(const Neighbours& n, std::uint16_t* out) { lower_envelope(n, out); }

}  // namespace

DistanceField::DistanceField(const GridGeometry& geometry, double distance_max_m)
    : geometry_(geometry),
      distance_max_m_(std::min(distance_max_m, kReachMax * geometry.resolution_m)),
      per_m_(1 / geometry.resolution_m) {
  ENSURE(3011, geometry.resolution_m > 0 && (geometry.size.array() > 0).all() && distance_max_m > 0);
  reach_ = std::min(kReachMax, static_cast<int>(std::ceil(distance_max_m_ / geometry.resolution_m)));
  const std::size_t rows = to_size(geometry.size.y()) * to_size(geometry.size.z());
  free_.assign(geometry.count(), 0);
  along_x_.assign(geometry.count(), 0);
  within_layer_.assign(geometry.count(), 0);
  values_.assign(geometry.count(), 0);
  row_changed_.assign(rows, 0);
  layer_changed_.assign(rows, 0);
  scratch_.assign(to_size(geometry.size.x()), 0);
}

std::size_t DistanceField::required_bytes(const GridGeometry& geometry) {
  return geometry.count() * (sizeof(std::uint8_t) + 2 * sizeof(std::uint16_t) + sizeof(float)) +
         2 * to_size(geometry.size.y()) * to_size(geometry.size.z()) +
         sizeof(std::uint16_t) * to_size(geometry.size.x());
}

std::size_t DistanceField::update(std::span<const std::uint8_t> free_mask) {
  ENSURE(3012, free_mask.size() == values_.size());
  follow_mask(free_mask);
  add_axis_y();
  return add_axis_z();
}

// Along x two runs tell all; the voxels just outside the row are not free.
void DistanceField::follow_mask(std::span<const std::uint8_t> free_mask) {
  const std::size_t nx = to_size(geometry_.size.x());
  for (std::size_t row = 0; row < row_changed_.size(); ++row) {
    const auto mask = free_mask.subspan(row * nx, nx);
    std::uint8_t* kept = free_.data() + row * nx;
    row_changed_[row] = std::equal(mask.begin(), mask.end(), kept) ? 0 : 1;
    if (row_changed_[row] == 0) continue;
    std::copy(mask.begin(), mask.end(), kept);
    std::uint16_t* squared = along_x_.data() + row * nx;
    int run = 0;
    for (std::size_t x = 0; x < nx; ++x) {
      run = mask[x] != 0 ? std::min(run + 1, reach_) : 0;
      squared[x] = static_cast<std::uint16_t>(run);
    }
    run = 0;
    for (std::size_t x = nx; x-- > 0;) {
      run = mask[x] != 0 ? std::min(run + 1, reach_) : 0;
      const int nearer = std::min<int>(run, squared[x]);
      squared[x] = static_cast<std::uint16_t>(nearer * nearer);
    }
  }
}

bool DistanceField::any_near(const std::vector<std::uint8_t>& rows, std::size_t first, std::size_t stride, int middle,
                             int count) const {
  const int last = std::min(count - 1, middle + reach_);
  for (int i = std::max(0, middle - reach_); i <= last; ++i) {
    if (rows[first + to_size(i) * stride] != 0) return true;
  }
  return false;
}

void DistanceField::add_axis_y() {
  const std::size_t nx = to_size(geometry_.size.x());
  const int ny = geometry_.size.y();
  for (std::size_t row = 0; row < row_changed_.size(); ++row) {
    const int y = static_cast<int>(row) % ny;
    layer_changed_[row] = 0;
    if (!any_near(row_changed_, row - to_size(y), 1, y, ny)) continue;
    const Neighbours rows{along_x_.data() + row * nx, geometry_.size.x(), y, ny - 1 - y, reach_, nx};
    has_avx2() ? lower_envelope_avx2(rows, scratch_.data()) : lower_envelope_portable(rows, scratch_.data());
    std::uint16_t* kept = within_layer_.data() + row * nx;
    if (std::equal(scratch_.begin(), scratch_.end(), kept)) continue;
    std::copy(scratch_.begin(), scratch_.end(), kept);
    layer_changed_[row] = 1;
  }
}

std::size_t DistanceField::add_axis_z() {
  const std::size_t nx = to_size(geometry_.size.x()), ny = to_size(geometry_.size.y());
  const int nz = geometry_.size.z();
  const auto cut = static_cast<float>(distance_max_m_);
  const auto resolution = static_cast<float>(geometry_.resolution_m);
  std::size_t updated = 0;
  for (std::size_t row = 0; row < layer_changed_.size(); ++row) {
    const int z = static_cast<int>(row / ny);
    if (!any_near(layer_changed_, row % ny, ny, z, nz)) continue;
    const Neighbours rows{
        within_layer_.data() + row * nx, static_cast<std::ptrdiff_t>(nx * ny), z, nz - 1 - z, reach_, nx};
    has_avx2() ? lower_envelope_avx2(rows, scratch_.data()) : lower_envelope_portable(rows, scratch_.data());
    float* value = values_.data() + row * nx;
    for (std::size_t x = 0; x < nx; ++x)
      value[x] = std::min(cut, resolution * std::sqrt(static_cast<float>(scratch_[x])));
    ++updated;
  }
  return updated;
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
  const bool inside = v[0] >= 0 && v[1] >= 0 && v[2] >= 0 && v[0] + 1 < geometry_.size.x() &&
                      v[1] + 1 < geometry_.size.y() && v[2] + 1 < geometry_.size.z();
  double squared = 0;
  if (inside) {
    const std::size_t row = to_size(geometry_.size.x()), layer = row * to_size(geometry_.size.y());
    const float* const first = values_.data() + geometry_.index({v[0], v[1], v[2]});
    for (int dz = 0; dz < 2; ++dz) {
      const double wz = dz != 0 ? f[2] : 1 - f[2];
      for (int dy = 0; dy < 2; ++dy) {
        const double wy = wz * (dy != 0 ? f[1] : 1 - f[1]);
        const float* const pair = first + to_size(dz) * layer + to_size(dy) * row;
        const double d0 = pair[0], d1 = pair[1];
        squared += wy * (1 - f[0]) * d0 * d0;
        squared += wy * f[0] * d1 * d1;
      }
    }
  } else {
    for (int corner = 0; corner < 8; ++corner) {
      const int dx = corner & 1, dy = corner >> 1 & 1, dz = corner >> 2;
      const Eigen::Vector3i at(v[0] + dx, v[1] + dy, v[2] + dz);
      if (!geometry_.contains(at)) continue;  // outside the grid nothing is free
      const double wy = (dz != 0 ? f[2] : 1 - f[2]) * (dy != 0 ? f[1] : 1 - f[1]);
      const auto d = static_cast<double>(values_[geometry_.index(at)]);
      squared += wy * (dx != 0 ? f[0] : 1 - f[0]) * d * d;
    }
  }
  squared -= spread * geometry_.resolution_m * geometry_.resolution_m;
  return squared > 0 ? std::max(0.0, std::sqrt(squared) - kRounding_m) : 0;
}

}  // namespace firstlook
