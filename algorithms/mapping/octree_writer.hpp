/// OctoMap's files streamed straight from the grid; no octree is built.
#pragma once

#include "algorithms/mapping/byte_sink.hpp"
#include "algorithms/mapping/class_reading.hpp"
#include "algorithms/mapping/map_planes.hpp"
#include "algorithms/mapping/voxel_map.hpp"

namespace firstlook {

inline constexpr int kOctreeDepth = 16;  ///< OctoMap's: leaves at this depth are one voxel

/// `.bt`: free and occupied only. Equal blocks are pruned as OctoMap prunes.
/// @param reading  collision_class for a map to plan with, octomap_class for what map.ot says
/// @param depth    1..16: nodes are cut there, and a cut node is the largest value of its known voxels, as OctoMap's
///                 inner nodes are (a block of free and unknown voxels reads as free); ENSURE otherwise
void write_bt(const VoxelMap& map, ClassReading reading, int depth, ByteSink sink);

/// `.ot`: with log-odds in OctoMap's units, which know nothing of octants; depth as above.
void write_ot(const VoxelMap& map, int depth, ByteSink sink);

/// The same as a ColorOcTree: occupied voxels have their colours, all else is white, which OctoMap takes for no colour.
/// Only blocks of one value and one colour are pruned; a node above several has the mean of its coloured voxels.
void write_color_ot(const VoxelMap& map, const ColorPlane& colors, int depth, ByteSink sink);

/// The nodes of the same files without their header: what OctoMap calls binary data and data, and messages carry.
void write_bt_nodes(const VoxelMap& map, ClassReading reading, int depth, ByteSink sink);
void write_ot_nodes(const VoxelMap& map, int depth, ByteSink sink);

}  // namespace firstlook
