#include "tests/bench/visp_peer.hpp"

#ifdef BENCH_HAS_VISP
#include <visp3/vision/vpHandEyeCalibration.h>
#endif

namespace firstlook::bench {

#ifdef BENCH_HAS_VISP
namespace {

std::vector<vpHomogeneousMatrix> visp_matrices(const std::vector<Eigen::Isometry3d>& poses) {
  std::vector<vpHomogeneousMatrix> matrices;
  for (const Eigen::Isometry3d& pose : poses) {
    vpHomogeneousMatrix& m = matrices.emplace_back();
    for (unsigned r = 0; r < 3; ++r) {
      for (unsigned c = 0; c < 4; ++c) m[r][c] = pose.matrix()(static_cast<int>(r), static_cast<int>(c));
    }
  }
  return matrices;
}

}  // namespace

bool visp_installed() { return true; }

std::optional<Eigen::Isometry3d> visp_hand_eye(const std::vector<Eigen::Isometry3d>& base_T_flange,
                                               const std::vector<Eigen::Isometry3d>& camera_T_board) {
  vpHomogeneousMatrix m;
  if (vpHandEyeCalibration::calibrate(visp_matrices(camera_T_board), visp_matrices(base_T_flange), m) != 0) {
    return std::nullopt;
  }
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  for (unsigned r = 0; r < 3; ++r) {
    for (unsigned c = 0; c < 4; ++c) pose.matrix()(static_cast<int>(r), static_cast<int>(c)) = m[r][c];
  }
  return pose;
}
#else
bool visp_installed() { return false; }

std::optional<Eigen::Isometry3d> visp_hand_eye(const std::vector<Eigen::Isometry3d>&,
                                               const std::vector<Eigen::Isometry3d>&) {
  return std::nullopt;
}
#endif

}  // namespace firstlook::bench
