#include "algorithms/calibration/mistakes/mistake_trial.hpp"

#include "algorithms/calibration/hand_eye_closed_form.hpp"
#include "algorithms/calibration/view_gate.hpp"
#include "platform/core/ensure.hpp"

namespace firstlook {

std::string_view mistake_name(Mistake mistake) {
  switch (mistake) {
    case Mistake::kFlangePosesInverted:
      return "flange_poses_inverted";
    case Mistake::kBoardPosesInverted:
      return "board_poses_inverted";
    case Mistake::kFlangeRotations:
      return "flange_rotations";
    case Mistake::kBoardRotations:
      return "board_rotations";
    case Mistake::kScale:
      return "scale";
    case Mistake::kOrder:
      return "order";
    case Mistake::kPlacements:
      return "placements";
    case Mistake::kCornerOrder:
      return "corner_order";
    case Mistake::kImageAxes:
      return "image_axes";
    case Mistake::kIntrinsics:
      return "intrinsics";
    case Mistake::kViewsAlike:
      return "views_alike";
    case Mistake::kSingleViews:
      return "single_views";
  }
  ENSURE(2410, false);
  return {};
}

namespace mistakes {

std::vector<PosePair> thinned(std::span<const PosePair> pairs) {
  constexpr std::size_t kPairsMax = 40;  // a robust solve grows with the square of their number: 40 take 40 ms
  if (pairs.size() <= kPairsMax) return {pairs.begin(), pairs.end()};
  std::vector<PosePair> some;
  for (std::size_t i = 0; i < kPairsMax; ++i) some.push_back(pairs[i * pairs.size() / kPairsMax]);
  return some;
}

std::optional<Fit> fit_of(std::span<const PosePair> pairs) {
  constexpr double kGate = 6;  // as RefinementOptions
  const std::vector<PosePair> some = thinned(pairs);
  if (some.size() < 3) return std::nullopt;
  const auto hand_eye = robust_closed_form(some, Solver::kParkMartin, kGate);
  if (!hand_eye) return std::nullopt;
  return Fit{median_misfit(some, *hand_eye), *hand_eye};
}

}  // namespace mistakes
}  // namespace firstlook
