/// Recorded depth frames with camera poses, in the TUM RGB-D layout.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "platform/core/camera_intrinsics.hpp"
#include "platform/core/image_view.hpp"
#include "platform/core/result.hpp"
#include "platform/core/transform.hpp"

namespace firstlook {

/// One line of depth.txt with its pose at that time.
struct MappingFrame {
  double stamp_s = 0;
  std::filesystem::path image;
  Transform<Base, Depth> map_T_depth;
};

struct MappingDataset {
  CameraIntrinsics intrinsics;
  double units_per_m = 5000;  ///< depth_scale of camera_info.yaml; TUM's default
  std::vector<MappingFrame> frames;
  std::size_t frames_without_pose = 0;  ///< left out
};

/// Reads depth.txt, groundtruth.txt and camera_info.yaml of `folder`. A frame takes the pose at its stamp: interpolated
/// between neighbours at most 0.2 s apart, else the nearest within 20 ms; frames without a pose are counted and left
/// out.
/// @return kDataMissing or kDataMalformed, naming file and line
[[nodiscard]] Result<MappingDataset> read_mapping_dataset(const std::filesystem::path& folder);

/// A 16-bit grey image in memory.
struct DepthPixels {
  std::vector<std::uint16_t> pixels;
  int width = 0;
  int height = 0;
  [[nodiscard]] DepthImage view(double units_per_m) const { return {{pixels.data(), width, height}, units_per_m}; }
};

/// Reads a 16-bit grey PNG.
/// @return kDataMissing, or kDataMalformed for anything else than a whole 16-bit grey PNG of at most 8192 x 8192 pixels
[[nodiscard]] Result<DepthPixels> read_depth_png(const std::filesystem::path& file);

}  // namespace firstlook
