/// Depth sensors as data: what their makers and those who measured them say. `depth.sensor` of the configuration names
/// one; single keys beside it override single figures.
#pragma once

#include <array>
#include <optional>
#include <string_view>

#include "platform/core/camera_intrinsics.hpp"

namespace firstlook {

/// How a sensor finds depth; decides what its noise, its steps and its shadows look like.
struct SensorPreset {
  std::string_view name;
  CameraIntrinsics intrinsics;   ///< a pinhole from the stated field of view; a device states its own
  double range_min_m = 0;        ///< along the optical axis
  double range_max_m = 0;        ///< distance
  double range_trusted_m = 0;    ///< up to which returns mark surfaces (safety rule 9)
  double noise_floor_m = 0;      ///< standard deviation of a depth: sqrt(noise_floor² + (noise_at_1m z²)²)
  double noise_at_1m_m = 0;      ///< triangulation's part, at 1 m
  double baseline_m = 0;         ///< from the camera to the projector or second camera, along +x; 0: no shadow
  double disparity_step_px = 0;  ///< of triangulation; 0: depth comes in millimetres
  double edge_mixed_share = 0;   ///< of the pixels at an edge, those between the two depths ("flying pixels")
};

/// kinect, xtion, time_of_flight, stereo.
[[nodiscard]] const std::array<SensorPreset, 4>& sensor_presets();
[[nodiscard]] std::array<std::string_view, 4> sensor_preset_names();
[[nodiscard]] std::optional<SensorPreset> find_sensor_preset(std::string_view name);

}  // namespace firstlook
