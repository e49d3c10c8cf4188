#include "hal/sim/pose_deviation.hpp"

#include <cmath>
#include <numbers>

#include "hal/sim/random_streams.hpp"
#include "platform/core/random.hpp"

namespace firstlook::sim {
namespace {
constexpr double kFrequencySigma_1_rad = 5;  // e-folding of the correlation: 0.3 rad
}

PoseDeviation::PoseDeviation(std::uint64_t seed, const DeviationSigmas& sigmas) : sigmas_(sigmas) {
  Random random(seed, kDeviationStream);
  for (auto& axis : waves_) {
    for (Wave& wave : axis) {
      for (double& frequency : wave.frequency) frequency = kFrequencySigma_1_rad * random.normal();
      wave.phase_rad = random.uniform(0, 2 * std::numbers::pi);
    }
  }
}

Transform<Flange, Flange> PoseDeviation::at(const JointVector& q_rad) const {
  std::array<double, 6> unit{};
  for (std::size_t axis = 0; axis < 6; ++axis) {
    for (const Wave& wave : waves_[axis]) {
      double argument = wave.phase_rad;
      for (std::size_t j = 0; j < wave.frequency.size(); ++j) argument += wave.frequency[j] * q_rad.values[j];
      unit[axis] += std::cos(argument);
    }
    unit[axis] *= std::sqrt(2.0 / kWaves);
  }
  const Eigen::Vector3d translation_m = Eigen::Vector3d(unit[0], unit[1], unit[2]) * sigmas_.translation_m;
  const Eigen::Vector3d turn_rad = Eigen::Vector3d(unit[3], unit[4], unit[5]) * sigmas_.rotation_rad;
  const double angle_rad = turn_rad.norm();
  const Eigen::Quaterniond rotation = angle_rad > 0
                                          ? Eigen::Quaterniond(Eigen::AngleAxisd(angle_rad, turn_rad / angle_rad))
                                          : Eigen::Quaterniond::Identity();
  return Transform<Flange, Flange>(rotation, translation_m);
}

}  // namespace firstlook::sim
