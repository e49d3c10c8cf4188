#include "hal/sim/scene.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "algorithms/mapping/sensor_presets.hpp"
#include "algorithms/vision/target_pattern.hpp"

namespace firstlook::sim {
namespace {

using Eigen::Vector3d;

double squared_distance(const Box& box, const Vector3d& p) {
  return (p.cwiseAbs() - box.half_m).cwiseMax(0.0).squaredNorm();
}

double squared_distance(const Cylinder& cylinder, const Vector3d& p) {
  const double across = std::max(0.0, std::hypot(p.x(), p.y()) - cylinder.radius_m);
  const double along = std::max(0.0, std::abs(p.z()) - cylinder.half_height_m);
  return across * across + along * along;
}

struct Triangle {
  Vector3d a, b, c;
};

/// Ericson 2005, "Real-time collision detection", 5.1.5.
Vector3d closest_point(const Triangle& t, const Vector3d& p) {
  const Vector3d ab = t.b - t.a, ac = t.c - t.a, ap = p - t.a;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return t.a;
  const Vector3d bp = p - t.b;
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return t.b;
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return t.a + d1 / (d1 - d3) * ab;
  const Vector3d cp = p - t.c;
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return t.c;
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return t.a + d2 / (d2 - d6) * ac;
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) return t.b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (t.c - t.b);
  const double sum = va + vb + vc;
  return t.a + vb / sum * ab + vc / sum * ac;
}

double squared_distance(const Triangle& t, const Vector3d& p) { return (closest_point(t, p) - p).squaredNorm(); }

/// The distance of a point from a convex set is convex along a segment: golden section finds its minimum.
template <typename Convex>
double segment_to_convex_m(const Convex& convex, const Vector3d& a, const Vector3d& b) {
  constexpr double kGolden = 0.6180339887498949;
  constexpr int kSteps = 45;  // 0.618^45 = 4e-10 of the segment
  const auto at = [&](double t) { return squared_distance(convex, a + t * (b - a)); };
  double low = 0, high = 1;
  double t1 = high - kGolden, t2 = low + kGolden;
  double f1 = at(t1), f2 = at(t2);
  double best = std::min({at(0), at(1), f1, f2});
  for (int i = 0; i < kSteps && best > 0; ++i) {
    if (f1 <= f2) {
      high = t2, t2 = t1, f2 = f1;
      t1 = high - kGolden * (high - low);
      f1 = at(t1);
    } else {
      low = t1, t1 = t2, f1 = f2;
      t2 = low + kGolden * (high - low);
      f2 = at(t2);
    }
    best = std::min({best, f1, f2});
  }
  return std::sqrt(best);
}

Triangle triangle(const Mesh& mesh, const std::array<std::uint32_t, 3>& t) {
  return {mesh.vertices_m[t[0]], mesh.vertices_m[t[1]], mesh.vertices_m[t[2]]};
}

/// Where the line from `a` along `d` crosses the triangle, in units of d (Moeller and Trumbore 1997); negative: nowhere
/// ahead.
double crossing(const Triangle& t, const Vector3d& a, const Vector3d& d) {
  const Vector3d e1 = t.b - t.a, e2 = t.c - t.a;
  const Vector3d h = d.cross(e2);
  const double determinant = e1.dot(h);
  if (std::abs(determinant) < 1e-15) return -1;
  const Vector3d s = a - t.a;
  const double u = s.dot(h) / determinant;
  const Vector3d q = s.cross(e1);
  const double v = d.dot(q) / determinant;
  if (u < 0 || v < 0 || u + v > 1) return -1;
  return e2.dot(q) / determinant;
}

/// In a closed mesh a ray from an inside point leaves it an odd number of times.
bool is_inside(const Mesh& mesh, const Vector3d& p) {
  const Vector3d direction(0.5377, 0.2910, 0.7913);  // along no edge that anyone draws
  const auto ahead = std::ranges::count_if(
      mesh.triangles, [&](const auto& t) { return crossing(triangle(mesh, t), p, direction) >= 0; });
  return ahead % 2 == 1;
}
bool is_inside(const Box& box, const Vector3d& p) { return squared_distance(box, p) == 0; }
bool is_inside(const Cylinder& cylinder, const Vector3d& p) { return squared_distance(cylinder, p) == 0; }

double segment_to_shape_m(const Box& box, const Vector3d& a, const Vector3d& b) {
  return segment_to_convex_m(box, a, b);
}
double segment_to_shape_m(const Cylinder& cylinder, const Vector3d& a, const Vector3d& b) {
  return segment_to_convex_m(cylinder, a, b);
}
double segment_to_shape_m(const Mesh& mesh, const Vector3d& a, const Vector3d& b) {
  if (is_inside(mesh, a)) return 0;
  double nearest_m = std::numeric_limits<double>::infinity();
  for (const auto& indices : mesh.triangles) {
    const Triangle t = triangle(mesh, indices);
    const double at = crossing(t, a, b - a);
    if (at >= 0 && at <= 1) return 0;
    nearest_m = std::min(nearest_m, segment_to_convex_m(t, a, b));
  }
  return nearest_m;
}

Eigen::AlignedBox3d local_bounds(const Box& box) { return {-box.half_m, box.half_m}; }
Eigen::AlignedBox3d local_bounds(const Cylinder& cylinder) {
  const Vector3d half(cylinder.radius_m, cylinder.radius_m, cylinder.half_height_m);
  return {-half, half};
}
Eigen::AlignedBox3d local_bounds(const Mesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const Vector3d& v : mesh.vertices_m) box.extend(v);
  return box;
}

}  // namespace

double distance_m(const Solid& solid, const Vector3d& a, const Vector3d& b) {
  const Pose solid_T_base = solid.base_T_solid.inverse(Eigen::Isometry);
  return std::visit([&](const auto& shape) { return segment_to_shape_m(shape, solid_T_base * a, solid_T_base * b); },
                    solid.shape);
}

Eigen::AlignedBox3d bounds(const Solid& solid) {
  const Eigen::AlignedBox3d local = std::visit([](const auto& shape) { return local_bounds(shape); }, solid.shape);
  const Vector3d center = solid.base_T_solid * local.center();
  const Vector3d half = solid.base_T_solid.linear().cwiseAbs() * (0.5 * local.sizes());
  return {center - half, center + half};
}

bool touches(const Scene& scene, const Capsule& capsule) {
  Eigen::AlignedBox3d reach(capsule.a.cwiseMin(capsule.b).array() - capsule.radius_m,
                            capsule.a.cwiseMax(capsule.b).array() + capsule.radius_m);
  return std::ranges::any_of(scene.solids, [&](const Solid& solid) {
    return reach.intersects(bounds(solid)) && distance_m(solid, capsule.a, capsule.b) <= capsule.radius_m;
  });
}

bool inside(const Scene& scene, const Vector3d& point_m) {
  return std::ranges::any_of(scene.solids, [&](const Solid& solid) {
    const Vector3d p = solid.base_T_solid.inverse(Eigen::Isometry) * point_m;
    return std::visit([&](const auto& shape) { return is_inside(shape, p); }, solid.shape);
  });
}

CameraMount default_mount(int joints) {
  CameraMount mount;
  mount.link = joints;
  mount.link_T_camera.translation() = Vector3d(0, -0.07, 0.06);
  mount.camera_T_depth = Transform<Camera, Depth>(Eigen::Quaterniond::Identity(), Vector3d(-0.025, 0, 0));
  // The thesis's own calibration of its Kinect (table D-2).
  mount.color = {640, 480, 537.33, 538.35, 321.61, 252.18, 0.17938, -0.31818, -0.00268, 0.00209, 0};
  mount.depth = find_sensor_preset("kinect").value().intrinsics;
  return mount;
}

Solid board_panel(const BoardPlacement& board) {
  const Eigen::Vector2d ink = ink_extent(board.spec).size_m;
  const Vector3d size(ink.x() + 2 * board.white_margin_m, ink.y() + 2 * board.white_margin_m, board.thickness_m);
  Solid panel;
  panel.name = "board";
  panel.shape = Box{0.5 * size};
  panel.base_T_solid = board.base_T_board.pose();
  panel.base_T_solid.translate(board.spec.center() + Vector3d(0, 0, 0.5 * board.thickness_m));
  panel.surface.color = {0.9F, 0.9F, 0.9F};
  return panel;
}

void move_board(Scene& scene, const Transform<Base, Board>& base_T_board) {
  scene.board.base_T_board = base_T_board;
  scene.solids[scene.board_solid] = board_panel(scene.board);
}

void exchange_board(Scene& scene, const BoardSpec& board) {
  Pose base_T_board = scene.board.base_T_board.pose();
  base_T_board.translate(scene.board.spec.center() - board.center());
  scene.board.spec = board;
  move_board(scene, Transform<Base, Board>(base_T_board));
}

}  // namespace firstlook::sim
