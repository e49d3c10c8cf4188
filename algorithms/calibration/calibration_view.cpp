#include "algorithms/calibration/calibration_view.hpp"

#include <algorithm>

namespace firstlook {

int target_count(std::span<const PosePair> pairs) {
  int count = 1;
  for (const PosePair& pair : pairs) count = std::max(count, pair.target + 1);
  return count;
}

std::vector<PosePair> pairs_of_target(std::span<const PosePair> pairs, int target) {
  std::vector<PosePair> own;
  own.reserve(pairs.size());
  for (const PosePair& pair : pairs) {
    if (pair.target == target) own.push_back(pair);
  }
  return own;
}

std::vector<std::size_t> stations_of(std::span<const PosePair> pairs) {
  std::vector<std::size_t> stations;
  stations.reserve(pairs.size());
  std::size_t count = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    std::size_t same = i;
    for (std::size_t j = 0; j < i && pairs[i].station >= 0 && same == i; ++j) {
      if (pairs[j].station == pairs[i].station) same = j;
    }
    stations.push_back(same == i ? count++ : stations[same]);
  }
  return stations;
}

std::size_t station_count(std::span<const std::size_t> stations) {
  return stations.empty() ? 0 : *std::max_element(stations.begin(), stations.end()) + 1;
}

Vector6d pose_difference(const Pose& truth, const Pose& estimate) {
  Vector6d difference;
  difference << truth.translation() - estimate.translation(),
      rotation_log(truth.linear() * estimate.linear().transpose());
  return difference;
}

Pose perturb(const Pose& estimate, const Vector6d& difference) {
  Pose result = Pose::Identity();
  result.linear() = rotation_exp(difference.tail<3>()) * estimate.linear();
  result.translation() = estimate.translation() + difference.head<3>();
  return result;
}

}  // namespace firstlook
