/// The cameras of a simulated cell. They hang on the arm's true pose; pixels are rendered by whoever reads a frame.
#pragma once

#include "hal/api/cameras.hpp"
#include "hal/sim/frame_clock.hpp"
#include "hal/sim/scene_history.hpp"
#include "hal/sim/true_motion.hpp"

namespace firstlook::sim {

/// Where arm and cameras truly are for true joint angles. Thread-safe.
class CameraRig {
 public:
  CameraRig(const ArmModel& model, const CameraMount& mount, const TrueMotion& arm);
  [[nodiscard]] Transform<Base, Camera> base_T_camera(const JointVector& true_joints_rad) const;
  [[nodiscard]] Transform<Base, Depth> base_T_depth(const JointVector& true_joints_rad) const;
  /// What stands in the way of light: the true body with the camera's housing.
  [[nodiscard]] Exposure exposure(const ExposedFrame& frame, std::uint64_t seed) const;

 private:
  ArmModel model_;
  CameraMount mount_;
  Capsules body_;
  const TrueMotion& arm_;
};

/// poll, next_due and counters from the loop thread, read and read_corners from any.
class SimulatedColorCamera final : public hal::ColorCamera {
 public:
  /// @param stated  what it says of itself; pictures are made with the scene's
  SimulatedColorCamera(const FrameTiming& timing, TrueMotion& arm, const CameraRig& rig, const SceneHistory& scenes,
                       const CameraIntrinsics& stated, bool delivers_corners);

  [[nodiscard]] const CameraIntrinsics& intrinsics() const override { return intrinsics_; }
  [[nodiscard]] std::optional<hal::Frame> poll(Instant now) override { return clock_.poll(now); }
  [[nodiscard]] Instant next_due() const override { return clock_.next_due(); }
  [[nodiscard]] hal::StreamCounters counters() const override { return clock_.counters(); }
  [[nodiscard]] Status read(const hal::Frame& frame, MutableGrayImage image) override;
  [[nodiscard]] bool delivers_color() const override { return true; }
  [[nodiscard]] Status read_color(const hal::Frame& frame, ImageView<std::array<std::uint8_t, 3>> image) override;
  [[nodiscard]] std::optional<hal::CornerObservation> read_corners(const hal::Frame& frame, int target) override;

 private:
  FrameClock clock_;
  const CameraRig& rig_;
  const SceneHistory& scenes_;
  CameraIntrinsics intrinsics_;
  std::uint64_t seed_;
  bool delivers_corners_;
};

class SimulatedDepthCamera final : public hal::DepthCamera {
 public:
  SimulatedDepthCamera(const FrameTiming& timing, TrueMotion& arm, const CameraRig& rig, const SceneHistory& scenes,
                       DepthDetail detail);

  [[nodiscard]] const CameraIntrinsics& intrinsics() const override { return intrinsics_; }
  [[nodiscard]] std::optional<hal::Frame> poll(Instant now) override { return clock_.poll(now); }
  [[nodiscard]] Instant next_due() const override { return clock_.next_due(); }
  [[nodiscard]] hal::StreamCounters counters() const override { return clock_.counters(); }
  [[nodiscard]] double units_per_m() const override { return 1000; }
  [[nodiscard]] Status read(const hal::Frame& frame, ImageView<std::uint16_t> image) override;

 private:
  FrameClock clock_;
  const CameraRig& rig_;
  const SceneHistory& scenes_;
  DepthDetail detail_;
  CameraIntrinsics intrinsics_;
  std::uint64_t seed_;
};

}  // namespace firstlook::sim
