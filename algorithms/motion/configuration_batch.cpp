#include "algorithms/motion/configuration_batch.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "algorithms/mapping/lanes.hpp"
#include "platform/core/ensure.hpp"
#include "platform/core/processor.hpp"

namespace firstlook {
namespace {

using lanes::any;
using lanes::Floats;
using lanes::Ints;
using lanes::kLanes;

constexpr double kPiece_m = 0.13;  // axes are halved until pieces are as short: radius and clearance are larger
constexpr std::size_t kPiecesMax = 160;
// In voxels: the field's bound is not lower than this from 0.1 m on. With mean distance m <= 0.87 voxels to the eight
// centres around it, d_bound^2 >= d^2 - 2 d m.
constexpr float kFieldSag = 1.3F;
// Floats of a few metres, and of angles up to some turns: points are off by some ten micrometres at most.
constexpr float kRounding_m = 1e-4F;
constexpr double kAngleMax_rad = 30;
constexpr float kFar_m = 1e3F;  // from any point that counts

/// What a joint does behind its turn: Tz(d) Tx(a) Rx(alpha) Ry(beta) Rz(gamma).
struct Row {
  float offset_rad;
  float turned[3][3];
  float moved[3];
};

/// A piece of a capsule's axis, and what its middle must keep.
struct Piece {
  int link;
  float middle_m[3];      // in the frame of its link
  float half_m;           // the ends are so far away
  float field_m, zone_m;  // distance to voxels, depth in the zone: with less the body is blocked
};

/// A capsule's axis, and two of them that must stay apart.
struct Axis {
  int link;
  float from_m[3], to_m[3];  // in the frame of its link
  float length2_m2;
};
struct Pair {
  int near, far;          // of Question::axes
  float apart_m;          // of the axes
  float balls_apart2_m2;  // farther than this the middles need no closer look
};

/// What one question needs, in floats.
struct Question {
  int joints = 0;
  float first[3][4]{};  // base_T_first
  std::array<Row, kJointsMax> rows{};
  std::array<Piece, kPiecesMax> pieces{};  // those that fail most often first
  int count = 0;
  bool tells_free = true;       // false: only what is blocked shows
  bool zone_tells_free = true;  // false: hits took parts of it
  FixedVector<Axis, kCapsulesMax> axes;
  FixedVector<Pair, kSelfPairsMax> pairs;
  const float* field = nullptr;  // null: nothing is mapped
  float per_m = 0, voxel_m = 0;
  float origin[3]{};  // of the grid, in voxels
  std::int32_t size[3]{};
  bool zone_counts = false;
  float zone_radius_m = 0, zone_low_m = 0, zone_high_m = 0;
};

void fill_rows(const ArmModel& arm, Question& q) {
  q.joints = arm.joints;
  const Eigen::Matrix<double, 3, 4> first = arm.base_T_first.matrix().topRows<3>();
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 4; ++k) q.first[i][k] = static_cast<float>(first(i, k));
  }
  for (int j = 0; j < arm.joints; ++j) {
    const auto index = static_cast<std::size_t>(j);
    const DhRow& dh = arm.dh[index];
    const Eigen::Matrix3d turned = (Eigen::AngleAxisd(dh.alpha_rad, Eigen::Vector3d::UnitX()) *
                                    Eigen::AngleAxisd(dh.beta_rad, Eigen::Vector3d::UnitY()) *
                                    Eigen::AngleAxisd(dh.gamma_rad, Eigen::Vector3d::UnitZ()))
                                       .toRotationMatrix();
    Row& row = q.rows[index];
    row.offset_rad = static_cast<float>(dh.theta_offset_rad);
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < 3; ++k) row.turned[i][k] = static_cast<float>(turned(i, k));
    }
    row.moved[0] = static_cast<float>(dh.a_m);
    row.moved[1] = 0;
    row.moved[2] = static_cast<float>(dh.d_m);
  }
}

void fill_pieces(const Body& body, const Clearance& need, double margin_m, Question& q) {
  for (std::size_t i = body.capsules.size(); i-- > 0;) {  // the outermost capsules fail most often
    if (body.exempt[i] != 0) continue;
    const Capsule& c = body.capsules[i];
    const double length_m = (c.b - c.a).norm(), least_m = margin_m + c.radius_m;
    int pieces = 1;
    while (length_m / pieces > kPiece_m) pieces *= 2;
    for (int k = 0; k < pieces; ++k) {
      if (q.count == static_cast<int>(kPiecesMax)) {
        q.tells_free = false;
        return;
      }
      const Eigen::Vector3d middle = c.a + (c.b - c.a) * (k + 0.5) / pieces;
      Piece& piece = q.pieces[static_cast<std::size_t>(q.count++)];
      piece.link = c.link;
      for (int axis = 0; axis < 3; ++axis) piece.middle_m[axis] = static_cast<float>(middle[axis]);
      piece.half_m = static_cast<float>(length_m / pieces / 2);
      piece.field_m = static_cast<float>(least_m + need.voxels_m);
      piece.zone_m = static_cast<float>(least_m + need.surface_m);
    }
  }
}

void fill_pairs(const Body& body, double margin_m, Question& q) {
  for (const Capsule& c : body.capsules) {
    Axis axis{.link = c.link, .from_m = {}, .to_m = {}, .length2_m2 = static_cast<float>((c.b - c.a).squaredNorm())};
    for (int i = 0; i < 3; ++i) {
      axis.from_m[i] = static_cast<float>(c.a[i]);
      axis.to_m[i] = static_cast<float>(c.b[i]);
    }
    q.axes.push_back(axis);
  }
  for (const SelfPair& pair : body.self_pairs) {
    const Capsule& n = body.capsules[static_cast<std::size_t>(pair.near)];
    const Capsule& f = body.capsules[static_cast<std::size_t>(pair.far)];
    const double apart_m = pair.axes_apart_m + margin_m;
    const double balls_m = std::max(0.0, apart_m + ((n.b - n.a).norm() + (f.b - f.a).norm()) / 2 + kRounding_m);
    q.pairs.push_back({.near = pair.near,
                       .far = pair.far,
                       .apart_m = static_cast<float>(apart_m),
                       .balls_apart2_m2 = static_cast<float>(balls_m * balls_m)});
  }
}

Question question_of(const ArmModel& arm, const Body& body, const FreeSpace& space, const Clearance& need,
                     double margin_m) {
  Question q;
  fill_rows(arm, q);
  fill_pieces(body, need, margin_m, q);
  fill_pairs(body, margin_m, q);
  q.tells_free &= space.field != nullptr && space.keep_out_boxes.empty() && space.keep_out_planes.empty();
  q.zone_tells_free = space.revoked == nullptr;
  if (space.field != nullptr) {
    const GridGeometry& g = space.field->geometry();
    q.field = space.field->values().data();
    q.per_m = static_cast<float>(1 / g.resolution_m);
    q.voxel_m = static_cast<float>(g.resolution_m);
    for (int axis = 0; axis < 3; ++axis) {
      q.origin[axis] = static_cast<float>(g.first[axis]);
      q.size[axis] = g.size[axis];
    }
  }
  q.zone_counts = space.zone_intact;
  q.zone_radius_m = static_cast<float>(space.zone.radius_m);
  q.zone_low_m = static_cast<float>(space.zone.floor_m);
  q.zone_high_m = static_cast<float>(space.zone.floor_m + space.zone.height_m);
  return q;
}

// Lanes are handed out by reference: by value they would be passed otherwise in functions with AVX2 than in others.
using Lanes3 = Floats[3];
[[gnu::always_inline]] inline void take_root(Floats& x) {
  for (int i = 0; i < kLanes; ++i) x[i] = std::sqrt(x[i]);
}

/// Taylor's series about the nearest quarter turn: within 1e-6 for some turns either way.
[[gnu::always_inline]] inline void sin_cos(const Floats& angle_rad, Floats& sine, Floats& cosine) {
  constexpr float kHalfPi = std::numbers::pi_v<float> / 2;
  constexpr float kHalfPiRest = static_cast<float>(std::numbers::pi / 2 - static_cast<double>(kHalfPi));
  const Floats turns = angle_rad * (1 / kHalfPi);
  const Ints quarter = __builtin_convertvector(turns + (turns < 0 ? -0.5F - Floats{} : 0.5F + Floats{}), Ints);
  const Floats whole = __builtin_convertvector(quarter, Floats);
  const Floats r = (angle_rad - whole * kHalfPi) - whole * kHalfPiRest;
  const Floats r2 = r * r;
  const Floats s = r + r * r2 * (-1.0F / 6 + r2 * (1.0F / 120 + r2 * (-1.0F / 5040 + r2 * (1.0F / 362880))));
  const Floats c =
      1 + r2 * (-0.5F + r2 * (1.0F / 24 + r2 * (-1.0F / 720 + r2 * (1.0F / 40320 + r2 * (-1.0F / 3628800)))));
  const Ints swaps = (quarter & 1) != 0;
  sine = swaps ? c : s;
  cosine = swaps ? s : c;
  sine = (quarter & 2) != 0 ? -sine : sine;
  cosine = ((quarter + 1) & 2) != 0 ? -cosine : cosine;
}

/// The frames of all links, as the rows of base_T_link, after forward().
struct Frames {
  Floats at[kJointsMax + 1][3][4];
};
[[gnu::always_inline]] inline void place_links(const Question& q, const Floats (&angles_rad)[kJointsMax],
                                               Frames& frames) {
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 4; ++k) frames.at[0][i][k] = Floats{} + q.first[i][k];
  }
  for (int j = 0; j < q.joints; ++j) {
    const Row& row = q.rows[static_cast<std::size_t>(j)];
    Floats s, c;
    sin_cos(angles_rad[j] + row.offset_rad, s, c);
    for (int i = 0; i < 3; ++i) {
      const Floats(&from)[4] = frames.at[j][i];
      Floats(&to)[4] = frames.at[j + 1][i];
      const Floats x = from[0] * c + from[1] * s;
      const Floats y = from[1] * c - from[0] * s;
      for (int k = 0; k < 3; ++k) {
        to[k] = x * row.turned[0][k] + y * row.turned[1][k] + from[2] * row.turned[2][k];
      }
      to[3] = from[3] + x * row.moved[0] + y * row.moved[1] + from[2] * row.moved[2];
    }
  }
}

/// Between what and what the distance to the nearest centre that is not free lies: the one at the centre of the point's
/// voxel, and the way to there. Outside the grid nothing is free.
[[gnu::always_inline]] inline void bound_distance(const Question& q, const Lanes3& p, Floats& at_least_m,
                                                  Floats& at_most_m) {
  Floats to_center2 = Floats{};
  Ints at[3], inside = Ints{} - 1;
  for (int i = 0; i < 3; ++i) {
    const Floats v = p[i] * q.per_m - q.origin[i];
    const Ints cut = __builtin_convertvector(v, Ints);
    const Floats up = __builtin_convertvector(cut, Floats) > v ? 1.0F + Floats{} : Floats{};
    at[i] = cut - __builtin_convertvector(up, Ints);
    const Floats off = v - (__builtin_convertvector(at[i], Floats) + 0.5F);
    to_center2 += off * off;
    inside &= (at[i] >= 0) & (at[i] < q.size[i]);
  }
  const Ints index = inside & ((at[2] * q.size[1] + at[1]) * q.size[0] + at[0]);
  take_root(to_center2);
  lanes::gather(q.field, index, at_most_m);
  const Floats center_m = inside ? at_most_m : Floats{};
  at_least_m = center_m - to_center2 * q.voxel_m;
  at_most_m = center_m + to_center2 * q.voxel_m;
}

/// What the field says of the point (DistanceField::distance_m); 0 in the outermost half voxel, too.
[[gnu::always_inline]] inline void read_field(const Question& q, const Lanes3& p, Floats& distance_m) {
  Ints at[3], inside = Ints{} - 1;
  Floats f[3], spread = Floats{};
  for (int i = 0; i < 3; ++i) {
    const Floats v = p[i] * q.per_m - q.origin[i] - 0.5F;
    at[i] = __builtin_convertvector(v, Ints);
    inside &= (v >= 0) & (at[i] + 1 < q.size[i]);
    f[i] = v - __builtin_convertvector(at[i], Floats);
    spread += f[i] * (1 - f[i]);
  }
  const std::int32_t row = q.size[0], layer = row * q.size[1];
  const Ints first = inside & (at[2] * layer + at[1] * row + at[0]);
  Floats squared = Floats{};
  for (int corner = 0; corner < 8; ++corner) {
    const int dx = corner & 1, dy = corner >> 1 & 1, dz = corner >> 2;
    const Ints index = first + (inside & (dz * layer + dy * row + dx));
    Floats d_m;
    lanes::gather(q.field, index, d_m);
    const Floats w = (dx != 0 ? f[0] : 1 - f[0]) * (dy != 0 ? f[1] : 1 - f[1]) * (dz != 0 ? f[2] : 1 - f[2]);
    squared += w * d_m * d_m;
  }
  squared -= spread * (q.voxel_m * q.voxel_m);
  distance_m = (inside & (squared > 0)) ? squared : Floats{};
  take_root(distance_m);
}

/// The depth of a point in the safe zone.
[[gnu::always_inline]] inline void find_depth_in_zone(const Question& q, const Lanes3& p, Floats& depth_m) {
  depth_m = p[0] * p[0] + p[1] * p[1];
  take_root(depth_m);
  depth_m = q.zone_radius_m - depth_m;
  const Floats below = q.zone_high_m - p[2], above = p[2] - q.zone_low_m;
  depth_m = below < depth_m ? below : depth_m;
  depth_m = above < depth_m ? above : depth_m;
}

/// What floats decide, a bit for each configuration; the others are neither.
struct Answer {
  unsigned blocked = 0, free = 0;
};

/// The point `m` of a link.
[[gnu::always_inline]] inline void place_point(const Frames& frames, int link, const float (&m)[3], Lanes3& p) {
  for (int axis = 0; axis < 3; ++axis) {
    const Floats(&row)[4] = frames.at[link][axis];
    p[axis] = row[0] * m[0] + row[1] * m[1] + row[2] * m[2] + row[3];
  }
}

/// An axis in base coordinates.
struct Segment {
  Lanes3 from, way, middle;
};
[[gnu::always_inline]] inline void clamp_share(Floats& x) {
  x = x > 0 ? x : Floats{};
  x = x < 1 ? x : 1.0F + Floats{};
}
[[gnu::always_inline]] inline void multiply(const Lanes3& a, const Lanes3& b, Floats& dot) {
  dot = a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/// As segment_distance_m: one point is the best for all of the other line, then each the best for the other. Floats do
/// not tell where axes that are nearly parallel come nearest: there the distance is too large by `excess_m` at most.
[[gnu::always_inline]] inline void find_distance(const Segment& a, float aa, const Segment& b, float bb,
                                                 Floats& distance_m, Floats& excess_m) {
  constexpr float kPoint_m2 = 1e-12F, kParallel = 1e-4F;  // square of the sine
  excess_m = Floats{};
  Lanes3 r;
  for (int i = 0; i < 3; ++i) r[i] = a.from[i] - b.from[i];
  Floats ar, br, ab;
  multiply(a.way, r, ar);
  multiply(b.way, r, br);
  multiply(a.way, b.way, ab);
  Floats s = Floats{}, t = Floats{};
  if (aa > kPoint_m2 && bb > kPoint_m2) {
    const Floats det = aa * bb - ab * ab;
    const Ints crosses = det > kParallel * aa * bb;
    s = (ab * br - ar * bb) / (crosses ? det : 1.0F + Floats{});
    s = crosses ? s : Floats{};
    excess_m = crosses ? Floats{} : std::sqrt(kParallel * std::max(aa, bb)) + Floats{};
    clamp_share(s);
  }
  if (bb > kPoint_m2) {
    t = (ab * s + br) / bb;
    clamp_share(t);
  }
  if (aa > kPoint_m2) {
    s = (ab * t - ar) / aa;
    clamp_share(s);
  }
  distance_m = Floats{};
  for (int i = 0; i < 3; ++i) {
    const Floats off = r[i] + a.way[i] * s - b.way[i] * t;
    distance_m += off * off;
  }
  take_root(distance_m);
}

/// Of those that are not blocked yet: which have two parts too near to each other, and which have none that might be.
[[gnu::always_inline]] inline void ask_pairs(const Question& q, const Frames& frames, Ints& blocked, Ints& free) {
  Segment axes[kCapsulesMax];
  for (std::size_t i = 0; i < q.axes.size(); ++i) {
    Segment& axis = axes[i];
    Lanes3 to;
    place_point(frames, q.axes[i].link, q.axes[i].from_m, axis.from);
    place_point(frames, q.axes[i].link, q.axes[i].to_m, to);
    for (int k = 0; k < 3; ++k) {
      axis.way[k] = to[k] - axis.from[k];
      axis.middle[k] = (to[k] + axis.from[k]) * 0.5F;
    }
  }
  for (const Pair& pair : q.pairs) {
    const Segment &near = axes[pair.near], &far = axes[pair.far];
    Lanes3 between;
    Floats distance_m, excess_m;
    for (int k = 0; k < 3; ++k) between[k] = near.middle[k] - far.middle[k];
    multiply(between, between, distance_m);
    if (!any(~blocked & (distance_m < pair.balls_apart2_m2))) continue;
    find_distance(near, q.axes[static_cast<std::size_t>(pair.near)].length2_m2, far,
                  q.axes[static_cast<std::size_t>(pair.far)].length2_m2, distance_m, excess_m);
    blocked |= distance_m < pair.apart_m - kRounding_m;
    free &= distance_m - excess_m > pair.apart_m + kRounding_m;
    if (!any(~blocked)) return;
  }
}

[[gnu::always_inline]] inline Answer decide(const Question& q, const Floats (&angles_rad)[kJointsMax]) {
  Frames frames;
  place_links(q, angles_rad, frames);
  Ints blocked = Ints{}, free = Ints{} - (q.tells_free ? 1 : 0);
  for (int i = 0; i < q.count; ++i) {
    const Piece& piece = q.pieces[static_cast<std::size_t>(i)];
    Lanes3 p;
    place_point(frames, piece.link, piece.middle_m, p);
    Floats depth_m = Floats{} - kFar_m, at_least_m = Floats{}, at_most_m = Floats{};
    if (q.zone_counts) find_depth_in_zone(q, p, depth_m);
    if (q.field != nullptr) bound_distance(q, p, at_least_m, at_most_m);
    blocked |= (depth_m < piece.zone_m - kRounding_m) & (at_most_m < piece.field_m - kRounding_m);
    if (!any(~blocked)) break;
    free &= ~blocked;
    const float free_m = piece.field_m + piece.half_m + kRounding_m;
    Ints holds = depth_m > piece.zone_m + piece.half_m + kRounding_m;
    holds &= Ints{} - (q.zone_tells_free ? 1 : 0);
    holds |= at_least_m > free_m + kFieldSag * q.voxel_m;
    if (any(free & ~holds)) {
      read_field(q, p, at_least_m);
      holds |= at_least_m > free_m;
    }
    free &= holds;
  }
  if (any(~blocked)) ask_pairs(q, frames, blocked, free);
  free &= ~blocked;
  return {.blocked = lanes::bits_of(blocked), .free = lanes::bits_of(free)};
}
FIRSTLOOK_AVX2 Answer decide_avx2(const Question& q, const Floats (&angles_rad)[kJointsMax]) {
  return decide(q, angles_rad);
}
Answer decide_portable(const Question& q, const Floats (&angles_rad)[kJointsMax]) { return decide(q, angles_rad); }

}  // namespace

void configurations_are_free(const ArmModel& arm, const Body& body, const FreeSpace& space, const Clearance& clearance,
                             std::span<const JointVector> q_rad, double margin_m, std::span<std::uint8_t> free) {
  ENSURE(4151, q_rad.size() == free.size());
  const Question question = question_of(arm, body, space, clearance, margin_m);
  const bool avx2 = has_avx2();
  for (std::size_t first = 0; first < q_rad.size(); first += kLanes) {
    const std::size_t count = std::min<std::size_t>(kLanes, q_rad.size() - first);
    Floats angles_rad[kJointsMax]{};
    std::array<bool, kLanes> fits{};  // the others are asked one by one
    for (std::size_t i = 0; i < count; ++i) {
      const JointVector& q = q_rad[first + i];
      fits[i] = within_limits(arm, q, kLimitMargin_rad) && q.max_abs() <= kAngleMax_rad;
      for (int j = 0; j < arm.joints && fits[i]; ++j) angles_rad[j][i] = static_cast<float>(q[j]);
    }
    const Answer answer = avx2 ? decide_avx2(question, angles_rad) : decide_portable(question, angles_rad);
    for (std::size_t i = 0; i < count; ++i) {
      const bool is_blocked = fits[i] && (answer.blocked >> i & 1) != 0;
      const bool is_clear = fits[i] && (answer.free >> i & 1) != 0;
      const bool is_free =
          is_clear || (!is_blocked && configuration_is_free(arm, body, space, clearance, q_rad[first + i], margin_m));
      free[first + i] = is_free ? 1 : 0;
    }
  }
}

}  // namespace firstlook
