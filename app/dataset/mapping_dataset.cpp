#include "app/dataset/mapping_dataset.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <optional>
#include <span>
#include <string_view>

#include "app/dataset/calibration_dataset.hpp"

namespace firstlook {
namespace {

constexpr double kAssociation_s = 0.02;        // depth frames and poses this near belong together
constexpr double kInterpolationMax_s = 0.2;    // a pose is interpolated between two that are no farther apart
constexpr double kQuaternionTolerance = 1e-2;  // TUM's files round to four decimals
constexpr double kDepthScaleMin = 1, kDepthScaleMax = 1e6;  // metres to micrometres

// A line of a file that is neither empty nor a comment, cut at white space.
struct Line {
  int number = 0;
  std::vector<std::string> words;
};

struct StampedPose {
  double stamp_s = 0;
  Eigen::Quaterniond rotation;
  Eigen::Vector3d position_m;
};

Result<std::vector<Line>> read_lines(const std::filesystem::path& file) {
  std::ifstream stream(file);
  if (!stream || std::filesystem::is_directory(file))
    return failure(Fault::kDataMissing, "{}: no such file", file.string());
  std::vector<Line> lines;
  std::string text;
  for (int number = 1; std::getline(stream, text); ++number) {
    Line line{number, {}};
    std::string_view rest = text;
    while (true) {
      const std::size_t from = rest.find_first_not_of(" \t\r");
      if (from == std::string_view::npos) break;
      rest.remove_prefix(from);
      const std::size_t to = std::min(rest.find_first_of(" \t\r"), rest.size());
      line.words.emplace_back(rest.substr(0, to));
      rest.remove_prefix(to);
    }
    if (!line.words.empty() && line.words.front().front() != '#') lines.push_back(std::move(line));
  }
  return lines;
}

// A finite number and nothing else.
std::optional<double> to_number(const std::string& word) {
  double value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

// The numbers of a line's first `count` words.
Result<std::vector<double>> to_numbers(const std::filesystem::path& file, const Line& line, std::size_t count) {
  std::vector<double> numbers;
  for (std::size_t i = 0; i < count; ++i) {
    const std::optional<double> number = to_number(line.words[i]);
    if (!number)
      return failure(Fault::kDataMalformed, "{}:{}: '{}' is not a finite number", file.filename().string(), line.number,
                     line.words[i]);
    numbers.push_back(*number);
  }
  return numbers;
}

Result<std::vector<StampedPose>> read_poses(const std::filesystem::path& file) {
  const Result<std::vector<Line>> lines = read_lines(file);
  if (!lines) return std::unexpected(lines.error());
  const std::string name = file.filename().string();
  std::vector<StampedPose> poses;
  for (const Line& line : *lines) {
    if (line.words.size() != 8)
      return failure(Fault::kDataMalformed, "{}:{}: {} columns instead of 'timestamp tx ty tz qx qy qz qw'", name,
                     line.number, line.words.size());
    const Result<std::vector<double>> n = to_numbers(file, line, 8);
    if (!n) return std::unexpected(n.error());
    const Eigen::Quaterniond rotation((*n)[7], (*n)[4], (*n)[5], (*n)[6]);
    if (std::abs(rotation.norm() - 1) > kQuaternionTolerance)
      return failure(Fault::kDataMalformed, "{}:{}: quaternion of length {:.4f} instead of 1", name, line.number,
                     rotation.norm());
    if (!poses.empty() && (*n)[0] < poses.back().stamp_s)
      return failure(Fault::kDataMalformed, "{}:{}: time stamps must ascend", name, line.number);
    poses.push_back({(*n)[0], rotation.normalized(), {(*n)[1], (*n)[2], (*n)[3]}});
  }
  if (poses.empty()) return failure(Fault::kDataMalformed, "{}: no poses", name);
  return poses;
}

// The pose at a time: interpolated between near neighbours, else the nearest within the association time.
std::optional<Transform<Base, Depth>> pose_at(std::span<const StampedPose> poses, double stamp_s) {
  const auto after = std::lower_bound(poses.begin(), poses.end(), stamp_s,
                                      [](const StampedPose& pose, double stamp) { return pose.stamp_s < stamp; });
  const auto take = [](const StampedPose& pose) { return Transform<Base, Depth>(pose.rotation, pose.position_m); };
  if (after != poses.end() && after->stamp_s == stamp_s) return take(*after);
  const StampedPose* next = after != poses.end() ? &*after : nullptr;
  const StampedPose* previous = after != poses.begin() ? &*(after - 1) : nullptr;
  if (next != nullptr && previous != nullptr && next->stamp_s - previous->stamp_s <= kInterpolationMax_s) {
    const double t = (stamp_s - previous->stamp_s) / (next->stamp_s - previous->stamp_s);
    return Transform<Base, Depth>(previous->rotation.slerp(t, next->rotation),
                                  previous->position_m + t * (next->position_m - previous->position_m));
  }
  if (previous != nullptr && stamp_s - previous->stamp_s <= kAssociation_s &&
      (next == nullptr || stamp_s - previous->stamp_s <= next->stamp_s - stamp_s))
    return take(*previous);
  if (next != nullptr && next->stamp_s - stamp_s <= kAssociation_s) return take(*next);
  return std::nullopt;
}

Status read_frames(const std::filesystem::path& folder, std::span<const StampedPose> poses, MappingDataset& dataset) {
  const Result<std::vector<Line>> lines = read_lines(folder / "depth.txt");
  if (!lines) return std::unexpected(lines.error());
  double last_s = -1;
  for (const Line& line : *lines) {
    if (line.words.size() != 2)
      return failure(Fault::kDataMalformed, "depth.txt:{}: {} columns instead of 'timestamp filename'", line.number,
                     line.words.size());
    const Result<std::vector<double>> stamp = to_numbers("depth.txt", line, 1);
    if (!stamp) return std::unexpected(stamp.error());
    const double stamp_s = stamp->front();
    if (stamp_s < 0) return failure(Fault::kDataMalformed, "depth.txt:{}: negative time stamp", line.number);
    if (stamp_s <= last_s) return failure(Fault::kDataMalformed, "depth.txt:{}: time stamps must ascend", line.number);
    last_s = stamp_s;
    if (!std::filesystem::is_regular_file(folder / line.words[1]))
      return failure(Fault::kDataMissing, "depth.txt:{}: {}: no such file", line.number, line.words[1]);
    const std::optional<Transform<Base, Depth>> pose = pose_at(poses, stamp_s);
    if (!pose) {
      ++dataset.frames_without_pose;
      continue;
    }
    dataset.frames.push_back({stamp_s, folder / line.words[1], *pose});
  }
  if (lines->empty()) return failure(Fault::kDataMalformed, "depth.txt: no frames");
  if (dataset.frames.empty())
    return failure(Fault::kDataMalformed, "groundtruth.txt: no pose within {} s of any frame of depth.txt",
                   kAssociation_s);
  return {};
}

// The key that camera_info.yaml has beyond ROS's.
Result<double> read_depth_scale(const std::filesystem::path& file) {
  constexpr double kTumDepthScale = 5000;
  try {
    const YAML::Node scale = YAML::LoadFile(file.string())["depth_scale"];
    if (!scale) return kTumDepthScale;
    const auto value = scale.as<double>();
    if (value >= kDepthScaleMin && value <= kDepthScaleMax) return value;
    return failure(Fault::kDataMalformed, "camera_info.yaml:{}: depth_scale {} is not between {} and {} units a metre",
                   scale.Mark().line + 1, value, kDepthScaleMin, kDepthScaleMax);
  } catch (const YAML::Exception& error) {
    return failure(Fault::kDataMalformed, "camera_info.yaml:{}: depth_scale: {}", error.mark.line + 1, error.msg);
  }
}

}  // namespace

Result<MappingDataset> read_mapping_dataset(const std::filesystem::path& folder) {
  if (!std::filesystem::is_directory(folder))
    return failure(Fault::kDataMissing, "{}: no such folder", folder.string());
  MappingDataset dataset;
  const Result<CameraIntrinsics> intrinsics = read_camera_info(folder / "camera_info.yaml");
  if (!intrinsics) return std::unexpected(intrinsics.error());
  dataset.intrinsics = *intrinsics;
  const Result<double> scale = read_depth_scale(folder / "camera_info.yaml");
  if (!scale) return std::unexpected(scale.error());
  dataset.units_per_m = *scale;
  const Result<std::vector<StampedPose>> poses = read_poses(folder / "groundtruth.txt");
  if (!poses) return std::unexpected(poses.error());
  if (Status status = read_frames(folder, *poses, dataset); !status) return std::unexpected(status.error());
  return dataset;
}

}  // namespace firstlook
