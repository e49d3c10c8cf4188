#include "algorithms/mapping/octree_writer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <string>
#include <vector>

#include "platform/core/ensure.hpp"

namespace firstlook {
namespace {

constexpr int kKeyZero = 32768;  // OctoMap's key of the voxel at the origin

// The leaves at the depth where the tree is cut: a dense block of values with its place among the keys of that depth.
struct Leaves {
  Eigen::Vector3i first;  // key of the first leaf at this depth, 0 ..
  Eigen::Vector3i size;
  int depth = kOctreeDepth;
  std::vector<std::int8_t> values;
  std::vector<ColorSum> colors;  // of a ColorOcTree, else empty

  [[nodiscard]] std::size_t index(int x, int y, int z) const {
    return (static_cast<std::size_t>(z) * static_cast<std::size_t>(size.y()) + static_cast<std::size_t>(y)) *
               static_cast<std::size_t>(size.x()) +
           static_cast<std::size_t>(x);
  }
};

// A cube of leaves: a node of the tree.
struct Node {
  Eigen::Vector3i low;  // key of its first leaf
  int depth = 0;

  [[nodiscard]] Node child(int i, int leaf_depth) const {
    const int half = 1 << (leaf_depth - depth - 1);
    return {low + half * Eigen::Vector3i(i & 1, (i >> 1) & 1, (i >> 2) & 1), depth + 1};
  }
};

enum class Shape : std::uint8_t { kAbsent, kLeaf, kInner };

// What OctoMap's tree would have here after pruning; `value` is the largest known below.
struct NodeState {
  Shape shape = Shape::kAbsent;
  std::int8_t value = kUnknownLogOdds;
  ColorSum color{};
};

NodeState state_of(const Leaves& leaves, const Node& node) {
  const int edge = 1 << (leaves.depth - node.depth);
  const Eigen::Vector3i low = (node.low - leaves.first).cwiseMax(0);
  const Eigen::Vector3i high = (node.low - leaves.first + Eigen::Vector3i::Constant(edge)).cwiseMin(leaves.size);
  NodeState state;
  if ((low.array() >= high.array()).any()) return state;
  bool uniform = (high - low == Eigen::Vector3i::Constant(edge));
  const std::size_t first = leaves.index(low.x(), low.y(), low.z());
  for (int z = low.z(); z < high.z(); ++z) {
    for (int y = low.y(); y < high.y(); ++y) {
      for (int x = low.x(); x < high.x(); ++x) {
        const std::size_t at = leaves.index(x, y, z);
        uniform = uniform && leaves.values[at] == leaves.values[first];
        state.value = std::max(state.value, leaves.values[at]);  // unknown is the smallest of all values
        if (leaves.colors.empty()) continue;
        uniform = uniform && leaves.colors[at].mean() == leaves.colors[first].mean();
        if (const auto color = leaves.colors[at].mean()) state.color.add(*color);
      }
    }
  }
  if (state.value == kUnknownLogOdds) return state;
  // OctoMap never prunes the root.
  state.shape = (uniform && node.depth > 0) || edge == 1 ? Shape::kLeaf : Shape::kInner;
  return state;
}

std::array<NodeState, 8> children_of(const Leaves& leaves, const Node& node) {
  std::array<NodeState, 8> children;
  for (int i = 0; i < 8; ++i) children[static_cast<std::size_t>(i)] = state_of(leaves, node.child(i, leaves.depth));
  return children;
}

// One of two values for each class, so that blocks of a class are equal.
std::int8_t value_of(VoxelClass voxel_class) {
  if (voxel_class == VoxelClass::kUnknown) return kUnknownLogOdds;
  return voxel_class == VoxelClass::kOccupied ? 1 : 0;
}

// Cuts the map at a depth: log-odds, or classes when there is a reading of them; with the colours of what is occupied.
Leaves cut(const VoxelMap& map, int depth, ClassReading reading, const ColorPlane* colors) {
  const GridGeometry& g = map.geometry();
  const int shift = kOctreeDepth - depth;
  Leaves leaves;
  leaves.depth = depth;
  const Eigen::Vector3i first = g.first + Eigen::Vector3i::Constant(kKeyZero);
  const Eigen::Vector3i last = first + g.size - Eigen::Vector3i::Ones();
  for (int axis = 0; axis < 3; ++axis) {
    ENSURE(3052, first[axis] >= 0 && last[axis] < 2 * kKeyZero);
    leaves.first[axis] = first[axis] >> shift;
    leaves.size[axis] = (last[axis] >> shift) - leaves.first[axis] + 1;
  }
  const auto nx = static_cast<std::size_t>(leaves.size.x()), ny = static_cast<std::size_t>(leaves.size.y());
  leaves.values.assign(nx * ny * static_cast<std::size_t>(leaves.size.z()), kUnknownLogOdds);
  if (colors != nullptr) leaves.colors.resize(leaves.values.size());
  std::size_t index = 0;
  for (int z = 0; z < g.size.z(); ++z) {
    for (int y = 0; y < g.size.y(); ++y) {
      for (int x = 0; x < g.size.x(); ++x, ++index) {
        const std::int8_t value = reading == nullptr ? map.log_odds(index) : value_of(reading(map, index));
        if (value == kUnknownLogOdds) continue;
        const auto i = static_cast<std::size_t>(((first.x() + x) >> shift) - leaves.first.x());
        const auto j = static_cast<std::size_t>(((first.y() + y) >> shift) - leaves.first.y());
        const auto k = static_cast<std::size_t>(((first.z() + z) >> shift) - leaves.first.z());
        std::int8_t& leaf = leaves.values[(k * ny + j) * nx + i];
        leaf = std::max(leaf, value);
        if (colors == nullptr || map.voxel_class(index) != VoxelClass::kOccupied) continue;
        if (const auto color = colors->at(index)) leaves.colors[(k * ny + j) * nx + i].add(*color);
      }
    }
  }
  return leaves;
}

std::size_t count_nodes(const Leaves& leaves, const Node& node) {
  std::size_t nodes = 1;
  const std::array<NodeState, 8> children = children_of(leaves, node);
  for (int i = 0; i < 8; ++i) {
    const Shape shape = children[static_cast<std::size_t>(i)].shape;
    if (shape == Shape::kInner) nodes += count_nodes(leaves, node.child(i, leaves.depth));
    if (shape == Shape::kLeaf) ++nodes;
  }
  return nodes;
}

// Two bits a child, the lower bit first: free 1 0, occupied 0 1, has children 1 1, unknown 0 0.
void write_binary_node(const Leaves& leaves, const Node& node, ByteSink sink) {
  const std::array<NodeState, 8> children = children_of(leaves, node);
  unsigned bits = 0;
  for (unsigned i = 0; i < 8; ++i) {
    const NodeState& child = children[i];
    if (child.shape == Shape::kInner) bits |= 3u << (2 * i);
    if (child.shape == Shape::kLeaf) bits |= (child.value > 0 ? 2u : 1u) << (2 * i);
  }
  const std::array<std::byte, 2> bytes = {static_cast<std::byte>(bits & 0xff), static_cast<std::byte>(bits >> 8)};
  sink(bytes);
  for (int i = 0; i < 8; ++i)
    if (children[static_cast<std::size_t>(i)].shape == Shape::kInner)
      write_binary_node(leaves, node.child(i, leaves.depth), sink);
}

// A little-endian float, three bytes of a ColorOcTree, and one byte with a bit for each child; then the children.
void write_full_node(const Leaves& leaves, const Node& node, const NodeState& state, ByteSink sink) {
  std::array<NodeState, 8> children{};
  if (state.shape == Shape::kInner) children = children_of(leaves, node);
  unsigned present = 0;
  for (unsigned i = 0; i < 8; ++i) present |= (children[i].shape != Shape::kAbsent ? 1u : 0u) << i;
  const auto value = std::bit_cast<std::uint32_t>(static_cast<float>(state.value * kLogOddsUnit));
  std::array<std::byte, 4 + 3 + 1> bytes = {
      static_cast<std::byte>(value & 0xff), static_cast<std::byte>((value >> 8) & 0xff),
      static_cast<std::byte>((value >> 16) & 0xff), static_cast<std::byte>(value >> 24)};
  std::size_t size = 4;
  if (!leaves.colors.empty())
    for (const std::uint8_t channel : state.color.mean().value_or(kNoColor))
      bytes[size++] = static_cast<std::byte>(channel);
  bytes[size++] = static_cast<std::byte>(present);
  sink(std::span(bytes).first(size));
  for (int i = 0; i < 8; ++i) {
    const NodeState& child = children[static_cast<std::size_t>(i)];
    if (child.shape != Shape::kAbsent) write_full_node(leaves, node.child(i, leaves.depth), child, sink);
  }
}

const Node kRoot{Eigen::Vector3i::Zero(), 0};

void write_nodes(const Leaves& leaves, bool binary, ByteSink sink) {
  const NodeState root = state_of(leaves, kRoot);
  if (root.shape == Shape::kAbsent) return;
  binary ? write_binary_node(leaves, kRoot, sink) : write_full_node(leaves, kRoot, root, sink);
}

void write_file(const Leaves& leaves, bool binary, double resolution_m, ByteSink sink) {
  const bool empty = state_of(leaves, kRoot).shape == Shape::kAbsent;
  const std::string header = fmt::format(
      "# Octomap OcTree {}file\n# (feel free to add / change comments, but leave the first line as it is!)\n#\n"
      "id {}\nsize {}\nres {}\ndata\n",
      binary ? "binary " : "", leaves.colors.empty() ? "OcTree" : "ColorOcTree", empty ? 0 : count_nodes(leaves, kRoot),
      resolution_m);
  sink(std::as_bytes(std::span(header)));
  write_nodes(leaves, binary, sink);
}

Leaves checked_cut(const VoxelMap& map, int depth, ClassReading reading, const ColorPlane* colors = nullptr) {
  ENSURE(3051, depth >= 1 && depth <= kOctreeDepth);
  return cut(map, depth, reading, colors);
}

}  // namespace

void write_bt(const VoxelMap& map, ClassReading reading, int depth, ByteSink sink) {
  write_file(checked_cut(map, depth, reading), true, map.geometry().resolution_m, sink);
}

void write_ot(const VoxelMap& map, int depth, ByteSink sink) {
  write_file(checked_cut(map, depth, nullptr), false, map.geometry().resolution_m, sink);
}

void write_color_ot(const VoxelMap& map, const ColorPlane& colors, int depth, ByteSink sink) {
  write_file(checked_cut(map, depth, nullptr, &colors), false, map.geometry().resolution_m, sink);
}

void write_bt_nodes(const VoxelMap& map, ClassReading reading, int depth, ByteSink sink) {
  write_nodes(checked_cut(map, depth, reading), true, sink);
}

void write_ot_nodes(const VoxelMap& map, int depth, ByteSink sink) {
  write_nodes(checked_cut(map, depth, nullptr), false, sink);
}

}  // namespace firstlook
