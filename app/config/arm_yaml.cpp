#include <yaml-cpp/yaml.h>

#include <cmath>
#include <filesystem>
#include <numbers>
#include <set>

#include "algorithms/kinematics/joint_chain.hpp"
#include "app/config/arm_file.hpp"
#include "app/config/arm_naming.hpp"
#include "app/config/nearest_name.hpp"

namespace firstlook {
namespace {

constexpr double kDegree_rad = std::numbers::pi / 180;

/// Leaves the parser of this file; nothing else throws or catches it.
struct ArmFailure {
  Error error;
};

/// One mapping: every key known, every value checked where it stands.
class Mapping {
 public:
  Mapping(const std::string& file, const YAML::Node& node, std::string path, std::vector<std::string_view> keys)
      : file_(file), node_(node), path_(std::move(path)) {
    if (!node_.IsMap()) fail(node_, fmt::format("{} must be a mapping", path_.empty() ? "the arm" : path_));
    std::set<std::string> met;
    for (const auto& entry : node_) {
      const std::string key = entry.first.IsScalar() ? entry.first.Scalar() : std::string();
      if (!met.insert(key).second) fail(entry.first, fmt::format("{} is given twice", inside(key)));
      if (std::ranges::find(keys, key) != keys.end()) continue;
      fail(entry.first, fmt::format("{:.60} is unknown; did you mean {}?", inside(key), nearest_name(key, keys)));
    }
  }
  [[noreturn]] void fail(const YAML::Node& at, const std::string& what) const {
    const YAML::Mark mark = at.Mark();
    throw ArmFailure{
        failure(Fault::kConfigBadValue, "{:.80}:{}:{}: {}", file_, mark.line + 1, mark.column + 1, what).error()};
  }
  [[nodiscard]] bool has(const std::string& key) const { return static_cast<bool>(node_[key]); }
  [[nodiscard]] YAML::Node child(const std::string& key) const {
    if (!has(key)) fail(node_, inside(key) + " is missing");
    return node_[key];
  }
  [[nodiscard]] std::string inside(const std::string& key) const { return path_.empty() ? key : path_ + "." + key; }
  [[nodiscard]] const YAML::Node& node() const { return node_; }
  [[nodiscard]] const std::string& file() const { return file_; }

  [[nodiscard]] double number(const YAML::Node& node, const std::string& key) const {
    double value = 0;
    if (!node.IsScalar() || !YAML::convert<double>::decode(node, value) || !std::isfinite(value)) {
      fail(node, inside(key) + " must be a finite number");
    }
    return value;
  }
  [[nodiscard]] double number_or(const std::string& key, double otherwise) const {
    return has(key) ? number(child(key), key) : otherwise;
  }
  /// KEY_rad or KEY_deg, one of them.
  [[nodiscard]] std::string angle_key(const std::string& key) const {
    if (has(key + "_rad") && has(key + "_deg")) fail(child(key + "_deg"), inside(key) + " stands in rad and in deg");
    return has(key + "_deg") ? key + "_deg" : key + "_rad";
  }
  [[nodiscard]] double angle_or(const std::string& key, double otherwise) const {
    const std::string with_unit = angle_key(key);
    return has(with_unit) ? unit(with_unit) * number(child(with_unit), with_unit) : otherwise;
  }
  [[nodiscard]] double angle(const std::string& key) const {
    if (!has(angle_key(key))) fail(node_, inside(key) + "_deg (or _rad) is missing");
    return angle_or(key, 0);
  }
  [[nodiscard]] std::vector<double> angles(const std::string& key, std::size_t count) const {
    const std::string with_unit = angle_key(key);
    if (!has(with_unit)) fail(node_, inside(key) + "_deg (or _rad) is missing");
    std::vector<double> values = numbers(with_unit, count);
    for (double& value : values) value *= unit(with_unit);
    return values;
  }
  [[nodiscard]] std::vector<double> numbers(const std::string& key, std::size_t count) const {
    const YAML::Node list = child(key);
    if (!list.IsSequence() || list.size() != count) {
      fail(list, fmt::format("{} must be a list of {} numbers", inside(key), count));
    }
    std::vector<double> values;
    for (const auto& item : list) values.push_back(number(item, key));
    return values;
  }
  [[nodiscard]] Eigen::Vector3d point(const std::string& key) const {
    const std::vector<double> v = numbers(key, 3);
    return {v[0], v[1], v[2]};
  }

 private:
  static double unit(const std::string& key) { return key.ends_with("_deg") ? kDegree_rad : 1; }

  const std::string& file_;
  YAML::Node node_;
  std::string path_;
};

void read_rows(const Mapping& root, ArmModel& arm) {
  const YAML::Node rows = root.child("dh");
  if (!rows.IsSequence() || rows.size() < 2 || rows.size() > kJointsMax) {
    root.fail(rows,
              fmt::format("dh must be a list of 2 to {} rows, one for each joint, not {}", kJointsMax, rows.size()));
  }
  arm.joints = static_cast<int>(rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Mapping row(root.file(), rows[i], fmt::format("dh[{}]", i),
                      {"theta_offset_deg", "theta_offset_rad", "d_m", "a_m", "alpha_deg", "alpha_rad", "limits_deg",
                       "limits_rad", "speed_max_deg_s", "speed_max_rad_s"});
    arm.dh[i] = {.theta_offset_rad = row.angle_or("theta_offset", 0),
                 .d_m = row.number_or("d_m", 0),
                 .a_m = row.number_or("a_m", 0),
                 .alpha_rad = row.angle_or("alpha", 0)};
    const std::vector<double> limits = row.angles("limits", 2);
    arm.lower_rad[i] = limits[0];
    arm.upper_rad[i] = limits[1];
    const bool degrees = row.has("speed_max_deg_s");
    const std::string speed = degrees ? "speed_max_deg_s" : "speed_max_rad_s";
    arm.speed_max_rad_s[i] = row.number(row.child(speed), speed) * (degrees ? kDegree_rad : 1);
  }
}

void read_capsules(const Mapping& root, ArmModel& arm) {
  const YAML::Node list = root.child("capsules");
  if (!list.IsSequence() || list.size() == 0 || list.size() > kArmFileCapsulesMax) {
    root.fail(list, fmt::format("capsules must be a list of 1 to {}", kArmFileCapsulesMax));
  }
  for (std::size_t i = 0; i < list.size(); ++i) {
    const Mapping capsule(root.file(), list[i], fmt::format("capsules[{}]", i), {"link", "a_m", "b_m", "radius_m"});
    const double link = capsule.number(capsule.child("link"), "link");
    if (link != std::floor(link) || link < 0 || link > arm.joints) {
      capsule.fail(capsule.child("link"), fmt::format("{} must be a whole number from 0 (the base) to {} (the flange)",
                                                      capsule.inside("link"), arm.joints));
    }
    Capsule c;
    c.link = static_cast<int>(link);
    c.a = capsule.point("a_m");
    c.b = capsule.has("b_m") ? capsule.point("b_m") : c.a;
    c.radius_m = capsule.number(capsule.child("radius_m"), "radius_m") + kBodyPadding_m;
    arm.body.push_back(c);
  }
}

unsigned links_named(const Mapping& root, const ArmFileOptions& options, int joints) {
  unsigned bare = 0;
  std::vector<std::string> words = options.links_without_body;
  if (root.has("links_without_body")) {
    const YAML::Node list = root.child("links_without_body");
    if (!list.IsSequence()) root.fail(list, "links_without_body must be a list of link numbers");
    for (const auto& item : list) words.push_back(item.IsScalar() ? item.Scalar() : std::string());
  }
  for (const std::string& word : words) {
    const bool digit = word.size() == 1 && word[0] >= '0' && word[0] <= '0' + joints;
    if (!digit)
      root.fail(root.node(), fmt::format("links_without_body: '{:.20}' is no link from 0 to {}", word, joints));
    bare |= 1U << (word[0] - '0');
  }
  return bare;
}

ArmFromFile read_arm(const std::string& file, const YAML::Node& node, const ArmFileOptions& options) {
  const Mapping root(file, node, "",
                     {"name", "dh", "capsules", "links_without_body", "acceleration_max_deg_s2",
                      "acceleration_max_rad_s2", "start_deg", "start_rad"});
  ArmFromFile read;
  ArmModel& arm = read.arm;
  std::string name = std::filesystem::path(file).stem().string();
  if (root.has("name")) name = root.child("name").IsScalar() ? root.child("name").Scalar() : std::string();
  if (const Status named = check_arm_name(name, file); !named) throw ArmFailure{named.error()};
  arm.name = name;
  read_rows(root, arm);
  read_capsules(root, arm);
  const bool degrees = root.has("acceleration_max_deg_s2");
  arm.acceleration_max_rad_s2 = degrees ? kDegree_rad * root.number_or("acceleration_max_deg_s2", 0)
                                        : root.number_or("acceleration_max_rad_s2", kUsualAcceleration_rad_s2);
  if (!(arm.acceleration_max_rad_s2 > 0)) root.fail(node, "acceleration_max must be above 0");
  if (root.has("start_deg") || root.has("start_rad")) {
    const std::vector<double> start = root.angles("start", static_cast<std::size_t>(arm.joints));
    arm.start_rad = JointVector::zero(arm.joints);
    for (std::size_t i = 0; i < start.size(); ++i) {
      if (start[i] < arm.lower_rad[i] || start[i] > arm.upper_rad[i]) {
        root.fail(root.child(root.angle_key("start")),
                  fmt::format("start: joint {} lies outside of its limits", i + 1));
      }
      arm.start_rad[static_cast<int>(i)] = start[i];
    }
  }
  const Status sound = check_arm(arm, {}, links_named(root, options, arm.joints));
  if (!sound) throw ArmFailure{failure(sound.error().fault, "{:.80}: {}", file, sound.error().detail()).error()};
  if (const Status complete = complete_arm(arm); !complete) {
    throw ArmFailure{failure(complete.error().fault, "{:.80}: {}", file, complete.error().detail()).error()};
  }
  read.summary = fmt::format("{}: {} joints, {} capsules, from {}", name, arm.joints, arm.body.size(), file);
  return read;
}

}  // namespace

Result<ArmFromFile> parse_arm_yaml(std::string_view yaml, const std::string& name, const ArmFileOptions& options) {
  try {
    return read_arm(name, YAML::Load(std::string(yaml)), options);
  } catch (const ArmFailure& wrong) {
    return std::unexpected(wrong.error);
  } catch (const YAML::Exception& wrong) {
    return failure(Fault::kConfigBadValue, "{:.80}:{}:{}: {}", name, wrong.mark.line + 1, wrong.mark.column + 1,
                   wrong.msg);
  }
}

}  // namespace firstlook
