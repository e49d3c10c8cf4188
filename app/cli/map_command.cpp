#include "app/cli/map_command.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>

#include "algorithms/mapping/insertion.hpp"
#include "algorithms/mapping/octree_writer.hpp"
#include "algorithms/mapping/ply_writer.hpp"
#include "app/dataset/mapping_dataset.hpp"

namespace firstlook {
namespace {

constexpr int kExitDone = 0, kExitUsage = 2, kExitData = 3;
constexpr double kResolutionMin_m = 0.002, kResolutionMax_m = 1.0;
constexpr double kRangeLimit_m = 50;
// Log-odds and two bit planes: 640 MiB at most.
constexpr double kVoxelsMax = 512.0 * 1024 * 1024;

DepthSensor offline_sensor(const MappingDataset& dataset, double range_max_m) {
  DepthSensor sensor;
  sensor.intrinsics = dataset.intrinsics;
  sensor.range_min_m = 0;  // what the recording holds is taken as it is
  sensor.range_max_m = sensor.range_trusted_m = range_max_m;
  return sensor;
}

// Names the frame in an error of its pixels or pose.
std::unexpected<Error> refused(const MappingFrame& frame, const Error& error) {
  return failure(Fault::kDataMalformed, "{}: {}", frame.image.string(), error.detail());
}

// The grid that holds every ray of every frame.
Result<GridGeometry> fit_extents(const MappingDataset& dataset, DepthRays& rays, double resolution_m) {
  AxisBox box;
  for (const MappingFrame& frame : dataset.frames) {
    const Result<DepthPixels> image = read_depth_png(frame.image);
    if (!image) return std::unexpected(image.error());
    const DepthImage depth = image->view(dataset.units_per_m);
    if (const Status status = rays.check(depth, frame.map_T_depth, {}); !status) return refused(frame, status.error());
    const AxisBox bounds = rays.bounds(depth, frame.map_T_depth);
    const bool first = &frame == &dataset.frames.front();
    box.low_m = first ? bounds.low_m : Eigen::Vector3d(box.low_m.cwiseMin(bounds.low_m));
    box.high_m = first ? bounds.high_m : Eigen::Vector3d(box.high_m.cwiseMax(bounds.high_m));
  }
  // One voxel on each side, for points on a boundary.
  const Eigen::Vector3d margin_m = Eigen::Vector3d::Constant(resolution_m);
  const Eigen::Vector3d voxels = (box.high_m - box.low_m + 2 * margin_m) / resolution_m;
  const double reach_m = 32000 * resolution_m;  // OctoMap's keys end at 32768 voxels
  if (voxels.prod() > kVoxelsMax || box.low_m.minCoeff() < -reach_m || box.high_m.maxCoeff() > reach_m)
    return failure(Fault::kMapTooLarge, "{:.0f} x {:.0f} x {:.0f} voxels of {} m about ({:.1f}, {:.1f}, {:.1f})",
                   voxels.x(), voxels.y(), voxels.z(), resolution_m, box.low_m.x(), box.low_m.y(), box.low_m.z());
  return GridGeometry::covering(box.low_m - margin_m, box.high_m + margin_m, resolution_m);
}

nlohmann::ordered_json to_json(const VoxelCounts& counts) {
  return {{"unknown", counts.unknown}, {"free", counts.free}, {"occupied", counts.occupied}};
}

nlohmann::ordered_json to_json(const MappingFrame& frame, const InsertionResult& result, const VoxelCounts& counts) {
  return {
      {"stamp_s", frame.stamp_s},
      {"image", frame.image.filename().string()},
      {"pixels",
       {{"used", result.pixels_used}, {"beyond_range", result.pixels_beyond}, {"without_return", result.pixels_empty}}},
      {"voxels_missed", result.change.voxels_missed},
      {"voxels_hit", result.change.voxels_hit},
      {"voxels_discovered", result.change.voxels_discovered},
      {"voxels", to_json(counts)}};
}

struct Mapped {
  VoxelMap map;
  nlohmann::ordered_json frames = nlohmann::ordered_json::array();
};

Result<Mapped> map_dataset(const MappingDataset& dataset, const MapCommandOptions& options) {
  const DepthSensor sensor = offline_sensor(dataset, options.range_max_m);
  DepthRays rays(sensor);
  const Result<GridGeometry> geometry = fit_extents(dataset, rays, options.resolution_m);
  if (!geometry) return std::unexpected(geometry.error());
  fmt::print(stderr, "grid of {} x {} x {} voxels of {} m\n", geometry->size.x(), geometry->size.y(),
             geometry->size.z(), options.resolution_m);
  Mapped mapped{VoxelMap(*geometry, VoxelMap::Planes::kLogOddsOnly), nlohmann::ordered_json::array()};
  Inserter inserter(*geometry, sensor);
  for (const MappingFrame& frame : dataset.frames) {
    const Result<DepthPixels> image = read_depth_png(frame.image);
    if (!image) return std::unexpected(image.error());
    const Result<InsertionResult> result =
        inserter.insert(mapped.map, image->view(dataset.units_per_m), frame.map_T_depth, {}, frame.stamp_s);
    if (!result) return refused(frame, result.error());
    const VoxelCounts counts = mapped.map.counts();
    mapped.frames.push_back(to_json(frame, *result, counts));
    fmt::print(stderr, "{}: {} of {} pixels used, {} voxels discovered; {} free, {} occupied\n",
               frame.image.filename().string(), result->pixels_used, image->pixels.size(),
               result->change.voxels_discovered, counts.free, counts.occupied);
  }
  return mapped;
}

template <typename Write>
Status write_file(const std::filesystem::path& file, Write write) {
  std::ofstream stream(file, std::ios::binary);
  write([&](std::span<const std::byte> bytes) {
    stream.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  });
  stream.close();
  if (!stream) return failure(Fault::kDiskWrite, "{}", file.string());
  return {};
}

Status write_map_files(const VoxelMap& map, const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) return failure(Fault::kDiskWrite, "{}: {}", folder.string(), error.message());
  Status status = write_file(folder / "collision_map.bt",
                             [&](ByteSink sink) { write_bt(map, collision_class, kOctreeDepth, sink); });
  if (status) status = write_file(folder / "map.ot", [&](ByteSink sink) { write_ot(map, kOctreeDepth, sink); });
  if (status) status = write_file(folder / "map.ply", [&](ByteSink sink) { write_ply(map, false, sink); });
  return status;
}

void print_result(const MapCommandOptions& options, const MappingDataset& dataset, const Mapped& mapped) {
  const GridGeometry& g = mapped.map.geometry();
  const VoxelCounts counts = mapped.map.counts();
  if (!options.json) {
    fmt::print("{} frames at {} m: {} voxels free, {} occupied, {} unknown\n", dataset.frames.size(),
               options.resolution_m, counts.free, counts.occupied, counts.unknown);
    return;
  }
  const Eigen::Vector3d low_m = g.first.cast<double>() * g.resolution_m;
  const Eigen::Vector3d high_m = (g.first + g.size).cast<double>() * g.resolution_m;
  const nlohmann::ordered_json result = {
      {"resolution_m", g.resolution_m},
      {"range_max_m", options.range_max_m},
      {"extents_m", {{"low", {low_m.x(), low_m.y(), low_m.z()}}, {"high", {high_m.x(), high_m.y(), high_m.z()}}}},
      {"frames", mapped.frames},
      {"frames_without_pose", dataset.frames_without_pose},
      {"voxels", to_json(counts)}};
  fmt::print("{}\n", result.dump(2));
}

int report(const Error& error) {
  fmt::print(stderr, "{}\n", describe(error));
  return error.fault == Fault::kUsage ? kExitUsage : kExitData;
}

Status check_options(const MapCommandOptions& options) {
  if (!(options.resolution_m >= kResolutionMin_m && options.resolution_m <= kResolutionMax_m))
    return failure(Fault::kUsage, "--resolution {}: must be {} to {} m", options.resolution_m, kResolutionMin_m,
                   kResolutionMax_m);
  if (!(options.range_max_m > 0 && options.range_max_m <= kRangeLimit_m))
    return failure(Fault::kUsage, "--max-range {}: must be above 0 and at most {} m", options.range_max_m,
                   kRangeLimit_m);
  return {};
}

}  // namespace

int run_map_command(const MapCommandOptions& options) {
  if (const Status status = check_options(options); !status) return report(status.error());
  const Result<MappingDataset> dataset = read_mapping_dataset(options.dataset);
  if (!dataset) return report(dataset.error());
  if (dataset->frames_without_pose > 0)
    fmt::print(stderr, "{} frames have no pose and are left out\n", dataset->frames_without_pose);
  const Result<Mapped> mapped = map_dataset(*dataset, options);
  if (!mapped) return report(mapped.error());
  if (!options.out.empty())
    if (const Status status = write_map_files(mapped->map, options.out); !status) return report(status.error());
  print_result(options, *dataset, *mapped);
  return kExitDone;
}

}  // namespace firstlook
