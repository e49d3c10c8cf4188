#include <bit>
#include <catch2/catch.hpp>
#include <cstring>
#include <string>

#include "algorithms/mapping/moveit_scene.hpp"
#include "algorithms/mapping/ply_reader.hpp"
#include "algorithms/mapping/ply_writer.hpp"
#include "platform/core/random.hpp"
#include "tests/support/collect_bytes.hpp"

namespace firstlook {
namespace {

VoxelMap random_map(double occupied_fraction, std::uint64_t seed) {
  Random random(seed);
  VoxelMap map(GridGeometry{0.05, {-4, -5, 0}, {9, 12, 7}});
  for (std::size_t i = 0; i < map.size(); ++i) {
    const double draw = random.uniform();
    if (draw < occupied_fraction) map.set(i, VoxelClass::kOccupied, 0);
    if (draw > 0.95) map.set(i, VoxelClass::kFree, 0);
  }
  return map;
}

}  // namespace

TEST_CASE("the point cloud holds the occupied voxels' centres", "[mapping][export]") {
  const VoxelMap map = random_map(0.2, 1);
  const VoxelCounts counts = map.counts();
  for (const bool with_free : {false, true}) {
    const std::string text = collect([&](ByteSink sink) { write_ply(map, with_free, sink); });
    const std::size_t points = counts.occupied + (with_free ? counts.free : 0);
    CHECK(text.starts_with("ply\nformat binary_little_endian 1.0\n"));
    CHECK(text.find("element vertex " + std::to_string(points) + "\n") != std::string::npos);
    const std::size_t data = text.find("end_header\n") + 11;
    REQUIRE(text.size() == data + 16 * points);
    for (std::size_t i = 0; i < points; ++i) {
      float xyz[3];
      std::memcpy(xyz, text.data() + data + 16 * i, sizeof xyz);
      const Eigen::Vector3d p(static_cast<double>(xyz[0]), static_cast<double>(xyz[1]), static_cast<double>(xyz[2]));
      const auto voxel_class = static_cast<VoxelClass>(text[data + 16 * i + 15]);
      REQUIRE(map.class_at(p) == voxel_class);
      REQUIRE(voxel_class != VoxelClass::kUnknown);
    }
  }
}

namespace {

MapPlanes random_planes(const VoxelMap& map, const PlaneChoice& choice) {
  Random random(9);
  MapPlanes planes(map.geometry(), choice);
  const auto byte = [&random] { return static_cast<std::uint8_t>(random.below(255)); };
  for (std::size_t i = 0; i < map.size(); ++i) {
    if (planes.color && random.below(3) > 0) planes.color->set(i, {byte(), byte(), byte()});
    if (planes.label && random.below(3) > 0)
      planes.label->set(i, {static_cast<std::uint16_t>(random.below(65536)), ObjectShape(random.below(3))});
    if (planes.sensor) planes.sensor->set(i, byte());
  }
  return planes;
}

Result<MapPlanes> read_ply(const std::string& text, const GridGeometry& geometry) {
  std::size_t at = 0;
  return read_ply_planes(
      [&](std::span<std::byte> out) {
        const std::size_t size = std::min(out.size(), text.size() - at);
        std::memcpy(out.data(), text.data() + at, size);
        at += size;
        return size;
      },
      geometry);
}

}  // namespace

TEST_CASE("a point cloud keeps the planes of its voxels", "[mapping][export][planes]") {
  const VoxelMap map = random_map(0.3, 4);
  const std::string plain = collect([&](ByteSink sink) { write_ply(map, false, sink); });
  for (int words = 0; words < 8; ++words) {
    const PlaneChoice choice{(words & 1) != 0, (words & 2) != 0, (words & 4) != 0};
    const MapPlanes planes = random_planes(map, choice);
    const std::string text = collect([&](ByteSink sink) { write_ply(map, false, sink, planes); });
    if (words == 0) CHECK(text == plain);
    const auto read = read_ply(text, map.geometry());
    REQUIRE(read);
    REQUIRE(read->choice() == choice);
    for (std::size_t i = 0; i < map.size(); ++i) {
      const bool occupied = map.voxel_class(i) == VoxelClass::kOccupied;
      if (choice.color) REQUIRE(read->color->at(i) == (occupied ? planes.color->at(i) : std::nullopt));
      if (choice.label) {
        const VoxelLabel& label = read->label->at(i);
        REQUIRE(label.object == (occupied ? planes.label->at(i).object : 0));
        if (label.object != 0) REQUIRE(label.shape == planes.label->at(i).shape);
      }
      if (choice.sensor) REQUIRE(read->sensor->at(i) == (occupied ? planes.sensor->at(i) : 0));
    }
  }
}

TEST_CASE("a point cloud that is broken or not ours has no planes", "[mapping][export][planes][hostile]") {
  const VoxelMap map = random_map(0.3, 4);
  const MapPlanes planes = random_planes(map, {true, true, true});
  const std::string text = collect([&](ByteSink sink) { write_ply(map, false, sink, planes); });
  const auto refused = [&](const std::string& broken) {
    const auto read = read_ply(broken, map.geometry());
    return !read && read.error().fault == Fault::kMapUnreadable;
  };
  CHECK(refused(""));
  CHECK(refused("ply\nformat ascii 1.0\nend_header\n"));
  CHECK(refused(text.substr(0, 100)));
  CHECK(refused(text.substr(0, text.size() - 1)));
  const auto with = [&text](const std::string& from, const std::string& to) {
    std::string changed = text;
    return changed.replace(changed.find(from), from.size(), to);
  };
  CHECK(refused(with("resolution 0.05", "resolution 0.06")));
  CHECK(refused(with("property ushort label", "property ushort labels")));
  CHECK(refused(with("property float x\n", "")));
  // Points that are nowhere, a shape that is none.
  std::string hostile = text;
  const std::size_t data = hostile.find("end_header\n") + 11;
  for (std::size_t i = data; i < hostile.size(); ++i) hostile[i] = static_cast<char>(i * 97 % 256);
  CHECK(read_ply(hostile, map.geometry()));
}

TEST_CASE("merged boxes cover exactly the occupied voxels, each once", "[mapping][export]") {
  for (const double fraction : {0.0, 0.3, 0.9}) {
    const VoxelMap map = random_map(fraction, 2);
    const std::vector<AxisBox> boxes = merge_occupied(map, octomap_class);
    for (std::size_t i = 0; i < map.size(); ++i) {
      const Eigen::Vector3d c = map.geometry().center_m(map.geometry().voxel_at(i));
      int covers = 0;
      for (const AxisBox& box : boxes)
        covers += (c.array() > box.low_m.array()).all() && (c.array() < box.high_m.array()).all();
      REQUIRE(covers == (map.voxel_class(i) == VoxelClass::kOccupied ? 1 : 0));
    }
    CHECK(boxes.size() <= map.counts().occupied);
  }
}

TEST_CASE("boxes for planning also cover free voxels in which a surface is left", "[mapping][export]") {
  VoxelMap map(GridGeometry{0.1, {0, 0, 0}, {5, 3, 1}});
  for (std::size_t i = 0; i < map.size(); ++i) map.set(i, VoxelClass::kFree, 0);
  for (const int x : {0, 1, 3, 4}) map.set(map.geometry().index({x, 1, 0}), VoxelClass::kOccupied, 0);
  map.note_surface(map.geometry().index({2, 1, 0}), 6);  // a panel with a hole in it
  CHECK(merge_occupied(map, octomap_class).size() == 2);
  const std::vector<AxisBox> boxes = merge_occupied(map, collision_class);
  REQUIRE(boxes.size() == 1);
  CHECK(boxes[0].low_m.isApprox(Eigen::Vector3d(0.0, 0.1, 0.0)));
  CHECK(boxes[0].high_m.isApprox(Eigen::Vector3d(0.5, 0.2, 0.1)));
}

TEST_CASE("a solid block is one box", "[mapping][export]") {
  VoxelMap map(GridGeometry{0.1, {0, 0, 0}, {6, 6, 6}});
  for (std::size_t i = 0; i < map.size(); ++i) {
    const Eigen::Vector3i v = map.geometry().voxel_at(i);
    if (v.x() >= 1 && v.x() < 4 && v.y() >= 2 && v.y() < 6 && v.z() < 2) map.set(i, VoxelClass::kOccupied, 0);
  }
  const std::vector<AxisBox> boxes = merge_occupied(map, octomap_class);
  REQUIRE(boxes.size() == 1);
  CHECK(boxes[0].low_m.isApprox(Eigen::Vector3d(0.1, 0.2, 0.0)));
  CHECK(boxes[0].high_m.isApprox(Eigen::Vector3d(0.4, 0.6, 0.2)));
}

TEST_CASE("the scene has MoveIt's shape", "[mapping][export]") {
  const std::vector<AxisBox> boxes = {{{0, 0, 0}, {0.1, 0.2, 0.4}}, {{-1, 0, 0}, {-0.5, 1, 1}}};
  const std::string text = collect([&](ByteSink sink) { write_moveit_scene(boxes, "cell", sink); });
  CHECK(text ==
        "cell\n* map\n0 0 0\n0 0 0 1\n2\n"
        "box\n0.1 0.2 0.4\n0.05 0.1 0.2\n0 0 0 1\n0.6 0.6 0.6 1\n"
        "box\n0.5 1 1\n-0.75 0.5 0.5\n0 0 0 1\n0.6 0.6 0.6 1\n"
        "0\n.\n");
}

}  // namespace firstlook
