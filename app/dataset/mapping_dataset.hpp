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
  int line = 0;  ///< of depth.txt
  double stamp_s = 0;
  std::filesystem::path image;
  Transform<Base, Depth> map_T_depth;
};

/// A line that is left out, and why.
struct RefusedLine {
  int line = 0;
  double stamp_s = 0;  ///< NaN when it could not be read
  std::string image;   ///< as depth.txt has it; empty for a pose
  std::string reason;  ///< "depth.txt:7: what is wrong"
};

struct MappingDataset {
  CameraIntrinsics intrinsics;
  double units_per_m = 5000;            ///< depth_scale of camera_info.yaml; TUM's default
  std::vector<MappingFrame> frames;     ///< in the order of depth.txt, or of their stamps
  std::vector<RefusedLine> refused;     ///< frames of depth.txt, in the order of its lines
  std::size_t frames_without_pose = 0;  ///< of `refused`: nothing near enough in groundtruth.txt
  std::vector<RefusedLine> refused_poses;
  bool poses_were_sorted = false;  ///< groundtruth.txt was not in the order of time
};

/// What belongs together in time.
inline constexpr double kPoseAssociation_s = 0.02;   ///< a pose this near is a frame's own (TUM's associate.py)
inline constexpr double kPoseInterpolation_s = 0.2;  ///< a pose is interpolated between two no farther apart

enum class FrameOrder : std::uint8_t {
  kAsRecorded,  ///< a stamp that goes back is a fault of the recording: that frame is refused
  kByStamp,     ///< depth.txt is only a list: its frames are sorted
};

/// Reads depth.txt, groundtruth.txt and camera_info.yaml of `folder`; other files (rgb.txt) do not matter. A frame
/// takes the pose at its stamp: interpolated (slerp) between neighbours at most kPoseInterpolation_s apart, else the
/// nearest within kPoseAssociation_s. Poses may come in any order. A pose that is not a number or no rotation ends
/// interpolation: around it the camera was lost. Frames without a pose, without a file, or with a stamp that does not
/// ascend are left out, each with its reason.
/// @return kDataMissing or kDataMalformed, naming file and line; also when no frame is left
[[nodiscard]] Result<MappingDataset> read_mapping_dataset(const std::filesystem::path& folder,
                                                          FrameOrder order = FrameOrder::kAsRecorded);

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
