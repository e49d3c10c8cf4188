/// Problems for solve_bundle and for Ceres.
#pragma once

#include <cstdint>
#include <vector>

#include "algorithms/calibration/bundle.hpp"
#include "platform/core/random.hpp"
#include "tests/unit/calibration/synthetic_views.hpp"

namespace firstlook::test {

inline Vector6d somewhere(Random& random) {
  Vector6d v;
  for (int i = 0; i < 6; ++i) v[i] = random.uniform(-1, 1);
  return v;
}

/// Numbers of a bundle: views of `board_count` boards side by side with noise, and a start that is off by centimetres
/// and degrees.
struct BundleScene {
  Setup setup;
  std::vector<BoardSpec> boards;
  std::vector<std::vector<Eigen::Vector2d>> corners;
  std::vector<std::vector<double>> weights;
  std::vector<BundleView> views;
  BundleState start;
  BundleNoise noise;

  BundleScene(std::uint64_t seed, std::size_t board_count, int stations, double off) {
    Random random(seed);
    boards.assign(board_count, setup.board);
    corners.reserve(static_cast<std::size_t>(stations) * board_count);
    weights.reserve(corners.capacity());
    std::vector<Pose> base_T_board(board_count, setup.base_T_board);
    for (std::size_t b = 1; b < board_count; ++b) base_T_board[b].translation().y() += 0.12 * static_cast<double>(b);
    for (int s = 0; s < stations; ++s) {
      const Pose flange = flange_for(setup, random_camera_T_board(setup, random));
      const Pose said = perturb(flange, arm_noise(setup.arm_sigma, random));
      for (std::size_t b = 0; b < board_count; ++b) add_view(flange, said, base_T_board[b], b, s, random);
    }
    noise = {setup.corner_sigma_px, setup.arm_sigma};
    start.camera = setup.camera;
    start.flange_T_camera = perturb(setup.flange_T_camera, off * somewhere(random));
    for (const Pose& pose : base_T_board) start.base_T_board.push_back(perturb(pose, off * somewhere(random)));
    start.deviations.assign(static_cast<std::size_t>(stations), Vector6d::Zero());
  }

  void add_view(const Pose& flange, const Pose& said, const Pose& base_T_board, std::size_t board, int station,
                Random& random) {
    auto& seen = corners.emplace_back();
    auto& weight = weights.emplace_back();
    const Pose camera_T_board = (flange * setup.flange_T_camera).inverse(Eigen::Isometry) * base_T_board;
    for (int i = 0; i < setup.board.corners(); ++i) {
      const auto pixel = project(setup.camera, camera_T_board * setup.board.corner(i));
      seen.emplace_back(pixel.value() + setup.corner_sigma_px * Eigen::Vector2d(random.normal(), random.normal()));
      weight.push_back(random.uniform(0.3, 1));
    }
    views.push_back({said, seen, weight, board, static_cast<std::size_t>(station)});
  }
};

}  // namespace firstlook::test
