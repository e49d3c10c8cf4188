/// A map from recorded depth frames: what can be used goes in, the rest is named and counted.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "algorithms/mapping/insertion.hpp"
#include "algorithms/mapping/map_planes.hpp"
#include "app/dataset/color_dataset.hpp"
#include "app/dataset/mapping_dataset.hpp"
#include "platform/core/function_ref.hpp"

namespace firstlook {

/// Log-odds and two bit planes of an offline map: 320 MiB at most. Insertion counts eighths of voxels in 31 bits.
inline constexpr std::size_t kOfflineVoxelsMax = (std::size_t{1} << 28) - 1;

/// What the planes of an offline map may take: 64 million voxels with colours, 400 x 400 x 400.
inline constexpr std::size_t kOfflinePlaneBytesMax = std::size_t{1} << 30;
/// Sensors are numbered with one byte, from 1 on.
inline constexpr std::size_t kSensorsMax = 255;

/// Beyond these a whole frame's median says that the depth scale is wrong (by 1000, or another sensor's), not that a
/// wall is that near or far.
inline constexpr double kMedianDepthMin_m = 0.02, kMedianDepthMax_m = 100;

struct DatasetMappingOptions {
  double resolution_m = 0.05;
  double range_max_m = 5.0;                ///< rays are cut here
  std::optional<Eigen::Vector3d> place_m;  ///< a place whose voxel is watched
  PlaneChoice planes{};                    ///< beside the map; objects are labelled by whoever finds them
};

/// What one sensor has recorded. Its number is its place among the others, from 1 on.
struct SensorRecording {
  MappingDataset depth;
  std::optional<ColorDataset> color;  ///< where colours are asked for
};

/// What became of one line of depth.txt.
struct FrameOutcome {
  int sensor = 1;
  int line = 0;
  double stamp_s = 0;
  std::string image;
  std::string refused;  ///< the reason; empty when it went in
  InsertionResult inserted;
  std::uint32_t pixels_saturated = 0;  ///< of 65535: taken as no return
  VoxelCounts voxels;                  ///< of the whole map, after it
  std::uint32_t pixels_colored = 0;    ///< points that gave their voxels a colour
  std::string color_refused;           ///< why its picture gave none; empty without colours, and when it did
};

/// When the voxel of a place was seen.
struct PlaceSeen {
  std::size_t frames = 0;  ///< that passed or hit it
  std::size_t frames_hit = 0;
  std::optional<double> last_seen_s, last_hit_s;  ///< stamps of depth.txt
};

struct DatasetMap {
  VoxelMap map;
  MapPlanes planes;
  std::vector<FrameOutcome> frames;  ///< every line of each depth.txt, in the order in which they were taken
  PlaceSeen place;
  [[nodiscard]] std::size_t refused() const;
};

/// Maps the recordings of one or several sensors, one after the other, into a grid that is fitted to their rays.
/// Refused and counted are frames of another size than camera_info.yaml's, without a return or with a median depth that
/// cannot be, unreadable pictures, poses out of the keys' reach, and what the dataset itself refused. A frame whose
/// colour picture is missing or broken is mapped without colours.
/// @param recordings  kSensorsMax at most; with colours each has some
/// @param report      is called after each frame
/// @return kMapTooLarge with the numbers; kDataMalformed with the first reason when no frame is left
[[nodiscard]] Result<DatasetMap> map_dataset(std::span<const SensorRecording> recordings,
                                             const DatasetMappingOptions& options,
                                             FunctionRef<void(const FrameOutcome&)> report);

}  // namespace firstlook
