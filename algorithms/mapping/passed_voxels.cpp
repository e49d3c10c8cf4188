#include "algorithms/mapping/passed_voxels.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "algorithms/mapping/lanes.hpp"
#include "algorithms/mapping/ray_marker.hpp"
#include "platform/core/fixed_vector.hpp"
#include "platform/core/processor.hpp"

namespace firstlook {
namespace {

using namespace lanes;  // boxes of a row, pixels of a row

const Eigen::Vector3i kBrick(kLanes, 4, 4);
constexpr float kNear_m = 1e-3F;  // boxes that come nearer than this to the camera's plane have no footprint
constexpr int kSmall_px = 8;      // footprints up to this width are searched row by row, others cell by cell:
constexpr int kFineLevel = 2;     // cells of 4 x 4 pixels
constexpr int kCoarseLevel = 3;   // and of 8 x 8 for those that are wider than eight fine ones

/// The exponents of positive numbers: floor(log2(x)).
[[gnu::always_inline]] inline void exponents(const Floats& x, Ints& out) {
  std::memcpy(&out, &x, sizeof(out));
  out = (out >> 23) - 127;
}
[[gnu::always_inline]] inline void clamp(Ints& x, std::int32_t low, std::int32_t high) {
  x = x < low ? Ints{} + low : x;
  x = x > high ? Ints{} + high : x;
}

/// A pyramid as the vectors read it.
struct Levels {
  const float* data;
  std::int32_t stride, rows, first;
};
Levels levels_of(const Pyramid& p) { return {p.data(), p.stride(), p.rows(), p.first_level()}; }
[[gnu::always_inline]] inline void look_up(const Levels& l, const Ints& level, const Ints& u, const Ints& v,
                                           Floats& out) {
  const Ints row = l.rows - (l.rows >> (level - l.first));
  gather(l.data, (row + (v >> level)) * l.stride + (u >> level), out);
}

/// Eight boxes in a row against the image. Camera coordinates.
struct BoxRow {
  float center_m[3];  // of the first box
  float step_m[3];    // from one to the next
  float half_m[3];    // of their bounding boxes
  float fx, fy, cx, cy;
  float u_max, v_max;              // the last pixel
  float side_slope[4], side_m[4];  // planes around the image, and how far beside them a middle is surely beside
  float rounding_m;
  float footprint_px_m, slack_px;
  float ball_px_m;  // voxels: times 1 / depth: how far beside a middle, in pixels along both axes, a ray still meets it
  float whole_far_m;  // bricks: up to this depth every voxel is met by all rays of the 2 x 2 pixels at its middle
  std::int32_t level_max;
  Levels cell_farthest, around_farthest, around_nearest;
};
struct BoxAnswers {
  unsigned rejected = 0;  // no ray enters it
  unsigned passed = 0;    // a ray leaves it: each of its voxels
};

template <bool kBricks>
[[gnu::always_inline]] inline BoxAnswers ask_boxes(const BoxRow& b) {
  const Floats x = b.center_m[0] + kCounting * b.step_m[0];
  const Floats y = b.center_m[1] + kCounting * b.step_m[1];
  const Floats z = b.center_m[2] + kCounting * b.step_m[2];
  const Floats in = z - b.half_m[2], out = z + b.half_m[2];
  Ints rejected = out < 0.0F;
  rejected |= x - b.side_slope[0] * z < -b.side_m[0];
  rejected |= b.side_slope[1] * z - x < -b.side_m[1];
  rejected |= y - b.side_slope[2] * z < -b.side_m[2];
  rejected |= b.side_slope[3] * z - y < -b.side_m[3];
  if (!any(~rejected)) return {0xFF, 0};

  const Ints in_front = in > kNear_m;
  const Floats over_z = 1.0F / (in_front ? z : Floats{} + 1.0F);
  Floats u = x * over_z * b.fx + (b.cx + 0.5F);
  Floats v = y * over_z * b.fy + (b.cy + 0.5F);
  const Ints in_image = (u >= 0.0F) & (u < b.u_max + 1) & (v >= 0.0F) & (v < b.v_max + 1);
  u = u > 0.0F ? u : Floats{};
  v = v > 0.0F ? v : Floats{};
  u = u < b.u_max ? u : Floats{} + b.u_max;
  v = v < b.v_max ? v : Floats{} + b.v_max;
  const Ints column = __builtin_convertvector(u, Ints);
  const Ints row = __builtin_convertvector(v, Ints);

  const Floats around_px = b.footprint_px_m / (in_front ? in : Floats{} + kNear_m) + b.slack_px;
  Ints level;
  exponents(around_px, level);
  level += 1;
  clamp(level, 1, b.level_max);
  Floats farthest;
  look_up(b.around_farthest, level, column, row, farthest);
  const Floats enters = in - 2 * b.rounding_m;
  rejected |= farthest < (enters > 0.0F ? enters : Floats{});

  const Floats leaves = out + 2 * b.rounding_m;
  Floats reach;
  Ints sure;
  if constexpr (kBricks) {
    look_up(b.around_nearest, level, column, row, reach);
    sure = in_front & (out < b.whole_far_m);
  } else {
    const Floats ball_px = b.ball_px_m * over_z + 0.5F;
    sure = in_front & in_image & (ball_px >= 1.0F);
    exponents(ball_px, level);
    clamp(level, 0, b.level_max);
    look_up(b.cell_farthest, level, column, row, reach);
  }
  return {bits_of(rejected), bits_of(sure & (reach > leaves))};
}
FIRSTLOOK_AVX2 BoxAnswers ask_voxels_avx2(const BoxRow& b) { return ask_boxes<false>(b); }
BoxAnswers ask_voxels_portable(const BoxRow& b) { return ask_boxes<false>(b); }
FIRSTLOOK_AVX2 BoxAnswers ask_bricks_avx2(const BoxRow& b) { return ask_boxes<true>(b); }
BoxAnswers ask_bricks_portable(const BoxRow& b) { return ask_boxes<true>(b); }

/// Rows of eight rays against a voxel. Depths along the optical axis count the way along a ray.
struct RayTest {
  float rotation[3][3];  // base_R_depth
  float fx_inverse, fy_inverse, cx, cy;
  float rounding_m;
  float to_center_m[3];  // from the camera to the voxel's middle, base axes
  float half_m;
  float enters_m, leaves_m;  // nearest and farthest depth of its box, without and with rounding
  const float* reach_m;      // of the first row
  std::int32_t stride;
  float u, v;     // of the first ray
  float step_px;  // from one ray to the next
  int rows;
};
struct Rays {
  Floats along[3];  // direction, base axes; one along the optical axis
};
[[gnu::always_inline]] inline void rays_of_row(const RayTest& t, int row, Rays& rays) {
  const Floats x = (kCounting * t.step_px + (t.u - t.cx)) * t.fx_inverse;
  const float y = (static_cast<float>(row) * t.step_px + t.v - t.cy) * t.fy_inverse;
  for (int i = 0; i < 3; ++i) rays.along[i] = t.rotation[i][0] * x + (t.rotation[i][1] * y + t.rotation[i][2]);
}
[[gnu::always_inline]] inline void magnitude(const Floats& x, Floats& out) { out = x < 0.0F ? -x : x; }

/// How far the lines of rays pass beside a cube's silhouette along three axes, at most; negative: they meet it.
[[gnu::always_inline]] inline void miss(const RayTest& t, const Rays& r, float half_m, Floats& out) {
  Floats size[3];
  for (int i = 0; i < 3; ++i) magnitude(r.along[i], size[i]);
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    Floats beside;
    magnitude(t.to_center_m[j] * r.along[k] - t.to_center_m[k] * r.along[j], beside);
    beside -= half_m * (size[j] + size[k]);
    out = i == 0 || beside > out ? beside : out;
  }
}

/// Where each ray enters and leaves the cube of half edge `half_m`.
struct Crossing {
  Floats in, out;
};
[[gnu::always_inline]] inline void cross(const RayTest& t, const Rays& r, float half_m, Crossing& c) {
  for (int i = 0; i < 3; ++i) {
    const Ints backwards = r.along[i] < 0.0F;
    const Floats size = backwards ? -r.along[i] : r.along[i];
    const Floats per_m = 1.0F / (size > 1e-12F ? size : Floats{} + 1e-12F);
    const Floats way = t.to_center_m[i] * per_m;
    const Floats middle = backwards ? -way : way;
    const Floats in = middle - half_m * per_m, out = middle + half_m * per_m;
    c.in = i == 0 || in > c.in ? in : c.in;
    c.out = i == 0 || out < c.out ? out : c.out;
  }
}

struct RayAnswer {
  bool passed = false;        // a ray certainly passes
  std::uint64_t perhaps = 0;  // rays that rounding could decide, eight of each row
};
/// A voxel is passed by a ray that leaves it before the ray ends.
[[gnu::always_inline]] inline RayAnswer ask_rays(const RayTest& t) {
  RayAnswer answer;
  for (int row = 0; row < t.rows; ++row) {
    Floats reach;
    std::memcpy(&reach, t.reach_m + row * t.stride, sizeof(reach));
    Ints meets = (reach > t.enters_m) & (reach > 0.0F);
    if (!any(meets)) continue;
    Rays rays;
    rays_of_row(t, row, rays);
    Floats beside;
    miss(t, rays, t.half_m, beside);
    meets &= beside <= t.rounding_m;
    if (!any(meets)) continue;
    if (any(meets & (beside < -t.rounding_m) & (reach > t.leaves_m)) && t.enters_m > kNear_m) return {true, 0};
    Crossing outer, inner;
    cross(t, rays, t.half_m + t.rounding_m, outer);
    meets &= (outer.in <= outer.out) & (outer.out >= -t.rounding_m) & (outer.in <= reach + t.rounding_m);
    if (!any(meets)) continue;
    cross(t, rays, t.half_m - t.rounding_m, inner);
    const Ints sure = meets & (inner.in < inner.out) & (inner.out > t.rounding_m) & (outer.out < reach - t.rounding_m);
    if (any(sure)) return {true, 0};
    const Floats leaves = inner.out < outer.out ? inner.out : outer.out;
    answer.perhaps |= static_cast<std::uint64_t>(bits_of(meets & (leaves <= reach + t.rounding_m))) << (row * kLanes);
  }
  return answer;
}
FIRSTLOOK_AVX2 RayAnswer ask_rays_avx2(const RayTest& t) { return ask_rays(t); }
RayAnswer ask_rays_portable(const RayTest& t) { return ask_rays(t); }

/// The middles of eight cells against a cube that is larger by how far a cell's other rays are from its middle: one bit
/// for each cell whose rays could enter the voxel before they end.
[[gnu::always_inline]] inline unsigned ask_cells(const RayTest& t) {
  Floats reach;
  std::memcpy(&reach, t.reach_m, sizeof(reach));
  const Ints reaches = (reach > t.enters_m) & (reach > 0.0F);
  if (!any(reaches)) return 0;
  Rays rays;
  rays_of_row(t, 0, rays);
  Crossing outer;
  cross(t, rays, t.half_m, outer);
  return bits_of(reaches & (outer.in <= outer.out) & (outer.out >= -t.rounding_m) & (outer.in <= reach + t.rounding_m));
}
FIRSTLOOK_AVX2 unsigned ask_cells_avx2(const RayTest& t) { return ask_cells(t); }
unsigned ask_cells_portable(const RayTest& t) { return ask_cells(t); }

/// A voxel's silhouette: rays pass it where each of six linear functions of the pixel, distances times depth beside its
/// edges, is not positive (Pineda 1988).
struct Silhouette {
  static constexpr std::size_t kEdges = 6;
  float at[kEdges], per_u[kEdges], per_v[kEdges];
};
/// Cells of the image against a silhouette: eight columns, up to eight rows.
struct CellTest {
  Silhouette edges;      // in cells from the first one on, widened by half a cell and rounding
  float enters_m;        // nearest depth of the voxel's box
  const float* reach_m;  // of the first row
  std::int32_t stride;
  int rows;
};
/// The cells where a ray could pass the voxel, eight bits for each row.
[[gnu::always_inline]] inline std::uint64_t ask_silhouette(const CellTest& t) {
  const Silhouette& s = t.edges;
  Floats column[Silhouette::kEdges];
  for (std::size_t edge = 0; edge < Silhouette::kEdges; ++edge) column[edge] = s.at[edge] + kCounting * s.per_u[edge];
  std::uint64_t open = 0;
  for (int row = 0; row < t.rows; ++row) {
    Floats reach;
    std::memcpy(&reach, t.reach_m + row * t.stride, sizeof(reach));
    const Ints reaches = (reach > t.enters_m) & (reach > 0.0F);
    if (!any(reaches)) continue;
    Floats beside = column[0] + static_cast<float>(row) * s.per_v[0];
    for (std::size_t edge = 1; edge < Silhouette::kEdges; ++edge) {
      const Floats other = column[edge] + static_cast<float>(row) * s.per_v[edge];
      beside = other > beside ? other : beside;
    }
    open |= static_cast<std::uint64_t>(bits_of(reaches & (beside <= 0.0F))) << (row * kLanes);
  }
  return open;
}
FIRSTLOOK_AVX2 std::uint64_t ask_silhouette_avx2(const CellTest& t) { return ask_silhouette(t); }
std::uint64_t ask_silhouette_portable(const CellTest& t) { return ask_silhouette(t); }

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

struct Pixel {
  int u, v;
};
/// Pixels from (u_low, v_low) to (u_high, v_high), both included.
struct PixelRect {
  int u_low = 0, v_low = 0, u_high = -1, v_high = -1;
  [[nodiscard]] bool empty() const { return u_low > u_high || v_low > v_high; }
};

/// One frame, held against the voxels of a grid.
class Frame {
 public:
  Frame(const GridGeometry& geometry, const DepthRays& rays, const RangeImage& image, const DepthImage& depth,
        const Transform<Base, Depth>& base_T_depth, std::span<const std::uint64_t> hits,
        std::span<std::uint64_t> plane);
  void mark();

 private:
  void prepare(BoxRow& row, const Eigen::Vector3i& box, float slack_px) const;
  static void place(BoxRow& row, const Eigen::Vector3d& center_m);
  [[nodiscard]] Eigen::Vector3d in_camera(const Eigen::Vector3d& voxel) const;
  [[nodiscard]] PixelRect footprint(const Eigen::Vector3f& center_m) const;
  void mark_brick(const Eigen::Vector3i& low, bool all);
  void mark_row(const Eigen::Vector3i& low);
  [[nodiscard]] bool is_passed(const Eigen::Vector3i& row, int lane);
  [[nodiscard]] bool is_passed_in_footprint(const PixelRect& rect);
  [[nodiscard]] bool is_passed_in_columns(int u, int v_low, int v_high);
  [[nodiscard]] bool find_silhouette(const PixelRect& rect, Silhouette& silhouette) const;
  [[nodiscard]] bool is_passed_in_silhouette(const PixelRect& rect, const Silhouette& silhouette);
  [[nodiscard]] bool is_passed_in_cells(const PixelRect& rect);
  [[nodiscard]] bool is_walked(const Pixel& pixel) const;

  const GridGeometry& geometry_;
  const DepthRays& rays_;
  RayFrame ray_frame_;
  const RangeImage& image_;
  const DepthImage& depth_;
  const Transform<Base, Depth>& base_T_depth_;
  std::span<const std::uint64_t> hits_;
  std::span<std::uint64_t> plane_;
  RayMarker marker_;

  const CameraIntrinsics& camera_;
  Eigen::Matrix3d depth_R_base_;
  Eigen::Vector3d origin_m_;   // rounded to float as the rays' is
  double rounding_m_ = 0;      // no rounding of a ray's geometry, here or in OctoMap's walk, reaches this
  double pixel_diagonal_ = 0;  // slope between the rays of diagonal neighbours
  double half_m_ = 0;          // half a voxel
  BoxRow voxels_{}, bricks_{};
  // The voxel that is being held against rays.
  Eigen::Vector3i voxel_;
  RayTest test_{};
  float along_[3][3];  // direction of the ray of pixel (0, 0), base axes, and its change from column to column and row
                       // to row
  FixedVector<Pixel, 256> perhaps_;  // rays that rounding could decide: walked when no other one passes
};

Frame::Frame(const GridGeometry& geometry, const DepthRays& rays, const RangeImage& image, const DepthImage& depth,
             const Transform<Base, Depth>& base_T_depth, std::span<const std::uint64_t> hits,
             std::span<std::uint64_t> plane)
    : geometry_(geometry),
      rays_(rays),
      ray_frame_(rays.frame(depth.units_per_m, base_T_depth)),
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
  // Floats hold 6e-8 of their size: some ten such errors add up in a ray's ends, direction and crossings.
  rounding_m_ = 4e-6 * rays.range_m() + 1e-6 * origin_m_.cwiseAbs().maxCoeff();
  pixel_diagonal_ = std::hypot(1 / camera_.fx, 1 / camera_.fy);
  // From a voxel's middle to its pixel half a pixel is lost to rounding, and as much to the middle's own pixel.
  prepare(voxels_, Eigen::Vector3i::Ones(), 0.51F);
  prepare(bricks_, kBrick, 1.02F);

  RayTest& t = test_;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) t.rotation[i][j] = static_cast<float>(depth_R_base_(j, i));
  }
  t.fx_inverse = static_cast<float>(1 / camera_.fx);
  t.fy_inverse = static_cast<float>(1 / camera_.fy);
  t.cx = static_cast<float>(camera_.cx);
  t.cy = static_cast<float>(camera_.cy);
  t.rounding_m = static_cast<float>(rounding_m_);
  t.half_m = static_cast<float>(half_m_);
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d axis = depth_R_base_.col(i);
    along_[i][0] =
        static_cast<float>(axis.z() - axis.x() * camera_.cx / camera_.fx - axis.y() * camera_.cy / camera_.fy);
    along_[i][1] = static_cast<float>(axis.x() / camera_.fx);
    along_[i][2] = static_cast<float>(axis.y() / camera_.fy);
  }
  t.step_px = 1;
  t.stride = image.cell_farthest().stride();
}

/// What is the same for all rows of boxes of one size (in voxels).
void Frame::prepare(BoxRow& b, const Eigen::Vector3i& box, float slack_px) const {
  const Eigen::Vector3d half_m = depth_R_base_.cwiseAbs() * box.cast<double>() * half_m_;
  const Eigen::Vector3d step_m = depth_R_base_.col(0) * (geometry_.resolution_m * box.x());
  const double slope[4] = {-camera_.cx / camera_.fx, (camera_.width - 1 - camera_.cx) / camera_.fx,
                           -camera_.cy / camera_.fy, (camera_.height - 1 - camera_.cy) / camera_.fy};
  double footprint_px_m = 0;
  for (int side = 0; side < 4; ++side) {
    const double across_m = half_m[side / 2] + std::abs(slope[side]) * half_m.z();
    const double f = side < 2 ? camera_.fx : camera_.fy;
    footprint_px_m = std::max(footprint_px_m, f * across_m);
    b.side_slope[side] = static_cast<float>(slope[side]);
    b.side_m[side] = static_cast<float>(across_m + 2 * rounding_m_);
  }
  for (int i = 0; i < 3; ++i) {
    b.half_m[i] = static_cast<float>(half_m[i]);
    b.step_m[i] = static_cast<float>(step_m[i]);
  }
  b.fx = static_cast<float>(camera_.fx);
  b.fy = static_cast<float>(camera_.fy);
  b.cx = static_cast<float>(camera_.cx);
  b.cy = static_cast<float>(camera_.cy);
  b.u_max = static_cast<float>(camera_.width - 1);
  b.v_max = static_cast<float>(camera_.height - 1);
  b.rounding_m = static_cast<float>(rounding_m_);
  b.footprint_px_m = static_cast<float>(footprint_px_m);
  b.slack_px = slack_px;
  // Within its inscribed ball a ray meets a voxel for certain; half a pixel is off already where the middle lies.
  b.ball_px_m = static_cast<float>((half_m_ - 2 * rounding_m_) / (1.002 * pixel_diagonal_));
  b.whole_far_m = b.ball_px_m / 1.5F;
  b.level_max = image_.level_max();
  b.cell_farthest = levels_of(image_.cell_farthest());
  b.around_farthest = levels_of(image_.around_farthest());
  b.around_nearest = levels_of(image_.around_nearest());
}

void Frame::place(BoxRow& b, const Eigen::Vector3d& center_m) {
  for (int i = 0; i < 3; ++i) b.center_m[i] = static_cast<float>(center_m[i]);
}

/// From coordinates in voxels of the grid.
Eigen::Vector3d Frame::in_camera(const Eigen::Vector3d& voxel) const {
  return depth_R_base_ * ((geometry_.first.cast<double>() + voxel) * geometry_.resolution_m - origin_m_);
}

/// Pixels whose rays could meet a voxel in front of the camera.
PixelRect Frame::footprint(const Eigen::Vector3f& center_m) const {
  constexpr float kSlack_px = 0.01F;
  const Eigen::Vector3f half_m(voxels_.half_m[0], voxels_.half_m[1], voxels_.half_m[2]);
  const Eigen::Vector3f a = center_m - half_m, b = center_m + half_m;
  const float over_near = 1 / a.z(), over_far = 1 / b.z();
  const auto low = [&](float x, float f, float c) { return x * (x < 0 ? over_near : over_far) * f + c - kSlack_px; };
  const auto high = [&](float x, float f, float c) { return x * (x > 0 ? over_near : over_far) * f + c + kSlack_px; };
  const auto first = [](float pixel) {
    const int cut = static_cast<int>(pixel);
    return cut + static_cast<int>(static_cast<float>(cut) < pixel);
  };
  PixelRect rect;
  rect.u_low = first(std::clamp(low(a.x(), voxels_.fx, voxels_.cx), 0.0F, voxels_.u_max + 1));
  rect.u_high = static_cast<int>(std::clamp(high(b.x(), voxels_.fx, voxels_.cx), -1.0F, voxels_.u_max));
  rect.v_low = first(std::clamp(low(a.y(), voxels_.fy, voxels_.cy), 0.0F, voxels_.v_max + 1));
  rect.v_high = static_cast<int>(std::clamp(high(b.y(), voxels_.fy, voxels_.cy), -1.0F, voxels_.v_max));
  return rect;
}

void Frame::mark() {
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
      for (int x = first.x(); x <= last.x(); x += kLanes) {
        const Eigen::Vector3i low = kBrick.cwiseProduct(Eigen::Vector3i(x, y, z));
        place(bricks_, in_camera(low.cast<double>() + kBrick.cast<double>() / 2));
        const BoxAnswers answers = has_avx2() ? ask_bricks_avx2(bricks_) : ask_bricks_portable(bricks_);
        const unsigned lanes = (1U << std::min(kLanes, last.x() - x + 1)) - 1;
        for (unsigned open = lanes & ~answers.rejected; open != 0; open &= open - 1) {
          const int lane = std::countr_zero(open);
          mark_brick({low.x() + lane * kBrick.x(), low.y(), low.z()}, (answers.passed >> lane & 1) != 0);
        }
      }
    }
  }
}

void Frame::mark_brick(const Eigen::Vector3i& low, bool all) {
  const Eigen::Vector3i high = (low + kBrick).cwiseMin(geometry_.size);
  const Eigen::Vector3d first_m = in_camera(low.cast<double>() + Eigen::Vector3d::Constant(0.5));
  const Eigen::Vector3d step_y_m = depth_R_base_.col(1) * geometry_.resolution_m;
  const Eigen::Vector3d step_z_m = depth_R_base_.col(2) * geometry_.resolution_m;
  for (int z = low.z(); z < high.z(); ++z) {
    for (int y = low.y(); y < high.y(); ++y) {
      const Eigen::Vector3i row(low.x(), y, z);
      if (all) {
        set_bits(plane_, geometry_.index(row), (1U << (high.x() - low.x())) - 1);
      } else {
        place(voxels_, first_m + (y - low.y()) * step_y_m + (z - low.z()) * step_z_m);
        mark_row(row);
      }
    }
  }
}

/// voxels_ are in place.
void Frame::mark_row(const Eigen::Vector3i& low) {
  const std::size_t index = geometry_.index(low);
  const unsigned lanes = (1U << std::min(kLanes, geometry_.size.x() - low.x())) - 1;
  const BoxAnswers answers = has_avx2() ? ask_voxels_avx2(voxels_) : ask_voxels_portable(voxels_);
  unsigned passed = answers.passed & ~answers.rejected & lanes;
  for (unsigned open = lanes & ~answers.rejected & ~passed & ~read_bits(hits_, index); open != 0; open &= open - 1) {
    const int lane = std::countr_zero(open);
    if (is_passed(low, lane)) passed |= 1U << lane;
  }
  if (passed != 0) set_bits(plane_, index, passed);
}

/// A voxel of the row that is in place.
bool Frame::is_passed(const Eigen::Vector3i& row, int lane) {
  voxel_ = row + Eigen::Vector3i(lane, 0, 0);
  Eigen::Vector3f center_m;
  for (int i = 0; i < 3; ++i) {
    center_m[i] = voxels_.center_m[i] + static_cast<float>(lane) * voxels_.step_m[i];
    test_.to_center_m[i] =
        static_cast<float>((geometry_.first[i] + voxel_[i] + 0.5) * geometry_.resolution_m - origin_m_[i]);
  }
  const float near_m = center_m.z() - voxels_.half_m[2], far_m = center_m.z() + voxels_.half_m[2];
  test_.enters_m = near_m - 2 * voxels_.rounding_m;
  test_.leaves_m = far_m + 2 * voxels_.rounding_m;
  perhaps_.clear();
  PixelRect rect{0, 0, camera_.width - 1, camera_.height - 1};
  if (near_m > kNear_m) rect = footprint(center_m);
  if (rect.empty()) return false;
  if (is_passed_in_footprint(rect)) return true;
  return std::any_of(perhaps_.begin(), perhaps_.end(), [&](const Pixel& pixel) { return is_walked(pixel); });
}

bool Frame::is_passed_in_footprint(const PixelRect& rect) {
  if (rect.u_high - rect.u_low >= kSmall_px) {
    Silhouette silhouette;
    return find_silhouette(rect, silhouette) ? is_passed_in_silhouette(rect, silhouette) : is_passed_in_cells(rect);
  }
  return is_passed_in_columns(rect.u_low, rect.v_low, rect.v_high);
}

/// @return false where rays of the footprint go both ways along an axis: the silhouette's edges differ then
bool Frame::find_silhouette(const PixelRect& rect, Silhouette& silhouette) const {
  float sign[3];
  for (int i = 0; i < 3; ++i) {
    const auto [first, per_u, per_v] = along_[i];
    const float corner = first + static_cast<float>(rect.u_low) * per_u + static_cast<float>(rect.v_low) * per_v;
    const float across = static_cast<float>(rect.u_high - rect.u_low) * per_u;
    const float down = static_cast<float>(rect.v_high - rect.v_low) * per_v;
    const float low = corner + std::min(across, 0.0F) + std::min(down, 0.0F);
    const float high = corner + std::max(across, 0.0F) + std::max(down, 0.0F);
    if (low < 0 && high > 0) return false;
    sign[i] = low < 0 ? -1 : 1;
  }
  float* const terms[3] = {silhouette.at, silhouette.per_u, silhouette.per_v};
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    for (int term = 0; term < 3; ++term) {
      const float beside = test_.to_center_m[j] * along_[k][term] - test_.to_center_m[k] * along_[j][term];
      const float half = test_.half_m * (sign[j] * along_[j][term] + sign[k] * along_[k][term]);
      terms[term][2 * i] = beside - half;
      terms[term][2 * i + 1] = -beside - half;
    }
  }
  return true;
}

bool Frame::is_passed_in_silhouette(const PixelRect& rect, const Silhouette& silhouette) {
  const int level = rect.u_high - rect.u_low < (kLanes - 1) << kFineLevel ? kFineLevel : kCoarseLevel;
  const int x_low = rect.u_low >> level, x_high = rect.u_high >> level;
  const int y_low = rect.v_low >> level, y_high = rect.v_high >> level;
  const auto cell_px = static_cast<float>(1 << level);
  const float to_middle_px = (cell_px - 1) / 2;
  CellTest cells;
  cells.enters_m = test_.enters_m;
  cells.stride = test_.stride;
  for (std::size_t edge = 0; edge < Silhouette::kEdges; ++edge) {
    cells.edges.per_u[edge] = silhouette.per_u[edge] * cell_px;
    cells.edges.per_v[edge] = silhouette.per_v[edge] * cell_px;
  }
  for (int y = y_low; y <= y_high; y += kLanes) {
    cells.rows = std::min(kLanes, y_high - y + 1);
    for (int x = x_low; x <= x_high; x += kLanes) {
      const float u = static_cast<float>(x) * cell_px + to_middle_px,
                  v = static_cast<float>(y) * cell_px + to_middle_px;
      for (std::size_t edge = 0; edge < Silhouette::kEdges; ++edge) {
        const float per_u = silhouette.per_u[edge], per_v = silhouette.per_v[edge];
        const float spread = to_middle_px * (std::abs(per_u) + std::abs(per_v));
        cells.edges.at[edge] = silhouette.at[edge] + u * per_u + v * per_v - spread - 2 * test_.rounding_m;
      }
      cells.reach_m = image_.cell_farthest().row(level, y) + x;
      std::uint64_t open = has_avx2() ? ask_silhouette_avx2(cells) : ask_silhouette_portable(cells);
      const int columns = std::min(kLanes, x_high - x + 1);
      while (open != 0) {
        const int cell = std::countr_zero(open), column = cell % kLanes, row = y + cell / kLanes;
        // A look at eight columns is one at two fine cells.
        open &= ~((level == kFineLevel && column + 1 < kLanes ? 3ULL : 1ULL) << cell);
        if (column >= columns) continue;
        const int v_low = std::max(rect.v_low, row << level), v_high = std::min(rect.v_high, ((row + 1) << level) - 1);
        if (is_passed_in_columns((x + column) << level, v_low, v_high)) return true;
      }
    }
  }
  return false;
}

bool Frame::is_passed_in_cells(const PixelRect& rect) {
  constexpr int kCell = 1 << kCoarseLevel;
  constexpr float kToMiddle_px = (kCell - 1) / 2.0F;
  // As far as a cell's other rays are from its middle's within the voxel.
  const float spread_m = kToMiddle_px * static_cast<float>(pixel_diagonal_) * std::max(0.0F, test_.leaves_m);
  RayTest cells = test_;
  cells.half_m = static_cast<float>(half_m_ + 2 * rounding_m_) + spread_m;
  cells.enters_m -= spread_m;
  cells.step_px = kCell;
  for (int y = rect.v_low / kCell; y <= rect.v_high / kCell; ++y) {
    const int v_low = std::max(rect.v_low, y * kCell), v_high = std::min(rect.v_high, y * kCell + kCell - 1);
    cells.v = static_cast<float>(y * kCell) + kToMiddle_px;
    for (int x = rect.u_low / kCell; x <= rect.u_high / kCell; x += kLanes) {
      cells.u = static_cast<float>(x * kCell) + kToMiddle_px;
      cells.reach_m = image_.cell_farthest().row(kCoarseLevel, y) + x;
      for (unsigned open = has_avx2() ? ask_cells_avx2(cells) : ask_cells_portable(cells); open != 0;
           open &= open - 1) {
        if (is_passed_in_columns((x + std::countr_zero(open)) * kCell, v_low, v_high)) return true;
      }
    }
  }
  return false;
}

/// Eight columns of pixels from `u` on.
bool Frame::is_passed_in_columns(int u, int v_low, int v_high) {
  RayTest& t = test_;
  t.u = static_cast<float>(u);
  for (int v = v_low; v <= v_high; v += kLanes) {
    t.v = static_cast<float>(v);
    t.reach_m = image_.cell_farthest().row(0, v) + u;
    t.rows = std::min(kLanes, v_high - v + 1);
    RayAnswer answer = has_avx2() ? ask_rays_avx2(t) : ask_rays_portable(t);
    if (answer.passed) return true;
    for (; answer.perhaps != 0; answer.perhaps &= answer.perhaps - 1) {
      const int i = std::countr_zero(answer.perhaps);
      const Pixel pixel{u + i % kLanes, v + i / kLanes};
      if (!perhaps_.full()) {
        perhaps_.push_back(pixel);
      } else if (is_walked(pixel)) {
        return true;
      }
    }
  }
  return false;
}

bool Frame::is_walked(const Pixel& pixel) const {
  return marker_.passes(rays_.ray(ray_frame_, depth_, pixel.u, pixel.v).end_m, voxel_);
}

}  // namespace

void mark_passed_voxels(const GridGeometry& geometry, const DepthRays& rays, const RangeImage& image,
                        const DepthImage& depth, const Transform<Base, Depth>& base_T_depth,
                        std::span<const std::uint64_t> hits, std::span<std::uint64_t> plane) {
  Frame(geometry, rays, image, depth, base_T_depth, hits, plane).mark();
}

}  // namespace firstlook
