#include "app/dataset/dataset_mapping.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "platform/core/ensure.hpp"

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

FrameOutcome outcome_of(const MappingFrame& frame, int sensor) {
  FrameOutcome outcome;
  outcome.sensor = sensor;
  outcome.line = frame.line;
  outcome.stamp_s = frame.stamp_s;
  outcome.image = frame.image.filename().string();
  return outcome;
}

std::string reason_of(const FrameOutcome& frame, const Error& error) {
  return fmt::format("depth.txt:{}: {}: {}", frame.line, frame.image, error.detail());
}

const AxisBox kNoBox{Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity()),
                     Eigen::Vector3d::Constant(-std::numeric_limits<double>::infinity())};

// Widens the box to every ray of the frames that can be used; notes why the others cannot.
void widen(AxisBox& box, const MappingDataset& dataset, DepthRays rays, double resolution_m, int sensor,
           std::vector<FrameOutcome>& outcomes) {
  for (const MappingFrame& frame : dataset.frames) {
    FrameOutcome& outcome = outcomes.emplace_back(outcome_of(frame, sensor));
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
}

Result<GridGeometry> fit_grid(const AxisBox& box, double resolution_m, const PlaneChoice& planes) {
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
  const double plane_bytes = voxels.prod() * static_cast<double>(planes.bytes_per_voxel());
  if (plane_bytes > static_cast<double>(kOfflinePlaneBytesMax))
    return failure(Fault::kMapTooLarge,
                   "{:.0f} x {:.0f} x {:.0f} voxels of {} m with planes of {} bytes each need {:.0f} MiB for them; at "
                   "most {:.0f} MiB are taken",
                   voxels.x(), voxels.y(), voxels.z(), resolution_m, planes.bytes_per_voxel(), plane_bytes / kMiB,
                   static_cast<double>(kOfflinePlaneBytesMax) / kMiB);
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

// Puts the frames of one sensor into the map and its planes.
class RecordingMapper {
 public:
  RecordingMapper(const SensorRecording& recording, const DatasetMappingOptions& options, DatasetMap& mapped)
      : recording_(recording),
        mapped_(mapped),
        inserter_(mapped.map.geometry(), offline_sensor(recording.depth, options.range_max_m)) {
    if (options.place_m) watch_.emplace(*options.place_m, options.resolution_m, inserter_.sensor());
    if (mapped.planes.color)
      registration_.emplace(mapped.map.geometry(), inserter_.sensor(), recording.color->sensor.intrinsics);
  }

  // An error only for a picture that was readable a moment ago.
  Status map(std::size_t index, FrameOutcome& outcome) {
    const MappingFrame& frame = recording_.depth.frames[index];
    const Result<LoadedFrame> loaded = load(frame, recording_.depth);
    if (!loaded) return std::unexpected(loaded.error());
    const DepthImage depth = loaded->image.view(recording_.depth.units_per_m);
    const Result<InsertionResult> result = inserter_.insert(mapped_.map, depth, frame.map_T_depth, {}, frame.stamp_s);
    outcome.pixels_saturated = loaded->pixels_saturated;
    if (!result) {
      outcome.refused = reason_of(outcome, result.error());
      return {};
    }
    outcome.inserted = *result;
    if (watch_) watch_->see(depth, frame, mapped_.place);
    if (mapped_.planes.sensor)
      mapped_.planes.sensor->note(inserter_.missed(), inserter_.hit(), static_cast<std::uint8_t>(outcome.sensor));
    if (registration_) color(depth, frame, recording_.color->of_frame[index], outcome);
    return {};
  }

 private:
  void color(const DepthImage& depth, const MappingFrame& frame, const ColorPicture& picture, FrameOutcome& outcome) {
    if (picture.file.empty()) {
      outcome.color_refused = fmt::format("rgb.txt: no picture within {} s", kPoseAssociation_s);
      return;
    }
    const Result<ColorPixels> pixels = read_color_picture(*recording_.color, picture);
    if (!pixels) {
      outcome.color_refused = pixels.error().detail();
      return;
    }
    outcome.pixels_colored = registration_->add(*mapped_.planes.color, depth, frame.map_T_depth, {},
                                                recording_.color->sensor, pixels->view(), inserter_.hit());
  }

  const SensorRecording& recording_;
  DatasetMap& mapped_;
  Inserter inserter_;
  std::optional<PlaceWatch> watch_;
  std::optional<ColorRegistration> registration_;
};

// The dataset's own refusals among the frames, in the order of depth.txt.
void add_refused_lines(const MappingDataset& dataset, int sensor, std::vector<FrameOutcome>& outcomes) {
  for (const RefusedLine& line : dataset.refused) {
    FrameOutcome outcome;
    outcome.sensor = sensor;
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

Result<DatasetMap> map_dataset(std::span<const SensorRecording> recordings, const DatasetMappingOptions& options,
                               FunctionRef<void(const FrameOutcome&)> report) {
  ENSURE(7302, !recordings.empty() && recordings.size() <= kSensorsMax);
  AxisBox box = kNoBox;
  std::vector<std::vector<FrameOutcome>> outcomes;  // of each recording
  for (const SensorRecording& recording : recordings) {
    const DepthSensor sensor = offline_sensor(recording.depth, options.range_max_m);
    const auto number = static_cast<int>(outcomes.size()) + 1;
    widen(box, recording.depth, DepthRays(sensor), options.resolution_m, number, outcomes.emplace_back());
  }
  if (!box.low_m.allFinite())
    return failure(Fault::kDataMalformed, "no frame can be used; the first: {}", outcomes.front().front().refused);
  const Result<GridGeometry> geometry = fit_grid(box, options.resolution_m, options.planes);
  if (!geometry) return std::unexpected(geometry.error());
  DatasetMap mapped{VoxelMap(*geometry, VoxelMap::Planes::kLogOddsOnly), MapPlanes(*geometry, options.planes), {}, {}};
  for (std::size_t i = 0; i < recordings.size(); ++i) {
    RecordingMapper mapper(recordings[i], options, mapped);
    for (std::size_t frame = 0; frame < outcomes[i].size(); ++frame) {
      FrameOutcome& outcome = outcomes[i][frame];
      if (outcome.refused.empty())
        if (const Status status = mapper.map(frame, outcome); !status) return std::unexpected(status.error());
      outcome.voxels = mapped.map.counts();
      report(outcome);
    }
    add_refused_lines(recordings[i].depth, static_cast<int>(i) + 1, outcomes[i]);
    for (FrameOutcome& outcome : outcomes[i]) {
      if (outcome.voxels == VoxelCounts{})
        outcome.voxels = mapped.frames.empty() ? VoxelCounts{mapped.map.size(), 0, 0} : mapped.frames.back().voxels;
      mapped.frames.push_back(std::move(outcome));
    }
  }
  return mapped;
}

}  // namespace firstlook
