#include "tests/bench/depth_frames.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <numbers>

#include "app/dataset/mapping_dataset.hpp"
#include "hal/sim/cell_file.hpp"
#include "hal/sim/renderer.hpp"
#include "platform/core/random.hpp"

namespace firstlook::bench {
namespace {

constexpr double kDepthTolerance = 0.15;  // of the mean depth that is wished for
constexpr double kReturnsMin = 0.6;  // share of pixels with a return: others look at a black surface or into a wall
constexpr double kRangeMax_m = 5.0;

template <typename T>
T value_or_exit(Result<T> result) {
  if (result) return std::move(*result);
  fmt::print(stderr, "firstlook_bench: {}\n", describe(result.error()));
  std::exit(3);
}

struct DepthStatistics {
  double mean_m = 0;
  double returns = 0;
};

DepthStatistics statistics(const std::vector<std::uint16_t>& values, double units_per_m) {
  double sum = 0, count = 0;
  for (const std::uint16_t value : values) {
    if (value == 0) continue;
    sum += value / units_per_m;
    ++count;
  }
  return {count > 0 ? sum / count : 0, count / static_cast<double>(values.size())};
}

// Anywhere in the workshop's room (4.7 x 4.6 m), level or looking up to 40 degrees down or up.
Transform<Base, Depth> random_pose(Random& random) {
  constexpr double kPitch_rad = 40 * std::numbers::pi / 180;
  const Eigen::Vector3d position_m(random.uniform(-1.9, 2.2), random.uniform(-2.1, 1.9), random.uniform(0.1, 1.4));
  const double azimuth = random.uniform(-std::numbers::pi, std::numbers::pi);
  const double pitch = random.uniform(-kPitch_rad, kPitch_rad);
  const Eigen::Vector3d z(std::cos(pitch) * std::cos(azimuth), std::cos(pitch) * std::sin(azimuth), std::sin(pitch));
  const Eigen::Vector3d x = z.cross(Eigen::Vector3d::UnitZ()).normalized();
  Eigen::Matrix3d rotation;
  rotation << x, z.cross(x), z;
  const Eigen::Quaterniond roll(Eigen::AngleAxisd(random.uniform(-0.5, 0.5), Eigen::Vector3d::UnitZ()));
  return {Eigen::Quaterniond(rotation) * roll, position_m};
}

DepthFrames rendered(const FrameWish& wish) {
  const sim::Scene scene = value_or_exit(sim::load_cell("workshop", 1));
  const sim::Renderer renderer(scene);
  const auto render = [&](const Transform<Base, Depth>& pose, std::uint64_t number, sim::DepthDetail detail) {
    const CameraIntrinsics& camera = renderer.depth_intrinsics(detail);
    std::vector<std::uint16_t> values(static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height));
    renderer.render_depth(pose, {.body = {}, .seed = 1, .frame = number}, detail,
                          {values.data(), camera.width, camera.height});
    return values;
  };
  DepthFrames result;
  result.sensor.intrinsics = renderer.depth_intrinsics(sim::DepthDetail::kFull);
  result.sensor.range_min_m = 0;
  result.sensor.range_max_m = result.sensor.range_trusted_m = kRangeMax_m;
  Random random(7, static_cast<std::uint64_t>(1000 * wish.mean_depth_m));
  for (std::uint64_t number = 0; static_cast<int>(result.frames.size()) < wish.count; ++number) {
    const Transform<Base, Depth> pose = random_pose(random);
    const auto coarse = statistics(render(pose, number, sim::DepthDetail::kFast), result.units_per_m);
    const bool fits = std::abs(coarse.mean_m / wish.mean_depth_m - 1) < kDepthTolerance;
    if (fits && coarse.returns > kReturnsMin) {
      result.frames.push_back({render(pose, number, sim::DepthDetail::kFull), pose});
    }
  }
  return result;
}

DepthFrames recorded(const std::filesystem::path& folder, int count) {
  const MappingDataset dataset = value_or_exit(read_mapping_dataset(folder));
  const CameraIntrinsics& c = dataset.intrinsics;
  if (c.k1 != 0 || c.k2 != 0 || c.p1 != 0 || c.p2 != 0 || c.k3 != 0) {
    fmt::print(stderr, "firstlook_bench: {}: give OctoMap undistorted frames\n", folder.string());
    std::exit(3);
  }
  DepthFrames result;
  result.sensor.intrinsics = dataset.intrinsics;
  result.sensor.range_min_m = 0;
  result.sensor.range_max_m = result.sensor.range_trusted_m = kRangeMax_m;
  result.units_per_m = dataset.units_per_m;
  for (const MappingFrame& frame : dataset.frames) {
    if (static_cast<int>(result.frames.size()) == count) break;
    result.frames.push_back({value_or_exit(read_depth_png(frame.image)).pixels, frame.map_T_depth});
  }
  return result;
}

}  // namespace

DepthFrames depth_frames(const Options& options, const FrameWish& wish) {
  return options.dataset.empty() ? rendered(wish) : recorded(options.dataset, wish.count);
}

GridGeometry grid_around(const DepthFrames& frames, double resolution_m) {
  DepthRays rays(frames.sensor);
  AxisBox box;
  for (std::size_t i = 0; i < frames.frames.size(); ++i) {
    const AxisBox one = rays.bounds(frames.image(frames.frames[i]), frames.frames[i].base_T_depth);
    box.low_m = i == 0 ? one.low_m : Eigen::Vector3d(box.low_m.cwiseMin(one.low_m));
    box.high_m = i == 0 ? one.high_m : Eigen::Vector3d(box.high_m.cwiseMax(one.high_m));
  }
  return GridGeometry::covering(box.low_m.array() - resolution_m, box.high_m.array() + resolution_m, resolution_m);
}

}  // namespace firstlook::bench
