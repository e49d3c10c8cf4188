#include "algorithms/mapping/remaining.hpp"

#include <algorithm>
#include <array>
#include <limits>

#include "platform/core/ensure.hpp"

namespace firstlook {
namespace {

// Calls visit(index) for each of up to six voxels that share a face.
template <typename Visit>
void for_each_neighbor(const GridGeometry& g, std::size_t index, Visit visit) {
  const Eigen::Vector3i v = g.voxel_at(index);
  const std::array<std::size_t, 3> stride = {
      1, static_cast<std::size_t>(g.size.x()),
      static_cast<std::size_t>(g.size.x()) * static_cast<std::size_t>(g.size.y())};
  for (int axis = 0; axis < 3; ++axis) {
    if (v[axis] > 0) visit(index - stride[static_cast<std::size_t>(axis)]);
    if (v[axis] + 1 < g.size[axis]) visit(index + stride[static_cast<std::size_t>(axis)]);
  }
}

bool touches_free(const VoxelMap& map, std::size_t index) {
  bool touches = false;
  for_each_neighbor(map.geometry(), index,
                    [&](std::size_t other) { touches = touches || map.voxel_class(other) == VoxelClass::kFree; });
  return touches;
}

// Describes the voxels of one cluster.
UnknownCluster describe_cluster(const VoxelMap& map, const std::vector<std::uint32_t>& voxels) {
  const GridGeometry& g = map.geometry();
  const Eigen::Vector3d half_m = Eigen::Vector3d::Constant(g.resolution_m / 2);
  UnknownCluster cluster;
  cluster.voxels = voxels.size();
  cluster.box.low_m.setConstant(std::numeric_limits<double>::infinity());
  cluster.box.high_m.setConstant(-std::numeric_limits<double>::infinity());
  for (const std::uint32_t index : voxels) {
    const Eigen::Vector3d center_m = g.center_m(g.voxel_at(index));
    cluster.center_m += center_m / static_cast<double>(voxels.size());
    cluster.box.low_m = cluster.box.low_m.cwiseMin(center_m - half_m);
    cluster.box.high_m = cluster.box.high_m.cwiseMax(center_m + half_m);
    if (touches_free(map, index)) cluster.frontier.push_back(index);
  }
  return cluster;
}

// Calls visit(voxels) for each cluster, in the order of their first voxels; visit may change the vector.
template <typename Visit>
void for_each_cluster(const VoxelMap& map, std::span<const std::uint8_t> zone, Visit visit) {
  ENSURE(3061, zone.empty() || zone.size() == map.size());
  ENSURE(3062, map.size() <= std::numeric_limits<std::uint32_t>::max());
  std::vector<bool> open(map.size());
  for (std::size_t i = 0; i < open.size(); ++i)
    open[i] = map.voxel_class(i) == VoxelClass::kUnknown && (zone.empty() || zone[i] != 0);

  std::vector<std::uint32_t> voxels;
  for (std::size_t seed = 0; seed < open.size(); ++seed) {
    if (!open[seed]) continue;
    voxels.assign(1, static_cast<std::uint32_t>(seed));
    open[seed] = false;
    for (std::size_t next = 0; next < voxels.size(); ++next) {
      for_each_neighbor(map.geometry(), voxels[next], [&](std::size_t other) {
        if (!open[other]) return;
        open[other] = false;
        voxels.push_back(static_cast<std::uint32_t>(other));
      });
    }
    visit(voxels);
  }
}

}  // namespace

std::vector<UnknownCluster> find_remaining(const VoxelMap& map, std::span<const std::uint8_t> zone,
                                           std::size_t voxels_min) {
  std::vector<UnknownCluster> clusters;
  for_each_cluster(map, zone, [&](std::vector<std::uint32_t>& voxels) {
    if (voxels.size() < voxels_min) return;
    std::sort(voxels.begin(), voxels.end());
    UnknownCluster cluster = describe_cluster(map, voxels);
    if (!cluster.frontier.empty()) clusters.push_back(std::move(cluster));
  });
  // Stable: equal sizes keep the order of their first voxels.
  std::stable_sort(clusters.begin(), clusters.end(),
                   [](const UnknownCluster& a, const UnknownCluster& b) { return a.voxels > b.voxels; });
  return clusters;
}

std::vector<std::uint32_t> find_specks(const VoxelMap& map, std::span<const std::uint8_t> zone,
                                       std::size_t voxels_min) {
  std::vector<std::uint32_t> specks;
  for_each_cluster(map, zone, [&](const std::vector<std::uint32_t>& voxels) {
    if (voxels.size() < voxels_min) specks.insert(specks.end(), voxels.begin(), voxels.end());
  });
  return specks;
}

}  // namespace firstlook
