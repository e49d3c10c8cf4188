#include "algorithms/vision/detector_presets.hpp"

#include <algorithm>
#include <array>

namespace firstlook {
namespace {

/// cv::cornerSubPix takes half of the window: "search window (11, 11)" of table D-8 is passed as it stands, as the
/// packages passed it.
constexpr DetectionOptions thesis_detection(int half_window_px, int iterations, double step_px) {
  DetectionOptions options;
  options.fixed_half_window_px = half_window_px;
  options.refinement_iterations = iterations;
  options.refinement_step_px = step_px;
  return options;
}

const std::array<DetectorPreset, 4> kPresets = {
    {{"default", {}, {}},
     {"thesis2014", thesis_detection(11, 30, 0.1), {PnpMethod::kIterative, RansacOptions{100, 8.0, 10}}},
     {"thesis2014_plain", thesis_detection(11, 30, 0.1), {PnpMethod::kIterative, std::nullopt}},
     {"thesis2014_detector2", thesis_detection(5, 20, 0.01), {PnpMethod::kIterative, std::nullopt}}}};

constexpr std::array<std::string_view, 4> kNames = {"default", "thesis2014", "thesis2014_plain",
                                                    "thesis2014_detector2"};

}  // namespace

std::span<const DetectorPreset> detector_presets() { return kPresets; }
std::span<const std::string_view> detector_preset_names() { return kNames; }

std::optional<DetectorPreset> find_detector_preset(std::string_view name) {
  const auto* const found = std::ranges::find(kPresets, name, &DetectorPreset::name);
  if (found == kPresets.end()) return std::nullopt;
  return *found;
}

}  // namespace firstlook
