#include "algorithms/mapping/objects.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>

#include "platform/core/random.hpp"

namespace firstlook {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;

constexpr double kResolution_m = 0.05;

/// A scene of solids, seen from outside: their surface voxels are occupied, what is deeper inside unknown, all else
/// free.
class Scene {
 public:
  explicit Scene(const Vector3i& size, double resolution_m = kResolution_m)
      : geometry_{resolution_m, -size / 2, size}, log_odds_(geometry_.count(), kLogOddsMin) {}

  /// A turned box.
  void add(const Vector3d& center_m, const Vector3d& size_m, double yaw_rad, double pitch_rad = 0) {
    const OrientedBox box{
        center_m, size_m,
        Eigen::AngleAxisd(yaw_rad, Vector3d::UnitZ()) * Eigen::AngleAxisd(pitch_rad, Vector3d::UnitY())};
    OrientedBox core = box;
    core.size_m.array() -= 2.2 * geometry_.resolution_m;
    each([&](std::size_t index, const Vector3d& p) {
      if (!box.contains(p)) return;
      const bool deep = core.size_m.minCoeff() > 0 && core.contains(p);
      log_odds_[index] = deep ? kUnknownLogOdds : kLogOddsMax;
    });
  }
  void fill(const std::function<bool(const Vector3d&)>& where, std::int8_t value) {
    each([&](std::size_t index, const Vector3d& p) {
      if (where(p)) log_odds_[index] = value;
    });
  }
  [[nodiscard]] VoxelMap map() const { return {geometry_, log_odds_}; }

 private:
  template <typename Visit>
  void each(Visit visit) {
    for (std::size_t i = 0; i < log_odds_.size(); ++i) visit(i, geometry_.center_m(geometry_.voxel_at(i)));
  }
  GridGeometry geometry_;
  std::vector<std::int8_t> log_odds_;
};

const MapObject& object_at(const MapObjects& found, const VoxelMap& map, const Vector3d& p) {
  const std::uint32_t id = found.id_of[map.geometry().index(map.geometry().voxel(p))];
  REQUIRE(id > 0);
  return found.objects[id - 1];
}

/// Every voxel of an object lies in its box with all its corners.
void require_boxes_hold_their_voxels(const MapObjects& found, const VoxelMap& map) {
  std::vector<std::size_t> count(found.objects.size() + 1, 0);
  for (std::size_t i = 0; i < map.size(); ++i) {
    const std::uint32_t id = found.id_of[i];
    ++count[id];
    if (id == 0) continue;
    REQUIRE(map.voxel_class(i) == VoxelClass::kOccupied);
    for (int corner = 0; corner < 8; ++corner) {
      const Vector3d sign((corner & 1) != 0 ? 1 : -1, (corner & 2) != 0 ? 1 : -1, (corner & 4) != 0 ? 1 : -1);
      REQUIRE(found.objects[id - 1].box.contains(map.geometry().center_m(map.geometry().voxel_at(i)) +
                                                 map.geometry().resolution_m / 2 * sign));
    }
  }
  for (const MapObject& object : found.objects) REQUIRE(count[static_cast<std::size_t>(object.id)] == object.voxels);
}

}  // namespace

TEST_CASE("boxes, panels and odd pieces are told apart at any angle", "[mapping][objects]") {
  Random random(1);
  for (int round = 0; round < 12; ++round) {
    Scene scene({80, 80, 40});
    const double yaw = random.uniform() * 3.1, yaw2 = random.uniform() * 3.1;
    const Vector3d box_m(-1, -1, 0), panel_m(1, 1, 0), odd_m(1, -1, 0);
    const Vector3d box_size(0.5 + 0.3 * random.uniform(), 0.4, 0.5);
    scene.add(box_m, box_size, yaw);
    scene.add(panel_m, {1.0, 0.06, 0.9}, yaw2);
    scene.fill([&](const Vector3d& p) { return std::abs((p - odd_m).norm() - 0.4) < 0.06; }, kLogOddsMax);
    const VoxelMap map = scene.map();
    const MapObjects found = find_objects(map, octomap_class);
    INFO("yaw " << yaw << " and " << yaw2);
    REQUIRE(found.objects.size() == 3);
    require_boxes_hold_their_voxels(found, map);
    const MapObject& box = object_at(found, map, box_m + Vector3d(0, 0, 0.22));
    CHECK(box.shape == ObjectShape::kBox);
    CHECK((box.box.center_m - box_m).norm() < kResolution_m);
    CHECK(box.box.size_m.z() == Approx(0.5).margin(kResolution_m + 1e-9));
    CHECK(box.box.volume_m3() < 1.8 * box_size.prod());
    const auto panel = std::ranges::find(found.objects, ObjectShape::kPlane, &MapObject::shape);
    REQUIRE(panel != found.objects.end());
    CHECK((panel->box.center_m - panel_m).norm() < kResolution_m);
    int thin = 0;
    panel->box.size_m.minCoeff(&thin);
    const Vector3d normal = panel->box.rotation.toRotationMatrix().col(thin);
    CHECK(std::abs(normal.dot(Vector3d(-std::sin(yaw2), std::cos(yaw2), 0))) > std::cos(0.1));
    CHECK(std::ranges::count(found.objects, ObjectShape::kOther, &MapObject::shape) == 1);
  }
}

TEST_CASE("a tilted panel is a plane in a tilted box", "[mapping][objects]") {
  Scene scene({60, 60, 60});
  scene.add({0, 0, 0}, {1.2, 0.8, 0.06}, 0.4, 0.6);
  const MapObjects found = find_objects(scene.map(), octomap_class);
  REQUIRE(found.objects.size() == 1);
  CHECK(found.objects[0].shape == ObjectShape::kPlane);
  CHECK(found.objects[0].box.size_m.minCoeff() < 0.2);
  CHECK(found.objects[0].box.volume_m3() < 0.25);
}

TEST_CASE("the floor and walls of a room do not join what stands on them", "[mapping][objects]") {
  Scene scene({100, 80, 50});
  const auto outside = [](const Vector3d& p) { return p.z() < -1.0 || p.x() > 2.0; };
  scene.fill(outside, kUnknownLogOdds);
  scene.fill([](const Vector3d& p) { return std::abs(p.z() + 1.0) < 0.05 && p.x() < 2.0; }, kLogOddsMax);
  scene.fill([](const Vector3d& p) { return std::abs(p.x() - 2.0) < 0.05 && p.z() > -1.0; }, kLogOddsMax);
  scene.add({0, 0, -0.75}, {0.6, 0.6, 0.5}, 0);    // a box on the floor
  scene.add({1.7, -1, -0.6}, {0.6, 0.5, 0.9}, 0);  // a cabinet in the corner of floor and wall
  const VoxelMap map = scene.map();
  const MapObjects found = find_objects(map, octomap_class);
  require_boxes_hold_their_voxels(found, map);
  CHECK(object_at(found, map, {-1.5, 1, -1.0}).bounds_room);
  CHECK(object_at(found, map, {-1.5, 1, -1.0}).shape == ObjectShape::kPlane);
  CHECK(object_at(found, map, {2.0, 1, 0.5}).bounds_room);
  const MapObject& box = object_at(found, map, {0.28, 0, -0.7});
  CHECK(box.shape == ObjectShape::kBox);
  CHECK_FALSE(box.bounds_room);
  CHECK(box.box.center_m.head<2>().norm() < 0.05);
  CHECK(object_at(found, map, {1.42, -1, -0.5}).id != box.id);
  CHECK(found.objects.size() == 4);
}

TEST_CASE("a large box alone is a box, not a room", "[mapping][objects]") {
  Scene scene({60, 60, 60});
  scene.add({0, 0, 0}, {1.5, 1.2, 1.4}, 0.3);
  const MapObjects found = find_objects(scene.map(), octomap_class);
  REQUIRE(found.objects.size() == 1);
  CHECK(found.objects[0].shape == ObjectShape::kBox);
}

TEST_CASE("objects come in the order of their size, specks are counted", "[mapping][objects]") {
  Scene scene({60, 60, 20});
  scene.add({-1, 0, 0}, {0.3, 0.3, 0.3}, 0);
  scene.add({0, 0, 0}, {0.5, 0.5, 0.5}, 0);
  scene.add({1, 0, 0}, {0.3, 0.3, 0.3}, 0);
  scene.add({0.025, 1.025, 0.025}, {0.12, 0.02, 0.02}, 0);
  const VoxelMap map = scene.map();
  const MapObjects found = find_objects(map, octomap_class);
  REQUIRE(found.objects.size() == 3);
  CHECK(found.objects[0].box.center_m.norm() < 0.03);
  CHECK(found.objects[1].box.center_m.x() < found.objects[2].box.center_m.x());
  CHECK(found.specks > 0);
  CHECK(found.specks < kObjectVoxelsMin);
  std::size_t labelled = 0;
  for (const MapObject& object : found.objects) labelled += object.voxels;
  CHECK(labelled + found.specks == map.counts().occupied);
  CHECK(find_objects(VoxelMap(GridGeometry{0.1, {0, 0, 0}, {3, 3, 3}}), octomap_class).objects.empty());
}

TEST_CASE("a moved object leaves unknown space behind and takes none for free", "[mapping][objects]") {
  Random random(3);
  for (int round = 0; round < 6; ++round) {
    Scene scene({50, 50, 30});
    scene.add({-0.5, 0, 0}, {0.5, 0.4, 0.45}, random.uniform());
    scene.add({0.6, 0.6, 0}, {0.3, 0.3, 0.3}, 0);
    const VoxelMap map = scene.map();
    const MapObjects found = find_objects(map, octomap_class);
    REQUIRE(found.objects.size() == 2);
    const Vector3i steps(random.below(40) - 10, random.below(20) - 10, random.below(7) - 3);
    const Vector3d by_m = kResolution_m * steps.cast<double>();
    const ObjectMove move{1, by_m + Vector3d::Constant(0.3 * kResolution_m)};  // to the nearest voxel
    const VoxelMap moved = move_objects(map, found, {&move, 1}, 1'000'000).value();
    const auto old_voxel = [&](std::size_t i) {
      return Vector3i(moved.geometry().voxel_at(i) + moved.geometry().first - map.geometry().first);
    };
    const auto id_at = [&](const Vector3i& v) {
      return map.geometry().contains(v) ? found.id_of[map.geometry().index(v)] : 0;
    };
    OrientedBox there = found.objects[0].box;
    there.center_m += by_m;
    for (std::size_t i = 0; i < moved.size(); ++i) {
      const Vector3i v = old_voxel(i);
      const VoxelClass before =
          map.geometry().contains(v) ? map.voxel_class(map.geometry().index(v)) : VoxelClass::kUnknown;
      const VoxelClass now = moved.voxel_class(i);
      if (id_at(v - steps) == 1) {
        REQUIRE(now == VoxelClass::kOccupied);
      } else if (id_at(v) == 1) {
        REQUIRE(now == VoxelClass::kUnknown);
      } else if (there.contains(moved.geometry().center_m(moved.geometry().voxel_at(i))) &&
                 before != VoxelClass::kOccupied) {
        REQUIRE(now == VoxelClass::kUnknown);
      } else {
        REQUIRE(now == before);
      }
    }
  }
}

TEST_CASE("moves that cannot be are refused", "[mapping][objects][hostile]") {
  Scene scene({30, 30, 30});
  scene.add({0, 0, 0}, {0.4, 0.4, 0.4}, 0);
  const VoxelMap map = scene.map();
  const MapObjects found = find_objects(map, octomap_class);
  const auto fault = [&](std::vector<ObjectMove> moves) {
    const auto moved = move_objects(map, found, moves, 100'000);
    REQUIRE_FALSE(moved);
    return moved.error().fault;
  };
  for (const int id : {0, 2, -1}) CHECK(fault({{id, {0, 0, 1}}}) == Fault::kUsage);
  CHECK(fault({{1, {0, 0, 0.1}}, {1, {0, 0.1, 0}}}) == Fault::kUsage);
  CHECK(fault({{1, {0, std::nan(""), 0}}}) == Fault::kUsage);
  CHECK(fault({{1, {0, 1e300, 0}}}) == Fault::kUsage);
  CHECK(fault({{1, {0, 900, 0}}}) == Fault::kMapTooLarge);
}

TEST_CASE("the nearest occupied voxel is the nearest of all", "[mapping][objects]") {
  Scene scene({40, 40, 20});
  scene.add({0.5, 0.2, 0}, {0.3, 0.3, 0.3}, 0.5);
  const VoxelMap map = scene.map();
  Random random(5);
  for (int i = 0; i < 50; ++i) {
    const Vector3d p(random.uniform() * 3 - 1.5, random.uniform() * 3 - 1.5, random.uniform() - 0.5);
    const NearestOccupied nearest = nearest_occupied(map, p, octomap_class).value();
    CHECK(map.class_at(nearest.center_m) == VoxelClass::kOccupied);
    for (std::size_t v = 0; v < map.size(); ++v)
      if (map.voxel_class(v) == VoxelClass::kOccupied)
        REQUIRE((map.geometry().center_m(map.geometry().voxel_at(v)) - p).norm() >= nearest.distance_m);
  }
  CHECK_FALSE(nearest_occupied(VoxelMap(GridGeometry{0.1, {0, 0, 0}, {3, 3, 3}}), {0, 0, 0}, octomap_class));
}

}  // namespace firstlook
