/// Frame-tagged rigid transforms: `base_T_camera = base_T_flange * flange_T_camera` compiles, the wrong order does not.
#pragma once

#include <Eigen/Geometry>

namespace firstlook {

// The frames of ARCHITECTURE.md, as types without members.
struct Base {};      ///< the robot controller's base; also the map's frame
struct BaseLink {};  ///< ROS base_link: Base turned by 180 degrees about z
struct Flange {};    ///< tool0 of the arm
struct Camera {};    ///< colour camera, optical: z forward, x right, y down
struct Depth {};     ///< depth camera, optical
struct Board {};     ///< calibration board: origin at the first inner corner, x along columns, y along rows

/// A rigid motion as rotation and translation, without frames. For algebra where frames are parameters.
using Pose = Eigen::Isometry3d;

/// The pose of frame B in frame A: maps coordinates of B to coordinates of A. Metres.
template <typename A, typename B>
class Transform {
 public:
  Transform() : pose_(Pose::Identity()) {}
  explicit Transform(const Pose& pose) : pose_(pose) {}
  Transform(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& translation_m) : pose_(Pose::Identity()) {
    pose_.linear() = rotation.normalized().toRotationMatrix();
    pose_.translation() = translation_m;
  }

  [[nodiscard]] const Pose& pose() const { return pose_; }
  [[nodiscard]] Eigen::Vector3d translation() const { return pose_.translation(); }
  [[nodiscard]] Eigen::Matrix3d rotation() const { return pose_.linear(); }
  [[nodiscard]] Eigen::Quaterniond quaternion() const { return Eigen::Quaterniond(pose_.linear()); }
  [[nodiscard]] Transform<B, A> inverse() const { return Transform<B, A>(pose_.inverse(Eigen::Isometry)); }

  /// A point given in B, expressed in A.
  [[nodiscard]] Eigen::Vector3d operator*(const Eigen::Vector3d& point_in_b) const { return pose_ * point_in_b; }

  template <typename C>
  [[nodiscard]] Transform<A, C> operator*(const Transform<B, C>& b_T_c) const {
    return Transform<A, C>(pose_ * b_T_c.pose());
  }

 private:
  Pose pose_;
};

}  // namespace firstlook
