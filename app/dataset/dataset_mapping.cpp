#include "app/dataset/dataset_mapping.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>

namespace firstlook {
namespace {

constexpr double kMiB = 1024.0 * 1024.0;
constexpr double kKeysReach = 32000;  // OctoMap's keys end at 32768 voxels

DepthSensor offline_sensor(const MappingDataset& dataset, double range_max_m) {
  DepthSensor sensor;
  sensor.intrinsics = dataset.intrinsics;
  sensor.range_min_m = 0;  // what the recording holds is taken as it is
  sensor.range_max_m = sensor.range_trusted_m = range_max_m;
  return sensor;
}

struct LoadedFrame {
  DepthPixels image;
  std::uint32_t pixels_saturated = 0;
};

// A picture that can be used, or why not.
Result<LoadedFrame> load(const MappingFrame& frame, const MappingDataset& dataset) {
  Result<DepthPixels> image = read_depth_png(frame.image);
  if (!image) return std::unexpected(image.error());
  const CameraIntrinsics& camera = dataset.intrinsics;
  if (image->width != camera.width || image->height != camera.height)
    return failure(Fault::kFrameRefused, "{} x {} pixels instead of the {} x {} of camera_info.yaml", image->width,
                   image->height, camera.width, camera.height);
  LoadedFrame loaded{std::move(*image), 0};
  // The largest value is where sensors and converters put "infinitely far": it says nothing of the way there.
  constexpr std::uint16_t kSaturated = std::numeric_limits<std::uint16_t>::max();
  std::vector<std::uint16_t> returns;
  returns.reserve(loaded.image.pixels.size());
  for (std::uint16_t& value : loaded.image.pixels) {
    loaded.pixels_saturated += value == kSaturated ? 1 : 0;
    if (value == kSaturated) value = 0;
    if (value != 0) returns.push_back(value);
  }
  if (returns.empty()) return failure(Fault::kFrameRefused, "no pixel has a depth");
  const auto middle = returns.begin() + std::ssize(returns) / 2;
  std::ranges::nth_element(returns, middle);
  const double median_m = *middle / dataset.units_per_m;
  if (median_m < kMedianDepthMin_m || median_m > kMedianDepthMax_m)
    return failure(Fault::kFrameRefused,
                   "its median depth would be {:.4g} m: depth_scale {} in camera_info.yaml is wrong", median_m,
                   dataset.units_per_m);
  return loaded;
}

FrameOutcome outcome_of(const MappingFrame& frame) {
  FrameOutcome outcome;
  outcome.line = frame.line;
  outcome.stamp_s = frame.stamp_s;
  outcome.image = frame.image.filename().string();
  return outcome;
}

std::string reason_of(const FrameOutcome& frame, const Error& error) {
  return fmt::format("depth.txt:{}: {}: {}", frame.line, frame.image, error.detail());
}

// The box of every ray of the frames that can be used; notes why the others cannot.
Result<AxisBox> find_extents(const MappingDataset& dataset, DepthRays& rays, double resolution_m,
                             std::vector<FrameOutcome>& outcomes) {
  AxisBox box{Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity()),
              Eigen::Vector3d::Constant(-std::numeric_limits<double>::infinity())};
  for (const MappingFrame& frame : dataset.frames) {
    FrameOutcome& outcome = outcomes.emplace_back(outcome_of(frame));
    const Result<LoadedFrame> loaded = load(frame, dataset);
    Status status;
    if (!loaded)
      status = std::unexpected(loaded.error());
    else if (frame.map_T_depth.translation().cwiseAbs().maxCoeff() > kKeysReach * resolution_m - rays.range_m())
      status = failure(Fault::kFrameRefused, "its pose is farther away than {:.0f} m, where OctoMap's keys end",
                       kKeysReach * resolution_m - rays.range_m());
    else
      status = rays.check(loaded->image.view(dataset.units_per_m), frame.map_T_depth, {});
    if (!status) {
      outcome.refused = reason_of(outcome, status.error());
      continue;
    }
    const AxisBox bounds = rays.bounds(loaded->image.view(dataset.units_per_m), frame.map_T_depth);
    box.low_m = box.low_m.cwiseMin(bounds.low_m);
    box.high_m = box.high_m.cwiseMax(bounds.high_m);
  }
  if (!box.low_m.allFinite())
    return failure(Fault::kDataMalformed, "no frame can be used; the first: {}", outcomes.front().refused);
  return box;
}

Result<GridGeometry> fit_grid(const AxisBox& box, double resolution_m) {
  // One voxel on each side, for points on a boundary.
  const Eigen::Vector3d margin_m = Eigen::Vector3d::Constant(resolution_m);
  const Eigen::Vector3d low = box.low_m - margin_m, high = box.high_m + margin_m;
  const Eigen::Vector3d voxels = ((high - low) / resolution_m).array().ceil();
  constexpr double kBytesPerVoxel = 1 + 2.0 / 8;  // log-odds and two bit planes
  if (voxels.prod() > static_cast<double>(kOfflineVoxelsMax))
    return failure(
        Fault::kMapTooLarge,
        "{:.0f} x {:.0f} x {:.0f} voxels of {} m from ({:.1f}, {:.1f}, {:.1f}) to ({:.1f}, {:.1f}, {:.1f}) m "
        "need {:.0f} MiB; at most {:.0f} MiB are taken",
        voxels.x(), voxels.y(), voxels.z(), resolution_m, low.x(), low.y(), low.z(), high.x(), high.y(), high.z(),
        voxels.prod() * kBytesPerVoxel / kMiB, static_cast<double>(kOfflineVoxelsMax) * kBytesPerVoxel / kMiB);
  return GridGeometry::covering(low, high, resolution_m);
}

// A map of the one voxel that holds a place: what a frame changes there says when it was seen.
class PlaceWatch {
 public:
  PlaceWatch(const Eigen::Vector3d& place_m, double resolution_m, const DepthSensor& sensor)
      : geometry_(voxel_of(place_m, resolution_m)),
        map_(geometry_, VoxelMap::Planes::kLogOddsOnly),
        inserter_(geometry_, sensor) {}

  void see(const DepthImage& depth, const MappingFrame& frame, PlaceSeen& seen) {
    const Result<InsertionResult> result = inserter_.insert(map_, depth, frame.map_T_depth, {}, frame.stamp_s);
    if (!result || result->change.voxels_missed + result->change.voxels_hit == 0) return;
    ++seen.frames;
    seen.last_seen_s = frame.stamp_s;
    if (result->change.voxels_hit == 0) return;
    ++seen.frames_hit;
    seen.last_hit_s = frame.stamp_s;
  }

 private:
  static GridGeometry voxel_of(const Eigen::Vector3d& place_m, double resolution_m) {
    GridGeometry g{resolution_m, Eigen::Vector3i::Zero(), Eigen::Vector3i::Ones()};
    g.first = g.voxel(place_m);
    return g;
  }
  GridGeometry geometry_;
  VoxelMap map_;
  Inserter inserter_;
};

// The dataset's own refusals among the frames, in the order of depth.txt.
void add_refused_lines(const MappingDataset& dataset, std::vector<FrameOutcome>& outcomes) {
  for (const RefusedLine& line : dataset.refused) {
    FrameOutcome outcome;
    outcome.line = line.line;
    outcome.stamp_s = line.stamp_s;
    outcome.image = std::filesystem::path(line.image).filename().string();
    outcome.refused = line.reason;
    const auto behind = std::ranges::find_if(outcomes, [&](const FrameOutcome& o) { return o.line > line.line; });
    outcomes.insert(behind, std::move(outcome));
  }
}

}  // namespace

std::size_t DatasetMap::refused() const {
  return static_cast<std::size_t>(
      std::ranges::count_if(frames, [](const FrameOutcome& frame) { return !frame.refused.empty(); }));
}

Result<DatasetMap> map_dataset(const MappingDataset& dataset, const DatasetMappingOptions& options,
                               FunctionRef<void(const FrameOutcome&)> report) {
  const DepthSensor sensor = offline_sensor(dataset, options.range_max_m);
  DepthRays rays(sensor);
  std::vector<FrameOutcome> outcomes;
  const Result<AxisBox> extents = find_extents(dataset, rays, options.resolution_m, outcomes);
  if (!extents) return std::unexpected(extents.error());
  const Result<GridGeometry> geometry = fit_grid(*extents, options.resolution_m);
  if (!geometry) return std::unexpected(geometry.error());
  DatasetMap mapped{VoxelMap(*geometry, VoxelMap::Planes::kLogOddsOnly), {}, {}};
  Inserter inserter(*geometry, sensor);
  std::optional<PlaceWatch> watch;
  if (options.place_m) watch.emplace(*options.place_m, options.resolution_m, sensor);
  for (std::size_t i = 0; i < outcomes.size(); ++i) {
    const MappingFrame& frame = dataset.frames[i];
    FrameOutcome& outcome = outcomes[i];
    if (outcome.refused.empty()) {
      const Result<LoadedFrame> loaded = load(frame, dataset);
      if (!loaded) return std::unexpected(loaded.error());  // it was readable a moment ago
      const DepthImage depth = loaded->image.view(dataset.units_per_m);
      const Result<InsertionResult> result = inserter.insert(mapped.map, depth, frame.map_T_depth, {}, frame.stamp_s);
      outcome.pixels_saturated = loaded->pixels_saturated;
      if (result)
        outcome.inserted = *result;
      else
        outcome.refused = reason_of(outcome, result.error());
      if (watch && result) watch->see(depth, frame, mapped.place);
    }
    outcome.voxels = mapped.map.counts();
    report(outcome);
  }
  add_refused_lines(dataset, outcomes);
  for (std::size_t i = 0; i < outcomes.size(); ++i) {
    if (outcomes[i].voxels == VoxelCounts{})
      outcomes[i].voxels = i == 0 ? VoxelCounts{mapped.map.size(), 0, 0} : outcomes[i - 1].voxels;
  }
  mapped.frames = std::move(outcomes);
  return mapped;
}

}  // namespace firstlook
