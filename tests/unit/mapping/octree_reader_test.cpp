#include "algorithms/mapping/octree_reader.hpp"

#include <octomap/ColorOcTree.h>

#include <limits>

#include "algorithms/mapping/octree_writer.hpp"
#include "octree_bytes.hpp"

namespace firstlook {
namespace {

/// Hands out a text as a ByteSource does.
struct Text {
  std::string_view left;
  explicit Text(std::string_view text) : left(text) {}
  std::size_t operator()(std::span<std::byte> out) {
    const std::size_t size = std::min(out.size(), left.size());
    std::copy_n(reinterpret_cast<const std::byte*>(left.data()), size, out.begin());
    left.remove_prefix(size);
    return size;
  }
};

Result<OctreeInfo> survey(std::string_view text) {
  Text source(text);
  return survey_octree(source);
}

VoxelMap read(std::string_view text, int depth = kOctreeDepth) {
  const OctreeInfo info = survey(text).value();
  const GridGeometry grid = info.grid(depth);
  std::vector<std::int8_t> log_odds(grid.count());
  Text source(text);
  REQUIRE(read_octree(source, depth, grid, log_odds).value() == 0);
  return {grid, std::move(log_odds)};
}

std::string error_of(std::string_view text) {
  const Result<OctreeInfo> info = survey(text);
  REQUIRE_FALSE(info);
  CHECK(info.error().fault == Fault::kMapUnreadable);
  return std::string(info.error().detail());
}

/// A tree that OctoMap makes of rays in all directions, its values anywhere between the clamps.
octomap::OcTree random_tree(std::uint64_t seed, double resolution_m) {
  Random random(seed);
  octomap::OcTree tree(resolution_m);
  for (int scan = 0; scan < 3; ++scan) {
    octomap::Pointcloud cloud;
    for (int i = 0; i < 400; ++i) {
      const Eigen::Vector3d p(random.uniform() * 4 - 2, random.uniform() * 4 - 2, random.uniform() * 2 - 1);
      cloud.push_back(to_octomap(p));
    }
    tree.insertPointCloud(cloud, to_octomap({0.1 * scan, 0.02, -0.05}));
  }
  return tree;
}

std::string write(octomap::OcTree tree, bool binary) {
  std::ostringstream stream;
  binary ? tree.writeBinary(stream) : tree.write(stream);
  return stream.str();
}

std::string header(std::string_view kind, std::size_t nodes) {
  return "# Octomap OcTree " + std::string(kind) + "file\n# comment\nid OcTree\nsize " + std::to_string(nodes) +
         "\nres 0.05\ndata\n";
}

bool contains(const std::string& text, std::string_view part) { return text.find(part) != std::string::npos; }

}  // namespace

TEST_CASE("what we write we read, value for value", "[mapping][octomap]") {
  Random random(11);
  for (int round = 0; round < 3; ++round) {
    const VoxelMap map = blocky_map(random);
    const std::string ot = collect([&](ByteSink sink) { write_ot(map, kOctreeDepth, sink); });
    const std::string bt = collect([&](ByteSink sink) { write_bt(map, octomap_class, kOctreeDepth, sink); });
    const VoxelMap full = read(ot), binary = read(bt);
    CHECK(full.geometry().resolution_m == 0.05);
    std::size_t known = 0;
    for (std::size_t i = 0; i < map.size(); ++i) {
      if (map.log_odds(i) == kUnknownLogOdds) continue;
      ++known;
      const Eigen::Vector3i v = map.geometry().voxel_at(i) + map.geometry().first;
      REQUIRE(full.log_odds(full.geometry().index(v - full.geometry().first)) == map.log_odds(i));
      REQUIRE(binary.voxel_class(binary.geometry().index(v - binary.geometry().first)) == map.voxel_class(i));
    }
    for (const VoxelMap* read_back : {&full, &binary})
      CHECK(read_back->counts().free + read_back->counts().occupied == known);
    CHECK(survey(ot)->known_voxels == known);
    CHECK(collect([&](ByteSink sink) { write_ot(full, kOctreeDepth, sink); }) == ot);
  }
}

TEST_CASE("what OctoMap writes we read as OctoMap does", "[mapping][octomap]") {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const octomap::OcTree tree = random_tree(seed, 0.1);
    const VoxelMap full = read(write(tree, false));
    require_equal(full, tree);
    CHECK(compare(full, tree).log_odds_error_max < 0.51 * kLogOddsUnit);
    require_equal(read(write(tree, true)), *read_bt(write(tree, true)));
  }
}

TEST_CASE("a tree is cut at a coarser depth as OctoMap cuts it", "[mapping][octomap]") {
  const octomap::OcTree tree = random_tree(4, 0.05);
  for (const int depth : {15, 13, 11}) {
    const VoxelMap map = read(write(tree, false), depth);
    CHECK(map.geometry().resolution_m == 0.05 * (1 << (16 - depth)));
    for (std::size_t i = 0; i < map.size(); ++i) {
      const Eigen::Vector3d c = map.geometry().center_m(map.geometry().voxel_at(i));
      const auto* node = tree.search(to_octomap(c), static_cast<unsigned>(depth));
      REQUIRE((node == nullptr) == (map.voxel_class(i) == VoxelClass::kUnknown));
      if (node != nullptr) REQUIRE(tree.isNodeOccupied(node) == (map.voxel_class(i) == VoxelClass::kOccupied));
    }
  }
}

TEST_CASE("colours are passed over, an empty tree is no voxels", "[mapping][octomap]") {
  octomap::ColorOcTree tree(0.1);
  for (const float x : {0.05F, 0.35F, -2.05F}) {
    tree.updateNode(octomap::point3d(x, 1, 2), true);
    tree.setNodeColor(x, 1, 2, 10, 20, 30);
  }
  tree.updateNode(octomap::point3d(0.05F, 1.1F, 2), false);
  tree.updateInnerOccupancy();
  std::ostringstream stream;
  tree.write(stream);
  const VoxelMap map = read(stream.str());
  CHECK(map.counts().occupied == 3);
  CHECK(map.counts().free == 1);
  CHECK(map.class_at({-2.05, 1, 2}) == VoxelClass::kOccupied);
  CHECK(map.class_at({0.05, 1.1, 2}) == VoxelClass::kFree);

  const OctreeInfo empty = survey(write(octomap::OcTree(0.2), false)).value();
  CHECK(empty.known_voxels == 0);
  CHECK(empty.grid(16).count() == 0);
}

TEST_CASE("what lies outside a given grid is counted, another resolution is refused", "[mapping][octomap]") {
  Random random(12);
  const VoxelMap map = blocky_map(random);
  const std::string ot = collect([&](ByteSink sink) { write_ot(map, kOctreeDepth, sink); });
  const GridGeometry part{0.05, {-10, -30, 0}, {20, 40, 7}};
  std::vector<std::int8_t> log_odds(part.count(), 77);
  Text source(ot);
  const std::uint64_t outside = read_octree(source, kOctreeDepth, part, log_odds).value();
  std::uint64_t expected_outside = 0, inside = 0;
  for (std::size_t i = 0; i < map.size(); ++i) {
    const Eigen::Vector3i v = map.geometry().voxel_at(i) + map.geometry().first - part.first;
    if (!part.contains(v)) {
      expected_outside += map.log_odds(i) != kUnknownLogOdds;
      continue;
    }
    inside += map.log_odds(i) != kUnknownLogOdds;
    REQUIRE(log_odds[part.index(v)] == map.log_odds(i));
  }
  CHECK(outside == expected_outside);
  CHECK(outside + inside == survey(ot)->known_voxels);

  for (const int depth : {16, 14}) {
    GridGeometry other = part;
    other.resolution_m = 0.1;
    Text again(ot);
    const auto refused = read_octree(again, depth, other, log_odds);
    REQUIRE_FALSE(refused);
    CHECK(contains(std::string(refused.error().detail()), depth == 16 ? "0.05 m at depth 16" : "0.2 m at depth 14"));
    CHECK(contains(std::string(refused.error().detail()), "0.1 m"));
  }
}

TEST_CASE("a file that is cut anywhere is refused", "[mapping][hostile]") {
  for (const bool binary : {false, true}) {
    const std::string whole = write(random_tree(5, 0.4), binary);
    REQUIRE(survey(whole));
    for (std::size_t size = 0; size < whole.size(); ++size) REQUIRE_FALSE(survey(whole.substr(0, size)));
    CHECK(contains(error_of(whole.substr(0, whole.size() - 1)), "byte " + std::to_string(whole.size() - 1)));
    CHECK(contains(error_of(whole + "x"), "byte " + std::to_string(whole.size()) + ": more follows"));
  }
}

TEST_CASE("flipped bits give a value or an error, and the two passes agree", "[mapping][hostile]") {
  Random random(13);
  int refused = 0, read_well = 0;
  for (const bool binary : {false, true}) {
    const std::string whole = write(random_tree(6, 0.4), binary);
    for (int round = 0; round < 3000; ++round) {
      std::string bytes = whole;
      const auto at = static_cast<std::size_t>(random.below(static_cast<int>(bytes.size())));
      bytes[at] = static_cast<char>(bytes[at] ^ (1 << random.below(8)));
      const Result<OctreeInfo> info = survey(bytes);
      if (!info) {
        ++refused;
        continue;
      }
      const GridGeometry grid = info->grid(16);
      if (grid.count() > 4'000'000) continue;
      std::vector<std::int8_t> log_odds(grid.count());
      Text source(bytes);
      REQUIRE(read_octree(source, 16, grid, log_odds).value() == 0);
      const auto unknown = static_cast<std::uint64_t>(std::ranges::count(log_odds, kUnknownLogOdds));
      REQUIRE(grid.count() - unknown == info->known_voxels);
      ++read_well;
    }
  }
  CHECK(refused > 100);
  CHECK(read_well > 100);
}

TEST_CASE("hostile trees are refused with the byte and the reason", "[mapping][hostile]") {
  CHECK(contains(error_of(""), "byte 0"));
  CHECK(contains(error_of("solid cube\n"), "# Octomap OcTree binary file"));
  CHECK(contains(error_of(std::string(100000, '#')), "byte 0"));
  CHECK(contains(error_of("# Octomap OcTree file\nid OcTree\nres 0.1\n" + std::string(5000, 'x')), "no 'data'"));
  CHECK(contains(error_of("# Octomap OcTree file\nid OcTree\nres 0.1\ndata\n"), "no 'size'"));
  CHECK(contains(error_of("# Octomap OcTree file\nid OcTree\nsize 0\ndata\n"), "no 'res'"));
  CHECK(contains(error_of("# Octomap OcTree file\nid OcTree\nsize 0\nres nan\ndata\n"), "res 'nan'"));
  CHECK(contains(error_of("# Octomap OcTree file\nid OcTree\nsize 0\nres -0.1\ndata\n"), "res '-0.1'"));
  CHECK(contains(error_of("# Octomap OcTree file\nid OcTree\nsize -4\nres 0.1\ndata\n"), "size '-4'"));
  CHECK(contains(error_of("# Octomap OcTree file\nid CountingOcTree\nsize 0\nres 1\ndata\n"), "CountingOcTree"));
  // A chain of inner nodes that goes deeper than any tree.
  std::string down;
  for (int i = 0; i < 40; ++i) down += std::string("\3\0", 2);
  CHECK(contains(error_of(header("binary ", 1000) + down), "depth 16 has children"));
  CHECK(contains(error_of(header("binary ", 1) + std::string("\3\0", 2)), "more nodes than the 1"));
  CHECK(contains(error_of(header("binary ", 2) + std::string("\3\0\0\0", 4)), "inner node without children"));
  CHECK(contains(error_of(header("binary ", 9) + std::string("\1\0", 2)), "after 2 nodes, its header says 9"));
  const float infinite = std::numeric_limits<float>::infinity();
  std::string value(reinterpret_cast<const char*>(&infinite), 4);
  CHECK(contains(error_of(header("", 1) + value + std::string(1, '\0')), "log-odds inf of a node at depth 0"));
  // One leaf that is all there can be: read, but no grid would hold it.
  const OctreeInfo all = survey(header("", 1) + std::string(5, '\0')).value();
  CHECK(all.size == Eigen::Vector3i::Constant(65536));
  CHECK(all.known_voxels == std::uint64_t{1} << 48);
}

TEST_CASE("log-odds of another sensor model keep their class", "[mapping][octomap]") {
  octomap::OcTree tree(0.1);
  const float values[] = {-0.001F, 0.0F, 0.001F, -9.0F, 9.0F, 3.0e38F};
  for (int i = 0; i < 6; ++i)
    tree.setNodeValue(octomap::point3d(0.05F + 0.1F * static_cast<float>(i), 0, 0), values[i], true);
  tree.updateInnerOccupancy();
  // setNodeValue clamps; the values are put in directly.
  for (int i = 0; i < 6; ++i) tree.search(0.05F + 0.1F * static_cast<float>(i), 0.0F, 0.0F)->setLogOdds(values[i]);
  std::ostringstream stream;
  static_cast<const octomap::OcTree&>(tree).write(stream);
  const VoxelMap map = read(stream.str());
  const std::int8_t expected[] = {-1, 0, 0, kLogOddsMin, kLogOddsMax, kLogOddsMax};
  for (int i = 0; i < 6; ++i) CHECK(map.log_odds(map.geometry().index({i, 0, 0})) == expected[i]);
}

}  // namespace firstlook
