/// The map as a ROS message octomap_msgs/Octomap, for `octomap_server`'s clients, MoveIt and RViz.
#pragma once

#include <string_view>

#include "algorithms/mapping/byte_sink.hpp"
#include "algorithms/mapping/class_reading.hpp"
#include "algorithms/mapping/voxel_map.hpp"

namespace firstlook {

/// What a message says: classes as `.bt` (binary: true), or log-odds as `.ot`.
struct OctomapContent {
  const VoxelMap& map;
  ClassReading binary = nullptr;  ///< how classes are read; null: log-odds
  int depth = 16;                 ///< as write_bt's
  std::string_view frame_id = "base";
};

/// YAML of the message, with a header of the frame alone so that ROS 1 and ROS 2 both take it (their stamps differ):
/// `rostopic pub -l -f FILE TOPIC octomap_msgs/Octomap`, `ros2 topic pub --yaml-file FILE TOPIC
/// octomap_msgs/msg/Octomap`.
void write_octomap_yaml(const OctomapContent& content, ByteSink sink);

/// The message as ROS 1 serialises it (roscpp, rospy's Octomap.deserialize): little-endian, lengths before strings and
/// arrays, sequence number and stamp 0.
void write_octomap_ros1(const OctomapContent& content, ByteSink sink);

/// The message as ROS 2 serialises it (rclpy.serialization.deserialize_message): a CDR little-endian encapsulation
/// (OMG RTPS 2.3, 10.5), then the members aligned to their sizes, strings with their final zero.
void write_octomap_ros2(const OctomapContent& content, ByteSink sink);

}  // namespace firstlook
