/// One mistake that people make with calibration data, undone.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "algorithms/calibration/calibration_view.hpp"

namespace firstlook {

enum class Mistake : std::uint8_t {
  kFlangePosesInverted,
  kBoardPosesInverted,
  kFlangeRotations,
  kBoardRotations,
  kScale,
  kOrder,
  kPlacements,
  kCornerOrder,
  kImageAxes,
  kIntrinsics,
  kViewsAlike,
  kSingleViews,
};

/// "flange_poses_inverted", as result.json says it.
[[nodiscard]] std::string_view mistake_name(Mistake mistake);

/// How far views contradict each other: the median over them.
struct Misfit {
  double translation_m = 0;
  double rotation_rad = 0;
  /// 0.5 m: a rotation of the flange moves the board in view by about that much for each radian.
  [[nodiscard]] double size_m() const { return translation_m + 0.5 * rotation_rad; }
};

namespace mistakes {

/// The data as it would be without the mistake.
struct Trial {
  Mistake mistake;
  std::string text;  ///< what the mistake is, in words that end before the figures
  std::vector<PosePair> pairs;
  /// How many times better the views must agree without it (from five views on).
  double gain_min = 4;
};

struct Fit {
  Misfit misfit;
  Transform<Flange, Camera> flange_T_camera;
};

/// Misfit of the pairs under their own robust closed form; at most 40 of them, evenly spread, are looked at. Empty when
/// they cannot be solved.
[[nodiscard]] std::optional<Fit> fit_of(std::span<const PosePair> pairs);

/// Every n-th of the pairs, so that at most 40 remain.
[[nodiscard]] std::vector<PosePair> thinned(std::span<const PosePair> pairs);

}  // namespace mistakes
}  // namespace firstlook
