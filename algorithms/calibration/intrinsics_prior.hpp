/// Which of the camera's intrinsics a refinement solves for, and what is known of them before the views say anything.
#pragma once

#include <optional>
#include <string>

#include "algorithms/vision/camera_model.hpp"
#include "platform/core/camera_intrinsics.hpp"

namespace firstlook {

/// What is solved for beside hand-eye, boards and arm: nothing of the camera; focal lengths, centre, k1, k2, p1, p2; or
/// k3 too, which few lenses need and few views tell.
enum class EstimatedIntrinsics : std::uint8_t { kNone, kWithoutK3, kAll };

/// How many numbers that is: the first ones of IntrinsicsVector.
[[nodiscard]] int count_of(EstimatedIntrinsics estimated);

/// Intrinsics that somebody states with their standard deviations, such as those of a factory's sheet.
struct IntrinsicsPrior {
  CameraIntrinsics camera;
  IntrinsicsVector sigma = IntrinsicsVector::Zero();  ///< 0: nothing is stated of that number
};

/// A Gaussian for each number that is solved for.
struct IntrinsicsBelief {
  int count = 0;  ///< the first so many of IntrinsicsVector are solved for
  IntrinsicsVector mean = IntrinsicsVector::Zero();
  IntrinsicsVector weight = IntrinsicsVector::Zero();  ///< 1 / sigma^2; 0: nothing is known

  /// Half the gradient of the squares that it adds where the camera has these numbers, downwards.
  [[nodiscard]] IntrinsicsVector right(const CameraIntrinsics& camera) const {
    return weight.cwiseProduct(mean - intrinsics_vector(camera));
  }
};

/// What is stated; of distortion of which nothing is stated, what lenses are like (k1 within 1, k2 and k3 within 2, p1
/// and p2 within 0.05, each a sigma around 0): it keeps finite what views of the picture's middle leave open, and
/// weighs nothing against views that tell.
[[nodiscard]] IntrinsicsBelief belief_of(EstimatedIntrinsics estimated, const std::optional<IntrinsicsPrior>& prior);

/// Intrinsics that came of a refinement.
struct IntrinsicsFit {
  int count = 0;  ///< the first so many of IntrinsicsVector were solved for
  Eigen::Matrix<double, 9, 9> covariance = Eigen::Matrix<double, 9, 9>::Zero();  ///< 0 for those that were not
  /// Distortion of which the views say hardly more than lenses do by themselves: "k2, p1"; empty when all is told.
  std::string untold;

  [[nodiscard]] IntrinsicsVector sigma() const { return covariance.diagonal().cwiseMax(0).cwiseSqrt(); }
};

/// Names what is unsure by more than half of what was believed before.
[[nodiscard]] std::string untold_distortion(const IntrinsicsBelief& belief, const IntrinsicsVector& sigma);

/// Names focal lengths and centre whose sigma exceeds a share of the focal length or of the picture's width, with their
/// sigmas: beyond 5 % the linear prediction of the errors ends. Empty when they are told.
[[nodiscard]] std::string undetermined_intrinsics(const CameraIntrinsics& camera, const IntrinsicsVector& sigma,
                                                  double share_max = 0.05);

}  // namespace firstlook
