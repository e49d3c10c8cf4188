#include "app/dataset/color_dataset.hpp"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>

#include "app/dataset/calibration_dataset.hpp"
#include "app/dataset/tum_lines.hpp"

namespace firstlook {
namespace {

constexpr double kQuaternionTolerance = 1e-2;
constexpr double kApartMax_m = 2;  // no two cameras of one head are farther apart

/// The key that rgb_camera_info.yaml has beyond ROS's.
Result<Transform<Camera, Depth>> read_mount(const std::filesystem::path& file) {
  const auto malformed = [](int line, std::string_view what) {
    return failure(Fault::kDataMalformed, "rgb_camera_info.yaml:{}: camera_T_depth: {}", line, what);
  };
  try {
    const YAML::Node mount = YAML::LoadFile(file.string())["camera_T_depth"];
    if (!mount)
      return malformed(1, "no such key: where the depth camera sits on this one, {translation_m, quaternion_xyzw}");
    const int line = mount.Mark().line + 1;
    const auto t = mount["translation_m"].as<std::vector<double>>();
    const auto q = mount["quaternion_xyzw"].as<std::vector<double>>();
    if (t.size() != 3 || q.size() != 4) return malformed(line, "three and four numbers are wanted");
    const Eigen::Vector3d translation_m(t[0], t[1], t[2]);
    const Eigen::Quaterniond rotation(q[3], q[0], q[1], q[2]);
    if (!(std::abs(rotation.norm() - 1) <= kQuaternionTolerance)) return malformed(line, "a quaternion has length 1");
    if (!(translation_m.norm() <= kApartMax_m))
      return malformed(line, fmt::format("cameras {:.3g} m apart: that looks like millimetres", translation_m.norm()));
    return Transform<Camera, Depth>(rotation, translation_m);
  } catch (const YAML::Exception& error) {
    return malformed(error.mark.line + 1, error.msg);
  }
}

Result<ColorSensor> read_sensor(const std::filesystem::path& folder, const MappingDataset& depth) {
  const std::filesystem::path file = folder / "rgb_camera_info.yaml";
  if (!std::filesystem::exists(file)) return ColorSensor{depth.intrinsics, {}};
  const Result<CameraIntrinsics> intrinsics = read_camera_info(file);
  if (!intrinsics) return std::unexpected(intrinsics.error());
  const Result<Transform<Camera, Depth>> mount = read_mount(file);
  if (!mount) return std::unexpected(mount.error());
  return ColorSensor{*intrinsics, *mount};
}

/// In the order of time, without what cannot be used.
Result<std::vector<StampedImage>> read_pictures(const std::filesystem::path& folder,
                                                std::vector<RefusedLine>& refused) {
  const Result<std::vector<TumLine>> lines = read_tum_lines(folder / "rgb.txt");
  if (!lines)
    return failure(lines.error().fault, "{}: colours are taken from the pictures that it lists, 'timestamp filename'",
                   lines.error().detail());
  std::vector<StampedImage> pictures;
  for (const TumLine& line : *lines) {
    StampedImage picture = read_stamped_image(line, folder);
    if (picture.fault.empty())
      pictures.push_back(std::move(picture));
    else
      refused.push_back(
          {picture.line, picture.stamp_s, picture.image, fmt::format("rgb.txt:{}: {}", picture.line, picture.fault)});
  }
  std::ranges::stable_sort(pictures, {}, &StampedImage::stamp_s);
  return pictures;
}

ColorPicture nearest(const std::vector<StampedImage>& pictures, double stamp_s, const std::filesystem::path& folder) {
  const auto after = std::ranges::lower_bound(pictures, stamp_s, {}, &StampedImage::stamp_s);
  const StampedImage* best = after != pictures.end() ? &*after : nullptr;
  if (after != pictures.begin() && (best == nullptr || stamp_s - (after - 1)->stamp_s <= best->stamp_s - stamp_s))
    best = &*(after - 1);
  if (best == nullptr || std::abs(best->stamp_s - stamp_s) > kPoseAssociation_s) return {};
  return {best->line, folder / best->image};
}

}  // namespace

std::size_t ColorDataset::frames_without() const {
  return static_cast<std::size_t>(
      std::ranges::count_if(of_frame, [](const ColorPicture& picture) { return picture.file.empty(); }));
}

Result<ColorDataset> read_color_dataset(const std::filesystem::path& folder, const MappingDataset& depth) {
  ColorDataset dataset;
  const Result<std::vector<StampedImage>> pictures = read_pictures(folder, dataset.refused);
  if (!pictures) return std::unexpected(pictures.error());
  const Result<ColorSensor> sensor = read_sensor(folder, depth);
  if (!sensor) return std::unexpected(sensor.error());
  dataset.sensor = *sensor;
  for (const MappingFrame& frame : depth.frames) dataset.of_frame.push_back(nearest(*pictures, frame.stamp_s, folder));
  if (dataset.frames_without() == dataset.of_frame.size())
    return failure(
        Fault::kDataMalformed, "rgb.txt: no picture within {} s of a depth frame{}{}", kPoseAssociation_s,
        dataset.refused.empty() ? "" : "; the first: ", dataset.refused.empty() ? "" : dataset.refused.front().reason);
  return dataset;
}

Result<ColorPixels> read_color_picture(const ColorDataset& dataset, const ColorPicture& picture) {
  Result<ColorPixels> pixels = read_color_image(picture.file);
  if (!pixels) return failure(pixels.error().fault, "rgb.txt:{}: {}", picture.line, pixels.error().detail());
  const CameraIntrinsics& camera = dataset.sensor.intrinsics;
  if (pixels->width != camera.width || pixels->height != camera.height)
    return failure(Fault::kDataMalformed,
                   "rgb.txt:{}: {}: {} x {} pixels instead of {} x {}: rgb_camera_info.yaml tells of a colour camera "
                   "that is not the depth camera",
                   picture.line, picture.file.filename().string(), pixels->width, pixels->height, camera.width,
                   camera.height);
  return pixels;
}

}  // namespace firstlook
