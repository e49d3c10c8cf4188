#include "algorithms/mapping/octree_reader.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <vector>

#include "algorithms/mapping/octree_writer.hpp"
#include "algorithms/mapping/voxel_map.hpp"
#include "platform/core/ensure.hpp"

namespace firstlook {
namespace {

constexpr int kKeyZero = 32768;  // OctoMap's key of the voxel at the origin
constexpr std::string_view kFullHead = "# Octomap OcTree file", kBinaryHead = "# Octomap OcTree binary file";
constexpr std::size_t kLineMax = 1024;
// OctoMap prints resolutions with six digits.
constexpr double kResolutionTolerance = 1e-5;

class ByteReader {
 public:
  explicit ByteReader(ByteSource source) : source_(source), buffer_(64 * 1024) {}

  [[nodiscard]] std::uint64_t offset() const { return passed_ + at_; }
  [[nodiscard]] bool at_end() {
    if (at_ == filled_) refill();
    return at_ == filled_;
  }
  /// False when the bytes end before `out` is full.
  bool read(std::span<std::byte> out) {
    for (std::byte& byte : out) {
      if (at_end()) return false;
      byte = buffer_[at_++];
    }
    return true;
  }
  /// Up to the next newline, without it. False at the end, or for a line that no header has.
  bool read_line(std::string& line) {
    line.clear();
    std::byte byte{};
    while (line.size() < kLineMax && read({&byte, 1})) {
      if (byte == std::byte{'\n'}) return true;
      line += static_cast<char>(byte);
    }
    return false;
  }

 private:
  void refill() {
    passed_ += at_;
    at_ = 0;
    filled_ = std::min(source_(buffer_), buffer_.size());
  }

  ByteSource source_;
  std::vector<std::byte> buffer_;
  std::size_t at_ = 0, filled_ = 0;
  std::uint64_t passed_ = 0;
};

template <typename Number>
bool to_number(std::string_view word, Number& number) {
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
  return error == std::errc{} && end == word.data() + word.size();
}

/// The text before the nodes, as OctoMap reads it: keywords in any order, comments, unknown keywords passed over.
Result<OctreeInfo> read_header(ByteReader& reader) {
  OctreeInfo info;
  std::string line;
  if (!reader.read_line(line) || !(line.starts_with(kFullHead) || line.starts_with(kBinaryHead)))
    return failure(Fault::kMapUnreadable, "byte 0: does not begin with '{}' or '{}'", kFullHead, kBinaryHead);
  info.has_log_odds = line.starts_with(kFullHead);
  bool has_size = false;
  while (true) {
    const std::uint64_t at = reader.offset();
    if (!reader.read_line(line)) return failure(Fault::kMapUnreadable, "byte {}: no 'data' ends the header", at);
    if (line.ends_with('\r')) line.pop_back();
    if (line.empty() || line.front() == '#') continue;
    const std::size_t space = std::min(line.find(' '), line.size());
    const std::string_view key = std::string_view(line).substr(0, space);
    const std::string_view value = std::string_view(line).substr(std::min(space + 1, line.size()));
    if (key == "data") break;
    if (key == "id") info.id = value;
    if (key == "size") has_size = to_number(value, info.nodes);
    if (key == "size" && !has_size)
      return failure(Fault::kMapUnreadable, "byte {}: size '{}' is not a number of nodes", at, value);
    if (key == "res" &&
        !(to_number(value, info.resolution_m) && info.resolution_m > 0 && std::isfinite(info.resolution_m)))
      return failure(Fault::kMapUnreadable, "byte {}: res '{}' is not a resolution in metres", at, value);
  }
  if (info.id != "OcTree" && info.id != "OcTreeStamped" && info.id != "ColorOcTree")
    return failure(Fault::kMapUnreadable, "id '{}' is no OcTree, OcTreeStamped or ColorOcTree", info.id);
  if (!has_size || info.resolution_m == 0)
    return failure(Fault::kMapUnreadable, "the header has no '{}'", has_size ? "res" : "size");
  return info;
}

/// A node of the tree: the key of its first voxel, and its depth.
struct Node {
  Eigen::Vector3i key = Eigen::Vector3i::Zero();
  int depth = 0;

  [[nodiscard]] int edge() const { return 1 << (kOctreeDepth - depth); }
  [[nodiscard]] Node child(int i) const {
    return {key + edge() / 2 * Eigen::Vector3i(i & 1, (i >> 1) & 1, (i >> 2) & 1), depth + 1};
  }
};

using LeafVisitor = FunctionRef<void(const Node& leaf, std::int8_t log_odds)>;

/// In the map's units and between its clamps; a value below 0 stays free.
std::int8_t to_units(float log_odds) {
  const double units = std::round(std::clamp(static_cast<double>(log_odds), -100.0, 100.0) / kLogOddsUnit);
  const int value = static_cast<int>(std::clamp<double>(units, kLogOddsMin, kLogOddsMax));
  return static_cast<std::int8_t>(log_odds < 0 ? std::min(value, -1) : value);
}

/// One pass over the nodes of a file. Recursion ends at depth 16.
class Walk {
 public:
  Walk(ByteReader& reader, const OctreeInfo& info, LeafVisitor visit)
      : reader_(reader), info_(info), visit_(visit), skipped_(info.id == "ColorOcTree" ? 3 : 0) {}

  Status run() {
    if (info_.nodes > 0) {
      if (Status status = count(); !status) return status;
      if (Status status = info_.has_log_odds ? full_node({}) : binary_node({}); !status) return status;
    }
    if (nodes_ != info_.nodes)
      return failure(Fault::kMapUnreadable, "byte {}: the tree ends after {} nodes, its header says {}",
                     reader_.offset(), nodes_, info_.nodes);
    if (!reader_.at_end())
      return failure(Fault::kMapUnreadable, "byte {}: more follows the {} nodes of the tree", reader_.offset(), nodes_);
    return {};
  }

 private:
  Status count() {
    if (++nodes_ > info_.nodes)
      return failure(Fault::kMapUnreadable, "byte {}: more nodes than the {} of its header", reader_.offset(),
                     info_.nodes);
    return {};
  }
  Status cut_short(const Node& node) const {
    return failure(Fault::kMapUnreadable, "byte {}: the file ends inside node {} of {}, at depth {}", reader_.offset(),
                   nodes_, info_.nodes, node.depth);
  }
  Status too_deep(const Node& node) const {
    return failure(Fault::kMapUnreadable, "byte {}: a node at depth {} has children", reader_.offset(), node.depth);
  }

  /// Two bits a child, the lower bit first: free 1 0, occupied 0 1, has children 1 1, unknown 0 0.
  Status binary_node(const Node& node) {
    if (node.depth == kOctreeDepth) return too_deep(node);
    std::array<std::byte, 2> bytes{};
    if (!reader_.read(bytes)) return cut_short(node);
    const unsigned bits = std::to_integer<unsigned>(bytes[0]) | std::to_integer<unsigned>(bytes[1]) << 8;
    if (bits == 0)
      return failure(Fault::kMapUnreadable, "byte {}: an inner node without children", reader_.offset() - 2);
    const auto kind = [bits](int i) { return bits >> (2 * i) & 3U; };
    for (int i = 0; i < 8; ++i) {
      if (kind(i) == 0) continue;
      if (Status status = count(); !status) return status;
      if (kind(i) != 3) visit_(node.child(i), static_cast<std::int8_t>(kind(i) == 2 ? kLogOddsMax : kLogOddsMin));
    }
    for (int i = 0; i < 8; ++i) {
      if (kind(i) != 3) continue;
      if (Status status = binary_node(node.child(i)); !status) return status;
    }
    return {};
  }

  /// A little-endian float, what the kind of tree adds, and one byte with a bit for each child; then the children.
  Status full_node(const Node& node) {
    std::array<std::byte, 4 + 3 + 1> bytes{};
    const std::span<std::byte> record = std::span(bytes).first(5 + skipped_);
    if (!reader_.read(record)) return cut_short(node);
    std::uint32_t raw = 0;
    for (std::size_t i = 0; i < 4; ++i) raw |= std::to_integer<std::uint32_t>(bytes[i]) << (8 * i);
    const auto log_odds = std::bit_cast<float>(raw);
    if (!std::isfinite(log_odds))
      return failure(Fault::kMapUnreadable, "byte {}: log-odds {} of a node at depth {}",
                     reader_.offset() - record.size(), log_odds, node.depth);
    const auto children = std::to_integer<unsigned>(record.back());
    if (children == 0) {
      visit_(node, to_units(log_odds));
      return {};
    }
    if (node.depth == kOctreeDepth) return too_deep(node);
    for (int i = 0; i < 8; ++i) {
      if ((children >> i & 1U) == 0) continue;
      if (Status status = count(); !status) return status;
      if (Status status = full_node(node.child(i)); !status) return status;
    }
    return {};
  }

  ByteReader& reader_;
  const OctreeInfo& info_;
  LeafVisitor visit_;
  std::size_t skipped_;
  std::size_t nodes_ = 0;
};

/// Puts the leaves of one file into a grid.
class GridFill {
 public:
  GridFill(int depth, const GridGeometry& geometry, std::span<std::int8_t> log_odds)
      : shift_(kOctreeDepth - depth), geometry_(geometry), log_odds_(log_odds) {}

  void leaf(const Node& leaf, std::int8_t value) {
    const Eigen::Vector3i zero = Eigen::Vector3i::Constant(kKeyZero >> shift_) + geometry_.first;
    const Eigen::Vector3i low = cell(leaf.key) - zero;
    const Eigen::Vector3i high = cell(leaf.key + Eigen::Vector3i::Constant(leaf.edge() - 1)) - zero;
    const Eigen::Vector3i from = low.cwiseMax(0), to = high.cwiseMin(geometry_.size - Eigen::Vector3i::Ones());
    const auto edge = static_cast<std::uint64_t>(leaf.edge());
    std::uint64_t inside = 1;  // of the leaf's voxels
    for (int axis = 0; axis < 3; ++axis) {
      const auto cells = static_cast<std::uint64_t>(std::max(0, to[axis] - from[axis] + 1));
      inside *= std::min(edge, cells << shift_);
    }
    outside_ += edge * edge * edge - inside;
    if (inside == 0) return;
    for (int z = from.z(); z <= to.z(); ++z) {
      for (int y = from.y(); y <= to.y(); ++y) {
        std::int8_t* row = &log_odds_[geometry_.index({0, y, z})];
        for (int x = from.x(); x <= to.x(); ++x) row[x] = std::max(row[x], value);  // unknown is the smallest
      }
    }
  }
  [[nodiscard]] std::uint64_t outside() const { return outside_; }

 private:
  [[nodiscard]] Eigen::Vector3i cell(const Eigen::Vector3i& key) const {
    return {key.x() >> shift_, key.y() >> shift_, key.z() >> shift_};
  }

  int shift_;
  const GridGeometry& geometry_;
  std::span<std::int8_t> log_odds_;
  std::uint64_t outside_ = 0;
};

}  // namespace

GridGeometry OctreeInfo::grid(int depth) const {
  ENSURE(3055, depth >= 1 && depth <= kOctreeDepth);
  const int shift = kOctreeDepth - depth;
  GridGeometry g;
  g.resolution_m = std::ldexp(resolution_m, shift);
  for (int axis = 0; axis < 3; ++axis) {
    const int low = first[axis] + kKeyZero, high = low + size[axis] - 1;
    g.first[axis] = (low >> shift) - (kKeyZero >> shift);
    g.size[axis] = size[axis] == 0 ? 0 : (high >> shift) - (low >> shift) + 1;
  }
  return g;
}

Result<OctreeInfo> survey_octree(ByteSource source) {
  ByteReader reader(source);
  Result<OctreeInfo> info = read_header(reader);
  if (!info) return info;
  Eigen::Vector3i low = Eigen::Vector3i::Constant(2 * kKeyZero), high = Eigen::Vector3i::Zero();
  std::uint64_t known = 0;
  const auto note = [&](const Node& leaf, std::int8_t) {
    low = low.cwiseMin(leaf.key);
    high = high.cwiseMax(leaf.key + Eigen::Vector3i::Constant(leaf.edge()));
    const auto edge = static_cast<std::uint64_t>(leaf.edge());
    known += edge * edge * edge;
  };
  if (const Status status = Walk(reader, *info, note).run(); !status) return std::unexpected(status.error());
  info->known_voxels = known;
  if (known == 0) return info;
  info->first = low - Eigen::Vector3i::Constant(kKeyZero);
  info->size = high - low;
  return info;
}

Result<std::uint64_t> read_octree(ByteSource source, int depth, const GridGeometry& geometry,
                                  std::span<std::int8_t> log_odds) {
  ENSURE(3056, depth >= 1 && depth <= kOctreeDepth && log_odds.size() == geometry.count());
  ByteReader reader(source);
  const Result<OctreeInfo> info = read_header(reader);
  if (!info) return std::unexpected(info.error());
  const double resolution_m = std::ldexp(info->resolution_m, kOctreeDepth - depth);
  if (std::abs(resolution_m - geometry.resolution_m) > kResolutionTolerance * geometry.resolution_m)
    return failure(Fault::kMapUnreadable, "voxels of {} m at depth {}, but the grid has {} m", resolution_m, depth,
                   geometry.resolution_m);
  std::ranges::fill(log_odds, kUnknownLogOdds);
  GridFill fill(depth, geometry, log_odds);
  const auto put = [&fill](const Node& leaf, std::int8_t value) { fill.leaf(leaf, value); };
  if (const Status status = Walk(reader, *info, put).run(); !status) return std::unexpected(status.error());
  return fill.outside();
}

}  // namespace firstlook
