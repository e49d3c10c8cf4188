/// Colour, label and sensor of voxels, against references that know nothing of them.
#include "algorithms/mapping/map_planes.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <map>

#include "algorithms/mapping/color_registration.hpp"
#include "algorithms/mapping/insertion.hpp"
#include "platform/core/random.hpp"

namespace firstlook {
namespace {

const GridGeometry kGrid = GridGeometry::covering({-1.5, -1.5, -0.2}, {1.5, 1.5, 2.6}, 0.05);

DepthSensor depth_sensor() {
  DepthSensor sensor;
  sensor.intrinsics = {80, 60, 70, 71, 39.2, 29.6};
  sensor.range_min_m = 0.2;
  sensor.range_max_m = sensor.range_trusted_m = 2.2;
  return sensor;
}

/// Twice as many columns as the depth camera, another lens.
CameraIntrinsics color_camera() { return {160, 96, 130, 128, 78.5, 50.25, 0.05, -0.02, 0.001, -0.002, 0.004}; }

Transform<Camera, Depth> mount() {
  return {Eigen::Quaterniond(1, 0.01, -0.02, 0.005).normalized(), {0.03, 0.01, -0.004}};
}

/// A picture of noise: every pixel says which it is.
struct Picture {
  CameraIntrinsics camera;
  std::vector<Rgb> pixels;
  explicit Picture(const CameraIntrinsics& c, std::uint64_t seed = 1) : camera(c) {
    Random random(seed);
    for (int i = 0; i < c.width * c.height; ++i)
      pixels.push_back({static_cast<std::uint8_t>(random.below(256)), static_cast<std::uint8_t>(random.below(256)),
                        static_cast<std::uint8_t>(random.below(256))});
  }
  [[nodiscard]] ColorImage view() const { return {pixels.data(), camera.width, camera.height}; }
};

/// Brown's model as OpenCV's documentation has it; nothing of ours.
Eigen::Vector2d pixel_of(const CameraIntrinsics& c, const Eigen::Vector3d& p) {
  const double x = p.x() / p.z(), y = p.y() / p.z(), r2 = x * x + y * y;
  const double radial = 1 + c.k1 * r2 + c.k2 * r2 * r2 + c.k3 * r2 * r2 * r2;
  const double xd = x * radial + 2 * c.p1 * x * y + c.p2 * (r2 + 2 * x * x);
  const double yd = y * radial + c.p1 * (r2 + 2 * y * y) + 2 * c.p2 * x * y;
  return {c.fx * xd + c.cx, c.fy * yd + c.cy};
}

std::vector<std::uint16_t> tilted_wall() {
  std::vector<std::uint16_t> values;
  for (int v = 0; v < 60; ++v)
    for (int u = 0; u < 80; ++u) values.push_back(static_cast<std::uint16_t>((u + v) % 17 == 0 ? 0 : 1100 + 14 * u));
  return values;
}

struct Mean {
  std::array<double, 3> sum{};
  int points = 0;
};

}  // namespace

TEST_CASE("a voxel has the mean colour of the points that hit it", "[mapping][planes]") {
  const DepthSensor sensor = depth_sensor();
  const CameraIntrinsics camera = GENERATE(color_camera(), depth_sensor().intrinsics);
  VoxelMap map(kGrid, VoxelMap::Planes::kLogOddsOnly);
  Inserter inserter(kGrid, sensor);
  ColorRegistration registration(kGrid, sensor, camera);
  ColorPlane plane(kGrid);
  const std::vector<std::uint16_t> values = tilted_wall();
  const DepthImage depth{{values.data(), 80, 60}, 1000};
  std::vector<float> self_m(values.size(), 100.0F);
  std::map<std::size_t, Mean> expected;
  for (std::uint64_t frame = 1; frame <= 3; ++frame) {
    const Picture picture(camera, frame);
    const Transform<Base, Depth> pose(Eigen::Quaterniond(1, 0.1, 0.05 * static_cast<double>(frame), -0.02).normalized(),
                                      {0.1, -0.05, 0.02 * static_cast<double>(frame)});
    for (std::size_t i = 0; i < 200; ++i) self_m[i * 7] = 0.5F;  // the arm's own body: these points are none
    REQUIRE(inserter.insert(map, depth, pose, self_m, static_cast<double>(frame)));
    std::uint32_t points = 0;
    for (int v = 0; v < 60; ++v) {
      for (int u = 0; u < 80; ++u) {
        const std::size_t pixel = static_cast<std::size_t>(v) * 80 + static_cast<std::size_t>(u);
        const double z = values[pixel] / 1000.0;
        const Eigen::Vector3d p((u - sensor.intrinsics.cx) / sensor.intrinsics.fx * z,
                                (v - sensor.intrinsics.cy) / sensor.intrinsics.fy * z, z);
        if (values[pixel] == 0 || self_m[pixel] < 1 || p.norm() > 2.2) continue;
        const Eigen::Vector3i voxel = kGrid.voxel(pose * p);
        const Eigen::Vector2d at = pixel_of(camera, mount() * p);
        const long column = std::lround(at.x()), row = std::lround(at.y());
        if (!kGrid.contains(voxel) || column < 0 || row < 0 || column >= camera.width || row >= camera.height) continue;
        Mean& mean = expected[kGrid.index(voxel)];
        const Rgb& color = picture.pixels[static_cast<std::size_t>(row * camera.width + column)];
        for (std::size_t i = 0; i < 3; ++i) mean.sum[i] += color[i];
        ++mean.points;
        ++points;
      }
    }
    CHECK(registration.add(plane, depth, pose, self_m, {camera, mount()}, picture.view(), inserter.hit()) == points);
    CHECK(points > 2000);
  }
  std::size_t colored = 0;
  for (std::size_t i = 0; i < map.size(); ++i) {
    const auto color = plane.at(i);
    REQUIRE(color.has_value() == expected.contains(i));
    if (!color) continue;
    ++colored;
    CHECK(map.voxel_class(i) == VoxelClass::kOccupied);
    for (std::size_t channel = 0; channel < 3; ++channel)
      CHECK(std::abs((*color)[channel] - expected[i].sum[channel] / expected[i].points) <= 0.5);
  }
  CHECK(colored > 100);
}

TEST_CASE("what the colour camera cannot see has no colour from what stands in front", "[mapping][planes]") {
  // A red plate 0.6 m away in the left half, a blue wall 1.5 m away; the colour camera sits 0.1 m to the left, where
  // the plate hides less of the wall on one side and more on the other.
  const double side_m = GENERATE(-0.1, 0.1);
  const DepthSensor sensor = depth_sensor();
  const CameraIntrinsics camera = sensor.intrinsics;
  const Transform<Camera, Depth> camera_T_depth(Eigen::Quaterniond::Identity(), {side_m, 0, 0});
  const auto on_plate = [](double x_m, double z_m) { return x_m / z_m * 0.6 < 0 && x_m / z_m * 0.6 > -0.15; };
  std::vector<std::uint16_t> values(80 * 60);
  Picture picture(camera);
  for (int v = 0; v < 60; ++v) {
    for (int u = 0; u < 80; ++u) {
      const std::size_t pixel = static_cast<std::size_t>(v) * 80 + static_cast<std::size_t>(u);
      const double x = (u - camera.cx) / camera.fx;
      values[pixel] = on_plate(x, 1) ? 600 : 1500;
      // The plate as the colour camera has it: moved by side_m at 0.6 m.
      picture.pixels[pixel] = on_plate(x - side_m / 0.6, 1) ? Rgb{200, 0, 0} : Rgb{0, 0, 200};
    }
  }
  VoxelMap map(kGrid, VoxelMap::Planes::kLogOddsOnly);
  Inserter inserter(kGrid, sensor);
  ColorRegistration registration(kGrid, sensor, camera);
  ColorPlane plane(kGrid);
  const DepthImage depth{{values.data(), 80, 60}, 1000};
  REQUIRE(inserter.insert(map, depth, {}, {}, 1));
  registration.add(plane, depth, {}, {}, {camera, camera_T_depth}, picture.view(), inserter.hit());
  int plate = 0, wall = 0, hidden = 0;
  for (std::size_t i = 0; i < map.size(); ++i) {
    if (map.voxel_class(i) != VoxelClass::kOccupied) continue;
    const bool is_wall = kGrid.center_m(kGrid.voxel_at(i)).z() > 1;
    const auto color = plane.at(i);
    if (!color) {
      hidden += is_wall ? 1 : 0;
      continue;
    }
    (is_wall ? wall : plate) += 1;
    CHECK((is_wall ? (*color)[0] < 100 : (*color)[0] > 100));
  }
  CHECK(plate > 20);
  CHECK(wall > 400);
  CHECK(hidden > 10);
}

TEST_CASE("points of a ground that clears only have no colour", "[mapping][planes]") {
  const DepthSensor sensor = depth_sensor();
  VoxelMap map(kGrid, VoxelMap::Planes::kLogOddsOnly);
  Inserter inserter(kGrid, sensor);
  inserter.set_ground({1.0, 0.1});
  ColorRegistration registration(kGrid, sensor, sensor.intrinsics);
  ColorPlane plane(kGrid);
  const std::vector<std::uint16_t> values(80 * 60, 1000);
  const DepthImage depth{{values.data(), 80, 60}, 1000};
  REQUIRE(inserter.insert(map, depth, {}, {}, 1));
  CHECK(registration.add(plane, depth, {}, {}, {sensor.intrinsics, {}}, Picture(sensor.intrinsics).view(),
                         inserter.hit()) == 0);
}

TEST_CASE("sums of colours end in no overflow", "[mapping][planes]") {
  ColorSum sum{{255 * ColorSum::kPointsMax, 255, 0}, ColorSum::kPointsMax};
  for (int i = 0; i < 3; ++i) sum.add({255, 0, 0});
  CHECK(sum.points == ColorSum::kPointsMax / 2 + 3);
  CHECK(*sum.mean() == Rgb{255, 0, 0});
  CHECK_FALSE(ColorSum{}.mean());
}

TEST_CASE("each voxel knows the sensor that saw it last", "[mapping][planes]") {
  const DepthSensor sensor = depth_sensor();
  VoxelMap map(kGrid, VoxelMap::Planes::kLogOddsOnly);
  Inserter first(kGrid, sensor), second(kGrid, sensor);
  SensorPlane plane(kGrid);
  std::vector<int> expected(map.size());
  const std::vector<std::uint16_t> near(80 * 60, 800), far(80 * 60, 1900);
  const Transform<Base, Depth> elsewhere(Eigen::Quaterniond(1, 0, 0.2, 0).normalized(), {-0.5, 0, 0});
  const auto see = [&](Inserter& inserter, std::uint8_t number, const std::vector<std::uint16_t>& values,
                       const Transform<Base, Depth>& pose) {
    VoxelMap alone(kGrid, VoxelMap::Planes::kLogOddsOnly);
    const DepthImage depth{{values.data(), 80, 60}, 1000};
    REQUIRE(inserter.insert(alone, depth, pose, {}, 1));
    plane.note(inserter.missed(), inserter.hit(), number);
    for (std::size_t i = 0; i < alone.size(); ++i)
      if (alone.voxel_class(i) != VoxelClass::kUnknown) expected[i] = number;
  };
  see(first, 1, far, {});
  see(second, 2, near, elsewhere);
  std::array<int, 3> seen{};
  for (std::size_t i = 0; i < map.size(); ++i) {
    REQUIRE(plane.at(i) == expected[i]);
    ++seen[plane.at(i)];
  }
  CHECK(seen[0] > 1000);
  CHECK(seen[1] > 1000);
  CHECK(seen[2] > 1000);
}

TEST_CASE("labels are the numbers and shapes of the objects", "[mapping][planes]") {
  const GridGeometry grid{0.05, {0, 0, 0}, {24, 24, 12}};
  VoxelMap map(grid, VoxelMap::Planes::kLogOddsOnly);
  for (std::size_t i = 0; i < map.size(); ++i) {
    const Eigen::Vector3i v = grid.voxel_at(i);
    const bool box = v.x() >= 4 && v.x() < 10 && v.y() >= 3 && v.y() < 9 && v.z() < 5;
    const bool plane = v.x() == 18 && v.y() > 4 && v.z() < 8;
    map.set(i, box || plane ? VoxelClass::kOccupied : VoxelClass::kFree, 0);
  }
  const MapObjects objects = find_objects(map, octomap_class);
  LabelPlane labels(grid);
  labels.write(objects);
  int with = 0;
  for (std::size_t i = 0; i < map.size(); ++i) {
    REQUIRE(labels.at(i).object == objects.id_of[i]);
    if (labels.at(i).object == 0) continue;
    ++with;
    REQUIRE(labels.at(i).shape == objects.objects[labels.at(i).object - 1U].shape);
  }
  CHECK(with > 200);
}

TEST_CASE("the words of the planes, and what they cost", "[mapping][planes]") {
  CHECK(planes_from_words("none") == PlaneChoice{});
  CHECK(planes_from_words("color") == PlaneChoice{true, false, false});
  CHECK(planes_from_words("sensor,label") == PlaneChoice{false, true, true});
  for (const std::string_view wrong : {"", "colour", "color,", ",color", "color,color", "none,color", "color label"})
    CHECK_FALSE(planes_from_words(wrong));
  CHECK(MapPlanes::required_bytes(kGrid, {}) == 0);
  CHECK(MapPlanes::required_bytes(kGrid, {true, true, true}) == 21 * kGrid.count());
  const MapPlanes none(kGrid, {});
  CHECK_FALSE(none.choice().any());
}

}  // namespace firstlook
