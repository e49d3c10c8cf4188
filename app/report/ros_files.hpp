/// The calibration and the map in the shapes that ROS tools read.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "algorithms/mapping/voxel_map.hpp"
#include "platform/core/camera_intrinsics.hpp"
#include "platform/core/transform.hpp"

namespace firstlook {

/// ROS names of our frames (ur_description, REP 103).
inline constexpr std::string_view kFlangeFrame = "tool0";
inline constexpr std::string_view kCameraFrame = "camera_color_optical_frame";
inline constexpr std::string_view kCameraLinkFrame = "camera_link";  ///< x forward, z up

/// A file of a folder: name relative to it, whole text.
struct NamedFile {
  std::string name;
  std::string text;
};

/// easy_handeye (ROS 1) and easy_handeye2 calibrations, static transforms as launch files for ROS 1 and ROS 2 (the
/// order and the names of tf2_ros static_transform_publisher's arguments), and a xacro with REP 103's camera_link, all
/// of the same transform to 1e-11; each says at its top what it is and how to load it.
[[nodiscard]] std::vector<NamedFile> ros_calibration_files(const Transform<Flange, Camera>& flange_T_camera);

/// MoveIt planning scenes of occupied boxes given in the controller's base: one in `base_link` (what MoveIt plans in on
/// a UR; turned by 180 degrees about z) and one in `base`.
[[nodiscard]] std::vector<NamedFile> ros_scene_files(std::span<const AxisBox> occupied);

/// The command that publishes the transform in a running ROS 2, ready to paste.
[[nodiscard]] std::string ros2_static_transform_command(const Transform<Flange, Camera>& flange_T_camera);

/// "p[x, y, z, rx, ry, rz]" as URScript has poses: metres and rotation vector.
[[nodiscard]] std::string ur_pose_text(const Transform<Flange, Camera>& flange_T_camera);

/// camera_info.yaml as camera_calibration_parsers reads and writes it: plumb_bob, no rectification.
[[nodiscard]] std::string camera_info_yaml(const CameraIntrinsics& camera);

}  // namespace firstlook
