#include "algorithms/calibration/view_spread.hpp"

#include <algorithm>
#include <cmath>

namespace firstlook {

double joint_distance_rad(const JointVector& a, const JointVector& b) {
  double squared = 0;
  for (int j = 0; j < a.size(); ++j) squared += (a[j] - b[j]) * (a[j] - b[j]);
  return std::sqrt(squared);
}

std::vector<std::size_t> spread_views(std::span<const JointVector> configurations, double apart_rad) {
  std::vector<std::size_t> kept;
  for (std::size_t i = configurations.size(); i-- > 0;) {
    const bool apart = std::all_of(kept.begin(), kept.end(), [&](std::size_t k) {
      return joint_distance_rad(configurations[i], configurations[k]) >= apart_rad;
    });
    if (apart) kept.push_back(i);
  }
  std::reverse(kept.begin(), kept.end());
  return kept;
}

}  // namespace firstlook
