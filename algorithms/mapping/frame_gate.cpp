#include "algorithms/mapping/frame_gate.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace firstlook {
namespace {

// Depths ten times beyond the sensor's limits are none of its own; a scale that is wrong by 1000 puts nearly all there.
constexpr double kImpossible = 10;
constexpr std::uint16_t kInfinity = std::numeric_limits<std::uint16_t>::max();

}  // namespace

std::string_view to_string(FrameFlaw flaw) {
  constexpr std::array<std::string_view, kFrameFlaws> kWords = {"unreadable",     "wrong_size",      "wrong_scale",
                                                                "bad_pose",       "stamp_backwards", "pose_unknown",
                                                                "pose_uncertain", "frozen"};
  return kWords[static_cast<std::size_t>(flaw)];
}

std::optional<FrameFlaw> FrameGate::inspect(ImageView<std::uint16_t> pixels, double units_per_m,
                                            const Transform<Base, Depth>& base_T_depth, double stamp_s) {
  const CameraIntrinsics& c = sensor_.intrinsics;
  if (pixels.data == nullptr || pixels.width != c.width || pixels.height != c.height) return FrameFlaw::kWrongSize;
  if (!is_rigid(base_T_depth)) return FrameFlaw::kBadPose;
  if (!(stamp_s >= 0) || !std::isfinite(stamp_s) || (last_stamp_s_ && stamp_s <= *last_stamp_s_))
    return FrameFlaw::kStampBackwards;
  for (std::uint16_t& value : pixels.pixels()) {
    if (value != kInfinity) continue;
    value = 0;
    ++infinite_pixels_;
  }
  if (has_wrong_scale(pixels, units_per_m)) return FrameFlaw::kWrongScale;
  last_stamp_s_ = stamp_s;
  return std::nullopt;
}

bool FrameGate::has_wrong_scale(ImageView<std::uint16_t> pixels, double units_per_m) const {
  if (!(units_per_m > 0) || !std::isfinite(units_per_m)) return true;
  const double low = sensor_.range_min_m / kImpossible * units_per_m;
  const double high = sensor_.range_max_m * kImpossible * units_per_m;
  std::size_t returns = 0, impossible = 0;
  for (const std::uint16_t value : pixels.pixels()) {
    if (value == 0) continue;
    ++returns;
    impossible += value < low || value > high ? 1 : 0;
  }
  return 2 * impossible > returns;
}

}  // namespace firstlook
