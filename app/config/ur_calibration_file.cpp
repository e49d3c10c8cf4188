#include "app/config/ur_calibration_file.hpp"

#include <yaml-cpp/yaml.h>

#include <cmath>
#include <functional>
#include <optional>
#include <sstream>

#include "platform/core/random.hpp"
#include "platform/linux/files.hpp"

namespace firstlook {
namespace {

constexpr std::size_t kFileMax = 64 * 1024;
constexpr const char* kLinks[] = {"shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3"};
constexpr const char* kNumbers[] = {"x", "y", "z", "roll", "pitch", "yaw"};
constexpr double kOffAxis = 1e-6;   // m and rad of axis 1 beside z of Base
constexpr double kLengthMax_m = 3;  // beyond every arm: millimetres, or another file

Pose pose_of(const std::array<double, 6>& v) {
  Pose pose = Pose::Identity();
  pose.translation() << v[0], v[1], v[2];
  pose.linear() =
      (Eigen::AngleAxisd(v[3], Eigen::Vector3d::UnitX()) * Eigen::AngleAxisd(v[4], Eigen::Vector3d::UnitY()) *
       Eigen::AngleAxisd(v[5], Eigen::Vector3d::UnitZ()))
          .toRotationMatrix();
  return pose;
}

/// The frame of one joint. Error: what is wrong with it.
Result<Pose> joint_of(const YAML::Node& kinematics, const char* link, std::string_view name) {
  const YAML::Node node = kinematics[link];
  if (!node || !node.IsMap()) {
    return failure(Fault::kConfigBadValue, "{}: kinematics.{} is missing: not a file of calibration_correction", name,
                   link);
  }
  std::array<double, 6> values{};
  for (std::size_t i = 0; i < values.size(); ++i) {
    const YAML::Node number = node[kNumbers[i]];
    const bool read = number && number.IsScalar() && YAML::convert<double>::decode(number, values[i]);
    if (!read || !std::isfinite(values[i]) || std::abs(values[i]) > (i < 3 ? kLengthMax_m : 2 * M_PI)) {
      return failure(Fault::kConfigBadValue, "{}:{}: kinematics.{}.{} must be a number in metres or radians", name,
                     (number ? number : node).Mark().line + 1, link, kNumbers[i]);
    }
  }
  return pose_of(values);
}

Result<UrCalibrationFile> read_node(const YAML::Node& root, std::string_view name) {
  const YAML::Node kinematics = root.IsMap() ? root["kinematics"] : YAML::Node(YAML::NodeType::Undefined);
  if (!kinematics || !kinematics.IsMap()) {
    return failure(Fault::kConfigBadValue, "{}: no mapping `kinematics`: not a file of calibration_correction", name);
  }
  UrCalibrationFile file;
  Pose base_T_joint = Pose::Identity();
  for (std::size_t i = 0; i < std::size(kLinks); ++i) {
    const auto joint = joint_of(kinematics, kLinks[i], name);
    if (!joint) return std::unexpected(joint.error());
    base_T_joint = base_T_joint * *joint;
    if (i > 0) file.frames[i - 1] = base_T_joint;
    const bool along_z = base_T_joint.translation().head<2>().norm() < kOffAxis && base_T_joint(2, 2) > 1 - kOffAxis;
    if (i == 0 && !along_z) {
      return failure(Fault::kConfigBadValue, "{}: kinematics.shoulder: axis 1 is not z of the robot's base", name);
    }
  }
  // Behind joint 6 the driver leaves out what turns nothing: a and alpha of its row, 0 on every UR.
  file.frames[std::size(kLinks) - 1] = base_T_joint;
  const YAML::Node hash = kinematics["hash"];
  if (hash && hash.IsScalar()) file.hash = hash.Scalar();
  return file;
}

}  // namespace

Result<UrCalibrationFile> parse_ur_calibration(std::string_view yaml, std::string_view name) {
  try {
    return read_node(YAML::Load(std::string(yaml)), name);
  } catch (const YAML::Exception& error) {
    return failure(Fault::kConfigBadValue, "{}:{}: {}", name, error.mark.line + 1, error.msg);
  }
}

Result<UrCalibrationFile> read_ur_calibration(const std::string& path) {
  const Result<std::string> text = read_text_file(path, kFileMax);
  if (!text) return std::unexpected(text.error());
  return parse_ur_calibration(*text, path);
}

std::string ur_calibration_hash(std::span<const DhRow> rows) {
  std::ostringstream text;
  for (const DhRow& row : rows) text << row.theta_offset_rad << row.d_m << row.a_m << row.alpha_rad;
  return "calib_" + std::to_string(std::hash<std::string>{}(text.str()));
}

FlangeDifference flange_difference(const ArmModel& one, const ArmModel& other) {
  constexpr int kPostures = 100;
  Random random(1, 7706);
  FlangeDifference found;
  for (int i = 0; i < kPostures; ++i) {
    JointVector q = JointVector::zero(one.joints);
    for (int j = 0; j < one.joints; ++j) q[j] = random.uniform(-M_PI, M_PI);
    const Pose off = forward(one, q).flange().pose().inverse(Eigen::Isometry) * forward(other, q).flange().pose();
    found.m = std::max(found.m, off.translation().norm());
    found.rad = std::max(found.rad, std::abs(Eigen::AngleAxisd(off.linear()).angle()));
  }
  return found;
}

}  // namespace firstlook
