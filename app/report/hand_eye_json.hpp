/// The hand_eye object of result.json.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <string_view>

#include "algorithms/calibration/solver_comparison.hpp"
#include "algorithms/calibration/verdict.hpp"
#include "app/report/run_record.hpp"

namespace firstlook {

/// The contract's keys and, beside them, source (solved), verification (null), solver, closed_form, closed_form_matrix
/// (3 rows of 4, the linear solution before its rotation was made one; null for other solvers), arm_sigma,
/// corner_sigma_px, subset_spread, holdout_rms_mm, views_given and ax_xb_residual (rotation_rms_deg and
/// translation_rms_mm of the board's pose in base against its mean; of AX = XB itself below all_pairs and consecutive).
/// SI units unless the name says otherwise; numbers that do not apply (no corners) are null.
[[nodiscard]] nlohmann::json hand_eye_json(const HandEyeResult& result, std::string_view parent_link,
                                           std::string_view solver);

/// Says where several targets are: `targets[]` with each one's pose in base and its sigmas (along base's axes; null
/// when no view shows it), and `mutual_poses[]` of every two that were solved (sigmas along the axes of `from`).
void describe_targets(const HandEyeResult& result, std::span<const std::string> names, nlohmann::json& hand_eye);

/// Every solver on the same random parts of the views: for each its name, how many were solved, why the first was not,
/// and for each figure minimum, lower quartile, median, upper quartile and maximum (null when none was solved).
[[nodiscard]] nlohmann::json solver_comparison_json(const SolverComparison& comparison);

/// Says of a hand_eye object that it came from an earlier job (source: stored), and how its test went (verification).
/// What only a solve of this job could tell becomes null.
void describe_stored(const VerifiedCalibration& verified, nlohmann::json& hand_eye);

}  // namespace firstlook
