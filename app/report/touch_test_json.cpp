#include "app/report/touch_test_json.hpp"

#include <nlohmann/json.hpp>
#include <numbers>

#include "algorithms/vision/rotation.hpp"

namespace firstlook {
namespace {

using nlohmann::json;

json array_of(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

json error_json(const CameraError& e) {
  return {{"translation_mm", array_of(e.head<3>() * 1e3)}, {"rotation_mrad", array_of(e.tail<3>() * 1e3)}};
}

json touches_json(const TouchedBoard& board) {
  json touches = json::array();
  for (const TouchFit& fit : board.fits) {
    touches.push_back({{"point", fit.corner},
                       {"used", fit.used},
                       {"off_mm", array_of(fit.off_m * 1e3)},
                       {"stood_on_point", fit.rather ? json(*fit.rather) : json(nullptr)}});
  }
  return touches;
}

json tip_json(const TouchedBoard& board) {
  return {{"flange_p_tip_m", array_of(board.flange_p_tip_m)},
          {"sigma_mm", array_of(board.tip_sigma_m * 1e3)},
          {"source", board.tip_estimated ? "estimated" : "given"}};
}

json board_json(const TouchedBoard& board) {
  const Eigen::Quaterniond q = board.base_T_board.quaternion();
  const Vector6d sigma = board.covariance.diagonal().cwiseMax(0).cwiseSqrt() * 1e3;
  return {{"translation_m", array_of(board.base_T_board.translation())},
          {"quaternion_xyzw", {q.x(), q.y(), q.z(), q.w()}},
          {"sigma_translation_mm", array_of(sigma.head<3>())},
          {"sigma_rotation_mrad", array_of(sigma.tail<3>())}};
}

}  // namespace

json touch_test_json(const std::optional<TouchTest>& test) {
  if (!test) return nullptr;
  const TouchedBoard& board = test->board;
  json mean = error_json(test->mean), errors = json::array();
  mean["roll_pitch_yaw_deg"] = array_of(roll_pitch_yaw(rotation_exp(test->mean.tail<3>())) * (180 / std::numbers::pi));
  for (const CameraError& e : test->errors) errors.push_back(error_json(e));
  const bool repeated = test->static_looks > 0, several = test->places > 1;
  return {{"agrees", test->agrees()},
          {"touches", touches_json(board)},
          {"touches_used", board.used},
          {"tip", tip_json(board)},
          {"base_T_board", board_json(board)},
          {"horn_residual_rms_mm", board.horn_residual_rms_m * 1e3},
          {"residual_rms_mm", board.residual_rms_m * 1e3},
          {"residual_max_mm", board.residual_max_m * 1e3},
          {"touch_sigma_mm", board.touch_sigma_m * 1e3},
          {"scale", board.scale},
          {"scale_sigma", board.scale_sigma},
          {"error", mean},
          {"error_sigma", error_json(test->mean_sigma)},
          {"error_deviation_over_views", several ? error_json(test->view_deviation) : json(nullptr)},
          {"error_deviation_static", repeated ? error_json(test->static_deviation) : json(nullptr)},
          {"views", test->places},
          {"static_looks", test->static_looks},
          {"errors", std::move(errors)},
          {"board_shift",
           {{"translation_mm", array_of(test->shift.head<3>() * 1e3)},
            {"rotation_mrad", array_of(test->shift.tail<3>() * 1e3)}}},
          {"chi2", test->chi2},
          {"chi2_limit", test->chi2_limit},
          {"degrees_of_freedom", 6}};
}

}  // namespace firstlook
