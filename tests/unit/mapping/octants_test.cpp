#include "algorithms/mapping/octants.hpp"

#include <catch2/catch.hpp>
#include <functional>

#include "algorithms/mapping/insertion.hpp"
#include "platform/core/random.hpp"

namespace firstlook {
namespace {

using Eigen::Vector3d;

constexpr int kWidth = 160, kHeight = 120;
constexpr double kGrazing_rad = 0.17;  // flatter than this nothing comes back, as from a real sensor

/// A panel 3 cm thick that fills the middle of its voxels by half, before a far wall.
struct Scene {
  double panel_x_m = 1.025;  // its front; the voxels there reach from 1.00 to 1.05
  double panel_top_m = 0.47;
  bool panel_there = true;
  double wall_x_m = 1.8;

  /// Depth along the optical axis of what a ray meets; 0 for no return.
  [[nodiscard]] double depth_m(const Vector3d& eye, const Vector3d& ray, double noise_m) const {
    const double to_panel = (panel_x_m - eye.x()) / ray.x();
    const double panel_z = eye.z() + to_panel * ray.z();
    if (panel_there && ray.x() > 0 && to_panel > 0 && panel_z < panel_top_m && eye.x() < panel_x_m) {
      return ray.x() / ray.norm() < std::sin(kGrazing_rad) ? 0 : to_panel * (1 + noise_m);
    }
    // Over its top: the edge is too thin for a return, the floor of a box around everything ends the ray.
    double nearest = 1e9;
    for (int axis = 0; axis < 3; ++axis) {
      if (ray[axis] == 0) continue;
      const double bound = ray[axis] > 0 ? (axis == 0 ? wall_x_m : 1.9) : -1.9;
      nearest = std::min(nearest, (bound - eye[axis]) / ray[axis]);
    }
    return nearest * (1 + noise_m);
  }
};

struct DepthCamera {
  DepthSensor sensor;
  std::vector<std::uint16_t> pixels = std::vector<std::uint16_t>(kWidth * kHeight);
  Random random{3};
  explicit DepthCamera(double k1 = 0) {
    sensor.intrinsics = {kWidth, kHeight, 140, 140, 79.5, 59.5};
    sensor.intrinsics.k1 = k1;
    sensor.range_min_m = 0.1;
    sensor.range_max_m = sensor.range_trusted_m = 5;
  }
  DepthImage look(const Scene& scene, const Transform<Base, Depth>& base_T_depth, double noise = 0.002) {
    const Vector3d eye = base_T_depth.translation();
    for (int v = 0; v < kHeight; ++v) {
      for (int u = 0; u < kWidth; ++u) {
        const Vector3d ray = base_T_depth.rotation() * Vector3d((u - 79.5) / 140, (v - 59.5) / 140, 1);
        const double z_m = scene.depth_m(eye, ray, noise * random.normal());
        pixels[static_cast<std::size_t>(v * kWidth + u)] = static_cast<std::uint16_t>(std::lround(10000 * z_m));
      }
    }
    return image();
  }
  [[nodiscard]] DepthImage image() const { return {{pixels.data(), kWidth, kHeight}, 10000}; }
};

/// Looks along `forward` from `eye`, the image's down being as far down as it can.
Transform<Base, Depth> looking(const Vector3d& eye, const Vector3d& forward) {
  Eigen::Matrix3d r;
  r.col(2) = forward.normalized();
  r.col(0) = r.col(2).cross(Vector3d::UnitZ()).normalized();
  r.col(1) = r.col(2).cross(r.col(0));
  return {Eigen::Quaterniond(r), eye};
}

GridGeometry grid() { return GridGeometry::covering({-0.5, -0.5, -0.2}, {1.95, 0.5, 0.8}, 0.05); }

/// Voxels that hold a part of the panel, away from the edges of the grid.
void for_panel(const VoxelMap& map, const Scene& scene, const std::function<void(std::size_t)>& visit) {
  for (double y = -0.2; y < 0.2; y += 0.05) {
    for (double z = 0.0; z < scene.panel_top_m - 0.05; z += 0.05) {
      const Vector3d p(scene.panel_x_m + 0.001, y + 0.01, z + 0.01);
      visit(map.geometry().index(map.geometry().voxel(p)));
    }
  }
}

void frontal_looks(VoxelMap& map, Inserter& inserter, DepthCamera& camera, const Scene& scene, double& stamp_s) {
  for (const double y : {-0.1, 0.0, 0.1}) {
    const auto pose = looking({0.2, y, 0.25}, {1, 0, 0});
    REQUIRE(inserter.insert(map, camera.look(scene, pose), pose, {}, stamp_s++));
  }
}

/// Along the panel's front, nearer to it than half a voxel.
void grazing_looks(VoxelMap& map, Inserter& inserter, DepthCamera& camera, const Scene& scene, double& stamp_s) {
  for (int i = 0; i < 40; ++i) {
    const double z = 0.02 + 0.01 * i;
    const auto pose = looking({scene.panel_x_m - 0.012, -0.48, z}, {0.0005 * (i % 3), 1, 0});
    REQUIRE(inserter.insert(map, camera.look(scene, pose), pose, {}, stamp_s++));
  }
}

}  // namespace

TEST_CASE("the octant of a point", "[mapping]") {
  const GridGeometry geometry = grid();
  CHECK(octant_of(geometry, {0.01F, 0.01F, 0.01F}) == 0);
  CHECK(octant_of(geometry, {0.03F, 0.01F, 0.01F}) == 1);
  CHECK(octant_of(geometry, {0.01F, 0.03F, 0.01F}) == 2);
  CHECK(octant_of(geometry, {0.01F, 0.01F, 0.03F}) == 4);
  CHECK(octant_of(geometry, {-0.01F, -0.03F, 0.13F}) == 5);  // upper half of [-0.05, 0), lower half of the same, upper
}

TEST_CASE("looks along a surface free its voxels in the map, never for motion", "[mapping][safety]") {
  const double k1 = GENERATE(0.0, 1e-9);  // by voxels, and by rays
  const Scene scene;
  DepthCamera camera(k1);
  VoxelMap map(grid());
  Inserter inserter(map.geometry(), camera.sensor);
  double stamp_s = 1;
  frontal_looks(map, inserter, camera, scene, stamp_s);
  for_panel(map, scene, [&](std::size_t i) { CHECK(map.voxel_class(i) == VoxelClass::kOccupied); });
  grazing_looks(map, inserter, camera, scene, stamp_s);
  int lost = 0;
  for_panel(map, scene, [&](std::size_t i) {
    lost += map.voxel_class(i) == VoxelClass::kFree ? 1 : 0;
    CHECK_FALSE(map.known_free(i, stamp_s, 600));
  });
  CHECK(lost > 10);  // log-odds alone would have let the arm through
}

TEST_CASE("where a surface was taken away, looks through its place free it for motion", "[mapping]") {
  const double k1 = GENERATE(0.0, 1e-9);
  Scene scene;
  DepthCamera camera(k1);
  VoxelMap map(grid());
  Inserter inserter(map.geometry(), camera.sensor);
  double stamp_s = 1;
  frontal_looks(map, inserter, camera, scene, stamp_s);
  scene.panel_there = false;
  for (int i = 0; i < 6; ++i) frontal_looks(map, inserter, camera, scene, stamp_s);
  for_panel(map, scene, [&](std::size_t i) {
    CHECK(!map.holds_surface(i));
    CHECK(map.known_free(i, stamp_s, 600));
  });
}

TEST_CASE("speckle in free space does not block it for longer than the next looks", "[mapping]") {
  Scene scene;
  scene.panel_there = false;
  DepthCamera camera;
  VoxelMap map(grid());
  Inserter inserter(map.geometry(), camera.sensor);
  double stamp_s = 1;
  frontal_looks(map, inserter, camera, scene, stamp_s);
  const auto pose = looking({0.2, 0.03, 0.25}, {1, 0, 0});
  (void)camera.look(scene, pose);
  for (std::size_t i = 0; i < camera.pixels.size(); i += 7) {
    camera.pixels[i] = static_cast<std::uint16_t>(10000 * camera.random.uniform(0.3, 1.2));
  }
  REQUIRE(inserter.insert(map, camera.image(), pose, {}, stamp_s++));
  int speckled = 0;
  for (std::size_t i = 0; i < map.size(); ++i) speckled += map.holds_surface(i) ? 1 : 0;
  for (int i = 0; i < 6; ++i) frontal_looks(map, inserter, camera, scene, stamp_s);
  int left = 0;
  for_panel(map, scene, [&](std::size_t i) { left += map.known_free(i, stamp_s, 600) ? 0 : 1; });
  CHECK(speckled > 500);
  CHECK(left == 0);
}

TEST_CASE("pixels too coarse to be sure of an octant leave its surface", "[mapping]") {
  Scene scene;
  DepthCamera camera;
  VoxelMap fine(GridGeometry::covering({-0.5, -0.5, -0.2}, {1.95, 0.5, 0.8}, 0.01));  // half an octant: 2.5 mm
  Inserter inserter(fine.geometry(), camera.sensor);
  double stamp_s = 1;
  frontal_looks(fine, inserter, camera, scene, stamp_s);
  std::size_t surfaces = 0, left = 0;
  for (std::size_t i = 0; i < fine.size(); ++i) surfaces += fine.holds_surface(i) ? 1 : 0;
  scene.panel_there = false;
  for (int i = 0; i < 6; ++i) frontal_looks(fine, inserter, camera, scene, stamp_s);
  for (std::size_t i = 0; i < fine.size(); ++i) left += fine.holds_surface(i) ? 1 : 0;
  // A pixel is 7 mm wide at the panel: 4 mm from its middle to its corner.
  CHECK(surfaces > 1000);
  CHECK(left >= surfaces);
}

TEST_CASE("a map of log-odds alone keeps no octants", "[mapping]") {
  const Scene scene;
  DepthCamera camera;
  VoxelMap map(grid(), VoxelMap::Planes::kLogOddsOnly);
  Inserter inserter(map.geometry(), camera.sensor);
  double stamp_s = 1;
  frontal_looks(map, inserter, camera, scene, stamp_s);
  for_panel(map, scene, [&](std::size_t i) { CHECK(!map.holds_surface(i)); });
}

}  // namespace firstlook
