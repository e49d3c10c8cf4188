/// The touch test: where a person led the arm's tip, against the calibration.
#include <algorithm>

#include "algorithms/calibration/board_ambiguity.hpp"
#include "app/jobs/workbench.hpp"

namespace firstlook {

static_assert(kTouchPointsMax == kTouchesMax);

TouchRecord Workbench::touch_record(const TouchTestArguments& arguments) const {
  TouchRecord record;
  for (const TouchedPoint& touched : arguments.touches) {
    record.touches.push_back({forward(arm_, touched.at_rad).flange(), touched.point});
  }
  const Config::Calibration& c = config_.calibration;
  if (c.touch_tip == "given") {
    record.tip = TipOffset{{c.touch_tip_m[0], c.touch_tip_m[1], c.touch_tip_m[2]}, c.touch_tip_sigma_mm * 1e-3};
  }
  return record;
}

/// Each frame of the stops that the calibration counts, by itself: what differs between those of one stop is the
/// camera's. Of the poses that a frame allows it is the one that its stop settled on.
std::vector<PosePair> Workbench::repeated_looks() const {
  std::vector<PosePair> looks;
  const std::vector<std::size_t> counted = independent_observations();
  for (std::size_t i = 0; i < counted.size(); ++i) {
    if (i < hand_eye_->fits.size() && !hand_eye_->fits[i].used) continue;
    const Observation& o = observations_[counted[i]];
    const Eigen::Matrix3d settled = o.pose.camera_T_board.rotation();
    const auto turn_rad = [&](const PoseChoice& choice) {
      return rotation_log(choice.camera_T_board.rotation() * settled.transpose()).norm();
    };
    for (const CornerSet& frame : o.frames) {
      const auto pose = estimate_board_pose(camera(), board_, frame);
      if (!pose) continue;
      const auto choices = open_view(board_, {o.view.base_T_flange, frame.corners_px, frame.ids}, *pose).choices;
      const auto nearest = std::ranges::min_element(choices, {}, turn_rad);
      looks.push_back({o.view.base_T_flange, nearest->camera_T_board});
    }
  }
  return looks;
}

TouchTestResult Workbench::touch_test(const TouchTestArguments& arguments) {
  TouchTestResult result;
  if (!hand_eye_) return result;
  hand_eye_->reasons.clear();
  hand_eye_->verdict = Verdict::kAccepted;
  const Status tested = test_hand_eye_by_touch(board_, touch_record(arguments), repeated_looks(),
                                               solve_options().limits.touch, *hand_eye_);
  if (!tested) {
    hand_eye_->verdict = Verdict::kRejected;
    hand_eye_->reasons.emplace_back(tested.error().detail());
    result.fault = tested.error().fault;
    return result;
  }
  const TouchTest& test = *hand_eye_->touch_test;
  result.usable = true;
  result.agrees = test.agrees();
  result.residual_rms_mm = 1000 * test.board.horn_residual_rms_m;
  result.error_mm = 1000 * test.mean.head<3>().norm();
  result.error_mrad = 1000 * test.mean.tail<3>().norm();
  result.chi2 = test.chi2;
  result.chi2_limit = test.chi2_limit;
  if (result.agrees) {
    begin_mapping();
    result.clearance_m = mapping_terms_->voxels_m;
  }
  return result;
}

}  // namespace firstlook
