#include "algorithms/mapping/ray_cast.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "algorithms/mapping/lanes.hpp"
#include "platform/core/ensure.hpp"
#include "platform/core/processor.hpp"

namespace firstlook {
namespace {

// A ray as origin + t * direction with t from 0 to 1, in voxels of the grid.
struct Ray {
  Eigen::Vector3d origin;
  Eigen::Vector3d direction;
};

// The part of a ray inside the grid; empty when from >= to.
struct Interval {
  double from = 0;
  double to = 1;
};

Interval clip(const Ray& ray, const Eigen::Vector3i& size) {
  Interval inside;
  for (int axis = 0; axis < 3; ++axis) {
    const double o = ray.origin[axis], d = ray.direction[axis];
    if (d == 0) {
      if (o < 0 || o >= size[axis]) return {1, 0};
      continue;
    }
    const double a = -o / d, b = (size[axis] - o) / d;
    inside.from = std::max(inside.from, std::min(a, b));
    inside.to = std::min(inside.to, std::max(a, b));
  }
  return inside;
}

// One step for each voxel (Amanatides and Woo 1987). `visit` gets the voxel's index and the t where the ray leaves it,
// and returns false to stop.
template <typename Visit>
void walk(const Ray& ray, const GridGeometry& geometry, Visit visit) {
  const Interval inside = clip(ray, geometry.size);
  if (!(inside.from < inside.to)) return;
  const Eigen::Vector3d entry = ray.origin + inside.from * ray.direction;
  const std::array<std::ptrdiff_t, 3> stride = {1, geometry.size.x(),
                                                static_cast<std::ptrdiff_t>(geometry.size.x()) * geometry.size.y()};
  std::array<double, 3> next{}, delta{};
  std::array<std::ptrdiff_t, 3> step{};
  std::array<int, 3> left{};  // voxels between this one and the grid's face ahead
  std::ptrdiff_t index = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    const double d = ray.direction[axis];
    const int at = std::clamp(static_cast<int>(std::floor(entry[axis])), 0, geometry.size[axis] - 1);
    index += at * stride[i];
    next[i] = delta[i] = std::numeric_limits<double>::infinity();
    if (d == 0) continue;
    next[i] = ((d > 0 ? at + 1 : at) - ray.origin[axis]) / d;
    delta[i] = 1 / std::abs(d);
    step[i] = d > 0 ? stride[i] : -stride[i];
    left[i] = d > 0 ? geometry.size[axis] - 1 - at : at;
  }
  while (true) {
    const std::size_t axis = next[0] < next[1] ? (next[0] < next[2] ? 0 : 2) : (next[1] < next[2] ? 1 : 2);
    if (!visit(static_cast<std::size_t>(index), next[axis])) return;
    if (next[axis] >= inside.to || left[axis] == 0) return;
    next[axis] += delta[axis];
    index += step[axis];
    --left[axis];
  }
}

/// Calls visit(column, row) tile by tile, what is left at the edges last.
template <typename Visit>
void for_each_in_tiles(int columns, int rows, Visit visit) {
  constexpr int kTileColumns = 4, kTileRows = 2;
  for (int top = 0; top < rows; top += kTileRows) {
    for (int left = 0; left < columns; left += kTileColumns) {
      for (int row = top; row < std::min(rows, top + kTileRows); ++row) {
        for (int column = left; column < std::min(columns, left + kTileColumns); ++column) visit(column, row);
      }
    }
  }
}

/// One view being counted.
struct View {
  const GainPlane& plane;
  GainScratch& scratch;
  Ray ray;  // of all: the origin
  Eigen::Matrix3d rotation;
  double range_min_m;
  GainCount count;

  View(const GainPlane& p, const Transform<Base, Depth>& base_T_depth, double min_m, GainScratch& s)
      : plane(p), scratch(s), rotation(base_T_depth.rotation() / p.geometry().resolution_m), range_min_m(min_m) {
    ENSURE(3034, base_T_depth.pose().matrix().allFinite());
    ray.origin = base_T_depth.translation() / p.geometry().resolution_m - p.geometry().first.cast<double>();
    scratch.begin();
  }
  /// A ray has come to a voxel. @return false where it ends
  bool meet(std::size_t index, bool far_enough) {
    const std::uint8_t what = plane.what()[index];
    const bool has_weight = what >= 1 && what <= kGainWeightMax;
    const bool is_new = scratch.mark(index, has_weight && far_enough);
    count.voxels += is_new ? 1 : 0;
    count.weight += is_new ? what : 0;
    return what == 0 || (what != kOpaque && plane.reading() == UnknownReading::kSeeThrough);
  }
  void walk_to(const Eigen::Vector3d& end_m) {
    ray.direction = rotation * end_m;
    const double t_min = range_min_m / end_m.z();
    walk(ray, plane.geometry(), [&](std::size_t index, double t_leave) { return meet(index, t_leave > t_min); });
  }
};

using namespace lanes;

/// What is the same for all packets of a view, in voxels.
struct Eye {
  float rotation[3][3];
  float in_voxel[3];      // where in its voxel the sensor stands, 0 to 1
  std::int32_t voxel[3];  // inside the grid
  std::int32_t after[3];  // voxels between it and the grid's upper faces
  std::int32_t stride[3];
  std::int32_t index, count;
  const std::uint8_t* room;
  float rounding;  // floats may be off by this
  float range_min_m;
  bool is_stopped;  // a ray ends where it first has something to do
};
/// Rays that have come to a voxel where there is something to do, and those that must be walked instead.
struct Arrivals {
  unsigned at = 0, near = 0, walked = 0;  // near: nearer than the minimum range
  std::int32_t index[kLanes];
};

/// Eight rays on their way. Each counts voxels in its own direction, so that all go upwards.
struct Way {
  Floats size[3], per[3];  // of the direction of length one, and its inverse
  Floats from[3];          // where in its voxel the ray starts
  Floats at[3];            // voxels gone along each axis
  Floats left[3];
  Ints stride[3];
  Ints octant;          // where its room begins
  Floats end, nearest;  // lengths: of the ray, and to the minimum range
  Ints active, unsure;  // unsure: rounding could mean the next voxel instead
};

/// @param ends_m  of eight rays, sensor axes
[[gnu::always_inline]] inline void start(const Eye& eye, const Eigen::Vector3d* ends_m, unsigned lanes, Way& way) {
  Floats end_m[3], direction[3], squared{};
  load_points(ends_m->data(), end_m);
  for (int i = 0; i < 3; ++i) {
    direction[i] = eye.rotation[i][0] * end_m[0] + eye.rotation[i][1] * end_m[1] + eye.rotation[i][2] * end_m[2];
    squared += direction[i] * direction[i];
  }
  for (int i = 0; i < kLanes; ++i) way.end[i] = std::sqrt(squared[i]);
  const Floats per_length = 1.0F / way.end;
  Ints octant{};
  for (int i = 0; i < 3; ++i) {
    const Ints backwards = direction[i] < 0.0F;
    const Floats size = (backwards ? -direction[i] : direction[i]) * per_length;
    way.size[i] = size > 1e-12F ? size : Floats{} + 1e-12F;
    way.per[i] = 1.0F / way.size[i];
    way.from[i] = backwards ? Floats{} + (1.0F - eye.in_voxel[i]) : Floats{} + eye.in_voxel[i];
    way.left[i] = __builtin_convertvector(backwards ? Ints{} + eye.voxel[i] : Ints{} + eye.after[i], Floats);
    way.stride[i] = backwards ? Ints{} - eye.stride[i] : Ints{} + eye.stride[i];
    way.at[i] = Floats{};
    octant |= backwards & (1 << i);
  }
  way.octant = octant * eye.count;
  way.nearest = eye.range_min_m / end_m[2] * way.end;
  constexpr Ints kBits = {1, 2, 4, 8, 16, 32, 64, 128};
  way.active = ((Ints{} + static_cast<std::int32_t>(lanes)) & kBits) != 0;
  way.unsure = Ints{};
}

/// From one room to the next. @return false when no ray is left
[[gnu::always_inline]] inline bool advance(const Eye& eye, Way& way, Arrivals& arrivals) {
  const float rounding = eye.rounding;
  Ints index = Ints{} + eye.index;
  for (int i = 0; i < 3; ++i) index += __builtin_convertvector(way.at[i], Ints) * way.stride[i];
  index = way.active ? index : Ints{} + eye.index;
  Ints room;
  gather_bytes(eye.room, index + way.octant, room);
  const Ints lost = way.active & way.unsure & (room <= 1);
  const Ints going = way.active & ~lost, arrived = going & (room == 0);

  const Floats clear = __builtin_convertvector(room > 1 ? room : Ints{} + 1, Floats);
  Floats beyond[3], leaves[3];
  for (int i = 0; i < 3; ++i) {
    beyond[i] = way.at[i] + clear;
    leaves[i] = (beyond[i] - way.from[i]) * way.per[i];
  }
  const Ints x = (leaves[0] <= leaves[1]) & (leaves[0] <= leaves[2]);
  const Ints y = ~x & (leaves[1] <= leaves[2]);
  const Ints through[3] = {x, y, ~x & ~y};
  const Floats leave = x ? leaves[0] : y ? leaves[1] : leaves[2];

  arrivals.at = bits_of(arrived);
  arrivals.walked = bits_of(lost);
  arrivals.near = 0;
  Ints done = ~going;
  if (arrivals.at != 0) {
    std::memcpy(arrivals.index, &index, sizeof(index));
    const Floats over = leave - way.nearest;
    arrivals.near = bits_of(over <= 0.0F);
    const Ints undecided = arrived & (over < rounding) & (over > -rounding);
    if (const unsigned bits = bits_of(undecided); bits != 0 && eye.range_min_m > 0) {
      arrivals.at &= ~bits;
      arrivals.walked |= bits;
      done |= undecided;
    }
    if (eye.is_stopped) done |= arrived;
  }

  // On to the next room. The rays that end, or leave the grid, are done.
  const Floats over = leave - way.end;
  const Ints ends = over > -rounding;
  if (any(ends & ~done)) {
    arrivals.walked |= bits_of(ends & ~done & (over < rounding));
    done |= ends;
  }
  way.unsure = Ints{};
  for (int i = 0; i < 3; ++i) {
    const Floats point = way.from[i] + leave * way.size[i];
    // Where rounding could decide, the lower one: its room holds both.
    const Floats whole = __builtin_convertvector(__builtin_convertvector(point - rounding, Ints), Floats);
    way.unsure |= ~through[i] & (point - whole > 1.0F - rounding);
    way.at[i] = through[i] ? beyond[i] : whole;
    done |= way.at[i] > way.left[i];
  }
  const Ints active = ~done;
  way.active = active;
  return any(active);
}
FIRSTLOOK_AVX2 void start_avx2(const Eye& eye, const Eigen::Vector3d* ends_m, unsigned lanes, Way& way) {
  start(eye, ends_m, lanes, way);
}
void start_portable(const Eye& eye, const Eigen::Vector3d* ends_m, unsigned lanes, Way& way) {
  start(eye, ends_m, lanes, way);
}
FIRSTLOOK_AVX2 bool advance_avx2(const Eye& eye, Way& way, Arrivals& arrivals) { return advance(eye, way, arrivals); }
bool advance_portable(const Eye& eye, Way& way, Arrivals& arrivals) { return advance(eye, way, arrivals); }

Eye eye_of(const View& view) {
  const GridGeometry& g = view.plane.geometry();
  Eye eye{};
  const std::int32_t strides[3] = {1, g.size.x(), g.size.x() * g.size.y()};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) eye.rotation[i][j] = static_cast<float>(view.rotation(i, j));
    eye.voxel[i] = static_cast<std::int32_t>(view.ray.origin[i]);
    eye.in_voxel[i] = static_cast<float>(view.ray.origin[i] - eye.voxel[i]);
    eye.after[i] = g.size[i] - 1 - eye.voxel[i];
    eye.stride[i] = strides[i];
    eye.index += eye.voxel[i] * strides[i];
  }
  eye.count = static_cast<std::int32_t>(g.count());
  eye.room = view.plane.room().data();
  eye.is_stopped = view.plane.reading() == UnknownReading::kStop;
  // Some ten roundings of numbers up to the grid's size.
  eye.rounding = 1e-4F + 1e-6F * static_cast<float>(g.size.maxCoeff());
  eye.range_min_m = static_cast<float>(view.range_min_m);
  return eye;
}

/// A packet on its way, and what it needs when rounding decides.
struct Flight {
  Way way;
  std::span<const Eigen::Vector3d> ends_m;  // at most kLanes
  unsigned walked = 0;                      // lanes
  bool is_over = false;
};

void take_off(const Eye& eye, std::span<const Eigen::Vector3d> ends_m, Flight& flight) {
  const unsigned lanes = (1U << ends_m.size()) - 1;
  const auto begin = has_avx2() ? start_avx2 : start_portable;
  if (ends_m.size() == kLanes) {
    begin(eye, ends_m.data(), lanes, flight.way);
  } else {
    std::array<Eigen::Vector3d, kLanes> filled;
    filled.fill(ends_m.back());
    std::copy(ends_m.begin(), ends_m.end(), filled.begin());
    begin(eye, filled.data(), lanes, flight.way);
  }
  flight.ends_m = ends_m;
  flight.walked = 0;
  flight.is_over = false;
}

void arrive(View& view, const Arrivals& arrivals, Flight& flight) {
  flight.walked |= arrivals.walked;
  for (unsigned bits = arrivals.at; bits != 0; bits &= bits - 1) {
    const int lane = std::countr_zero(bits);
    const bool far_enough = (arrivals.near >> lane & 1) == 0;
    const auto voxel = static_cast<std::size_t>(arrivals.index[lane]);
    if (!view.meet(voxel, far_enough)) flight.way.active[lane] = 0;
  }
}

/// Some packets at once: each step of one waits for memory and for the step before, others fill the time.
void count_packets(View& view, const Eye& eye, std::span<const Eigen::Vector3d> ends_m) {
  constexpr std::size_t kTogether = 4;
  std::array<Flight, kTogether> flights;
  const auto step = has_avx2() ? advance_avx2 : advance_portable;
  for (std::size_t first = 0; first < ends_m.size(); first += kTogether * kLanes) {
    std::size_t flying = 0;
    for (std::size_t i = first; i < ends_m.size() && flying < kTogether; i += kLanes, ++flying)
      take_off(eye, ends_m.subspan(i, std::min<std::size_t>(kLanes, ends_m.size() - i)), flights[flying]);
    for (std::size_t left = flying; left > 0;) {
      for (Flight& flight : std::span(flights).first(flying)) {
        if (flight.is_over) continue;
        Arrivals arrivals;
        flight.is_over = !step(eye, flight.way, arrivals);
        if (flight.is_over) --left;
        if ((arrivals.at | arrivals.walked) != 0) arrive(view, arrivals, flight);
      }
    }
    for (const Flight& flight : std::span(flights).first(flying)) {
      for (unsigned bits = flight.walked; bits != 0; bits &= bits - 1)
        view.walk_to(flight.ends_m[static_cast<std::size_t>(std::countr_zero(bits))]);
    }
  }
}

/// A row of rooms being found. Rows have kRoomMax voxels of nothing on either side.
struct RowSweep {
  const std::uint8_t* rows[3];  // neighbours already swept, without these sides
  std::uint8_t* room;           // in: 0 where there is something to do
  std::uint8_t* cubes;          // scratch, as
  std::uint8_t* other;
  std::size_t size;
  std::ptrdiff_t ahead;  // 1 or -1
};
constexpr std::uint8_t kRoomMax = 254;

/// The largest empty cube with a voxel at its near corner is one larger than the smallest of those at the seven voxels
/// beyond it. Along the row that is a minimum over all voxels ahead, found by doubling.
[[gnu::always_inline]] inline void sweep_row(const RowSweep& row) {
  const RowSweep s = row;  // bytes that are written do not lie in it
  std::uint8_t* __restrict nearest = s.other;
  for (std::size_t x = 0; x < s.size; ++x) nearest[x] = std::min(std::min(s.rows[0][x], s.rows[1][x]), s.rows[2][x]);
  std::uint8_t* __restrict cubes = s.cubes;
  for (std::size_t x = 0; x < s.size; ++x) {
    const std::uint8_t smallest = std::min(nearest[x], nearest[static_cast<std::ptrdiff_t>(x) + s.ahead]);
    const auto grown = static_cast<std::uint8_t>(std::min<std::uint8_t>(smallest, kRoomMax - 1) + 1);
    cubes[x] = s.room[x] == 0 ? std::uint8_t{0} : grown;
  }
  std::uint8_t *from = s.cubes, *to = s.other;
  for (std::size_t step = 1; step < std::min<std::size_t>(s.size, kRoomMax); step *= 2) {
    const std::uint8_t* __restrict here = from;
    const std::uint8_t* __restrict there = from + s.ahead * static_cast<std::ptrdiff_t>(step);
    std::uint8_t* __restrict out = to;
    const auto grows = static_cast<std::uint8_t>(step), most = static_cast<std::uint8_t>(kRoomMax - step);
    for (std::size_t x = 0; x < s.size; ++x)
      out[x] = std::min(here[x], static_cast<std::uint8_t>(std::min(there[x], most) + grows));
    std::swap(from, to);
  }
  std::copy_n(from, s.size, s.room);
}
FIRSTLOOK_AVX2 void sweep_row_avx2(const RowSweep& s) { sweep_row(s); }
void sweep_row_portable(const RowSweep& s) { sweep_row(s); }

/// The rooms of rays that go backwards along the axes whose bits are set in `octant`.
/// @param room  in: 0 where there is something to do
void sweep_octant(const GridGeometry& g, unsigned octant, std::span<std::uint8_t> room,
                  std::span<std::uint8_t> scratch) {
  const auto nx = static_cast<std::size_t>(g.size.x());
  const auto padded_row = [&](std::size_t i) { return scratch.data() + i * (nx + 2 * kRoomMax) + kRoomMax; };
  std::fill(scratch.begin(), scratch.end(), kRoomMax);
  const int ahead_y = (octant & 2) != 0 ? -1 : 1, ahead_z = (octant & 4) != 0 ? -1 : 1;
  const auto row_at = [&](int y, int z) -> std::uint8_t* {
    if (y < 0 || z < 0 || y >= g.size.y() || z >= g.size.z()) return padded_row(2);  // nothing
    return room.data() +
           (static_cast<std::size_t>(z) * static_cast<std::size_t>(g.size.y()) + static_cast<std::size_t>(y)) * nx;
  };
  for (int k = 0; k < g.size.z(); ++k) {
    const int z = ahead_z > 0 ? g.size.z() - 1 - k : k;
    for (int j = 0; j < g.size.y(); ++j) {
      const int y = ahead_y > 0 ? g.size.y() - 1 - j : j;
      (has_avx2() ? sweep_row_avx2 : sweep_row_portable)(
          {.rows = {row_at(y + ahead_y, z), row_at(y, z + ahead_z), row_at(y + ahead_y, z + ahead_z)},
           .room = row_at(y, z),
           .cubes = padded_row(0),
           .other = padded_row(1),
           .size = nx,
           .ahead = (octant & 1) != 0 ? -1 : 1});
    }
  }
}

}  // namespace

GainRays GainRays::thesis() {
  constexpr int kColumns = 108, kRows = 78;
  constexpr double kPlane_m = 5.0, kWidth_m = 5.4296, kHeight_m = 3.9391;
  GainRays rays;
  for_each_in_tiles(kColumns, kRows, [&](int column, int row) {
    rays.ends_m.emplace_back(((column + 0.5) / kColumns - 0.5) * kWidth_m, ((row + 0.5) / kRows - 0.5) * kHeight_m,
                             kPlane_m);
  });
  return rays;
}

GainRays GainRays::pinhole(const CameraIntrinsics& c, int columns, int rows, double range_max_m) {
  ENSURE(3031, columns > 0 && rows > 0 && c.fx > 0 && c.fy > 0 && range_max_m > 0);
  GainRays rays;
  for_each_in_tiles(columns, rows, [&](int column, int row) {
    // Pixel centres are integers, so the image spans -0.5 .. width - 0.5.
    const double u = (column + 0.5) * c.width / columns - 0.5, v = (row + 0.5) * c.height / rows - 0.5;
    rays.ends_m.push_back(Eigen::Vector3d((u - c.cx) / c.fx, (v - c.cy) / c.fy, 1).normalized() * range_max_m);
  });
  return rays;
}

GainPlane::GainPlane(const GridGeometry& geometry)
    : geometry_(geometry), what_(geometry.count(), 0), room_(kOctants * geometry.count() + kReadBeyond, 0) {
  ENSURE(3049, geometry.count() < std::numeric_limits<std::int32_t>::max() / kOctants);
  rows_.resize(3 * (static_cast<std::size_t>(geometry.size.x()) + 2 * kRoomMax));
}

void GainPlane::prepare(UnknownReading reading) {
  reading_ = reading;
  const std::span<std::uint8_t> rooms(room_);
  for (unsigned octant = 0; octant < kOctants; ++octant) {
    const std::span<std::uint8_t> room = rooms.subspan(octant * what_.size(), what_.size());
    for (std::size_t i = 0; i < what_.size(); ++i) {
      const bool nothing = what_[i] == 0 || (what_[i] == kUnknownNoWeight && reading == UnknownReading::kSeeThrough);
      room[i] = nothing ? std::uint8_t{1} : std::uint8_t{0};
    }
    sweep_octant(geometry_, octant, room, rows_);
  }
}

void build_gain_plane(const VoxelMap& map, std::span<const std::uint8_t> weights, UnknownReading reading,
                      GainPlane& plane) {
  ENSURE(3032, plane.geometry() == map.geometry() && (weights.empty() || weights.size() == map.size()));
  const std::span<std::uint8_t> what = plane.what();
  for (std::size_t i = 0; i < what.size(); ++i) {
    switch (map.voxel_class(i)) {
      case VoxelClass::kFree:
        what[i] = 0;
        break;
      case VoxelClass::kOccupied:
        what[i] = kOpaque;
        break;
      case VoxelClass::kUnknown: {
        const std::uint8_t weight = weights.empty() ? std::uint8_t{1} : weights[i];
        what[i] = weight == 0 ? kUnknownNoWeight : std::min(weight, kGainWeightMax);
        break;
      }
    }
  }
  plane.prepare(reading);
}

GainScratch::GainScratch(const GridGeometry& geometry) : epoch_of_(geometry.count(), 0) {}

void GainScratch::begin() {
  if (++epoch_ != 0) return;
  std::fill(epoch_of_.begin(), epoch_of_.end(), std::uint8_t{0});  // marks of 256 views ago would count as this view's
  epoch_ = 1;
}

GainCount count_unknown(const GainPlane& plane, const GainRays& rays, const Transform<Base, Depth>& base_T_depth,
                        double range_min_m, GainScratch& scratch) {
  View view(plane, base_T_depth, range_min_m, scratch);
  const Eigen::Vector3d& o = view.ray.origin;
  const bool inside = (o.array() >= 0).all() && (o.array() < plane.geometry().size.cast<double>().array()).all();
  if (!inside) return count_unknown_by_walking(plane, rays, base_T_depth, range_min_m, scratch);
  const Eye eye = eye_of(view);
  count_packets(view, eye, rays.ends_m);
  return view.count;
}

GainCount count_unknown_by_walking(const GainPlane& plane, const GainRays& rays,
                                   const Transform<Base, Depth>& base_T_depth, double range_min_m,
                                   GainScratch& scratch) {
  View view(plane, base_T_depth, range_min_m, scratch);
  for (const Eigen::Vector3d& end_m : rays.ends_m) view.walk_to(end_m);
  return view.count;
}

}  // namespace firstlook
