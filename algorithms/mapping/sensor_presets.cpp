#include "algorithms/mapping/sensor_presets.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace firstlook {
namespace {

double focal_px(int pixels, double field_of_view_deg) {
  return pixels / 2.0 / std::tan(field_of_view_deg / 2 * std::numbers::pi / 180);
}

CameraIntrinsics pinhole(int width, int height, double fx, double fy) {
  return {width, height, fx, fy, (width - 1) / 2.0, (height - 1) / 2.0};
}

}  // namespace

const std::array<SensorPreset, 4>& sensor_presets() {
  static const std::array<SensorPreset, 4> presets = {{
      // The first Kinect. Ranges of the thesis (0.5 to 5 m, 3 m recommended); field of view 57 degrees, projector
      // 75 mm beside the camera. Random error 2.85 mm at 1 m, growing with z², 1/8 px of disparity: Khoshelham and
      // Elberink 2012, "Accuracy and resolution of Kinect depth data".
      {.name = "kinect",
       .intrinsics = pinhole(640, 480, focal_px(640, 57), focal_px(640, 57)),
       .range_min_m = 0.5,
       .range_max_m = 5.0,
       .range_trusted_m = 3.0,
       .noise_at_1m_m = 0.00285,
       .baseline_m = 0.075,
       .disparity_step_px = 0.125,
       .edge_mixed_share = 0.15},
      // Asus Xtion Pro Live, data sheet: 0.8 to 3.5 m, 58 x 45 degrees. The same PrimeSense chip, baseline and
      // disparity as the Kinect (Boehm 2014, "Accuracy investigation for structured-light based consumer 3D sensors").
      {.name = "xtion",
       .intrinsics = pinhole(640, 480, focal_px(640, 58), focal_px(480, 45)),
       .range_min_m = 0.8,
       .range_max_m = 3.5,
       .range_trusted_m = 3.0,
       .noise_at_1m_m = 0.00285,
       .baseline_m = 0.075,
       .disparity_step_px = 0.125,
       .edge_mixed_share = 0.15},
      // The second Kinect, data sheet: 512 x 424, 70.6 x 60 degrees, 0.5 to 4.5 m. Axial noise 1.5 - 0.5 z + 0.3 z² mm
      // (Fankhauser et al. 2015, "Kinect v2 for mobile robot navigation: evaluation and modeling"), within 0.1 mm from
      // 1 to 4 m of the form here. Depths across an edge are mixed, not lost (Sarbolandi et al. 2015).
      {.name = "time_of_flight",
       .intrinsics = pinhole(512, 424, focal_px(512, 70.6), focal_px(424, 60)),
       .range_min_m = 0.5,
       .range_max_m = 4.5,
       .range_trusted_m = 4.0,
       .noise_floor_m = 0.0013,
       .noise_at_1m_m = 0.00026,
       .edge_mixed_share = 0.4},
      // Intel RealSense D435 at 848 x 480, data sheet: 87 x 58 degrees, baseline 50 mm, from 0.2 m to 10 m. Noise
      // z² x 0.08 px / (f b) (Grunnet-Jepsen et al., "Tuning depth cameras for best performance"), steps of 1/32 px.
      {.name = "stereo",
       .intrinsics = pinhole(848, 480, focal_px(848, 87), focal_px(480, 58)),
       .range_min_m = 0.2,
       .range_max_m = 10.0,
       .range_trusted_m = 3.0,
       .noise_at_1m_m = 0.00358,
       .baseline_m = 0.05,
       .disparity_step_px = 0.03125,
       .edge_mixed_share = 0.25},
  }};
  return presets;
}

std::array<std::string_view, 4> sensor_preset_names() {
  std::array<std::string_view, 4> names;
  std::ranges::transform(sensor_presets(), names.begin(), &SensorPreset::name);
  return names;
}

std::optional<SensorPreset> find_sensor_preset(std::string_view name) {
  const auto found = std::ranges::find(sensor_presets(), name, &SensorPreset::name);
  return found == sensor_presets().end() ? std::nullopt : std::optional(*found);
}

}  // namespace firstlook
