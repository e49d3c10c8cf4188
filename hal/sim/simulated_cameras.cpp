#include "hal/sim/simulated_cameras.hpp"

#include "hal/sim/contacts.hpp"
#include "hal/sim/random_streams.hpp"
#include "platform/memory/allocation_guard.hpp"

namespace firstlook::sim {
namespace {

template <typename Image>
Status check_size(const Image& image, const CameraIntrinsics& intrinsics) {
  if (image.data != nullptr && image.width == intrinsics.width && image.height == intrinsics.height) return {};
  return failure(Fault::kFrameRefused, "the image is {} x {}, the sensor {} x {}", image.width, image.height,
                 intrinsics.width, intrinsics.height);
}

}  // namespace

CameraRig::CameraRig(const ArmModel& model, const CameraMount& mount, const TrueMotion& arm)
    : model_(model), mount_(mount), body_(true_capsules(model, mount.link, mount.link_T_camera)), arm_(arm) {}

Transform<Base, Camera> CameraRig::base_T_camera(const JointVector& true_joints_rad) const {
  const auto link = static_cast<std::size_t>(mount_.link);
  const Pose base_T_link = mount_.link == model_.joints ? arm_.true_flange(true_joints_rad).pose()
                                                        : forward(model_, true_joints_rad).base_T_link[link];
  return Transform<Base, Camera>(base_T_link * mount_.link_T_camera);
}

Transform<Base, Depth> CameraRig::base_T_depth(const JointVector& true_joints_rad) const {
  return base_T_camera(true_joints_rad) * mount_.camera_T_depth;
}

Exposure CameraRig::exposure(const ExposedFrame& frame, std::uint64_t seed) const {
  return {place(body_, forward(model_, frame.true_joints_rad)), seed, frame.picture};
}

SimulatedColorCamera::SimulatedColorCamera(const FrameTiming& timing, TrueMotion& arm, const CameraRig& rig,
                                           const SceneHistory& scenes, const CameraIntrinsics& stated,
                                           bool delivers_corners)
    : clock_(timing, arm),
      rig_(rig),
      scenes_(scenes),
      intrinsics_(stated),
      seed_(mix64(timing.seed + kColorNoiseStream)),
      delivers_corners_(delivers_corners) {}

Status SimulatedColorCamera::read(const hal::Frame& frame, MutableGrayImage image) {
  const memory::SimulationScope simulation;
  if (Status status = check_size(image, intrinsics_); !status) return status;
  const Result<ExposedFrame> held = clock_.find(frame);
  if (!held) return std::unexpected(held.error());
  scenes_.at(held->exposed)
      .renderer.render_color(rig_.base_T_camera(held->true_joints_rad), rig_.exposure(*held, seed_), image);
  return {};
}

Status SimulatedColorCamera::read_color(const hal::Frame& frame, ImageView<std::array<std::uint8_t, 3>> image) {
  const memory::SimulationScope simulation;
  if (Status status = check_size(image, intrinsics_); !status) return status;
  const Result<ExposedFrame> held = clock_.find(frame);
  if (!held) return std::unexpected(held.error());
  scenes_.at(held->exposed)
      .renderer.render_rgb(rig_.base_T_camera(held->true_joints_rad), rig_.exposure(*held, seed_), image);
  return {};
}

std::optional<hal::CornerObservation> SimulatedColorCamera::read_corners(const hal::Frame& frame, int target) {
  const memory::SimulationScope simulation;
  if (!delivers_corners_) return std::nullopt;
  const Result<ExposedFrame> held = clock_.find(frame);
  if (!held) return std::nullopt;
  return scenes_.at(held->exposed)
      .renderer.observe_corners(rig_.base_T_camera(held->true_joints_rad), rig_.exposure(*held, seed_),
                                static_cast<std::size_t>(target));
}

SimulatedDepthCamera::SimulatedDepthCamera(const FrameTiming& timing, TrueMotion& arm, const CameraRig& rig,
                                           const SceneHistory& scenes, DepthDetail detail)
    : clock_(timing, arm),
      rig_(rig),
      scenes_(scenes),
      detail_(detail),
      intrinsics_(scenes.at(Instant{}).renderer.depth_intrinsics(detail)),
      seed_(mix64(timing.seed + kDepthNoiseStream)) {}

Status SimulatedDepthCamera::read(const hal::Frame& frame, ImageView<std::uint16_t> image) {
  const memory::SimulationScope simulation;
  if (Status status = check_size(image, intrinsics_); !status) return status;
  const Result<ExposedFrame> held = clock_.find(frame);
  if (!held) return std::unexpected(held.error());
  scenes_.at(held->exposed)
      .renderer.render_depth(rig_.base_T_depth(held->true_joints_rad), rig_.exposure(*held, seed_), detail_, image);
  return {};
}

}  // namespace firstlook::sim
