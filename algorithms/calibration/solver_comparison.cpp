#include "algorithms/calibration/solver_comparison.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "algorithms/calibration/view_subsets.hpp"
#include "algorithms/vision/rotation.hpp"

namespace firstlook {
namespace {

constexpr std::array<std::string_view, kPoseFigures> kNames = {"x",   "y",  "z",  "roll", "pitch",
                                                               "yaw", "qx", "qy", "qz",   "qw"};
/// Pairs up to which all subsets are solved.
constexpr double kPairsQuick = 60;
/// What a box needs to have quartiles that mean something.
constexpr int kSubsetsMin = 5;

using Figures = std::array<double, kPoseFigures>;

Figures figures_of(const Transform<Flange, Camera>& transform) {
  const Eigen::Vector3d t = transform.translation(), rpy = roll_pitch_yaw(transform.rotation());
  const Eigen::Quaterniond q = transform.quaternion();
  return {t.x(), t.y(), t.z(), rpy.x(), rpy.y(), rpy.z(), q.x(), q.y(), q.z(), q.w()};
}

/// The way to write a rotation that lies nearest to the reference's.
Figures near(Figures f, const Figures& reference) {
  for (std::size_t i = 3; i < 6; ++i) f[i] = reference[i] + std::remainder(f[i] - reference[i], 2 * std::numbers::pi);
  double same = 0;
  for (std::size_t i = 6; i < kPoseFigures; ++i) same += f[i] * reference[i];
  if (same < 0) {
    for (std::size_t i = 6; i < kPoseFigures; ++i) f[i] = -f[i];
  }
  return f;
}

void fill_boxes(std::span<const Transform<Flange, Camera>> solutions, const Figures& reference, SubsetSolves& solves) {
  std::array<std::vector<double>, kPoseFigures> samples;
  for (const auto& solution : solutions) {
    const Figures f = near(figures_of(solution), reference);
    for (std::size_t i = 0; i < kPoseFigures; ++i) samples[i].push_back(f[i]);
  }
  for (std::size_t i = 0; i < kPoseFigures; ++i) solves.boxes[i] = box_figures(std::move(samples[i]));
  solves.solved = static_cast<int>(solutions.size());
}

SubsetSolves solve_all(const SolverRow& row, std::span<const std::vector<PosePair>> subsets, const Figures& reference) {
  SubsetSolves solves;
  solves.solver = row.name;
  std::vector<Transform<Flange, Camera>> solutions;
  for (const std::vector<PosePair>& subset : subsets) {
    const auto solved = solve_pose_pairs(subset, row.solver);
    if (solved) {
      solutions.push_back(solved->flange_T_camera);
    } else if (solves.failed++ == 0) {
      solves.first_failure = solved.error().detail();
    }
  }
  fill_boxes(solutions, reference, solves);
  return solves;
}

}  // namespace

BoxFigures box_figures(std::vector<double> sample) {
  BoxFigures box;
  if (sample.empty()) return box;
  std::sort(sample.begin(), sample.end());
  const auto at = [&](double share) {
    const double place = share * static_cast<double>(sample.size() - 1);
    const auto below = static_cast<std::size_t>(place);
    const std::size_t above = std::min(below + 1, sample.size() - 1);
    return sample[below] + (place - static_cast<double>(below)) * (sample[above] - sample[below]);
  };
  box.minimum = sample.front();
  box.maximum = sample.back();
  box.quartile_low = at(0.25);
  box.median = at(0.5);
  box.quartile_high = at(0.75);
  const double reach = 1.5 * (box.quartile_high - box.quartile_low);
  box.whisker_low = box.quartile_low;
  box.whisker_high = box.quartile_high;
  for (const double value : sample) {
    if (value < box.quartile_low - reach || value > box.quartile_high + reach) {
      box.outliers.push_back(value);
    } else {
      box.whisker_low = std::min(box.whisker_low, value);
      box.whisker_high = std::max(box.whisker_high, value);
    }
  }
  return box;
}

std::string_view name_of(PoseFigure figure) { return kNames[static_cast<std::size_t>(figure)]; }

SolverComparison compare_solvers(std::span<const PosePair> pairs, const HandEyeResult& result,
                                 const HandEyeOptions& options) {
  SolverComparison comparison;
  const std::vector<std::size_t> station = stations_of(pairs);
  ViewSubsets random(station_count(station), options.subset_share, options.seed);
  comparison.views = station_count(station);
  comparison.views_of_solve = random.size();
  const double quick = std::min(1.0, std::pow(kPairsQuick / std::max(1.0, static_cast<double>(pairs.size())), 2));
  comparison.subsets =
      std::min(options.subset_solves, std::max(kSubsetsMin, static_cast<int>(quick * options.subset_solves)));
  std::vector<std::vector<PosePair>> subsets;
  for (int i = 0; i < comparison.subsets; ++i) {
    auto& subset = subsets.emplace_back();
    const std::vector<std::size_t> drawn = random.next();
    for (std::size_t k = 0; k < pairs.size(); ++k) {
      if (std::binary_search(drawn.begin(), drawn.end(), station[k])) subset.push_back(pairs[k]);
    }
  }
  const Figures reference = figures_of(result.flange_T_camera);
  SubsetSolves refined;
  refined.solver = "refinement";
  comparison.refined_subsets = options.subset_solves;
  fill_boxes(result.subset_solutions, reference, refined);
  refined.failed = options.subset_solves - refined.solved;
  comparison.solvers.push_back(std::move(refined));
  for (const SolverRow& row : solver_table()) comparison.solvers.push_back(solve_all(row, subsets, reference));
  return comparison;
}

}  // namespace firstlook
