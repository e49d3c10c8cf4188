/// Other people's hand-eye solvers behind one signature.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "algorithms/calibration/calibration_view.hpp"

namespace firstlook::bench {

struct HandEyePeer {
  std::string name;
  std::string title;
  /// Null: the library is not installed. Empty result: it failed.
  std::optional<Pose> (*solve)(std::span<const PosePair> pairs) = nullptr;
};

/// OpenCV's calibrateHandEye and calibrateRobotWorldHandEye with each of their methods, and ViSP's.
[[nodiscard]] std::span<const HandEyePeer> hand_eye_peers();

}  // namespace firstlook::bench
