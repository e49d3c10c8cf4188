#include "algorithms/calibration/board_flips.hpp"

#include <algorithm>
#include <array>
#include <numbers>

#include "algorithms/calibration/hand_eye_closed_form.hpp"
#include "platform/core/random.hpp"

namespace firstlook {
namespace {

/// The board's frame turned by 180 degrees about the board's middle: what reversing the corners does to a pose.
Transform<Board, Board> half_turn(const BoardSpec& board) {
  Pose turn = Pose::Identity();
  turn.linear() = rotation_exp({0, 0, std::numbers::pi});
  turn.translation() = 2 * board.center();
  return Transform<Board, Board>(turn);
}

PosePair turned(const PosePair& pair, const Transform<Board, Board>& turn, bool flip) {
  return flip ? PosePair{pair.base_T_flange, pair.camera_T_board * turn} : pair;
}

struct Choice {
  std::vector<bool> flips;
  double median_m = std::numeric_limits<double>::infinity();
};

/// Every view takes the turn that brings it nearer to where `base_T_board` is.
Choice choose_flips(std::span<const PosePair> pairs, const Transform<Board, Board>& turn,
                    const Transform<Flange, Camera>& flange_T_camera, const Transform<Base, Board>& base_T_board) {
  Choice choice;
  std::vector<double> distances;
  for (const PosePair& pair : pairs) {
    std::array<double, 2> distance{};
    for (const bool flip : {false, true}) {
      const PosePair view = turned(pair, turn, flip);
      const auto seen = view.base_T_flange * flange_T_camera * view.camera_T_board;
      const Vector6d d = pose_difference(seen.pose(), base_T_board.pose());
      distance[flip ? 1 : 0] = d.head<3>().norm() + 0.5 * d.tail<3>().norm();
    }
    choice.flips.push_back(distance[1] < distance[0]);
    distances.push_back(std::min(distance[0], distance[1]));
  }
  std::nth_element(distances.begin(), distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2),
                   distances.end());
  choice.median_m = distances[distances.size() / 2];
  return choice;
}

}  // namespace

std::vector<bool> settle_board_flips(const BoardSpec& board, std::span<const PosePair> pairs) {
  constexpr int kTrials = 40;
  Choice best{std::vector<bool>(pairs.size(), false), std::numeric_limits<double>::infinity()};
  if (pairs.size() < 4) return best.flips;
  const auto turn = half_turn(board);
  Random random(1, 2301);
  for (int trial = 0; trial < kTrials; ++trial) {
    std::array<const PosePair*, 4> four{};
    for (auto& one : four) one = &pairs[static_cast<std::size_t>(random.below(static_cast<int>(pairs.size())))];
    for (unsigned turns = 0; turns < 8; ++turns) {
      std::vector<PosePair> views{*four[0]};
      for (unsigned k = 0; k < 3; ++k) views.push_back(turned(*four[k + 1], turn, (turns >> k & 1U) != 0));
      const auto hand_eye = solve_closed_form(views);
      if (!hand_eye) continue;
      Choice choice = choose_flips(pairs, turn, *hand_eye, mean_board_pose(views, *hand_eye));
      if (choice.median_m < best.median_m) best = std::move(choice);
    }
  }
  if (best.flips.front()) best.flips.flip();
  return best.flips;
}

}  // namespace firstlook
