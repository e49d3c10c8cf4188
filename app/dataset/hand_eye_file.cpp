/// The adapter to yaml-cpp for hand_eye.yaml: its types and exceptions end here.
#include "app/dataset/hand_eye_file.hpp"

#include <yaml-cpp/yaml.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <set>

#include "algorithms/calibration/hand_eye_closed_form.hpp"
#include "algorithms/vision/camera_model.hpp"
#include "app/config/nearest_name.hpp"
#include "app/report/ros_files.hpp"
#include "app/report/yaml_number.hpp"
#include "platform/journal/journal.hpp"
#include "platform/linux/files.hpp"

namespace firstlook {
namespace {

constexpr int kFormat = 1;
constexpr std::size_t kFileBytesMax = 1 << 16;
constexpr double kTranslationMax_m = 2;                     // no bracket is longer; millimetres are
constexpr double kSigmaMax_m = 0.02, kSigmaMax_rad = 0.05;  // far beyond any verdict; 0.1 mm taken for metres is 0.1

/// What a file says in a wrong way; turned into an Error where the file is read.
struct Complaint {
  int line = 0;  ///< from 1; 0: of no single line
  std::string text;
};

[[noreturn]] void complain(const YAML::Node& node, std::string text) {
  throw Complaint{node.Mark().is_null() ? 0 : node.Mark().line + 1, std::move(text)};
}

/// A map of which every key must be known, and be there, once. Those in `optional` may be missing.
class Section {
 public:
  Section(const YAML::Node& node, std::string_view name, std::span<const std::string_view> keys,
          std::span<const std::string_view> optional = {})
      : node_(node), name_(name) {
    if (!node.IsMap()) complain(node, name_.empty() ? "not a list of keys and values" : name_ + " must have keys");
    std::set<std::string> seen;
    for (const auto& pair : node) {
      const std::string key = pair.first.IsScalar() ? pair.first.Scalar() : std::string();
      if (std::find(keys.begin(), keys.end(), key) == keys.end() &&
          std::find(optional.begin(), optional.end(), key) == optional.end()) {
        complain(pair.first, fmt::format("unknown key '{:.40}'; did you mean {}?", key, nearest_name(key, keys)));
      }
      if (!seen.insert(key).second) complain(pair.first, fmt::format("{} is given twice", key));
    }
    for (const std::string_view key : keys) {
      if (!seen.contains(std::string(key))) {
        complain(node, fmt::format("no key {}{}: written by an older version, or cut short?", prefix(), key));
      }
    }
  }

  [[nodiscard]] YAML::Node child(std::string_view key) const { return node_[std::string(key)]; }

  [[nodiscard]] std::string text(std::string_view key) const {
    const YAML::Node node = child(key);
    if (!node.IsScalar() || node.Scalar().empty()) complain(node, fmt::format("{}{} must be a word", prefix(), key));
    return node.Scalar();
  }

  [[nodiscard]] double number(std::string_view key, double low, double high) const {
    return number_of(child(key), fmt::format("{}{}", prefix(), key), low, high);
  }

  [[nodiscard]] int whole(std::string_view key, int low, int high) const {
    const double value = number(key, low, high);
    if (value != std::floor(value)) complain(child(key), fmt::format("{}{} must be a whole number", prefix(), key));
    return static_cast<int>(value);
  }

  template <std::size_t N>
  [[nodiscard]] std::array<double, N> numbers(std::string_view key, double low, double high) const {
    const YAML::Node node = child(key);
    if (!node.IsSequence() || node.size() != N) {
      complain(node, fmt::format("{}{} must be a list of {} numbers", prefix(), key, N));
    }
    std::array<double, N> values{};
    for (std::size_t i = 0; i < N; ++i) values[i] = number_of(node[i], fmt::format("{}{}", prefix(), key), low, high);
    return values;
  }

 private:
  [[nodiscard]] std::string prefix() const { return name_.empty() ? std::string() : name_ + "."; }

  static double number_of(const YAML::Node& node, const std::string& what, double low, double high) {
    double value = 0;
    const std::string& text = node.IsScalar() ? node.Scalar() : std::string();
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(value)) {
      complain(node, fmt::format("{} must be a finite number, not '{:.40}'", what, text));
    }
    if (value < low || value > high) {
      complain(node, fmt::format("{} is {}; must be between {} and {}", what, value, low, high));
    }
    return value;
  }

  YAML::Node node_;
  std::string name_;
};

constexpr std::array<std::string_view, 22> kKeys = {
    "format",
    "verdict",
    "arm_model",
    "kinematics",
    "parent_frame",
    "child_frame",
    "translation_m",
    "quaternion_xyzw",
    "sigma_translation_mm",
    "sigma_rotation_mrad",
    "covariance",
    "corner_sigma_px",
    "arm_sigma_mm",
    "arm_sigma_mrad",
    "intrinsics",
    "camera_T_depth",
    "solver",
    "views",
    "views_given",
    "reprojection_rms_px",
    "holdout_rms_px",
    "usable_distance_m",
};
/// Of calibrations that estimated them.
constexpr std::array<std::string_view, 3> kOptionalKeys = {"depth_camera", "color_stamps", "depth_stamps"};
constexpr std::array<std::string_view, 6> kDepthCameraKeys = {"sigma_translation_mm", "sigma_rotation_mrad",
                                                              "depth_scale",          "sigma_depth_scale",
                                                              "stated_translation_m", "stated_quaternion_xyzw"};
constexpr std::array<std::string_view, 2> kStampKeys = {"offset_s", "sigma_s"};
constexpr std::array<std::string_view, 11> kIntrinsicsKeys = {
    "image_width", "image_height", "fx_px", "fy_px", "cx_px", "cy_px", "k1", "k2", "p1", "p2", "k3"};
constexpr std::array<std::string_view, 2> kTransformKeys = {"translation_m", "quaternion_xyzw"};

/// @param prefix of the two keys
template <typename A, typename B>
Transform<A, B> read_transform(const Section& section, std::string_view prefix = {}) {
  const std::string translation = fmt::format("{}translation_m", prefix);
  const std::string quaternion = fmt::format("{}quaternion_xyzw", prefix);
  for (const double value : section.numbers<3>(translation, -1e9, 1e9)) {
    if (std::abs(value) > kTranslationMax_m) {
      complain(section.child(translation),
               fmt::format("{} holds {} m: metres are wanted, that looks like millimetres", translation, value));
    }
  }
  const auto t = section.numbers<3>(translation, -kTranslationMax_m, kTranslationMax_m);
  const auto q = section.numbers<4>(quaternion, -1e9, 1e9);
  const Eigen::Quaterniond rotation(q[3], q[0], q[1], q[2]);
  if (std::abs(rotation.norm() - 1) > 1e-6) {
    complain(section.child(quaternion),
             fmt::format("{} has the norm {:.7g} instead of 1: copy all digits", quaternion, rotation.norm()));
  }
  return {rotation, Eigen::Vector3d(t[0], t[1], t[2])};
}

void check_covariance(const Section& section, const Matrix6d& covariance) {
  const YAML::Node node = section.child("covariance");
  const Vector6d variances = covariance.diagonal();
  if (!(variances.minCoeff() > 0)) complain(node, "covariance has a variance that is not positive");
  const Vector6d sigmas = variances.cwiseSqrt();
  if (sigmas.head<3>().maxCoeff() > kSigmaMax_m || sigmas.tail<3>().maxCoeff() > kSigmaMax_rad) {
    complain(node, fmt::format("covariance says sigmas of {:.3g} m and {:.3g} rad: it must be in m^2 and rad^2",
                               sigmas.head<3>().maxCoeff(), sigmas.tail<3>().maxCoeff()));
  }
  const Matrix6d scaled =
      sigmas.cwiseInverse().asDiagonal() * covariance * sigmas.cwiseInverse().asDiagonal();  // correlations
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < i; ++j) {
      if (std::abs(scaled(i, j) - scaled(j, i)) > 1e-6) {
        complain(node, fmt::format("covariance is not symmetric: row {} column {} is {}, row {} column {} is {}", i + 1,
                                   j + 1, covariance(i, j), j + 1, i + 1, covariance(j, i)));
      }
    }
  }
  const Eigen::LDLT<Matrix6d> pivots(scaled);
  if (pivots.info() != Eigen::Success || !(pivots.vectorD().minCoeff() > 1e-12)) {
    complain(node, "covariance is not positive definite: some correlation is 1 or more");
  }
}

Matrix6d read_covariance(const Section& section) {
  const auto values = section.numbers<36>("covariance", -1e12, 1e12);
  Matrix6d covariance;
  std::size_t next = 0;
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) covariance(i, j) = values[next++];
  }
  check_covariance(section, covariance);
  const auto mm = section.numbers<3>("sigma_translation_mm", 0, 1e9);
  const auto mrad = section.numbers<3>("sigma_rotation_mrad", 0, 1e9);
  for (int i = 0; i < 6; ++i) {
    const auto axis = static_cast<std::size_t>(i % 3);
    const double told = (i < 3 ? mm[axis] : mrad[axis]) * 1e-3, implied = std::sqrt(covariance(i, i));
    if (std::abs(told - implied) > 1e-3 * implied) {
      const std::string_view key = i < 3 ? "sigma_translation_mm" : "sigma_rotation_mrad";
      complain(section.child(key), fmt::format("{} says {:.6g}, the covariance {:.6g}: one of them was changed", key,
                                               told * 1e3, implied * 1e3));
    }
  }
  return (covariance + covariance.transpose()) / 2;
}

CameraIntrinsics read_intrinsics(const YAML::Node& node) {
  const Section s(node, "intrinsics", kIntrinsicsKeys);
  CameraIntrinsics camera;
  camera.width = s.whole("image_width", 1, 8192);
  camera.height = s.whole("image_height", 1, 8192);
  camera.fx = s.number("fx_px", 1, 1e5);
  camera.fy = s.number("fy_px", 1, 1e5);
  camera.cx = s.number("cx_px", -1e5, 1e5);
  camera.cy = s.number("cy_px", -1e5, 1e5);
  camera.k1 = s.number("k1", -100, 100);
  camera.k2 = s.number("k2", -100, 100);
  camera.p1 = s.number("p1", -100, 100);
  camera.p2 = s.number("p2", -100, 100);
  camera.k3 = s.number("k3", -100, 100);
  return camera;
}

std::uint64_t read_checksum(const Section& section) {
  const std::string text = section.text("kinematics");
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, 16);
  if (error != std::errc{} || end != text.data() + text.size() || text.size() != 16) {
    complain(section.child("kinematics"), "kinematics must be 16 hexadecimal digits");
  }
  return value;
}

void require_word(const Section& section, std::string_view key, std::string_view wanted) {
  if (const std::string word = section.text(key); word != wanted) {
    complain(section.child(key), fmt::format("{} is '{:.40}'; only {} can be used", key, word, wanted));
  }
}

void read_depth_mount(const YAML::Node& node, StoredCalibration& c) {
  const Section s(node, "depth_camera", kDepthCameraKeys);
  if (!c.camera_T_depth) complain(node, "depth_camera says how sure camera_T_depth is, which is null");
  c.stated_camera_T_depth = read_transform<Camera, Depth>(s, "stated_");
  DepthMount mount;
  mount.camera_T_depth = *c.camera_T_depth;
  mount.depth_scale = s.number("depth_scale", 0.5, 2);
  const auto mm = s.numbers<3>("sigma_translation_mm", 0, 1000 * kSigmaMax_m);
  const auto mrad = s.numbers<3>("sigma_rotation_mrad", 0, 1000 * kSigmaMax_rad);
  Vector7d sigma;
  sigma << mm[0], mm[1], mm[2], mrad[0], mrad[1], mrad[2], 1e3 * s.number("sigma_depth_scale", 0, 1);
  mount.covariance.diagonal() = (1e-3 * sigma).cwiseAbs2();
  c.depth_mount = mount;
}

std::optional<StoredOffset> read_stamps(const YAML::Node& node, std::string_view name) {
  if (!node) return std::nullopt;
  const Section s(node, name, kStampKeys);
  return StoredOffset{s.number("offset_s", -1, 1), s.number("sigma_s", 0, 1)};
}

StoredCalibration parse(const YAML::Node& root) {
  const Section s(root, "", kKeys, kOptionalKeys);
  if (const int format = s.whole("format", 0, 1000); format != kFormat) {
    complain(s.child("format"), fmt::format("format {} is not known, only {}", format, kFormat));
  }
  StoredCalibration c;
  const std::string verdict = s.text("verdict");
  if (verdict != "accepted" && verdict != "rejected")
    complain(s.child("verdict"), "verdict must be accepted or rejected");
  c.accepted = verdict == "accepted";
  if (!c.accepted) return c;  // its figures are whatever made it be rejected
  if (s.text("parent_frame") == kCameraFrame && s.text("child_frame") == kFlangeFrame) {
    complain(s.child("parent_frame"),
             fmt::format("parent_frame and child_frame are swapped: the pose of {} in {} is wanted, not its inverse",
                         kCameraFrame, kFlangeFrame));
  }
  require_word(s, "parent_frame", kFlangeFrame);
  require_word(s, "child_frame", kCameraFrame);
  c.arm_model = s.text("arm_model");
  c.kinematics = read_checksum(s);
  c.flange_T_camera = read_transform<Flange, Camera>(s);
  c.covariance = read_covariance(s);
  c.corner_sigma_px = s.number("corner_sigma_px", 0, 100);
  c.arm_sigma = {s.number("arm_sigma_mm", 0, 100) * 1e-3, s.number("arm_sigma_mrad", 0, 100) * 1e-3};
  if (!s.child("intrinsics").IsNull()) c.intrinsics = read_intrinsics(s.child("intrinsics"));
  if (const YAML::Node depth = s.child("camera_T_depth"); !depth.IsNull()) {
    c.camera_T_depth = read_transform<Camera, Depth>(Section(depth, "camera_T_depth", kTransformKeys));
  }
  if (const YAML::Node mount = s.child("depth_camera")) read_depth_mount(mount, c);
  c.color_offset = read_stamps(s.child("color_stamps"), "color_stamps");
  c.depth_offset = read_stamps(s.child("depth_stamps"), "depth_stamps");
  c.solver = s.text("solver");
  if (!find_solver(c.solver)) complain(s.child("solver"), fmt::format("solver '{:.40}' is not known", c.solver));
  c.views = s.whole("views", 3, 100000);
  c.views_given = s.whole("views_given", c.views, 100000);
  c.reprojection_rms_px = s.number("reprojection_rms_px", 0, 1e6);
  c.holdout_rms_px = s.child("holdout_rms_px").IsNull() ? 0 : s.number("holdout_rms_px", 0, 1e6);
  c.usable_distance_m = s.number("usable_distance_m", 0, 1e6);
  return c;
}

template <typename Vector>
std::string list(const Vector& v) {
  std::string text;
  for (Eigen::Index i = 0; i < v.size(); ++i) text += fmt::format("{}{}", i == 0 ? "" : ", ", yaml_number(v(i)));
  return "[" + text + "]";
}

/// The one of the two quaternions that people expect.
Eigen::Vector4d quaternion_xyzw(const Eigen::Quaterniond& rotation) {
  const Eigen::Quaterniond q = rotation.normalized();
  return q.w() < 0 ? Eigen::Vector4d(-q.coeffs()) : Eigen::Vector4d(q.coeffs());
}

std::string intrinsics_text(const CameraIntrinsics& k) {
  if (k.width == 0) return "intrinsics: null\n";
  const auto n = yaml_number;
  return fmt::format(
      "intrinsics: {{image_width: {}, image_height: {}, fx_px: {}, fy_px: {}, cx_px: {}, cy_px: {},\n"
      "             k1: {}, k2: {}, p1: {}, p2: {}, k3: {}}}\n",
      k.width, k.height, n(k.fx), n(k.fy), n(k.cx), n(k.cy), n(k.k1), n(k.k2), n(k.p1), n(k.p2), n(k.k3));
}

std::string depth_text(const std::optional<Transform<Camera, Depth>>& camera_T_depth) {
  if (!camera_T_depth) return "camera_T_depth: null\n";
  return fmt::format("camera_T_depth:\n  translation_m: {}\n  quaternion_xyzw: {}\n",
                     list(camera_T_depth->translation()), list(quaternion_xyzw(camera_T_depth->quaternion())));
}

std::string alignment_text(const StoredCalibration& c) {
  std::string text;
  if (c.depth_mount && c.stated_camera_T_depth) {
    const Vector7d sigma = 1e3 * c.depth_mount->covariance.diagonal().cwiseMax(0).cwiseSqrt();
    text += fmt::format(
        "# camera_T_depth was estimated: how sure it is along and about the camera's axes, how much too long depths "
        "are\n"
        "# (1: not), and what its maker states.\n"
        "depth_camera:\n  sigma_translation_mm: {}\n  sigma_rotation_mrad: {}\n  depth_scale: {}\n"
        "  sigma_depth_scale: {}\n  stated_translation_m: {}\n  stated_quaternion_xyzw: {}\n",
        list(Eigen::Vector3d(sigma.head<3>())), list(Eigen::Vector3d(sigma.segment<3>(3))),
        yaml_number(c.depth_mount->depth_scale), yaml_number(1e-3 * sigma[6]),
        list(c.stated_camera_T_depth->translation()), list(quaternion_xyzw(c.stated_camera_T_depth->quaternion())));
  }
  const auto stamps = [&](std::string_view name, const std::optional<StoredOffset>& offset) {
    if (!offset) return;
    text += fmt::format("{}: {{offset_s: {}, sigma_s: {}}} # add to the camera's stamps to have the arm's time\n", name,
                        yaml_number(offset->offset_s), yaml_number(offset->sigma_s));
  };
  stamps("color_stamps", c.color_offset);
  stamps("depth_stamps", c.depth_offset);
  return text;
}

std::string covariance_text(const Matrix6d& covariance) {
  std::string text;
  for (int i = 0; i < 6; ++i) {
    text += i == 0 ? "\n  [" : ",\n   ";
    for (int j = 0; j < 6; ++j) text += fmt::format("{}{}", j == 0 ? "" : ", ", yaml_number(covariance(i, j)));
  }
  return text + "]";
}

}  // namespace

std::uint64_t kinematics_checksum(const ArmModel& arm) {
  constexpr double kSteps = 1e7;  // 0.1 um and 0.1 urad
  Fnv1a hash;
  hash.add(std::as_bytes(std::span(arm.name.view())));
  for (int i = 0; i < arm.joints; ++i) {
    const DhRow& row = arm.dh[static_cast<std::size_t>(i)];
    const auto add = [&hash](double value) {
      const std::int64_t steps = std::llround(value * kSteps);
      hash.add(std::as_bytes(std::span(&steps, 1)));
    };
    for (const double value : {row.theta_offset_rad, row.d_m, row.a_m, row.alpha_rad}) add(value);
    if (row.is_standard()) continue;
    add(row.beta_rad);
    add(row.gamma_rad);
  }
  return hash.value();
}

std::string hand_eye_yaml(const StoredCalibration& c) {
  const Vector6d sigmas = c.covariance.diagonal().cwiseMax(0).cwiseSqrt() * 1e3;
  const auto n = yaml_number;
  std::string text = fmt::format(
      "# Pose of the camera in the flange: p_flange = R p_camera + t. Metres; quaternion x y z w. A later job takes "
      "it\n"
      "# up again: firstlook run --only map --calibration hand_eye.yaml\n"
      "format: {}\n"
      "verdict: {}\n"
      "# It holds for this arm (checksum of its kinematics) and these cameras only.\n"
      "arm_model: {}\n"
      "kinematics: {}\n"
      "parent_frame: {}\n"
      "child_frame: {}\n"
      "translation_m: {}\n"
      "quaternion_xyzw: {}\n",
      kFormat, c.accepted ? "accepted" : "rejected", c.arm_model, hash_text(c.kinematics), kFlangeFrame, kCameraFrame,
      list(c.flange_T_camera.translation()), list(quaternion_xyzw(c.flange_T_camera.quaternion())));
  text += fmt::format(
      "sigma_translation_mm: {}\n"
      "sigma_rotation_mrad: {}\n"
      "# 6 x 6, row by row: translation m, rotation rad; left perturbation in the parent frame.\n"
      "covariance:{}\n"
      "# Noise of a corner and of the arm's pose for each axis, as estimated from the views.\n"
      "corner_sigma_px: {}\n"
      "arm_sigma_mm: {}\n"
      "arm_sigma_mrad: {}\n",
      list(Eigen::Vector3d(sigmas.head<3>())), list(Eigen::Vector3d(sigmas.tail<3>())), covariance_text(c.covariance),
      n(c.corner_sigma_px), n(c.arm_sigma.translation_m * 1e3), n(c.arm_sigma.rotation_rad * 1e3));
  text += intrinsics_text(c.intrinsics) + depth_text(c.camera_T_depth) + alignment_text(c);
  return text + fmt::format(
                    "solver: {}\n"
                    "views: {}\n"
                    "views_given: {}\n"
                    "reprojection_rms_px: {}\n"
                    "holdout_rms_px: {}\n"
                    "usable_distance_m: {}\n",
                    c.solver, c.views, c.views_given, n(c.reprojection_rms_px),
                    c.holdout_rms_px > 0 ? n(c.holdout_rms_px) : "null", n(c.usable_distance_m));
}

Result<StoredCalibration> read_hand_eye(const std::filesystem::path& file) {
  const std::string name = file.string();
  const Result<std::string> text = read_text_file(name, kFileBytesMax);
  if (!text) return std::unexpected(text.error());
  try {
    StoredCalibration calibration = parse(YAML::Load(*text));
    if (!calibration.accepted) {
      return failure(Fault::kStoredCalibration, "{}: rejected by the run that made it", name);
    }
    return calibration;
  } catch (const Complaint& complaint) {
    if (complaint.line == 0) return failure(Fault::kDataMalformed, "{}: {}", name, complaint.text);
    return failure(Fault::kDataMalformed, "{}:{}: {}", name, complaint.line, complaint.text);
  } catch (const YAML::Exception& e) {
    return failure(Fault::kDataMalformed, "{}:{}: {}", name, e.mark.line + 1, e.msg);
  }
}

Status check_belongs(const StoredCalibration& calibration, const ArmModel& arm, const CameraIntrinsics& intrinsics,
                     const Transform<Camera, Depth>& camera_T_depth, bool estimates_intrinsics) {
  constexpr double kSame_px = 0.01, kSameDistortion = 1e-6, kSame_m = 1e-4, kSame_rad = 1e-4;
  if (calibration.arm_model == kUnknownArm) {
    return failure(Fault::kStoredCalibration,
                   "it does not say which arm it was made with: solve it again with `firstlook calibrate --arm {}`",
                   arm.name.view());
  }
  if (calibration.arm_model != arm.name.view()) {
    return failure(Fault::kStoredCalibration, "it was made with the arm {:.20}, this one is {}", calibration.arm_model,
                   arm.name.view());
  }
  if (calibration.kinematics != kinematics_checksum(arm)) {
    return failure(Fault::kStoredCalibration, "it was made with other kinematics of the {}: checksum {}, now {}",
                   arm.name.view(), hash_text(calibration.kinematics), hash_text(kinematics_checksum(arm)));
  }
  const CameraIntrinsics& a = calibration.intrinsics;
  if (a.width == 0) {
    return failure(Fault::kStoredCalibration,
                   "it was solved from pose pairs and does not say what camera it holds for: solve it from images or "
                   "corners");
  }
  const CameraIntrinsics& b = intrinsics;
  if (a.width != b.width || a.height != b.height) {
    return failure(Fault::kStoredCalibration, "it was made with pictures of {}x{}, the camera gives {}x{}", a.width,
                   a.height, b.width, b.height);
  }
  const double px =
      std::max({std::abs(a.fx - b.fx), std::abs(a.fy - b.fy), std::abs(a.cx - b.cx), std::abs(a.cy - b.cy)});
  const double distortion = std::max({std::abs(a.k1 - b.k1), std::abs(a.k2 - b.k2), std::abs(a.p1 - b.p1),
                                      std::abs(a.p2 - b.p2), std::abs(a.k3 - b.k3)});
  if (!estimates_intrinsics && (!(px <= kSame_px) || !(distortion <= kSameDistortion))) {
    return failure(Fault::kStoredCalibration,
                   "it was made with other intrinsics of the colour camera: focal length and centre differ by up to "
                   "{:.3g} px, distortion by {:.3g}; if they were estimated then, set calibration.intrinsics: estimate",
                   px, distortion);
  }
  if (!calibration.camera_T_depth) return {};  // solved without one: nothing in it depends on where that sits
  const Transform<Camera, Depth>& stated = calibration.stated_camera_T_depth.value_or(*calibration.camera_T_depth);
  const Vector6d depth = pose_difference(camera_T_depth.pose(), stated.pose());
  if (!(depth.head<3>().norm() <= kSame_m) || !(depth.tail<3>().norm() <= kSame_rad)) {
    return failure(Fault::kStoredCalibration, "the depth camera sits {:.2f} mm and {:.2f} mrad elsewhere than then",
                   depth.head<3>().norm() * 1e3, depth.tail<3>().norm() * 1e3);
  }
  return {};
}

}  // namespace firstlook
