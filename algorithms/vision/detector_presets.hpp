/// Named settings of detection and pose: ours, and those of the thesis's packages.
#pragma once

#include <optional>
#include <span>
#include <string_view>

#include "algorithms/vision/checkerboard.hpp"
#include "algorithms/vision/pnp.hpp"

namespace firstlook {

struct DetectorPreset {
  std::string_view name;
  DetectionOptions detection;
  PnpOptions pnp;
};

/// `default`; `thesis2014`, the thesis's find_extrinsics with solvePnPRansac; `thesis2014_plain`, the same with
/// solvePnP; `thesis2014_detector2`, its checkerboard_detector2 (all table D-8).
[[nodiscard]] std::span<const DetectorPreset> detector_presets();
[[nodiscard]] std::optional<DetectorPreset> find_detector_preset(std::string_view name);
[[nodiscard]] std::span<const std::string_view> detector_preset_names();

}  // namespace firstlook
