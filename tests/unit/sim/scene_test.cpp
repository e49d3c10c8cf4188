#include "hal/sim/scene.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "platform/core/random.hpp"

using namespace firstlook;
using namespace firstlook::sim;
using Eigen::Vector3d;

namespace {

Pose random_pose(Random& random) {
  Pose pose = Pose::Identity();
  pose.linear() = random.rotation().toRotationMatrix();
  pose.translation() = 0.5 * random.normal3();
  return pose;
}

Mesh tetrahedron() {
  return {{{0, 0, 0}, {0.5, 0, 0}, {0, 0.4, 0}, {0, 0, 0.3}}, {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};
}

bool in_shape(const Box& box, const Vector3d& p) { return (p.cwiseAbs().array() <= box.half_m.array()).all(); }
bool in_shape(const Cylinder& c, const Vector3d& p) {
  return std::hypot(p.x(), p.y()) <= c.radius_m && std::abs(p.z()) <= c.half_height_m;
}
bool in_shape(const Mesh&, const Vector3d& p) {
  return p.minCoeff() >= 0 && p.x() / 0.5 + p.y() / 0.4 + p.z() / 0.3 <= 1;
}

/// Points of a solid drawn evenly, in base coordinates.
std::vector<Vector3d> points_in(const Solid& solid, int count, Random& random) {
  std::vector<Vector3d> points;
  while (static_cast<int>(points.size()) < count) {
    const Vector3d p(random.uniform(-0.6, 0.6), random.uniform(-0.6, 0.6), random.uniform(-0.6, 0.6));
    if (std::visit([&](const auto& shape) { return in_shape(shape, p); }, solid.shape)) {
      points.push_back(solid.base_T_solid * p);
    }
  }
  return points;
}

std::vector<Solid> samples(Random& random) {
  std::vector<Solid> solids(3);
  solids[0].shape = Box{Vector3d(0.3, 0.2, 0.05)};
  solids[1].shape = Cylinder{0.15, 0.4};
  solids[2].shape = tetrahedron();
  for (Solid& solid : solids) solid.base_T_solid = random_pose(random);
  return solids;
}

}  // namespace

TEST_CASE("no sampled point of a solid is nearer to a segment than the distance says, and the nearest comes close") {
  Random random(1);
  for (int trial = 0; trial < 20; ++trial) {
    for (const Solid& solid : samples(random)) {
      const Vector3d a = random.normal3(), b = a + 0.5 * random.normal3();
      const double said = distance_m(solid, a, b);
      double sampled = std::numeric_limits<double>::infinity();
      for (const Vector3d& p : points_in(solid, 4000, random)) {
        const double t = std::clamp((p - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
        sampled = std::min(sampled, (a + t * (b - a) - p).norm());
      }
      REQUIRE(said <= sampled + 1e-6);
      REQUIRE(said >= sampled - 0.07);  // half the spacing of the samples, at a corner
    }
  }
}

TEST_CASE("distances that can be said by hand are exact") {
  Solid box;
  box.shape = Box{Vector3d(0.1, 0.2, 0.3)};
  CHECK(distance_m(box, {0.5, 0, -1}, {0.5, 0, 1}) == Approx(0.4).margin(1e-9));
  CHECK(distance_m(box, {0.4, 0.6, 0}, {0.4, 0.6, 5}) == Approx(0.5).margin(1e-9));
  CHECK(distance_m(box, {-1, 0, 0}, {1, 0, 0}) == 0);
  Solid cylinder;
  cylinder.shape = Cylinder{0.2, 0.5};
  CHECK(distance_m(cylinder, {0.5, -1, 0.1}, {0.5, 1, 0.1}) == Approx(0.3).margin(1e-7));
  CHECK(distance_m(cylinder, {0.0, 0.1, 0.8}, {0.1, 0, 0.9}) == Approx(0.3).margin(1e-7));
  Solid mesh;
  mesh.shape = tetrahedron();
  CHECK(distance_m(mesh, {0.05, 0.05, -0.2}, {0.05, 0.05, -0.1}) == Approx(0.1).margin(1e-7));
  CHECK(distance_m(mesh, {0.05, 0.05, 0.05}, {0.06, 0.05, 0.05}) == 0);  // within
  CHECK(distance_m(mesh, {0.05, 0.05, -1}, {0.05, 0.05, 1}) == 0);       // through
}

TEST_CASE("a capsule touches at its radius and not before") {
  Scene scene;
  Solid box;
  box.shape = Box{Vector3d(0.1, 0.1, 0.1)};
  scene.solids = {box};
  Capsule capsule{{0.3, 0, -1}, {0.3, 0, 1}, 0.199999, 0};
  CHECK_FALSE(touches(scene, capsule));
  capsule.radius_m = 0.200001;
  CHECK(touches(scene, capsule));
}

TEST_CASE("a point in matter makes its voxel occupied, and an occupied voxel is near matter") {
  Random random(2);
  const GridGeometry grid = GridGeometry::covering(Vector3d(-1.5, -1.5, -1.5), Vector3d(1.5, 1.5, 1.5), 0.05);
  for (int trial = 0; trial < 5; ++trial) {
    Scene scene;
    scene.solids = samples(random);
    const std::vector<std::uint8_t> occupied = occupied_voxels(scene, grid);
    for (const Solid& solid : scene.solids) {
      for (const Vector3d& p : points_in(solid, 2000, random)) {
        REQUIRE(inside(scene, p));
        const Eigen::Vector3i v = grid.voxel(p);
        if (grid.contains(v)) REQUIRE(occupied[grid.index(v)] == 1);
      }
    }
    for (std::size_t i = 0; i < occupied.size(); ++i) {
      if (occupied[i] == 0) continue;
      const Vector3d center = grid.center_m(grid.voxel_at(i));
      REQUIRE(std::ranges::any_of(scene.solids, [&](const Solid& s) {
        return distance_m(s, center, center) <= 0.5 * std::sqrt(3.0) * grid.resolution_m + 1e-9;
      }));
    }
  }
}

TEST_CASE("a wall on a voxel boundary occupies one side only") {
  Scene scene;
  Solid wall;
  wall.shape = Box{Vector3d(0.05, 1, 1)};
  wall.base_T_solid.translation() = Vector3d(0.55, 0, 0);  // 0.5 .. 0.6
  scene.solids = {wall};
  const GridGeometry grid = GridGeometry::covering(Vector3d(0, -0.1, -0.1), Vector3d(1, 0.1, 0.1), 0.05);
  const std::vector<std::uint8_t> occupied = occupied_voxels(scene, grid);
  for (int i = 0; i < grid.size.x(); ++i) CHECK(occupied[grid.index({i, 1, 1})] == (i == 10 || i == 11 ? 1 : 0));
}

TEST_CASE("the board's panel lies behind its front and moves with it") {
  Scene scene;
  scene.solids = {board_panel(scene.boards.front())};
  const Vector3d before = Vector3d(0.12, 0.07, 0.001);
  CHECK(inside(scene, before));
  CHECK_FALSE(inside(scene, Vector3d(0.12, 0.07, -0.001)));
  Random random(3);
  const Pose elsewhere = random_pose(random);
  move_board(scene, Transform<Base, Board>(elsewhere));
  CHECK(inside(scene, elsewhere * before));
  CHECK_FALSE(inside(scene, elsewhere * Vector3d(0.12, 0.07, -0.001)));
}
