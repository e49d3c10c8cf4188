#include "algorithms/calibration/intrinsics_prior.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>

namespace firstlook {
namespace {

constexpr std::array<const char*, 9> kNames = {"fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"};
constexpr Eigen::Index kPinhole = 4;  // fx, fy, cx, cy
constexpr std::array<double, 9> kLensSigma = {0, 0, 0, 0, 1, 2, 0.05, 0.05, 2};

}  // namespace

int count_of(EstimatedIntrinsics estimated) {
  switch (estimated) {
    case EstimatedIntrinsics::kNone:
      return 0;
    case EstimatedIntrinsics::kWithoutK3:
      return 8;
    case EstimatedIntrinsics::kAll:
      return 9;
  }
  return 0;
}

IntrinsicsBelief belief_of(EstimatedIntrinsics estimated, const std::optional<IntrinsicsPrior>& prior) {
  IntrinsicsBelief belief;
  belief.count = count_of(estimated);
  for (Eigen::Index i = 0; i < belief.count; ++i) {
    const bool stated = prior && prior->sigma[i] > 0;
    const double sigma = stated ? prior->sigma[i] : kLensSigma[static_cast<std::size_t>(i)];
    if (stated) belief.mean[i] = intrinsics_vector(prior->camera)[i];
    if (sigma > 0) belief.weight[i] = 1 / (sigma * sigma);
  }
  return belief;
}

std::string untold_distortion(const IntrinsicsBelief& belief, const IntrinsicsVector& sigma) {
  constexpr double kHardlyMore = 0.5;
  std::string names;
  for (Eigen::Index i = kPinhole; i < belief.count; ++i) {
    if (sigma[i] * std::sqrt(belief.weight[i]) <= kHardlyMore) continue;
    names += fmt::format("{}{}", names.empty() ? "" : ", ", kNames[static_cast<std::size_t>(i)]);
  }
  return names;
}

std::string undetermined_intrinsics(const CameraIntrinsics& camera, const IntrinsicsVector& sigma, double share_max) {
  const std::array<double, 4> scale = {camera.fx, camera.fy, static_cast<double>(camera.width),
                                       static_cast<double>(camera.width)};
  std::string names;
  for (Eigen::Index i = 0; i < kPinhole; ++i) {
    const auto at = static_cast<std::size_t>(i);
    if (sigma[i] <= share_max * scale[at]) continue;
    names += fmt::format("{}{} (sigma {:.0f} px)", names.empty() ? "" : ", ", kNames[at], sigma[i]);
  }
  return names;
}

}  // namespace firstlook
