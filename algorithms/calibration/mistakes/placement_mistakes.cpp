#include "algorithms/calibration/mistakes/placement_mistakes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <numbers>
#include <utility>

#include "algorithms/calibration/hand_eye_closed_form.hpp"
#include "algorithms/calibration/view_gate.hpp"
#include "platform/core/random.hpp"

namespace firstlook::mistakes {
namespace {

using Indices = std::vector<std::size_t>;
constexpr double kDegree = std::numbers::pi / 180;
constexpr std::size_t kGroupMin = 3, kGroupsMax = 4;

double size_of(const Vector6d& d) { return d.head<3>().norm() + 0.5 * d.tail<3>().norm(); }

std::vector<Pose> boards_in_base(std::span<const PosePair> pairs, const Transform<Flange, Camera>& flange_T_camera) {
  std::vector<Pose> boards;
  for (const PosePair& pair : pairs) {
    boards.push_back((pair.base_T_flange * flange_T_camera * pair.camera_T_board).pose());
  }
  return boards;
}

/// Groups of views that put the board at one place, the largest first; what remains outside of them is left out.
std::vector<Indices> groups_of(std::span<const Pose> boards, double radius_m) {
  std::vector<bool> taken(boards.size(), false);
  std::vector<Indices> groups;
  while (groups.size() < kGroupsMax) {
    Indices best;
    for (std::size_t i = 0; i < boards.size(); ++i) {
      if (taken[i]) continue;
      Indices near;
      for (std::size_t j = 0; j < boards.size(); ++j) {
        if (!taken[j] && size_of(pose_difference(boards[j], boards[i])) <= radius_m) near.push_back(j);
      }
      if (near.size() > best.size()) best = std::move(near);
    }
    if (best.size() < kGroupMin) break;
    for (const std::size_t i : best) taken[i] = true;
    groups.push_back(std::move(best));
  }
  return groups;
}

std::size_t members(const std::vector<Indices>& groups) {
  std::size_t count = 0;
  for (const Indices& group : groups) count += group.size();
  return count;
}

struct Grouping {
  Transform<Flange, Camera> flange_T_camera;
  std::vector<Indices> groups;
};

Grouping best_grouping(std::span<const PosePair> pairs) {
  // 30 mm: a hand-eye transform from four views of a good set puts the board no farther apart.
  constexpr double kRadius_m = 0.03;
  constexpr int kTrials = 300;  // four of one group when two groups are as large: 1 in 8
  const std::vector<PosePair> some = thinned(pairs);
  Grouping best;
  Random random(1, 2410);
  for (int trial = 0; trial < kTrials; ++trial) {
    std::array<PosePair, 4> four;
    for (PosePair& one : four) one = some[static_cast<std::size_t>(random.below(static_cast<int>(some.size())))];
    const auto hand_eye = solve_closed_form(four);
    if (!hand_eye) continue;
    auto groups = groups_of(boards_in_base(some, *hand_eye), kRadius_m);
    const std::size_t found = members(groups), had = members(best.groups);
    if (found > had || (found == had && groups.size() < best.groups.size())) best = {*hand_eye, std::move(groups)};
  }
  best.groups = groups_of(boards_in_base(pairs, best.flange_T_camera), kRadius_m);
  return best;
}

std::vector<PosePair> selected(std::span<const PosePair> pairs, const Indices& group) {
  std::vector<PosePair> some;
  for (const std::size_t i : group) some.push_back(pairs[i]);
  return some;
}

/// The board's frames of the groups, each seen from the first one's.
std::vector<Pose> moves_of(std::span<const PosePair> pairs, const Grouping& grouping) {
  std::vector<Pose> moves;
  const Pose first = mean_board_pose(selected(pairs, grouping.groups[0]), grouping.flange_T_camera).pose();
  for (const Indices& group : grouping.groups) {
    moves.push_back(first.inverse(Eigen::Isometry) *
                    mean_board_pose(selected(pairs, group), grouping.flange_T_camera).pose());
  }
  return moves;
}

std::vector<PosePair> moved_together(std::span<const PosePair> pairs, const std::vector<Indices>& groups,
                                     const std::vector<Pose>& moves) {
  std::vector<PosePair> result;
  for (std::size_t g = 0; g < groups.size(); ++g) {
    for (const std::size_t i : groups[g]) {
      const Pose board = pairs[i].camera_T_board.pose() * moves[g].inverse(Eigen::Isometry);
      result.push_back({pairs[i].base_T_flange, Transform<Camera, Board>(board)});
    }
  }
  return result;
}

/// "3, 4, 5, 9"; the first twelve when there are more.
std::string numbers_text(const Indices& views) {
  std::string text;
  for (std::size_t i = 0; i < views.size() && i < 12; ++i) {
    text += fmt::format("{}{}", i == 0 ? "" : ", ", views[i] + 1);
  }
  return views.size() > 12 ? text + " ..." : text;
}

struct Turn {
  Pose pose;
  const char* text;
};

/// What corners in another order do to the pose of a board.
std::vector<Turn> turns_of(const BoardSpec& board) {
  const auto turn = [&](const Eigen::Vector3d& rotation_vector, const char* text) {
    Pose pose = Pose::Identity();
    pose.linear() = rotation_exp(rotation_vector);
    pose.translation() = board.center() - pose.linear() * board.center();
    return Turn{pose, text};
  };
  constexpr double kHalf = std::numbers::pi;
  std::vector<Turn> turns = {turn({0, 0, kHalf}, "reversed (the board upside down)"),
                             turn({0, kHalf, 0}, "mirrored: columns counted from the other side"),
                             turn({kHalf, 0, 0}, "mirrored: rows counted from the other side")};
  if (board.inner_columns == board.inner_rows) {
    turns.push_back(turn({0, 0, kHalf / 2}, "turned by 90 degrees"));
    turns.push_back(turn({0, 0, -kHalf / 2}, "turned by 90 degrees"));
    turns.push_back(turn(Eigen::Vector3d(1, 1, 0).normalized() * kHalf, "transposed: columns for rows"));
  }
  return turns;
}

/// The corner order that moves a board so, within 10 mm and 2 degrees; null when none does.
const char* corner_order(const Pose& move, const BoardSpec* board) {
  if (board == nullptr) return nullptr;
  for (const Turn& turn : turns_of(*board)) {
    const Vector6d d = pose_difference(move, turn.pose);
    const double shift_m = (move * board->center() - board->center()).norm();
    if (shift_m < 0.01 && d.tail<3>().norm() < 2 * kDegree) return turn.text;
  }
  return nullptr;
}

std::string placement_text(const std::vector<Indices>& groups, const std::vector<Pose>& moves, const BoardSpec* board,
                           Mistake& mistake) {
  mistake = Mistake::kCornerOrder;
  std::string text;
  for (std::size_t g = 1; g < groups.size(); ++g) {
    const char* order = corner_order(moves[g], board);
    if (order == nullptr) {
      mistake = Mistake::kPlacements;
      break;
    }
    text += fmt::format("{}the corners of {} views ({}) are {}", g == 1 ? "" : "; ", groups[g].size(),
                        numbers_text(groups[g]), order);
  }
  if (mistake == Mistake::kCornerOrder) return text;
  const Vector6d d = pose_difference(moves[1], Pose::Identity());
  const std::string how_far =
      fmt::format("{:.0f} mm and {:.1f} degrees", d.head<3>().norm() * 1e3, d.tail<3>().norm() / kDegree);
  const bool in_sequence =
      groups.size() == 2 && (groups[0].back() < groups[1].front() || groups[1].back() < groups[0].front());
  if (in_sequence) {
    const bool first_is_earlier = groups[0].front() < groups[1].front();
    return fmt::format("the board or the arm's base was moved after view {}, by {}",
                       (first_is_earlier ? groups[0] : groups[1]).back() + 1, how_far);
  }
  return fmt::format("the views show {} boards, or one board at {} places: views {} another than the rest, {} apart",
                     groups.size(), groups.size(), numbers_text(groups[1]), how_far);
}

/// The pose of the flange that a view's image was taken at.
Pose flange_of(const PosePair& pair, const Transform<Flange, Camera>& flange_T_camera,
               const Transform<Base, Board>& base_T_board) {
  return (base_T_board * (flange_T_camera * pair.camera_T_board).inverse()).pose();
}

struct Tolerance {
  double translation_m, rotation_rad;
  [[nodiscard]] bool takes(const Vector6d& d) const {
    return d.head<3>().norm() < translation_m && d.tail<3>().norm() < rotation_rad;
  }
};

std::string explain_poses(std::span<const PosePair> pairs, std::size_t i, const Pose& seen_from, Tolerance tolerance,
                          const Transform<Flange, Camera>& flange_T_camera,
                          const Transform<Base, Board>& base_T_board) {
  for (std::size_t j = 0; j < pairs.size(); ++j) {
    if (j == i || !tolerance.takes(pose_difference(seen_from, pairs[j].base_T_flange.pose()))) continue;
    const Pose other = flange_of(pairs[j], flange_T_camera, base_T_board);
    if (!tolerance.takes(pose_difference(other, pairs[i].base_T_flange.pose()))) {
      return fmt::format("the image of view {} was taken at the pose of view {}", i + 1, j + 1);
    }
    return i < j ? fmt::format("the poses of views {} and {} are exchanged", i + 1, j + 1) : std::string(" ");
  }
  return {};
}

struct Spread {
  double translation_m = 0, rotation_rad = 0;
  [[nodiscard]] bool within(double limit_m, double limit_rad) const {
    return translation_m < limit_m && rotation_rad < limit_rad;
  }
};

template <typename PoseOf>
Spread spread_of(std::span<const PosePair> pairs, PoseOf pose_of) {
  Spread spread;
  for (const PosePair& pair : pairs) {
    const Vector6d d = pose_difference(pose_of(pair), pose_of(pairs.front()));
    spread.translation_m = std::max(spread.translation_m, d.head<3>().norm());
    spread.rotation_rad = std::max(spread.rotation_rad, d.tail<3>().norm());
  }
  return spread;
}

std::size_t distinct_flange_poses(std::span<const PosePair> pairs) {
  std::vector<Pose> distinct;
  for (const PosePair& pair : pairs) {
    const Pose& pose = pair.base_T_flange.pose();
    const bool known = std::any_of(distinct.begin(), distinct.end(), [&](const Pose& other) {
      return Tolerance{1e-3, 0.1 * kDegree}.takes(pose_difference(pose, other));
    });
    if (!known) distinct.push_back(pose);
  }
  return distinct.size();
}

}  // namespace

std::optional<Trial> placement_trial(std::span<const PosePair> pairs, const BoardSpec* board) {
  constexpr std::size_t kPairsMin = 8;  // two groups of four: each other place costs six unknowns
  if (pairs.size() < kPairsMin) return std::nullopt;
  Grouping grouping = best_grouping(pairs);
  if (grouping.groups.size() < 2 || 10 * members(grouping.groups) < 9 * pairs.size()) return std::nullopt;
  std::vector<Pose> moves;
  std::vector<PosePair> together;
  constexpr int kRounds = 4;
  for (int round = 0; round < kRounds; ++round) {
    moves = moves_of(pairs, grouping);
    together = moved_together(pairs, grouping.groups, moves);
    const auto hand_eye = robust_closed_form(together, Solver::kParkMartin, 6);
    if (!hand_eye) return std::nullopt;
    grouping.flange_T_camera = *hand_eye;
  }
  Trial trial{Mistake::kPlacements, {}, std::move(together)};
  trial.text = placement_text(grouping.groups, moves, board, trial.mistake);
  return trial;
}

std::string explain_left_out(std::span<const PosePair> pairs, const std::vector<bool>& kept,
                             const Transform<Flange, Camera>& flange_T_camera, const BoardSpec* board) {
  std::vector<PosePair> good;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (kept[i]) good.push_back(pairs[i]);
  }
  if (good.size() < 4 || good.size() == pairs.size()) return {};
  const auto base_T_board = mean_board_pose(good, flange_T_camera);
  const Misfit misfit = median_misfit(good, flange_T_camera);
  const Tolerance tolerance{std::clamp(5 * misfit.translation_m, 1e-3, 0.01),
                            std::clamp(5 * misfit.rotation_rad, 2e-3, 0.02)};
  std::string text;
  const auto add = [&](const std::string& words) {
    if (words != " ") text += (text.empty() ? "" : "; ") + words;
  };
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (kept[i]) continue;
    const Pose seen_from = flange_of(pairs[i], flange_T_camera, base_T_board);
    std::string words = explain_poses(pairs, i, seen_from, tolerance, flange_T_camera, base_T_board);
    if (words.empty() && board != nullptr) {
      const Pose seen = (pairs[i].base_T_flange * flange_T_camera * pairs[i].camera_T_board).pose();
      const char* order = corner_order(base_T_board.pose().inverse(Eigen::Isometry) * seen, board);
      if (order != nullptr) words = fmt::format("the corners of view {} are {}", i + 1, order);
    }
    if (!words.empty()) add(words);
  }
  return text;
}

std::string explain_views_alike(std::span<const PosePair> pairs) {
  if (pairs.size() < 3) return {};
  const Spread flange = spread_of(pairs, [](const PosePair& p) -> const Pose& { return p.base_T_flange.pose(); });
  const Spread board = spread_of(pairs, [](const PosePair& p) -> const Pose& { return p.camera_T_board.pose(); });
  // 5 mm and 1 degree: noise of a board's pose from afar; 50 mm or 6 degrees: no arm is off by so much.
  const bool board_still = board.within(5e-3, kDegree);
  if (flange.within(1e-3, 0.1 * kDegree)) {
    if (board_still) {
      return fmt::format("all {} views are one and the same: move and turn the arm between them", pairs.size());
    }
    return fmt::format("the arm says the same pose {} times while the board moves in the images: old poses",
                       pairs.size());
  }
  if (board_still && !flange.within(0.05, 6 * kDegree)) {
    return fmt::format("all {} images are alike while the arm moves: an old image, or camera and board move together",
                       pairs.size());
  }
  const std::size_t distinct = distinct_flange_poses(pairs);
  if (distinct < 3) {
    return fmt::format("{} views from {} poses of the arm only: three that differ are the least", pairs.size(),
                       distinct);
  }
  return {};
}

}  // namespace firstlook::mistakes
