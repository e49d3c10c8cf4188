#include "algorithms/calibration/view_gate.hpp"

#include <algorithm>
#include <array>

#include "platform/core/random.hpp"

namespace firstlook {
namespace {

// Below these a view is never called wrong: what arms and boards commonly deviate by.
constexpr double kTranslationFloor_m = 0.5e-3;
constexpr double kRotationFloor_rad = 1e-3;

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// Views of one target that tell a wrong one among them.
constexpr std::size_t kOwnMedianMin = 3;

/// For each view the median that its value is held against: that of its target, since a small or oblique one is seen
/// less well than others, but not less than that of all views. The last is that of all; a target's only view always
/// fits and does not count there, unless there is no other.
std::vector<double> medians_for(std::span<const PosePair> pairs, std::span<const double> values) {
  std::vector<std::vector<double>> own(static_cast<std::size_t>(target_count(pairs)));
  const auto of = [&](const PosePair& pair) -> std::vector<double>& {
    return own[static_cast<std::size_t>(pair.target)];
  };
  for (std::size_t i = 0; i < pairs.size(); ++i) of(pairs[i]).push_back(values[i]);
  std::vector<double> repeated;
  repeated.reserve(values.size());
  for (const std::vector<double>& group : own) {
    if (group.size() > 1 || own.size() == 1) repeated.insert(repeated.end(), group.begin(), group.end());
  }
  if (repeated.empty()) repeated.assign(values.begin(), values.end());
  const double all = median(std::move(repeated));
  std::vector<double> medians;
  medians.reserve(values.size() + 1);
  for (const PosePair& pair : pairs) {
    const std::vector<double>& group = of(pair);
    medians.push_back(own.size() == 1 || group.size() < kOwnMedianMin ? all : std::max(all, median(group)));
  }
  medians.push_back(all);
  return medians;
}

/// Sizes of the misfits as one number each, in median (or floor) misfits.
struct Misfits {
  std::vector<double> ratio;
  Misfit median;
};

Misfits measure(std::span<const PosePair> pairs, const Transform<Flange, Camera>& flange_T_camera) {
  const auto misfits = flange_misfits(pairs, flange_T_camera, median_board_poses(pairs, flange_T_camera));
  std::vector<double> translation, rotation;
  for (const Vector6d& m : misfits) {
    translation.push_back(m.head<3>().norm());
    rotation.push_back(m.tail<3>().norm());
  }
  Misfits result;
  const std::vector<double> usual_m = medians_for(pairs, translation), usual_rad = medians_for(pairs, rotation);
  result.median = {usual_m.back(), usual_rad.back()};
  for (std::size_t i = 0; i < misfits.size(); ++i) {
    result.ratio.push_back(std::max(translation[i] / std::max(kTranslationFloor_m, usual_m[i]),
                                    rotation[i] / std::max(kRotationFloor_rad, usual_rad[i])));
  }
  return result;
}

std::vector<PosePair> kept(std::span<const PosePair> pairs, const std::vector<bool>& keep) {
  std::vector<PosePair> result;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (keep[i]) result.push_back(pairs[i]);
  }
  return result;
}

/// The views of each target that four or more show.
std::vector<std::vector<PosePair>> groups_of_four(std::span<const PosePair> pairs) {
  std::vector<std::vector<PosePair>> groups;
  for (int k = 0; k < target_count(pairs); ++k) {
    std::vector<PosePair> own = pairs_of_target(pairs, k);
    if (own.size() >= 4) groups.push_back(std::move(own));
  }
  return groups;
}

/// Four different views of one target.
std::array<PosePair, 4> random_four(std::span<const std::vector<PosePair>> groups, Random& random) {
  const auto group = groups.size() == 1 ? 0 : static_cast<std::size_t>(random.below(static_cast<int>(groups.size())));
  const std::vector<PosePair>& pairs = groups[group];
  std::array<std::size_t, 4> chosen{};
  for (std::size_t k = 0; k < chosen.size(); ++k) {
    do {
      chosen[k] = static_cast<std::size_t>(random.below(static_cast<int>(pairs.size())));
    } while (std::find(chosen.begin(), chosen.begin() + static_cast<std::ptrdiff_t>(k), chosen[k]) !=
             chosen.begin() + static_cast<std::ptrdiff_t>(k));
  }
  return {pairs[chosen[0]], pairs[chosen[1]], pairs[chosen[2]], pairs[chosen[3]]};
}

}  // namespace

std::vector<Vector6d> flange_misfits(std::span<const PosePair> pairs, const Transform<Flange, Camera>& flange_T_camera,
                                     std::span<const Transform<Base, Board>> base_T_board) {
  std::vector<Vector6d> misfits;
  for (const PosePair& pair : pairs) {
    const auto& board = base_T_board[static_cast<std::size_t>(pair.target)];
    const auto seen = board * (flange_T_camera * pair.camera_T_board).inverse();
    misfits.push_back(pose_difference(seen.pose(), pair.base_T_flange.pose()));
  }
  return misfits;
}

Misfit median_misfit(std::span<const PosePair> pairs, const Transform<Flange, Camera>& flange_T_camera) {
  return measure(pairs, flange_T_camera).median;
}

Transform<Base, Board> median_board_pose(std::span<const PosePair> pairs,
                                         const Transform<Flange, Camera>& flange_T_camera) {
  std::vector<Pose> boards;
  for (const PosePair& pair : pairs) {
    boards.push_back((pair.base_T_flange * flange_T_camera * pair.camera_T_board).pose());
  }
  // The view whose board pose is nearest to the others' by median distance, then the mean of the nearer half.
  std::size_t best = 0;
  double best_distance = std::numeric_limits<double>::infinity();
  const auto distance = [&](std::size_t i, std::size_t j) {
    const Vector6d d = pose_difference(boards[i], boards[j]);
    return d.head<3>().norm() + 0.5 * d.tail<3>().norm();
  };
  for (std::size_t i = 0; i < boards.size(); ++i) {
    std::vector<double> distances;
    for (std::size_t j = 0; j < boards.size(); ++j) distances.push_back(distance(i, j));
    const double middle = median(distances);
    if (middle < best_distance) {
      best_distance = middle;
      best = i;
    }
  }
  std::vector<PosePair> near;
  for (std::size_t j = 0; j < boards.size(); ++j) {
    if (distance(best, j) <= 2 * best_distance) near.push_back(pairs[j]);
  }
  return mean_board_pose(near, flange_T_camera);
}

std::vector<Transform<Base, Board>> median_board_poses(std::span<const PosePair> pairs,
                                                       const Transform<Flange, Camera>& flange_T_camera) {
  std::vector<Transform<Base, Board>> poses;
  for (int k = 0; k < target_count(pairs); ++k) {
    const std::vector<PosePair> own = pairs_of_target(pairs, k);
    poses.push_back(own.empty() ? Transform<Base, Board>() : median_board_pose(own, flange_T_camera));
  }
  return poses;
}

std::vector<bool> gate_views(std::span<const PosePair> pairs, const Transform<Flange, Camera>& flange_T_camera,
                             double gate) {
  std::vector<bool> keep;
  for (const double ratio : measure(pairs, flange_T_camera).ratio) keep.push_back(ratio <= gate);
  return keep;
}

Result<HandEyeSolution> solve_pose_pairs_robust(std::span<const PosePair> pairs, Solver solver, double gate) {
  constexpr double kStandsOut = 3;  // in median misfits: common enough among good views to look closer, no more
  constexpr int kTrials = 150;      // one of four wrong in each: a third of wrong views leaves 1 in 5 trials clean
  auto plain = solve_pose_pairs(pairs, solver);
  if (!plain || pairs.size() < 6) return plain;
  const Misfits all = measure(pairs, plain->flange_T_camera);
  if (*std::max_element(all.ratio.begin(), all.ratio.end()) <= kStandsOut) return plain;

  const auto groups = groups_of_four(pairs);
  if (groups.empty()) return plain;
  Random random(1, 2101);
  auto best = plain->flange_T_camera;
  double best_size_m = all.median.size_m();
  for (int trial = 0; trial < kTrials; ++trial) {
    // By any solver that takes every four: it only tells the good views.
    const auto four = solve_closed_form(random_four(groups, random), Solver::kParkMartin);
    if (!four) continue;
    const double size_m = measure(pairs, *four).median.size_m();
    if (size_m < best_size_m) {
      best_size_m = size_m;
      best = *four;
    }
  }
  return solve_pose_pairs(kept(pairs, gate_views(pairs, best, gate)), solver);
}

Result<Transform<Flange, Camera>> robust_closed_form(std::span<const PosePair> pairs, Solver solver, double gate) {
  const auto solution = solve_pose_pairs_robust(pairs, solver, gate);
  if (!solution) return std::unexpected(solution.error());
  return solution->flange_T_camera;
}

}  // namespace firstlook
