#include "app/dataset/mapping_dataset.hpp"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>

#include "app/dataset/calibration_dataset.hpp"
#include "app/dataset/tum_lines.hpp"

namespace firstlook {
namespace {

constexpr double kQuaternionTolerance = 1e-2;               // TUM's files round to four decimals
constexpr double kDepthScaleMin = 1, kDepthScaleMax = 1e6;  // metres to micrometres

struct StampedPose {
  int line = 0;
  double stamp_s = 0;
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  std::string fault;  // not empty: at this time the camera was lost
};

// What is wrong with the numbers of a line, or nothing.
std::string read_numbers(const TumLine& line, std::span<double> numbers) {
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const std::optional<double> number = to_number(line.words[i]);
    if (!number) return fmt::format("'{}' is not a finite number", line.words[i]);
    numbers[i] = *number;
  }
  return {};
}

StampedPose read_pose(const TumLine& line) {
  StampedPose pose;
  pose.line = line.number;
  pose.stamp_s = to_number(line.words[0]).value_or(std::nan(""));
  if (line.words.size() != 8) {
    pose.fault = fmt::format("{} columns instead of 'timestamp tx ty tz qx qy qz qw'", line.words.size());
    return pose;
  }
  std::array<double, 8> n{};
  pose.fault = read_numbers(line, n);
  if (!pose.fault.empty()) return pose;
  const Eigen::Quaterniond rotation(n[7], n[4], n[5], n[6]);
  if (std::abs(rotation.norm() - 1) > kQuaternionTolerance) {
    pose.fault = fmt::format("quaternion of length {:.4f} instead of 1", rotation.norm());
    return pose;
  }
  pose.rotation = rotation.normalized();
  pose.position_m = {n[1], n[2], n[3]};
  return pose;
}

// In the order of time, faults among them; those whose time is not known are only noted.
Result<std::vector<StampedPose>> read_poses(const std::filesystem::path& file, MappingDataset& dataset) {
  const Result<std::vector<TumLine>> lines = read_tum_lines(file);
  if (!lines) return std::unexpected(lines.error());
  std::vector<StampedPose> poses;
  const auto refuse = [&dataset](const StampedPose& pose, const std::string& reason) {
    dataset.refused_poses.push_back(
        {pose.line, pose.stamp_s, {}, fmt::format("groundtruth.txt:{}: {}", pose.line, reason)});
  };
  std::size_t good = 0;
  for (const TumLine& line : *lines) {
    StampedPose pose = read_pose(line);
    if (!pose.fault.empty()) refuse(pose, pose.fault);
    good += pose.fault.empty() ? 1 : 0;
    if (std::isfinite(pose.stamp_s)) poses.push_back(std::move(pose));
  }
  if (good == 0)
    return failure(Fault::kDataMalformed, "{}",
                   lines->empty() ? "groundtruth.txt: no poses" : dataset.refused_poses.front().reason);
  const auto by_stamp = [](const StampedPose& a, const StampedPose& b) { return a.stamp_s < b.stamp_s; };
  dataset.poses_were_sorted = !std::ranges::is_sorted(poses, by_stamp);
  std::ranges::stable_sort(poses, by_stamp);
  std::vector<StampedPose> kept;
  for (StampedPose& pose : poses) {
    const bool again = !kept.empty() && kept.back().stamp_s == pose.stamp_s;
    if (!again)
      kept.push_back(std::move(pose));
    else if (pose.fault.empty())
      refuse(pose, fmt::format("the stamp of line {} again", kept.back().line));
  }
  return kept;
}

using PoseOrReason = std::expected<Transform<Base, Depth>, std::string>;

PoseOrReason take(const StampedPose& pose) {
  if (!pose.fault.empty()) return std::unexpected(fmt::format("groundtruth.txt:{}: {}", pose.line, pose.fault));
  return Transform<Base, Depth>(pose.rotation, pose.position_m);
}

// The pose at a time: interpolated between near neighbours, else the nearest within the association time.
PoseOrReason pose_at(std::span<const StampedPose> poses, double stamp_s) {
  const auto after = std::lower_bound(poses.begin(), poses.end(), stamp_s,
                                      [](const StampedPose& pose, double stamp) { return pose.stamp_s < stamp; });
  if (after != poses.end() && after->stamp_s == stamp_s) return take(*after);
  const StampedPose* next = after != poses.end() ? &*after : nullptr;
  const StampedPose* previous = after != poses.begin() ? &*(after - 1) : nullptr;
  const bool between = next != nullptr && previous != nullptr;
  const double gap_s = between ? next->stamp_s - previous->stamp_s : 0;
  if (between && gap_s <= kPoseInterpolation_s && next->fault.empty() && previous->fault.empty()) {
    const double t = (stamp_s - previous->stamp_s) / gap_s;
    return Transform<Base, Depth>(previous->rotation.slerp(t, next->rotation),
                                  previous->position_m + t * (next->position_m - previous->position_m));
  }
  const bool next_is_nearer =
      next != nullptr && (previous == nullptr || next->stamp_s - stamp_s < stamp_s - previous->stamp_s);
  const StampedPose& nearest = next_is_nearer ? *next : *previous;
  if (std::abs(nearest.stamp_s - stamp_s) <= kPoseAssociation_s) return take(nearest);
  std::string reason = fmt::format("groundtruth.txt: no pose within {} s", kPoseAssociation_s);
  if (between) {
    const StampedPose& lost = previous->fault.empty() ? *next : *previous;
    reason += lost.fault.empty()
                  ? fmt::format(", and lines {} and {} around it are {:.3g} s apart", previous->line, next->line, gap_s)
                  : fmt::format(", and line {} beside it is no pose: {}", lost.line, lost.fault);
  }
  return std::unexpected(reason);
}

std::string order_fault(const StampedImage& frame, const MappingFrame& last) {
  if (frame.stamp_s > last.stamp_s) return {};
  if (frame.stamp_s == last.stamp_s) return fmt::format("the stamp of line {} again", last.line);
  return fmt::format("time stamps must ascend, and line {} has {:.6f} s (--sort sorts them)", last.line, last.stamp_s);
}

Status read_frames(const std::filesystem::path& folder, std::span<const StampedPose> poses, FrameOrder order,
                   MappingDataset& dataset) {
  const Result<std::vector<TumLine>> lines = read_tum_lines(folder / "depth.txt");
  if (!lines) return std::unexpected(lines.error());
  if (lines->empty()) return failure(Fault::kDataMalformed, "depth.txt: no frames");
  std::vector<StampedImage> frames;
  for (const TumLine& line : *lines) frames.push_back(read_stamped_image(line, folder));
  if (order == FrameOrder::kByStamp)
    std::ranges::stable_sort(frames, {},
                             [](const StampedImage& f) { return std::isfinite(f.stamp_s) ? f.stamp_s : -1; });
  for (StampedImage& frame : frames) {
    if (frame.fault.empty() && !dataset.frames.empty()) frame.fault = order_fault(frame, dataset.frames.back());
    const PoseOrReason pose = frame.fault.empty() ? pose_at(poses, frame.stamp_s) : std::unexpected(frame.fault);
    if (pose) {
      dataset.frames.push_back({frame.line, frame.stamp_s, folder / frame.image, *pose});
      continue;
    }
    dataset.frames_without_pose += frame.fault.empty() ? 1 : 0;
    dataset.refused.push_back(
        {frame.line, frame.stamp_s, frame.image, fmt::format("depth.txt:{}: {}", frame.line, pose.error())});
  }
  std::ranges::stable_sort(dataset.refused, {}, &RefusedLine::line);
  if (dataset.frames.empty())
    return failure(Fault::kDataMalformed, "no frame can be used; the first: {}", dataset.refused.front().reason);
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

Result<MappingDataset> read_mapping_dataset(const std::filesystem::path& folder, FrameOrder order) {
  if (!std::filesystem::is_directory(folder))
    return failure(Fault::kDataMissing, "{}: no such folder", folder.string());
  MappingDataset dataset;
  if (!std::filesystem::exists(folder / "camera_info.yaml"))
    return failure(Fault::kDataMissing,
                   "{}: no such file: it gives the depth camera's intrinsics as ROS writes them, and depth_scale",
                   (folder / "camera_info.yaml").string());
  const Result<CameraIntrinsics> intrinsics = read_camera_info(folder / "camera_info.yaml");
  if (!intrinsics) return std::unexpected(intrinsics.error());
  dataset.intrinsics = *intrinsics;
  const Result<double> scale = read_depth_scale(folder / "camera_info.yaml");
  if (!scale) return std::unexpected(scale.error());
  dataset.units_per_m = *scale;
  const Result<std::vector<StampedPose>> poses = read_poses(folder / "groundtruth.txt", dataset);
  if (!poses) return std::unexpected(poses.error());
  if (Status status = read_frames(folder, *poses, order, dataset); !status) return std::unexpected(status.error());
  return dataset;
}

}  // namespace firstlook
