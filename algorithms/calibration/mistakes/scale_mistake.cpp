#include "algorithms/calibration/mistakes/scale_mistake.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

namespace firstlook::mistakes {
namespace {

using Matrix3x7d = Eigen::Matrix<double, 3, 7>;
using Vector7d = Eigen::Matrix<double, 7, 1>;
using Matrix7d = Eigen::Matrix<double, 7, 7>;

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Unknown: t_X, s, t_Z.
Matrix3x7d equations_of(const PosePair& pair, const Eigen::Matrix3d& flange_R_camera) {
  const Eigen::Matrix3d r = pair.base_T_flange.rotation();
  Matrix3x7d rows;
  rows.leftCols<3>() = r;
  rows.col(3) = r * flange_R_camera * pair.camera_T_board.translation();
  rows.rightCols<3>() = -Eigen::Matrix3d::Identity();
  return rows;
}

struct UnitRatio {
  double scale;
  const char* text;
};
constexpr std::array<UnitRatio, 6> kUnits = {{
    {1e-3, "the board is in millimetres, the arm in metres"},
    {1e3, "the arm is in millimetres, the board in metres"},
    {1e-2, "the board is in centimetres, the arm in metres"},
    {1e2, "the arm is in centimetres, the board in metres"},
    {0.0254, "the board is in inches, the arm in metres"},
    {1 / 0.0254, "the arm is in inches, the board in metres"},
}};

std::string scale_text(const ScaleEstimate& s, double square_size_m) {
  for (const UnitRatio& unit : kUnits) {
    if (std::abs(s.scale / unit.scale - 1) < 0.05) return unit.text;
  }
  if (square_size_m > 0) {
    return fmt::format("the board's square size is {:.2f} mm, not {:.2f} mm ({:.3f} +- {:.3f} times)",
                       square_size_m * s.scale * 1e3, square_size_m * 1e3, s.scale, s.sigma);
  }
  return fmt::format("the board's size is {:.3f} +- {:.3f} times what its poses were computed with", s.scale, s.sigma);
}

}  // namespace

std::optional<ScaleEstimate> estimate_scale(std::span<const PosePair> pairs, const Eigen::Matrix3d& flange_R_camera) {
  if (pairs.size() < 5) return std::nullopt;
  constexpr int kRounds = 10;
  constexpr double kFloor_m = 1e-5;
  std::vector<double> weight(pairs.size(), 1);
  ScaleEstimate estimate;
  for (int round = 0; round < kRounds; ++round) {
    Matrix7d normal = Matrix7d::Zero();
    Vector7d right = Vector7d::Zero();
    double weights = 0;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const Matrix3x7d rows = equations_of(pairs[i], flange_R_camera);
      normal += weight[i] * rows.transpose() * rows;
      right -= weight[i] * rows.transpose() * pairs[i].base_T_flange.translation();
      weights += weight[i];
    }
    const Vector7d scaling = normal.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    const Eigen::LDLT<Matrix7d> ldlt(scaling.asDiagonal() * normal * scaling.asDiagonal());
    if (ldlt.info() != Eigen::Success || !(ldlt.vectorD().minCoeff() > 1e-9)) return std::nullopt;
    const Vector7d solution = scaling.cwiseProduct(ldlt.solve(scaling.cwiseProduct(right)));
    std::vector<double> misfit;
    double squared = 0;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const Eigen::Vector3d error =
          equations_of(pairs[i], flange_R_camera) * solution + pairs[i].base_T_flange.translation();
      misfit.push_back(error.norm());
      squared += weight[i] * error.squaredNorm();
    }
    const double variance = squared / std::max(1.0, 3 * weights - 7);
    estimate.scale = solution[3];
    estimate.sigma = std::sqrt(variance * ldlt.solve(Vector7d::Unit(3))[3]) * scaling[3];
    const double scale_m = 3 * std::max(kFloor_m, median(misfit));
    for (std::size_t i = 0; i < pairs.size(); ++i) weight[i] = 1 / (1 + std::pow(misfit[i] / scale_m, 4));
  }
  if (!std::isfinite(estimate.scale) || estimate.scale <= 0) return std::nullopt;
  return estimate;
}

std::optional<Trial> scale_trial(std::span<const PosePair> pairs, const Transform<Flange, Camera>& flange_T_camera,
                                 double square_size_m) {
  const auto scale = estimate_scale(thinned(pairs), flange_T_camera.rotation());
  // 0.4 %: what a wrong focal length or a warm printer commonly does; below it the result is good all the same. Ten
  // sigmas: errors of real sets are not independent, and five were reached by sets without this mistake.
  if (!scale || std::abs(scale->scale - 1) < std::max(0.004, 10 * scale->sigma)) return std::nullopt;
  // The scale has a sigma of its own to answer for it: the fall of the misfit only confirms.
  Trial trial{Mistake::kScale, scale_text(*scale, square_size_m), {}, 1.5};
  constexpr double kArmUnit = 5;  // beyond it the arm's numbers, not the board's, are in another unit
  for (const PosePair& pair : pairs) {
    Pose board = pair.camera_T_board.pose(), flange = pair.base_T_flange.pose();
    if (scale->scale > kArmUnit) {
      flange.translation() /= scale->scale;
    } else {
      board.translation() *= scale->scale;
    }
    trial.pairs.push_back({Transform<Base, Flange>(flange), Transform<Camera, Board>(board)});
  }
  return trial;
}

}  // namespace firstlook::mistakes
