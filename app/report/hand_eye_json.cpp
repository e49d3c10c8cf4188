#include "app/report/hand_eye_json.hpp"

#include <array>
#include <nlohmann/json.hpp>
#include <utility>

#include "app/report/touch_test_json.hpp"

namespace firstlook {
namespace {

using nlohmann::json;

template <typename Vector>
json array_of(const Vector& vector) {
  json array = json::array();
  for (Eigen::Index i = 0; i < vector.size(); ++i) array.push_back(vector(i));
  return array;
}

json transform_json(const Pose& pose) {
  Eigen::Quaterniond q(pose.linear());
  if (q.w() < 0) q.coeffs() = -q.coeffs();  // one of the two that mean the same
  return {{"translation_m", array_of(Eigen::Vector3d(pose.translation()))}, {"quaternion_xyzw", array_of(q.coeffs())}};
}

json row_major(const Matrix6d& matrix) {
  json array = json::array();
  for (Eigen::Index row = 0; row < 6; ++row) {
    for (Eigen::Index column = 0; column < 6; ++column) array.push_back(matrix(row, column));
  }
  return array;
}

json residual_json(const AxXbResidual& residual) {
  return {{"rotation_rms_deg", residual.rotation_rms_deg}, {"translation_rms_mm", residual.translation_rms_mm}};
}

json only_with_corners(const HandEyeResult& result, double value) {
  return result.from_pairs ? json(nullptr) : json(value);
}

/// A figure of the validation; none when the job ended before it, or when there were too few views to hold any out.
json only_validated(const HandEyeResult& result, json value) {
  return result.holdout_rms_m > 0 ? std::move(value) : json(nullptr);
}

json misfit_json(const std::optional<Misfit>& misfit) {
  if (!misfit) return nullptr;
  return {{"translation_mm", misfit->translation_m * 1e3}, {"rotation_mrad", misfit->rotation_rad * 1e3}};
}

json mistake_json(const std::optional<LikelyMistake>& mistake) {
  if (!mistake) return nullptr;
  return {{"mistake", mistake_name(mistake->mistake)},
          {"text", mistake->text},
          {"misfit_as_given", misfit_json(mistake->before)},
          {"misfit_without_it", misfit_json(mistake->after)}};
}

/// Estimated intrinsics with their sigmas under the names of hand_eye.yaml.
json intrinsics_json(const CameraIntrinsics& camera, const IntrinsicsFit& fit) {
  constexpr std::array<const char*, 9> kKeys = {"fx_px", "fy_px", "cx_px", "cy_px", "k1", "k2", "p1", "p2", "k3"};
  const IntrinsicsVector numbers = intrinsics_vector(camera), sigma = fit.sigma();
  json object = {{"image_width", camera.width}, {"image_height", camera.height}}, sigmas = json::object();
  for (std::size_t i = 0; i < kKeys.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    object[kKeys[i]] = numbers[at];
    sigmas[kKeys[i]] = at < fit.count ? json(sigma[at]) : json(nullptr);
  }
  object["sigma"] = std::move(sigmas);
  object["hardly_told"] = fit.untold.empty() ? json(nullptr) : json(fit.untold);
  return object;
}

json rows_or_null(const std::optional<Matrix3x4d>& matrix) {
  if (!matrix) return nullptr;
  json rows = json::array();
  for (Eigen::Index row = 0; row < 3; ++row) {
    rows.push_back({(*matrix)(row, 0), (*matrix)(row, 1), (*matrix)(row, 2), (*matrix)(row, 3)});
  }
  return rows;
}

}  // namespace

json hand_eye_json(const HandEyeResult& result, std::string_view parent_link, std::string_view solver) {
  json object = transform_json(result.flange_T_camera.pose());
  object["source"] = "solved";
  object["verification"] = nullptr;
  object["parent_link"] = parent_link;
  object["sigma_translation_mm"] = array_of(Eigen::Vector3d(result.sigma_translation_m * 1e3));
  object["sigma_rotation_mrad"] = array_of(Eigen::Vector3d(result.sigma_rotation_rad * 1e3));
  object["covariance"] = row_major(result.covariance);
  object["reprojection_rms_px"] = only_with_corners(result, result.reprojection_rms_px);
  object["holdout_rms_px"] = only_validated(result, only_with_corners(result, result.holdout_rms_px));
  object["holdout_rms_mm"] = only_validated(result, result.holdout_rms_m * 1e3);
  object["views"] = result.views;
  object["views_given"] = result.fits.size();
  object["usable_distance_m"] =
      result.usable_distance_m > 0 ? json(result.usable_distance_m) : only_validated(result, 0.0);
  object["verdict"] = result.verdict == Verdict::kAccepted ? "accepted" : "rejected";
  object["reasons"] = result.reasons;
  object["likely_mistake"] = mistake_json(result.likely_mistake);
  object["touch_test"] = touch_test_json(result.touch_test);
  object["solver"] = solver;
  object["closed_form"] = transform_json(result.closed_form.pose());
  object["closed_form_matrix"] = rows_or_null(result.closed_form_raw);
  object["corner_sigma_px"] = only_with_corners(result, result.corner_sigma_px);
  object["arm_sigma"] = {{"translation_mm", result.arm_sigma.translation_m * 1e3},
                         {"rotation_mrad", result.arm_sigma.rotation_rad * 1e3}};
  object["subset_spread"] = {{"translation_mm", result.subset_spread_m * 1e3},
                             {"rotation_mrad", result.subset_spread_rad * 1e3}};
  if (result.intrinsics) object["intrinsics"] = intrinsics_json(result.camera, *result.intrinsics);
  // At the top the usual way to state it; the other two are the residual of the equation itself.
  json residual = residual_json(result.board_in_base);
  residual["all_pairs"] = residual_json(result.ax_xb_all_pairs);
  residual["consecutive"] = residual_json(result.ax_xb_consecutive);
  object["ax_xb_residual"] = residual;
  return object;
}

json solver_comparison_json(const SolverComparison& comparison) {
  constexpr std::array<const char*, kPoseFigures> kKeys = {"x_m",     "y_m", "z_m", "roll_rad", "pitch_rad",
                                                           "yaw_rad", "qx",  "qy",  "qz",       "qw"};
  json solvers = json::array();
  for (const SubsetSolves& s : comparison.solvers) {
    json row = {{"solver", s.solver},
                {"solved", s.solved},
                {"failed", s.failed},
                {"first_failure", s.first_failure.empty() ? json(nullptr) : json(s.first_failure)}};
    for (std::size_t i = 0; i < kPoseFigures; ++i) {
      const BoxFigures& b = s.boxes[i];
      row[kKeys[i]] = s.solved > 0 ? json{b.minimum, b.quartile_low, b.median, b.quartile_high, b.maximum} : json();
    }
    solvers.push_back(std::move(row));
  }
  return {{"views", comparison.views},
          {"views_of_solve", comparison.views_of_solve},
          {"subsets", comparison.subsets},
          {"refined_subsets", comparison.refined_subsets},
          {"solvers", std::move(solvers)}};
}

void describe_targets(const HandEyeResult& result, std::span<const std::string> names, json& hand_eye) {
  const auto with_sigmas = [](const Pose& pose, const Matrix6d& covariance) {
    const Vector6d sigma = covariance.diagonal().cwiseMax(0).cwiseSqrt();
    json object = transform_json(pose);
    object["sigma_translation_mm"] = array_of(Eigen::Vector3d(sigma.head<3>() * 1e3));
    object["sigma_rotation_mrad"] = array_of(Eigen::Vector3d(sigma.tail<3>() * 1e3));
    return object;
  };
  json targets = json::array(), mutual = json::array();
  for (std::size_t k = 0; k < result.targets.size(); ++k) {
    const TargetPose& target = result.targets[k];
    targets.push_back({{"name", names[k]},
                       {"views", target.views},
                       {"base_T_board", target.views > 0 ? with_sigmas(target.base_T_board.pose(), target.covariance)
                                                         : json(nullptr)}});
    for (std::size_t other = k + 1; other < result.targets.size(); ++other) {
      const auto seen =
          mutual_pose(result.targets, result.joint_covariance, static_cast<int>(k), static_cast<int>(other));
      if (!seen) continue;
      json object = with_sigmas(seen->pose.pose(), seen->covariance);
      object["from"] = names[k];
      object["to"] = names[other];
      mutual.push_back(std::move(object));
    }
  }
  hand_eye["targets"] = std::move(targets);
  hand_eye["mutual_poses"] = std::move(mutual);
}

void describe_stored(const VerifiedCalibration& verified, json& hand_eye) {
  hand_eye["source"] = "stored";
  hand_eye["views_given"] = verified.calibration.views_given;
  hand_eye["solver"] = verified.calibration.solver;
  for (const char* key : {"closed_form", "closed_form_matrix", "subset_spread", "ax_xb_residual"})
    hand_eye[key] = nullptr;
  if (!verified.verification) {
    hand_eye["verification"] = {{"looks", verified.looks}, {"views", 0}};
    return;
  }
  const Verification& v = *verified.verification;
  json residuals = json::array();
  for (const VerifiedView& view : v.views) {
    residuals.push_back({{"rms_px", view.residual_rms_px},
                         {"board_shift_mm", view.board_shift_m * 1e3},
                         {"board_turn_mrad", view.board_turn_rad * 1e3}});
  }
  hand_eye["verification"] = {{"looks", verified.looks},
                              {"views", v.views.size()},
                              {"chi2", v.chi2},
                              {"chi2_limit", v.chi2_limit},
                              {"degrees_of_freedom", v.degrees_of_freedom},
                              {"corner_sigma_px", v.corner_sigma_px},
                              {"detectable_translation_mm", v.detectable.translation_m * 1e3},
                              {"detectable_rotation_mrad", v.detectable.rotation_rad * 1e3},
                              {"residuals", residuals}};
}

}  // namespace firstlook
