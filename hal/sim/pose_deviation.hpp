/// How far an arm's true flange pose lies from its kinematic model: gear, link and encoder errors.
#pragma once

#include <array>
#include <cstdint>

#include "platform/core/joint_vector.hpp"
#include "platform/core/transform.hpp"

namespace firstlook::sim {

/// Standard deviations for each axis (FACTS: a UR5's repeatability is 0.1 mm).
struct DeviationSigmas {
  double translation_m = 1e-4;
  double rotation_rad = 2e-4;
};

/// A smooth random field over configurations, fixed by its seed: one configuration always has one deviation, neighbours
/// have nearly the same, and 0.3 rad away it is another. A sum of cosines of random frequency and phase (random Fourier
/// features, Rahimi and Recht 2007) has the given standard deviation over phases.
class PoseDeviation {
 public:
  PoseDeviation(std::uint64_t seed, const DeviationSigmas& sigmas);
  /// flange (of the model) _T_ flange (true).
  [[nodiscard]] Transform<Flange, Flange> at(const JointVector& q_rad) const;

 private:
  static constexpr std::size_t kWaves = 12;
  struct Wave {
    std::array<double, kJointsMax> frequency{};
    double phase_rad = 0;
  };
  std::array<std::array<Wave, kWaves>, 6> waves_{};  ///< for each of x y z rx ry rz
  DeviationSigmas sigmas_;
};

}  // namespace firstlook::sim
