/// All solvers side by side on the same random parts of the views (thesis, figures 8-2 and 8-3).
#pragma once

#include <array>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "algorithms/calibration/verdict.hpp"

namespace firstlook {

/// A sample in the manner of Tukey 1977: quartiles, whiskers to the farthest values within 1.5 times the distance of
/// the quartiles, and what lies beyond. Quartiles interpolate between neighbours.
struct BoxFigures {
  double minimum = 0, whisker_low = 0, quartile_low = 0, median = 0, quartile_high = 0, whisker_high = 0, maximum = 0;
  std::vector<double> outliers;  ///< ascending
};
/// All zero for an empty sample.
[[nodiscard]] BoxFigures box_figures(std::vector<double> sample);

/// What is drawn of a transform: position (m), roll, pitch and yaw (rad), quaternion.
enum class PoseFigure : std::uint8_t { kX, kY, kZ, kRoll, kPitch, kYaw, kQx, kQy, kQz, kQw };
inline constexpr std::size_t kPoseFigures = 10;
/// "x", "roll", "qw".
[[nodiscard]] std::string_view name_of(PoseFigure figure);

/// The solves of one solver, or of the refinement.
struct SubsetSolves {
  std::string_view solver;  ///< name in solver_table; "refinement"
  int solved = 0, failed = 0;
  std::string first_failure;                   ///< in words; empty when none failed
  std::array<BoxFigures, kPoseFigures> boxes;  ///< by PoseFigure
};

struct SolverComparison {
  std::size_t views = 0;           ///< places of the arm that the calibration used
  std::size_t views_of_solve = 0;  ///< in each subset
  int subsets = 0;                 ///< of the solvers
  int refined_subsets = 0;
  std::vector<SubsetSolves> solvers;  ///< the refinement first, then solver_table's order
};

/// Solves `options.subset_solves` subsets with every solver, the same subsets for all; those of the refinement are
/// `result.subset_solutions`. Angles are given within half a turn of the result's, quaternions on its side. Above 60
/// pairs fewer subsets are solved, five at least, since a solve takes the square of their number: 0.3 s for 25 pairs,
/// about 1.3 s from 60 to 250.
[[nodiscard]] SolverComparison compare_solvers(std::span<const PosePair> pairs, const HandEyeResult& result,
                                               const HandEyeOptions& options);

}  // namespace firstlook
