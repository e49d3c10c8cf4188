/// Names the mistake that people most likely made with calibration data that does not fit.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "algorithms/calibration/calibration_view.hpp"
#include "algorithms/calibration/mistakes/mistake_trial.hpp"
#include "algorithms/vision/target.hpp"
#include "platform/core/camera_intrinsics.hpp"

namespace firstlook {

/// A mistake without which the views agree far better.
struct LikelyMistake {
  Mistake mistake;
  std::string text;              ///< one sentence: what it is, and the misfit as given and without it
  std::optional<Misfit> before;  ///< as given; empty when that could not be solved at all
  std::optional<Misfit> after;   ///< with the mistake undone; empty when nothing can undo it
};

struct MistakeSearch {
  std::optional<LikelyMistake> found;
  int tried = 0;  ///< mistakes undone
  std::optional<Misfit> as_given;

  /// What was found, or that none of those tried explains the data.
  [[nodiscard]] std::string sentence() const;
};

/// Undoes the usual mistakes one at a time on a copy and names the one under which the views agree at least four times
/// better and within 20 mm (ten times with fewer than five views); of several as good the simplest. The data itself is
/// never changed. For data that is rejected or cannot be solved; 0.5 to 2 s.
/// `board`: of views that came from images or corners; null for pose pairs.
[[nodiscard]] MistakeSearch find_likely_mistake(std::span<const PosePair> pairs, const BoardSpec* board = nullptr);

/// The same with what only corners can tell: their order, mirrored images, wrong intrinsics.
[[nodiscard]] MistakeSearch find_likely_mistake(const CameraIntrinsics& camera, const BoardSpec& board,
                                                std::span<const CalibrationView> views);

}  // namespace firstlook
