/// The gain of one view, the thesis's 8424 rays, against OctoMap's castRay on the same map.
#include <fmt/format.h>

#include <cmath>
#include <iostream>
#include <set>
#include <sstream>

#include "algorithms/mapping/insertion.hpp"
#include "algorithms/mapping/octree_writer.hpp"
#include "algorithms/mapping/ray_cast.hpp"
#include "platform/core/random.hpp"
#include "tests/bench/depth_frames.hpp"
#include "tests/support/octomap_peer.hpp"

namespace firstlook::bench {
namespace {

struct Resolution {
  const char* name;
  double m;
  double ratio_min;
};
constexpr Resolution kResolutions[] = {{"5cm", 0.05, 50}, {"2cm", 0.02, 40}, {"1cm", 0.01, 40}};

VoxelMap map_of(const DepthFrames& frames, double resolution_m) {
  VoxelMap map(grid_around(frames, resolution_m), VoxelMap::Planes::kLogOddsOnly);
  Inserter inserter(map.geometry(), frames.sensor);
  for (std::size_t i = 0; i < frames.frames.size(); ++i) {
    const DepthFrame& frame = frames.frames[i];
    if (!inserter.insert(map, frames.image(frame), frame.base_T_depth, {}, static_cast<double>(i))) std::abort();
  }
  return map;
}

/// The same voxels as an octree, by way of the file format.
octomap::OcTree octree_of(const VoxelMap& map) {
  std::stringstream file;
  write_bt(map, octomap_class, kOctreeDepth, [&](std::span<const std::byte> bytes) {
    file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  });
  octomap::OcTree tree(map.geometry().resolution_m);
  std::cerr.setstate(std::ios_base::failbit);  // it narrates
  const bool read = tree.readBinary(file);
  std::cerr.clear();
  if (!read) std::abort();
  return tree;
}

/// Views from places that are free.
std::vector<Transform<Base, Depth>> free_views(const VoxelMap& map, int count) {
  Random random(3);
  std::vector<Transform<Base, Depth>> views;
  while (static_cast<int>(views.size()) < count) {
    const auto index = static_cast<std::size_t>(random.uniform() * static_cast<double>(map.size()));
    if (map.voxel_class(index) != VoxelClass::kFree) continue;
    const GridGeometry& g = map.geometry();
    const Eigen::Vector3d inside(random.uniform(-0.4, 0.4), random.uniform(-0.4, 0.4), random.uniform(-0.4, 0.4));
    views.emplace_back(random.rotation(), g.center_m(g.voxel_at(index)) + g.resolution_m * inside);
  }
  return views;
}

/// Where castRay ends, for each ray that met an unknown voxel first.
void cast_rays(const octomap::OcTree& tree, const GainRays& rays, const Transform<Base, Depth>& view,
               std::vector<octomap::point3d>& unknown) {
  unknown.clear();
  const octomap::point3d origin = to_octomap(view.translation());
  const Eigen::Matrix3d rotation = view.rotation();
  octomap::point3d end;
  for (const Eigen::Vector3d& end_m : rays.ends_m) {
    const bool occupied = tree.castRay(origin, to_octomap(rotation * end_m), end, false, end_m.norm());
    if (!occupied && tree.search(end) == nullptr) unknown.push_back(end);
  }
}

/// The thesis's way: the keys of the whole ray, then a search for each.
void find_key_by_key(const octomap::OcTree& tree, const GainRays& rays, const Transform<Base, Depth>& view,
                     octomap::KeySet& unknown) {
  unknown.clear();
  const octomap::point3d origin = to_octomap(view.translation());
  octomap::KeyRay keys;
  for (const Eigen::Vector3d& end_m : rays.ends_m) {
    if (!tree.computeRayKeys(origin, to_octomap(view * end_m), keys)) continue;
    for (const octomap::OcTreeKey& key : keys) {
      const octomap::OcTreeNode* node = tree.search(key);
      if (node == nullptr) {
        unknown.insert(key);
      } else if (tree.isNodeOccupied(node)) {
        break;
      }
    }
  }
}

std::vector<octomap::point3d> centres(const octomap::OcTree& tree, const octomap::KeySet& keys) {
  std::vector<octomap::point3d> points;
  for (const octomap::OcTreeKey& key : keys) points.push_back(tree.keyToCoord(key));
  return points;
}

/// Distinct voxels of our grid; what lies outside of it counts nothing for us.
std::size_t distinct_voxels(const GridGeometry& geometry, const std::vector<octomap::point3d>& points) {
  std::set<std::size_t> distinct;
  for (const octomap::point3d& p : points) {
    const Eigen::Vector3i voxel = geometry.voxel(Eigen::Vector3f(p.x(), p.y(), p.z()).cast<double>());
    if (geometry.contains(voxel)) distinct.insert(geometry.index(voxel));
  }
  return distinct.size();
}

}  // namespace

void bench_gain(const Options& options, Report& report) {
  const DepthFrames frames = depth_frames(options, {1.7, options.amount(2, 8, 8)});
  const GainRays rays = GainRays::thesis();
  for (const Resolution& resolution : kResolutions) {
    if (options.smoke && resolution.m < 0.02) continue;
    const VoxelMap map = map_of(frames, resolution.m);
    const octomap::OcTree tree = octree_of(map);
    const GridGeometry& geometry = map.geometry();
    GainPlane plane(geometry);
    GainScratch scratch(geometry);
    const auto views = free_views(map, options.amount(3, 40, 200));
    GainCount ours;
    const auto count_in = [&](const Transform<Base, Depth>& view) {
      return seconds_of([&] { ours = count_unknown(plane, rays, view, 0, scratch); });
    };

    // Once for each choice of a view, like OctoMap's tree; then every candidate is counted on it.
    const double prepare_s = seconds_of([&] { build_gain_plane(map, {}, UnknownReading::kStop, plane); });
    std::vector<double> ours_s, peer_s;
    std::vector<octomap::point3d> ends;
    std::size_t differing = 0, counted = 0;
    for (const auto& view : views) {
      ours_s.push_back(count_in(view));
      peer_s.push_back(seconds_of([&] { cast_rays(tree, rays, view, ends); }));
      const std::size_t theirs = distinct_voxels(geometry, ends);
      differing += ours.voxels > theirs ? ours.voxels - theirs : theirs - ours.voxels;
      counted += theirs;
    }
    report.add(timed(fmt::format("gain/{}", resolution.name), 1e3 * median(ours_s), "ms", "OctoMap castRay",
                     1e3 * median(peer_s), Goal::ratio_at_least(resolution.ratio_min)));
    report.add(measured(fmt::format("gain/differing_counts/{}", resolution.name), static_cast<double>(differing),
                        "voxels", fmt::format("castRay's {} voxels", counted), static_cast<double>(counted),
                        Goal::ours_at_most(0)));
    report.add(
        timed(fmt::format("gain/prepare/{}", resolution.name), 1e3 * prepare_s, "ms", "", std::nullopt, Goal::none()));
    if (resolution.m < 0.05) continue;

    build_gain_plane(map, {}, UnknownReading::kSeeThrough, plane);
    std::vector<double> see_through_s, keys_s;
    octomap::KeySet keys;
    std::size_t seen_through = 0, key_by_key = 0;
    for (const auto& view : views) {
      see_through_s.push_back(count_in(view));
      keys_s.push_back(seconds_of([&] { find_key_by_key(tree, rays, view, keys); }));
      seen_through += ours.voxels;
      key_by_key += distinct_voxels(geometry, centres(tree, keys));
    }
    Row all = timed(fmt::format("gain/see_through/{}", resolution.name), 1e3 * median(see_through_s), "ms",
                    "OctoMap key by key", 1e3 * median(keys_s), Goal::none());
    // OctoMap leaves out the voxel of a ray's end, and walks in floats.
    const double ratio = static_cast<double>(seen_through) / static_cast<double>(key_by_key);
    if (!(std::abs(ratio - 1) < 0.01)) all.void_because = "counts differ";
    report.add(all);
  }
}

}  // namespace firstlook::bench
