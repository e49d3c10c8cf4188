#include "algorithms/mapping/octree_writer.hpp"

#include <octomap/ColorOcTree.h>

#include <algorithm>
#include <map>

#include "octree_bytes.hpp"

namespace firstlook {
namespace {

// The tree that OctoMap itself builds from the same values.
octomap::OcTree build_tree(const VoxelMap& map) {
  octomap::OcTree tree(0.05);
  for (std::size_t i = 0; i < map.size(); ++i) {
    if (map.log_odds(i) == kUnknownLogOdds) continue;
    const Eigen::Vector3i v = map.geometry().voxel_at(i) + map.geometry().first + Eigen::Vector3i::Constant(32768);
    tree.setNodeValue(octomap::OcTreeKey(static_cast<octomap::key_type>(v.x()), static_cast<octomap::key_type>(v.y()),
                                         static_cast<octomap::key_type>(v.z())),
                      static_cast<float>(map.log_odds(i) * kLogOddsUnit), true);
  }
  tree.updateInnerOccupancy();
  return tree;
}

}  // namespace

TEST_CASE("OctoMap reads our .bt back voxel for voxel, and writes the same bytes", "[mapping][octomap]") {
  Random random(1);
  for (int round = 0; round < 3; ++round) {
    const VoxelMap map = blocky_map(random);
    const std::string text = collect([&](ByteSink sink) { write_bt(map, octomap_class, kOctreeDepth, sink); });
    const auto tree = read_bt(text);
    require_equal(map, *tree);
    octomap::OcTree built = build_tree(map);
    built.toMaxLikelihood();
    built.prune();
    CHECK(tree->size() == built.size());
    std::ostringstream theirs;
    built.writeBinaryConst(theirs);
    CHECK(theirs.str() == text);
  }
}

TEST_CASE("OctoMap reads our .ot back with its log-odds, and writes the same bytes", "[mapping][octomap]") {
  Random random(2);
  const VoxelMap map = blocky_map(random);
  const std::string text = collect([&](ByteSink sink) { write_ot(map, kOctreeDepth, sink); });
  const auto tree = read_ot(text);
  require_equal(map, *tree);
  CHECK(compare(map, *tree).log_odds_error_max < 1e-6);
  octomap::OcTree built = build_tree(map);
  built.prune();
  std::ostringstream theirs;
  built.write(theirs);
  CHECK(theirs.str() == text);
}

TEST_CASE("a coarser tree has what OctoMap's inner nodes say", "[mapping][octomap]") {
  Random random(3);
  const VoxelMap map = blocky_map(random);
  const octomap::OcTree full = build_tree(map);
  for (const int depth : {15, 14, 12, 3, 1}) {
    const auto ot = read_ot(collect([&](ByteSink sink) { write_ot(map, depth, sink); }));
    const auto bt = read_bt(collect([&](ByteSink sink) { write_bt(map, octomap_class, depth, sink); }));
    CHECK(ot->size() < full.size());
    for (const auto* tree : {ot.get(), bt.get()})
      for (auto leaf = tree->begin_leafs(); leaf != tree->end_leafs(); ++leaf)
        REQUIRE(static_cast<int>(leaf.getDepth()) <= depth);
    for (std::size_t i = 0; i < map.size(); ++i) {
      const Eigen::Vector3d c = map.geometry().center_m(map.geometry().voxel_at(i));
      const auto* expected = full.search(c.x(), c.y(), c.z(), static_cast<unsigned>(depth));
      const auto* full_node = ot->search(c.x(), c.y(), c.z());
      const auto* binary_node = bt->search(c.x(), c.y(), c.z());
      REQUIRE((expected != nullptr) == (full_node != nullptr));
      REQUIRE((expected != nullptr) == (binary_node != nullptr));
      if (expected == nullptr) continue;
      REQUIRE(full_node->getLogOdds() == expected->getLogOdds());
      REQUIRE(bt->isNodeOccupied(binary_node) == full.isNodeOccupied(expected));
    }
  }
}

TEST_CASE("OctoMap reads a map with colours as a ColorOcTree", "[mapping][octomap][planes]") {
  Random random(6);
  const VoxelMap map = blocky_map(random);
  ColorPlane colors(map.geometry());
  for (std::size_t i = 0; i < map.size(); ++i) {
    const auto gray = static_cast<std::uint8_t>(40 * random.below(6));
    if (random.below(4) > 0) colors.set(i, {gray, static_cast<std::uint8_t>(random.below(2)), 7});
  }
  for (const int depth : {16, 15, 12}) {
    std::istringstream stream(collect([&](ByteSink sink) { write_color_ot(map, colors, depth, sink); }));
    const std::unique_ptr<octomap::AbstractOcTree> any(octomap::AbstractOcTree::read(stream));
    const auto* tree = dynamic_cast<octomap::ColorOcTree*>(any.get());
    REQUIRE(tree != nullptr);
    const auto plain = read_ot(collect([&](ByteSink sink) { write_ot(map, depth, sink); }));
    std::map<const octomap::ColorOcTreeNode*, std::pair<std::array<double, 3>, int>> blocks;  // by leaf
    for (std::size_t i = 0; i < map.size(); ++i) {
      const Eigen::Vector3d c = map.geometry().center_m(map.geometry().voxel_at(i));
      const auto* node = tree->search(c.x(), c.y(), c.z());
      const auto* same = plain->search(c.x(), c.y(), c.z());
      REQUIRE((node == nullptr) == (same == nullptr));
      if (node == nullptr) continue;
      REQUIRE(node->getLogOdds() == same->getLogOdds());
      auto& [sum, points] = blocks[node];
      const auto color = map.voxel_class(i) == VoxelClass::kOccupied ? colors.at(i) : std::nullopt;
      if (!color) continue;
      ++points;
      for (std::size_t k = 0; k < 3; ++k) sum[k] += (*color)[k];
    }
    int colored = 0;
    for (const auto& [node, block] : blocks) {
      const auto& [sum, points] = block;
      REQUIRE(node->isColorSet() == (points > 0));
      if (points == 0) continue;
      ++colored;
      const auto c = node->getColor();
      REQUIRE(std::abs(c.r - sum[0] / points) <= 0.5);
      REQUIRE(std::abs(c.g - sum[1] / points) <= 0.5);
      REQUIRE(std::abs(c.b - sum[2] / points) <= 0.5);
    }
    CHECK(colored > 10);
  }
}

TEST_CASE("a map that knows nothing is an empty tree", "[mapping][octomap]") {
  const VoxelMap map(GridGeometry{0.05, {0, 0, 0}, {8, 8, 8}});
  CHECK(read_bt(collect([&](ByteSink sink) { write_bt(map, octomap_class, kOctreeDepth, sink); }))->size() == 0);
  CHECK(read_ot(collect([&](ByteSink sink) { write_ot(map, kOctreeDepth, sink); }))->size() == 0);
}

TEST_CASE("a collision map has no hole where a surface is left in a voxel of class free", "[mapping][octomap]") {
  Random random(4);
  VoxelMap map = blocky_map(random);
  const std::string ot = collect([&](ByteSink sink) { write_ot(map, kOctreeDepth, sink); });
  const std::string by_classes = collect([&](ByteSink sink) { write_bt(map, octomap_class, kOctreeDepth, sink); });
  std::vector<bool> holds(map.size(), false);
  for (int n = 0; n < 300; ++n) {
    const auto at = static_cast<std::size_t>(random.below(static_cast<int>(map.size())));
    if (map.voxel_class(at) != VoxelClass::kFree) continue;
    map.note_surface(at, static_cast<unsigned>(random.below(8)));
    holds[at] = true;
  }
  REQUIRE(std::count(holds.begin(), holds.end(), true) > 20);
  const auto tree = read_bt(collect([&](ByteSink sink) { write_bt(map, collision_class, kOctreeDepth, sink); }));
  for (std::size_t i = 0; i < map.size(); ++i) {
    const Eigen::Vector3d c = map.geometry().center_m(map.geometry().voxel_at(i));
    const auto* node = tree->search(c.x(), c.y(), c.z());
    REQUIRE((node == nullptr) == (map.voxel_class(i) == VoxelClass::kUnknown));
    if (node == nullptr) continue;
    REQUIRE(tree->isNodeOccupied(node) == (holds[i] || map.voxel_class(i) == VoxelClass::kOccupied));
  }
  // OctoMap's own files say what they said.
  CHECK(collect([&](ByteSink sink) { write_ot(map, kOctreeDepth, sink); }) == ot);
  CHECK(collect([&](ByteSink sink) { write_bt(map, octomap_class, kOctreeDepth, sink); }) == by_classes);
}

TEST_CASE("a voxel that a ray has crossed again is free in a collision map, too", "[mapping][octomap]") {
  VoxelMap map(GridGeometry{0.05, {0, 0, 0}, {2, 2, 2}});
  map.set(3, VoxelClass::kFree, 0);
  map.note_surface(3, 5);
  CHECK(collision_class(map, 3) == VoxelClass::kOccupied);
  CHECK(octomap_class(map, 3) == VoxelClass::kFree);
  map.note_crossed(3, 1U << 5);
  CHECK(collision_class(map, 3) == VoxelClass::kFree);
  CHECK(collision_class(map, 0) == VoxelClass::kUnknown);
}

}  // namespace firstlook
