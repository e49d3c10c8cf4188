#include "app/report/ros_files.hpp"

#include <fmt/format.h>

#include <cmath>

#include "algorithms/mapping/moveit_scene.hpp"
#include "algorithms/vision/rotation.hpp"
#include "app/report/yaml_number.hpp"

namespace firstlook {
namespace {

/// -0 prints as "-0"; adding 0 makes it plain.
double plain(double v) { return v + 0.0; }

/// Translation and quaternion in the order x y z qx qy qz qw. Twelve decimals keep a transform to 1e-12 m and a few
/// 1e-12 rad, and fixed-point text is what std::stod, atof, YAML and XML readers all take.
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

/// easy_handeye finds a calibration by the last part of its namespace, and `eye_on_hand` adds the ending. The namespace
/// ends with a slash because easy_handeye puts names of parameters directly behind it.
std::string easy_handeye_yaml(const Numbers& n) {
  return fmt::format(
             "# Hand-eye calibration for easy_handeye (ROS 1), written by firstlook: the pose of {} in {},\n"
             "# metres and quaternion. To publish it:\n"
             "#   mkdir -p ~/.ros/easy_handeye && cp easy_handeye.yaml ~/.ros/easy_handeye/firstlook_eye_on_hand.yaml\n"
             "#   roslaunch easy_handeye publish.launch eye_on_hand:=true namespace_prefix:=firstlook\n",
             kCameraFrame, kFlangeFrame) +
         easy_handeye_parameters("  eye_on_hand: true\n  namespace: /firstlook_eye_on_hand/\n") +
         fmt::format(
             "transformation:\n"
             "  x: {:.12f}\n  y: {:.12f}\n  z: {:.12f}\n  qx: {:.12f}\n  qy: {:.12f}\n  qz: {:.12f}\n  qw: {:.12f}\n",
             n.x, n.y, n.z, n.qx, n.qy, n.qz, n.qw);
}

std::string easy_handeye2_calib(const Numbers& n) {
  return fmt::format(
             "# Hand-eye calibration for easy_handeye2 (ROS 2), written by firstlook: the pose of {} in\n"
             "# {}, metres and quaternion. To publish it:\n"
             "#   mkdir -p ~/.ros2/easy_handeye2/calibrations\n"
             "#   cp easy_handeye2.calib ~/.ros2/easy_handeye2/calibrations/firstlook.calib\n"
             "#   ros2 launch easy_handeye2 publish.launch.py name:=firstlook\n",
             kCameraFrame, kFlangeFrame) +
         easy_handeye_parameters("  name: firstlook\n  calibration_type: eye_in_hand\n") +
         fmt::format(
             "transform:\n"
             "  translation:\n    x: {:.12f}\n    y: {:.12f}\n    z: {:.12f}\n"
             "  rotation:\n    x: {:.12f}\n    y: {:.12f}\n    z: {:.12f}\n    w: {:.12f}\n",
             n.x, n.y, n.z, n.qx, n.qy, n.qz, n.qw);
}

std::string ros1_launch(const Numbers& n) {
  return fmt::format(
      "<!-- Hand-eye calibration, written by firstlook: publishes the pose of {} in {} (metres and\n"
      "     quaternion, in the order x y z qx qy qz qw parent child) in ROS 1. To start it:\n"
      "       roslaunch ./camera_transform.launch\n"
      "     A frame has one parent: when the camera's driver publishes this one itself, use camera.xacro. -->\n"
      "<launch>\n"
      "  <node pkg=\"tf2_ros\" type=\"static_transform_publisher\" name=\"firstlook_camera\"\n"
      "        args=\"{:.12f} {:.12f} {:.12f} {:.12f} {:.12f} {:.12f} {:.12f} {} {}\"/>\n"
      "</launch>\n",
      kCameraFrame, kFlangeFrame, n.x, n.y, n.z, n.qx, n.qy, n.qz, n.qw, kFlangeFrame, kCameraFrame);
}

std::string ros2_launch(const Numbers& n) {
  return fmt::format(
      "# Hand-eye calibration, written by firstlook: publishes the pose of {} in {} (metres and\n"
      "# quaternion) in ROS 2 (Humble and later; before, the publisher knew no names of arguments). To start it:\n"
      "#   ros2 launch ./camera_transform.launch.py\n"
      "# A frame has one parent: when the camera's driver publishes this one itself, use camera.xacro.\n"
      "from launch import LaunchDescription\n"
      "from launch_ros.actions import Node\n\n\n"
      "def generate_launch_description():\n"
      "    return LaunchDescription([\n"
      "        Node(\n"
      "            package='tf2_ros',\n"
      "            executable='static_transform_publisher',\n"
      "            name='firstlook_camera',\n"
      "            arguments=[\n"
      "                '--x', '{:.12f}', '--y', '{:.12f}', '--z', '{:.12f}',\n"
      "                '--qx', '{:.12f}', '--qy', '{:.12f}', '--qz', '{:.12f}', '--qw', '{:.12f}',\n"
      "                '--frame-id', '{}', '--child-frame-id', '{}',\n"
      "            ],\n"
      "        ),\n"
      "    ])\n",
      kCameraFrame, kFlangeFrame, n.x, n.y, n.z, n.qx, n.qy, n.qz, n.qw, kFlangeFrame, kCameraFrame);
}

constexpr std::string_view kXacroHead =
    "<?xml version=\"1.0\"?>\n"
    "<!-- Hand-eye calibration as a part of a robot description, written by firstlook: the pose of\n"
    "     camera_color_optical_frame (z forward, x right, y down) in the parent, by way of camera_link (x forward,\n"
    "     y left, z up: REP 103). In the robot's xacro:\n"
    "       <xacro:include filename=\"/path/to/camera.xacro\"/>\n"
    "       <xacro:firstlook_camera parent=\"tool0\"/>\n"
    "     A frame has one parent: tell the camera's driver not to publish these two itself (publish_tf:=false), or\n"
    "     rename them here when its own tree is to stay. -->\n";

/// tool0 -> camera_link -> camera_color_optical_frame: the second joint is the fixed turn of REP 103, so the first one
/// is chosen such that the whole is the calibrated transform.
std::string xacro(const Transform<Flange, Camera>& flange_T_camera) {
  Eigen::Matrix3d link_R_optical;  // rpy -pi/2 0 -pi/2, without the rounding of sines and cosines
  link_R_optical << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  const Eigen::Vector3d t = flange_T_camera.translation();
  const Eigen::Vector3d rpy = roll_pitch_yaw(flange_T_camera.rotation() * link_R_optical.transpose());
  return std::string(kXacroHead) +
         fmt::format(
             "<robot xmlns:xacro=\"http://www.ros.org/wiki/xacro\">\n"
             "  <xacro:macro name=\"firstlook_camera\" params=\"parent:={}\">\n"
             "    <link name=\"{}\"/>\n"
             "    <joint name=\"firstlook_camera_joint\" type=\"fixed\">\n"
             "      <parent link=\"${{parent}}\"/>\n"
             "      <child link=\"{}\"/>\n"
             "      <origin xyz=\"{:.12f} {:.12f} {:.12f}\" rpy=\"{:.12f} {:.12f} {:.12f}\"/>\n"
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
  return {
      {"collision_map_base_link.scene",
       scene_text(
           turned,
           "firstlook collision map in base_link, the planning frame of a UR: RViz, MotionPlanning, Scene Objects, "
           "Import")},
      {"collision_map_base.scene",
       scene_text(
           occupied,
           "firstlook collision map in base, UR's frame: only where MoveIt plans in base; RViz, MotionPlanning, Scene "
           "Objects, Import")}};
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
  const auto n = yaml_number;
  return fmt::format(
      "# Intrinsics of the colour camera as ROS has them, written by firstlook. To load them, give the camera's "
      "driver\n"
      "#   camera_info_url:=file:///path/to/camera_info.yaml\n"
      "# camera_info_manager warns when its camera has another name, and takes the numbers all the same.\n"
      "image_width: {}\n"
      "image_height: {}\n"
      "camera_name: camera\n"
      "camera_matrix:\n  rows: 3\n  cols: 3\n  data: [{}, 0.0, {}, 0.0, {}, {}, 0.0, 0.0, 1.0]\n"
      "distortion_model: plumb_bob\n"
      "distortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [{}, {}, {}, {}, {}]\n"
      "rectification_matrix:\n  rows: 3\n  cols: 3\n  data: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]\n"
      "projection_matrix:\n  rows: 3\n  cols: 4\n"
      "  data: [{}, 0.0, {}, 0.0, 0.0, {}, {}, 0.0, 0.0, 0.0, 1.0, 0.0]\n",
      c.width, c.height, n(c.fx), n(c.cx), n(c.fy), n(c.cy), n(c.k1), n(c.k2), n(c.p1), n(c.p2), n(c.k3), n(c.fx),
      n(c.cx), n(c.fy), n(c.cy));
}

}  // namespace firstlook
