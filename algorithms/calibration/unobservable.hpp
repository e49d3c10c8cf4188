/// What the motion of the arm leaves open of the hand-eye transform, whatever the camera saw.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "algorithms/calibration/calibration_view.hpp"

namespace firstlook {

/// Changes of flange_T_camera that no view shows: displacements C of the flange with A C = C A for all its motions A.
/// With A X = X B, C X then solves as well as X (Chen 1991 in screws).
struct Unobservable {
  std::vector<Eigen::Vector3d> translations;  ///< unit directions in the flange, orthogonal
  struct Turn {
    Eigen::Vector3d axis;     ///< unit vector in the flange
    Eigen::Vector3d point_m;  ///< of its line, the nearest to the flange's origin
  };
  std::vector<Turn> turns;

  [[nodiscard]] int parameters() const { return static_cast<int>(translations.size() + turns.size()); }
};

/// Motions between all views of the same target; a direction counts as shown when the flange's motions change it by 1
/// degree RMS (or a turn's line by 5 mm).
[[nodiscard]] Unobservable unobservable_of(std::span<const PosePair> pairs);

/// "its position along (0.00, 0.00, 1.00) and its turn about ... of the flange are not determined"; empty when
/// everything is.
[[nodiscard]] std::string unobservable_text(const Unobservable& unobservable);

}  // namespace firstlook
