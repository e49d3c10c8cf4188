/// Insertion of depth frames against OctoMap, the distance field against dynamicEDT3D, and a whole frame of the job.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>

#ifdef BENCH_HAS_DYNAMICEDT3D
#include <dynamicEDT3D/dynamicEDTOctomap.h>
#endif

#include "algorithms/mapping/distance_field.hpp"
#include "algorithms/mapping/insertion.hpp"
#include "algorithms/mapping/self_filter.hpp"
#include "algorithms/motion/body.hpp"
#include "tests/bench/depth_frames.hpp"
#include "tests/support/octomap_peer.hpp"

namespace firstlook::bench {
namespace {

struct Resolution {
  const char* name;
  double m;
  int frames_smoke, frames, frames_thorough;
  double full_ratio_min, discretized_ratio_min;  ///< how many times OctoMap's speed
  double differing_share_max;                    ///< of the known voxels: classes that differ, near ties apart
};
constexpr Resolution kResolutions[] = {
    {"5cm", 0.05, 2, 30, 30, 100, 6, 0},
    {"2cm", 0.02, 1, 12, 30, 100, 25, 0},
    {"1cm", 0.01, 0, 3, 12, 80, 30, 1e-6},
};

struct Distance {
  const char* suffix;
  double mean_depth_m;
};
constexpr Distance kDistances[] = {{"", 1.7}, {"/far", 3.0}};

/// Seconds of each frame, and whether the maps agree afterwards.
struct InsertionRun {
  std::vector<double> ours_s, peer_s;
  Agreement agreement;
  std::size_t known_here = 0;

  /// Missing, additional and differing voxels alike; near ties apart.
  [[nodiscard]] std::size_t differing() const {
    const std::size_t there = agreement.known_there + agreement.outside;
    return agreement.class_differs + agreement.outside + std::max(there, known_here) - std::min(there, known_here);
  }
};

InsertionRun insert_all(const DepthFrames& frames, double resolution_m, RayEnds ends) {
  const GridGeometry geometry = grid_around(frames, resolution_m);
  VoxelMap map(geometry, VoxelMap::Planes::kLogOddsOnly);  // all that OctoMap keeps, too
  Inserter inserter(geometry, frames.sensor, ends);
  octomap::OcTree tree(resolution_m);
  InsertionRun run;
  for (std::size_t i = 0; i < frames.frames.size(); ++i) {
    const DepthFrame& frame = frames.frames[i];
    const DepthImage image = frames.image(frame);
    const auto stamp_s = static_cast<double>(i);
    run.ours_s.push_back(seconds_of([&] {
      if (!inserter.insert(map, image, frame.base_T_depth, {}, stamp_s)) std::abort();
    }));
    // The peer's cloud is made beforehand; ours starts from the depth values.
    const octomap::Pointcloud cloud = cloud_of(image, frames.sensor.intrinsics, frame.base_T_depth);
    const octomap::point3d origin = to_octomap(frame.base_T_depth.translation());
    const bool discretize = ends == RayEnds::kVoxelCenters;
    run.peer_s.push_back(
        seconds_of([&] { tree.insertPointCloud(cloud, origin, frames.sensor.range_max_m, false, discretize); }));
  }
  run.agreement = compare(map, tree);
  const VoxelCounts counts = map.counts();
  run.known_here = counts.free + counts.occupied;
  return run;
}

struct InsertionMode {
  const char* name;
  const char* peer;
  RayEnds ends;
};
constexpr InsertionMode kModes[] = {{"full", "insertPointCloud", RayEnds::kPixels},
                                    {"discretized", "insertPointCloud, discretized", RayEnds::kVoxelCenters}};

void report_insertion(const InsertionRun& run, const InsertionMode& mode, const std::string& where, double ratio_min,
                      double share_max, Report& report) {
  const auto known = static_cast<double>(run.agreement.known_there);
  const auto differing = static_cast<double>(run.differing());
  const char* void_because = differing <= share_max * known ? "" : "results differ";
  Row time = timed(fmt::format("map/insert/{}/{}", mode.name, where), 1e3 * median(run.ours_s), "ms", mode.peer,
                   1e3 * median(run.peer_s), Goal::ratio_at_least(ratio_min));
  time.void_because = void_because;
  report.add(time);
  Row same = measured(fmt::format("map/differing_voxels/{}/{}", mode.name, where), differing, "voxels",
                      fmt::format("OctoMap's {} voxels", known), known, Goal::ratio_at_most(share_max));
  same.void_because = void_because;
  report.add(same);
  report.add(measured(fmt::format("map/near_ties/{}/{}", mode.name, where),
                      static_cast<double>(run.agreement.near_ties), "voxels", fmt::format("OctoMap's {} voxels", known),
                      known, Goal::none()));
}

void bench_insertion(const Options& options, Report& report) {
  const bool recorded = !options.dataset.empty();
  for (const Distance& distance : kDistances) {
    if (recorded && distance.suffix[0] != '\0') continue;
    const int frames_max = options.amount(2, 30, 30);
    const DepthFrames all = depth_frames(options, {distance.mean_depth_m, frames_max});
    for (const Resolution& resolution : kResolutions) {
      const int count = options.amount(resolution.frames_smoke, resolution.frames, resolution.frames_thorough);
      if (count == 0) continue;
      DepthFrames frames = all;
      frames.frames.resize(std::min(frames.frames.size(), static_cast<std::size_t>(count)));
      for (const InsertionMode& mode : kModes) {
        const bool full = mode.ends == RayEnds::kPixels;
        if (!full && distance.suffix[0] != '\0') continue;
        report_insertion(insert_all(frames, resolution.m, mode.ends), mode,
                         fmt::format("{}{}", resolution.name, distance.suffix),
                         full ? resolution.full_ratio_min : resolution.discretized_ratio_min,
                         recorded ? 0 : resolution.differing_share_max, report);
      }
    }
  }
}

/// The box around the arm that a job maps by default.
GridGeometry job_grid(double resolution_m) {
  return GridGeometry::covering({-1.5, -1.5, -0.3}, {1.5, 1.5, 1.5}, resolution_m);
}
constexpr double kFieldMax_m = 0.6;  // as the job's

std::vector<std::uint8_t> free_voxels(const VoxelMap& map) {
  std::vector<std::uint8_t> free(map.size());
  for (std::size_t i = 0; i < free.size(); ++i) free[i] = map.voxel_class(i) == VoxelClass::kFree ? 1 : 0;
  return free;
}

#ifdef BENCH_HAS_DYNAMICEDT3D
/// dynamicEDT3D on an octree (Lau, Sprunk and Burgard 2013): updates what changed; unknown is an obstacle as for us.
class DynamicField {
 public:
  DynamicField(const GridGeometry& geometry, double distance_max_m)
      : geometry_(geometry), tree_(geometry.resolution_m) {
    tree_.enableChangeDetection(true);
    // A box of voxel centres, so that rounding adds no layer.
    const Eigen::Vector3d low_m = geometry.center_m(Eigen::Vector3i::Zero());
    const Eigen::Vector3d high_m = geometry.center_m(geometry.size - Eigen::Vector3i::Ones());
    field_ = std::make_unique<DynamicEDTOctomap>(static_cast<float>(distance_max_m), &tree_, to_octomap(low_m),
                                                 to_octomap(high_m), true);
    field_->update();
  }
  /// Changes the voxels that differ from `free`, untimed; returns the seconds of the field's update.
  double update(std::span<const std::uint8_t> free) {
    before_.resize(free.size(), 0);
    for (std::size_t i = 0; i < free.size(); ++i) {
      if (before_[i] == free[i]) continue;
      tree_.updateNode(key(i), free[i] != 0 ? -10.0F : 10.0F);
      before_[i] = free[i];
    }
    const double seconds = seconds_of([&] { field_->update(); });
    tree_.resetChangeDetection();
    return seconds;
  }
  [[nodiscard]] double distance_m(std::size_t index) const {
    return static_cast<double>(field_->getDistance(key(index)));
  }

 private:
  [[nodiscard]] octomap::OcTreeKey key(std::size_t index) const {
    const Eigen::Vector3i k = geometry_.voxel_at(index) + geometry_.first + Eigen::Vector3i::Constant(32768);
    return {static_cast<octomap::key_type>(k.x()), static_cast<octomap::key_type>(k.y()),
            static_cast<octomap::key_type>(k.z())};
  }
  GridGeometry geometry_;
  octomap::OcTree tree_;
  std::vector<std::uint8_t> before_;
  std::unique_ptr<DynamicEDTOctomap> field_;
};

/// Largest difference of the two fields, where neither the cut nor the grid's edge (which only ours knows) decides.
double largest_difference_m(const DistanceField& ours, const DynamicField& peer) {
  const GridGeometry& g = ours.geometry();
  double largest = 0;
  for (std::size_t i = 0; i < g.count(); ++i) {
    const Eigen::Vector3i v = g.voxel_at(i);
    const int to_edge = std::min(v.minCoeff(), (g.size - v).minCoeff() - 1) + 1;
    const auto here = static_cast<double>(ours.values()[i]);
    if (here >= kFieldMax_m - g.resolution_m || here >= (to_edge - 1) * g.resolution_m) continue;
    largest = std::max(largest, std::abs(here - peer.distance_m(i)));
  }
  return largest;
}
#endif

/// What one frame changes in the free space, and the field after it.
void bench_distance_field(Report& report, const DepthFrames& frames) {
  const GridGeometry geometry = job_grid(0.05);
  VoxelMap map(geometry, VoxelMap::Planes::kLogOddsOnly);
  Inserter inserter(geometry, frames.sensor);
  DistanceField field(geometry, kFieldMax_m);
  std::vector<double> ours_s, whole_s, peer_s;
  double difference_m = 0;
#ifdef BENCH_HAS_DYNAMICEDT3D
  DynamicField peer(geometry, kFieldMax_m);
#endif
  for (std::size_t i = 0; i < frames.frames.size(); ++i) {
    const DepthFrame& frame = frames.frames[i];
    if (!inserter.insert(map, frames.image(frame), frame.base_T_depth, {}, static_cast<double>(i))) std::abort();
    const std::vector<std::uint8_t> free = free_voxels(map);
    ours_s.push_back(seconds_of([&] { field.update(free); }));
    DistanceField whole(geometry, kFieldMax_m);
    whole_s.push_back(seconds_of([&] { whole.update(free); }));
    if (!std::equal(whole.values().begin(), whole.values().end(), field.values().begin())) difference_m = 1;
#ifdef BENCH_HAS_DYNAMICEDT3D
    peer_s.push_back(peer.update(free));
    difference_m = std::max(difference_m, largest_difference_m(field, peer));
#endif
  }
  const std::optional<double> peer_ms = peer_s.empty() ? std::nullopt : std::optional(1e3 * median(peer_s));
  Row row = timed("map/distance_field/5cm", 1e3 * median(ours_s), "ms", "dynamicEDT3D update", peer_ms,
                  Goal::ours_at_most(2));
  Row whole = timed("map/distance_field/5cm/whole", 1e3 * median(whole_s), "ms", "", std::nullopt, Goal::none());
  for (Row* one : {&row, &whole}) {
    if (difference_m > 1e-4) one->void_because = "results differ";  // floats of a root
    report.add(*one);
  }
}

/// All that the job does with a frame: self filter, insertion with the planes for motion, free space, field.
void bench_frame(Report& report, const DepthFrames& frames) {
  const GridGeometry geometry = job_grid(0.05);
  DepthSensor sensor = frames.sensor;
  sensor.range_min_m = 0.5;
  sensor.range_trusted_m = 3.0;
  VoxelMap map(geometry);
  map.set_safe_zone(SafeZone{});
  Inserter inserter(geometry, sensor);
  DistanceField field(geometry, kFieldMax_m);
  std::vector<std::uint8_t> free(geometry.count());
  std::vector<float> self_m(frames.frames.front().values.size());
  const ArmModel arm = *find_arm_model("ur5");
  const Body body = bare_body(arm);
  const Capsules placed = place(body.capsules, forward(arm, default_start(arm)));
  std::vector<double> seconds;
  for (std::size_t i = 0; i < frames.frames.size(); ++i) {
    const DepthFrame& frame = frames.frames[i];
    const auto now_s = static_cast<double>(i);
    seconds.push_back(seconds_of([&] {
      render_self_depth({placed.data(), placed.size()}, 0.02, frame.base_T_depth, sensor.intrinsics, self_m);
      if (!inserter.insert(map, frames.image(frame), frame.base_T_depth, self_m, now_s)) std::abort();
      map.free_mask(now_s, 600, free);
      field.update(free);
    }));
  }
  report.add(timed("map/frame/5cm", 1e3 * median(seconds), "ms", "", std::nullopt, Goal::none()));
}

}  // namespace

void bench_map(const Options& options, Report& report) {
  bench_insertion(options, report);
  const DepthFrames frames = depth_frames(options, {1.7, options.amount(3, 20, 30)});
  bench_distance_field(report, frames);
  bench_frame(report, frames);
}

}  // namespace firstlook::bench
