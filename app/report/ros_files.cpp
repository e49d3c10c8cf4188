#include "app/report/ros_files.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "algorithms/mapping/moveit_scene.hpp"

namespace firstlook {
namespace {

/// -0 prints as "-0"; adding 0 makes it plain.
double plain(double v) { return v + 0.0; }

/// Translation and quaternion in the order x y z qx qy qz qw, ten digits: far below what any calibration resolves.
struct Numbers {
  double x, y, z, qx, qy, qz, qw;
};

Numbers numbers_of(const Transform<Flange, Camera>& transform) {
  const Eigen::Vector3d t = transform.translation();
  Eigen::Quaterniond q = transform.quaternion().normalized();
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  return {plain(t.x()), plain(t.y()), plain(t.z()), plain(q.x()), plain(q.y()), plain(q.z()), plain(q.w())};
}

/// What both generations of easy_handeye keep beside the transform. Without `freehand_robot_movement`: the first does
/// not know it in all its versions and refuses keys that it does not know; in the second it is false unless said.
std::string easy_handeye_parameters(std::string_view head) {
  return fmt::format(
      "parameters:\n"
      "{}"
      "  robot_base_frame: base_link\n"
      "  robot_effector_frame: {}\n"
      "  tracking_base_frame: {}\n"
      "  tracking_marker_frame: board\n"
      "  move_group_namespace: /\n"
      "  move_group: manipulator\n",
      head, kFlangeFrame, kCameraFrame);
}

/// easy_handeye finds a calibration by the last part of its namespace, and `eye_on_hand` adds the ending.
std::string easy_handeye_yaml(const Numbers& n) {
  return easy_handeye_parameters("  eye_on_hand: true\n  namespace: /firstlook_eye_on_hand/\n") +
         fmt::format(
             "transformation:\n"
             "  x: {:.10f}\n  y: {:.10f}\n  z: {:.10f}\n  qx: {:.10f}\n  qy: {:.10f}\n  qz: {:.10f}\n  qw: {:.10f}\n",
             n.x, n.y, n.z, n.qx, n.qy, n.qz, n.qw);
}

std::string easy_handeye2_calib(const Numbers& n) {
  return easy_handeye_parameters("  name: firstlook\n  calibration_type: eye_in_hand\n") +
         fmt::format(
             "transform:\n"
             "  translation:\n    x: {:.10f}\n    y: {:.10f}\n    z: {:.10f}\n"
             "  rotation:\n    x: {:.10f}\n    y: {:.10f}\n    z: {:.10f}\n    w: {:.10f}\n",
             n.x, n.y, n.z, n.qx, n.qy, n.qz, n.qw);
}

std::string ros1_launch(const Numbers& n) {
  return fmt::format(
      "<launch>\n"
      "  <node pkg=\"tf2_ros\" type=\"static_transform_publisher\" name=\"firstlook_camera\"\n"
      "        args=\"{:.10f} {:.10f} {:.10f} {:.10f} {:.10f} {:.10f} {:.10f} {} {}\"/>\n"
      "</launch>\n",
      n.x, n.y, n.z, n.qx, n.qy, n.qz, n.qw, kFlangeFrame, kCameraFrame);
}

std::string ros2_launch(const Numbers& n) {
  return fmt::format(
      "from launch import LaunchDescription\n"
      "from launch_ros.actions import Node\n\n\n"
      "def generate_launch_description():\n"
      "    return LaunchDescription([\n"
      "        Node(\n"
      "            package='tf2_ros',\n"
      "            executable='static_transform_publisher',\n"
      "            name='firstlook_camera',\n"
      "            arguments=[\n"
      "                '--x', '{:.10f}', '--y', '{:.10f}', '--z', '{:.10f}',\n"
      "                '--qx', '{:.10f}', '--qy', '{:.10f}', '--qz', '{:.10f}', '--qw', '{:.10f}',\n"
      "                '--frame-id', '{}', '--child-frame-id', '{}',\n"
      "            ],\n"
      "        ),\n"
      "    ])\n",
      n.x, n.y, n.z, n.qx, n.qy, n.qz, n.qw, kFlangeFrame, kCameraFrame);
}

/// tool0 -> camera_link -> camera_color_optical_frame: the second joint is the fixed turn of REP 103, so the first one
/// is chosen such that the whole is the calibrated transform.
std::string xacro(const Transform<Flange, Camera>& flange_T_camera) {
  constexpr double kQuarter = std::numbers::pi / 2;
  Pose link_T_optical = Pose::Identity();
  link_T_optical.linear() =
      (Eigen::AngleAxisd(-kQuarter, Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(-kQuarter, Eigen::Vector3d::UnitX()))
          .toRotationMatrix();
  const Pose flange_T_link = flange_T_camera.pose() * link_T_optical.inverse(Eigen::Isometry);
  const Eigen::Vector3d t = flange_T_link.translation();
  const Eigen::Vector3d rpy = roll_pitch_yaw(flange_T_link.linear());
  return fmt::format(
      "<?xml version=\"1.0\"?>\n"
      "<robot xmlns:xacro=\"http://www.ros.org/wiki/xacro\">\n"
      "  <xacro:macro name=\"firstlook_camera\" params=\"parent:={}\">\n"
      "    <link name=\"{}\"/>\n"
      "    <joint name=\"firstlook_camera_joint\" type=\"fixed\">\n"
      "      <parent link=\"${{parent}}\"/>\n"
      "      <child link=\"{}\"/>\n"
      "      <origin xyz=\"{:.10f} {:.10f} {:.10f}\" rpy=\"{:.10f} {:.10f} {:.10f}\"/>\n"
      "    </joint>\n"
      "    <link name=\"{}\"/>\n"
      "    <joint name=\"firstlook_camera_optical_joint\" type=\"fixed\">\n"
      "      <parent link=\"{}\"/>\n"
      "      <child link=\"{}\"/>\n"
      "      <origin xyz=\"0 0 0\" rpy=\"${{-pi/2}} 0 ${{-pi/2}}\"/>\n"
      "    </joint>\n"
      "  </xacro:macro>\n"
      "</robot>\n",
      kFlangeFrame, kCameraLinkFrame, kCameraLinkFrame, plain(t.x()), plain(t.y()), plain(t.z()), plain(rpy.x()),
      plain(rpy.y()), plain(rpy.z()), kCameraFrame, kCameraLinkFrame, kCameraFrame);
}

std::string scene_text(std::span<const AxisBox> boxes, std::string_view name) {
  std::string text;
  const auto append = [&text](std::span<const std::byte> bytes) {
    text.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  };
  write_moveit_scene(boxes, name, append);
  return text;
}

}  // namespace

std::vector<NamedFile> ros_calibration_files(const Transform<Flange, Camera>& flange_T_camera) {
  const Numbers n = numbers_of(flange_T_camera);
  return {{"easy_handeye.yaml", easy_handeye_yaml(n)},
          {"easy_handeye2.calib", easy_handeye2_calib(n)},
          {"camera_transform.launch", ros1_launch(n)},
          {"camera_transform.launch.py", ros2_launch(n)},
          {"camera.xacro", xacro(flange_T_camera)}};
}

std::vector<NamedFile> ros_scene_files(std::span<const AxisBox> occupied) {
  std::vector<AxisBox> turned;
  turned.reserve(occupied.size());
  for (const AxisBox& box : occupied) {
    turned.push_back(
        {{-box.high_m.x(), -box.high_m.y(), box.low_m.z()}, {-box.low_m.x(), -box.low_m.y(), box.high_m.z()}});
  }
  return {{"collision_map_base_link.scene", scene_text(turned, "firstlook collision map in base_link")},
          {"collision_map_base.scene", scene_text(occupied, "firstlook collision map in base")}};
}

std::string ros2_static_transform_command(const Transform<Flange, Camera>& flange_T_camera) {
  const Numbers n = numbers_of(flange_T_camera);
  return fmt::format(
      "ros2 run tf2_ros static_transform_publisher \\\n"
      "  --x {:.6f} --y {:.6f} --z {:.6f} \\\n"
      "  --qx {:.7f} --qy {:.7f} --qz {:.7f} --qw {:.7f} \\\n"
      "  --frame-id {} --child-frame-id {}",
      n.x, n.y, n.z, n.qx, n.qy, n.qz, n.qw, kFlangeFrame, kCameraFrame);
}

std::string ur_pose_text(const Transform<Flange, Camera>& flange_T_camera) {
  const Eigen::Vector3d t = flange_T_camera.translation();
  const Eigen::AngleAxisd turn(flange_T_camera.rotation());
  const Eigen::Vector3d r = turn.angle() * turn.axis();
  return fmt::format("p[{:.6f}, {:.6f}, {:.6f}, {:.7f}, {:.7f}, {:.7f}]", plain(t.x()), plain(t.y()), plain(t.z()),
                     plain(r.x()), plain(r.y()), plain(r.z()));
}

std::string camera_info_yaml(const CameraIntrinsics& c) {
  return fmt::format(
      "image_width: {}\n"
      "image_height: {}\n"
      "camera_name: camera\n"
      "camera_matrix:\n  rows: 3\n  cols: 3\n  data: [{}, 0.0, {}, 0.0, {}, {}, 0.0, 0.0, 1.0]\n"
      "distortion_model: plumb_bob\n"
      "distortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [{}, {}, {}, {}, {}]\n"
      "rectification_matrix:\n  rows: 3\n  cols: 3\n  data: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]\n"
      "projection_matrix:\n  rows: 3\n  cols: 4\n"
      "  data: [{}, 0.0, {}, 0.0, 0.0, {}, {}, 0.0, 0.0, 0.0, 1.0, 0.0]\n",
      c.width, c.height, c.fx, c.cx, c.fy, c.cy, c.k1, c.k2, c.p1, c.p2, c.k3, c.fx, c.cx, c.fy, c.cy);
}

Eigen::Vector3d roll_pitch_yaw(const Eigen::Matrix3d& r) {
  const double horizontal = std::hypot(r(0, 0), r(1, 0));
  const double pitch = std::atan2(-r(2, 0), horizontal);
  if (horizontal < 1e-9) return {std::atan2(-r(1, 2), r(1, 1)), pitch, 0.0};
  return {std::atan2(r(2, 1), r(2, 2)), pitch, std::atan2(r(1, 0), r(0, 0))};
}

}  // namespace firstlook
