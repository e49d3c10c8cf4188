/// OctoMap's files streamed into a dense grid; no octree is built, and memory does not depend on what a file says.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string>

#include "algorithms/mapping/byte_source.hpp"
#include "algorithms/mapping/grid_geometry.hpp"
#include "platform/core/result.hpp"

namespace firstlook {

/// What a file holds.
struct OctreeInfo {
  std::string id;             ///< "OcTree", "OcTreeStamped" or "ColorOcTree"; colours are skipped
  bool has_log_odds = false;  ///< `.ot`; a `.bt` has classes
  double resolution_m = 0;    ///< of a voxel, at the tree's lowest depth
  std::size_t nodes = 0;
  std::uint64_t known_voxels = 0;                   ///< at the lowest depth; leaves higher up hold many
  Eigen::Vector3i first = Eigen::Vector3i::Zero();  ///< as GridGeometry: the smallest box of voxels around all leaves
  Eigen::Vector3i size = Eigen::Vector3i::Zero();   ///< 0 when the tree is empty

  /// The smallest grid that holds the tree, cut at a depth as OctoMap's search(key, depth) cuts it (16: not at all).
  [[nodiscard]] GridGeometry grid(int depth) const;
};

/// Reads a whole `.bt` or `.ot` and says what it holds.
/// @return kMapUnreadable with the byte and what is wrong there: no such header, a kind of tree that is not known, a
/// value that is not finite, a node below depth 16, a number of nodes other than the header's, an end too early or late
[[nodiscard]] Result<OctreeInfo> survey_octree(ByteSource source);

/// Reads a `.bt` or `.ot` into a grid. Log-odds are OctoMap's in units of kLogOddsUnit, clamped as the map's are, with
/// their class kept; those of a `.bt` are at their clamps, as OctoMap reads it.
/// @param depth     1..16: where the tree is cut; a cut node takes the largest value of its known voxels
/// @param geometry  its resolution must be the tree's at `depth`
/// @param log_odds  geometry.count() values, kUnknownLogOdds where nothing is known
/// @return how many known voxels of the lowest depth lie outside the grid and are left out; kMapUnreadable as above, or
/// with both resolutions; `log_odds` then means nothing
[[nodiscard]] Result<std::uint64_t> read_octree(ByteSource source, int depth, const GridGeometry& geometry,
                                                std::span<std::int8_t> log_odds);

}  // namespace firstlook
