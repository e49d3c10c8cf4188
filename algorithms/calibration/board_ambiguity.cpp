#include "algorithms/calibration/board_ambiguity.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "algorithms/calibration/hand_eye_closed_form.hpp"
#include "algorithms/vision/rotation.hpp"
#include "platform/core/random.hpp"

namespace firstlook {
namespace {

using Indices = std::vector<std::size_t>;

struct Agreement {
  Indices choices;
  double median_m = std::numeric_limits<double>::infinity();
};

PosePair chosen(const OpenView& view, std::size_t choice) {
  return {view.base_T_flange, view.choices[choice].camera_T_board};
}

/// Every view takes the choice that brings it nearest to where `base_T_board` is.
Agreement agree(std::span<const OpenView> views, const Transform<Flange, Camera>& flange_T_camera,
                const Transform<Base, Board>& base_T_board) {
  constexpr double kLever_m = 0.5;  // at which a turn counts like a shift
  Agreement agreement;
  std::vector<double> distances;
  for (const OpenView& view : views) {
    std::size_t nearest = 0;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t c = 0; c < view.choices.size(); ++c) {
      const auto seen = view.base_T_flange * flange_T_camera * view.choices[c].camera_T_board;
      const Vector6d d = pose_difference(seen.pose(), base_T_board.pose());
      const double distance = d.head<3>().norm() + kLever_m * d.tail<3>().norm();
      if (distance < least) nearest = c, least = distance;
    }
    agreement.choices.push_back(nearest);
    distances.push_back(least);
  }
  const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
  std::nth_element(distances.begin(), middle, distances.end());
  agreement.median_m = *middle;
  return agreement;
}

bool any_open(std::span<const OpenView> views) {
  return std::any_of(views.begin(), views.end(), [](const OpenView& v) { return v.choices.size() > 1; });
}

/// Which way round all views are together cannot be told: the first stays as it was seen.
void keep_first_as_seen(std::span<const OpenView> views, Indices& choices) {
  if (!views[0].choices[choices[0]].reversed) return;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const PoseChoice& now = views[v].choices[choices[v]];
    for (std::size_t c = 0; c < views[v].choices.size(); ++c) {
      const PoseChoice& turned = views[v].choices[c];
      if (turned.other != now.other || turned.reversed == now.reversed) continue;
      choices[v] = c;
      break;
    }
  }
}

/// Four different views, at random.
std::array<std::size_t, 4> some_four(std::size_t count, Random& random) {
  std::array<std::size_t, 4> four{};
  for (std::size_t k = 0; k < four.size();) {
    four[k] = static_cast<std::size_t>(random.below(static_cast<int>(count)));
    if (std::find(four.begin(), four.begin() + static_cast<std::ptrdiff_t>(k), four[k]) ==
        four.begin() + static_cast<std::ptrdiff_t>(k)) {
      ++k;
    }
  }
  return four;
}

/// Counts through the combinations of choices of a four; false after the last. The first view is never reversed: the
/// mirror image of each combination would be tried twice.
bool next_combination(std::span<const OpenView> views, const std::array<std::size_t, 4>& four,
                      std::array<std::size_t, 4>& choices) {
  for (std::size_t k = 0; k < four.size(); ++k) {
    const auto& open = views[four[k]].choices;
    ++choices[k];
    if (choices[k] < open.size() && !(k == 0 && open[choices[k]].reversed)) return true;
    choices[k] = 0;
  }
  return false;
}

/// The origin moves to the last point: d_t there is d_t + d_r x (way there).
void turn_about_middle(const BoardSpec& board, Transform<Camera, Board>& camera_T_board, Matrix6d& covariance) {
  Matrix6d moved = Matrix6d::Identity();
  moved.topRightCorner<3, 3>() = -cross_matrix(camera_T_board.rotation() * (2 * board.center()));
  covariance = (moved * covariance * moved.transpose()).eval();
  camera_T_board = camera_T_board * half_turn(board);
}

}  // namespace

Transform<Board, Board> half_turn(const BoardSpec& board) {
  Pose turn = Pose::Identity();
  turn.linear() = rotation_exp({0, 0, std::numbers::pi});
  turn.translation() = 2 * board.center();
  return Transform<Board, Board>(turn);
}

OpenView seen_one_way(const CalibrationView& view, const BoardPose& pose) {
  constexpr double kSigmaMin_px = 0.2;  // a pose that explains the noise of a good detector leaves no trace of it
  constexpr double kDoubt = 30;
  const double coordinates = 2.0 * static_cast<double>(view.corners_px.size());
  const double variance = std::max(kSigmaMin_px * kSigmaMin_px,
                                   std::pow(pose.residual_rms_px, 2) * coordinates / std::max(2.0, coordinates - 6));
  OpenView open{view.base_T_flange, {{pose.camera_T_board, false, false}}, view.target};
  if (!pose.other) return open;
  const double worse = std::pow(pose.other->residual_rms_px, 2) - std::pow(pose.residual_rms_px, 2);
  if (worse * coordinates < 2 * kDoubt * variance) open.choices.push_back({pose.other->camera_T_board, false, true});
  return open;
}

OpenView open_view(const BoardSpec& board, const CalibrationView& view, const BoardPose& pose) {
  OpenView open = seen_one_way(view, pose);
  if (board.is_orientation_unique()) return open;
  const auto turn = half_turn(board);
  const auto straight = open.choices;
  for (const PoseChoice& c : straight) open.choices.push_back({c.camera_T_board * turn, true, c.other});
  return open;
}

namespace {

/// settle_choices for the views of one target.
Indices settle_one(std::span<const OpenView> views) {
  constexpr int kTrials = 40;
  Agreement best{Indices(views.size(), 0), std::numeric_limits<double>::infinity()};
  if (views.size() < 4 || !any_open(views)) return best.choices;
  Random random(1, 2301);
  for (int trial = 0; trial < kTrials; ++trial) {
    const auto four = some_four(views.size(), random);
    std::array<std::size_t, 4> choices{};
    do {
      std::vector<PosePair> pairs;
      for (std::size_t k = 0; k < four.size(); ++k) pairs.push_back(chosen(views[four[k]], choices[k]));
      const auto hand_eye = solve_closed_form(pairs);
      if (!hand_eye) continue;
      Agreement agreement = agree(views, *hand_eye, mean_board_pose(pairs, *hand_eye));
      if (agreement.median_m < best.median_m) best = std::move(agreement);
    } while (next_combination(views, four, choices));
  }
  keep_first_as_seen(views, best.choices);
  return best.choices;
}

/// settle_choices for the views of one target.
Indices settle_one(std::span<const OpenView> views, const Transform<Flange, Camera>& flange_T_camera) {
  constexpr std::size_t kAsked = 20;  // views whose poses are tried as the board's place
  Agreement best{Indices(views.size(), 0), std::numeric_limits<double>::infinity()};
  if (views.size() < 2 || !any_open(views)) return best.choices;
  for (std::size_t v = 0; v < std::min(kAsked, views.size()); ++v) {
    for (const PoseChoice& choice : views[v].choices) {
      const auto base_T_board = views[v].base_T_flange * flange_T_camera * choice.camera_T_board;
      Agreement agreement = agree(views, flange_T_camera, base_T_board);
      if (agreement.median_m < best.median_m) best = std::move(agreement);
    }
  }
  keep_first_as_seen(views, best.choices);
  return best.choices;
}

/// Numbers of the views of each target that is seen.
std::vector<Indices> views_by_target(std::span<const OpenView> views) {
  std::vector<Indices> groups;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const auto same = [&](const Indices& group) { return views[group.front()].target == views[i].target; };
    const auto group = std::find_if(groups.begin(), groups.end(), same);
    if (group == groups.end()) {
      groups.push_back({i});
    } else {
      group->push_back(i);
    }
  }
  return groups;
}

std::vector<OpenView> some_of(std::span<const OpenView> views, const Indices& group) {
  std::vector<OpenView> some;
  for (const std::size_t i : group) some.push_back(views[i]);
  return some;
}

void put_back(const Indices& own, const Indices& group, Indices& choices) {
  for (std::size_t k = 0; k < group.size(); ++k) choices[group[k]] = own[k];
}

}  // namespace

Indices settle_choices(std::span<const OpenView> views) {
  const std::vector<Indices> groups = views_by_target(views);
  if (groups.size() < 2) return settle_one(views);
  constexpr std::size_t kSettledBySelf = 4;
  Indices choices(views.size(), 0);
  std::vector<PosePair> sure;
  for (const Indices& group : groups) {
    const std::vector<OpenView> own = some_of(views, group);
    put_back(settle_one(own), group, choices);
    if (own.size() < kSettledBySelf && any_open(own)) continue;
    for (const std::size_t i : group) {
      sure.push_back(chosen(views[i], choices[i]));
      sure.back().target = views[i].target;
    }
  }
  const auto hand_eye = solve_closed_form(sure);
  if (!hand_eye) return choices;
  for (const Indices& group : groups) {
    const std::vector<OpenView> own = some_of(views, group);
    if (own.size() < kSettledBySelf && any_open(own)) put_back(settle_one(own, *hand_eye), group, choices);
  }
  return choices;
}

Indices settle_choices(std::span<const OpenView> views, const Transform<Flange, Camera>& flange_T_camera) {
  const std::vector<Indices> groups = views_by_target(views);
  if (groups.size() < 2) return settle_one(views, flange_T_camera);
  Indices choices(views.size(), 0);
  for (const Indices& group : groups) {
    put_back(settle_one(some_of(views, group), flange_T_camera), group, choices);
  }
  return choices;
}

void adopt_choice(const BoardSpec& board, const PoseChoice& choice, BoardPose& pose) {
  if (choice.other && pose.other) {
    std::swap(pose.camera_T_board, pose.other->camera_T_board);
    std::swap(pose.unit_covariance, pose.other->unit_covariance);
    std::swap(pose.residual_rms_px, pose.other->residual_rms_px);
  }
  if (!choice.reversed) return;
  turn_about_middle(board, pose.camera_T_board, pose.unit_covariance);
  if (pose.other) turn_about_middle(board, pose.other->camera_T_board, pose.other->unit_covariance);
}

}  // namespace firstlook
