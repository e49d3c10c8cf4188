/// A stored calibration in the report: what it says of itself, and its test on this job's views.
#include <fmt/format.h>

#include "app/report/html.hpp"
#include "app/report/sections.hpp"

namespace firstlook {

std::string verification_table(const RunRecord& record) {
  const HandEyeResult& h = *record.hand_eye;
  const StoredCalibration& stored = record.verified->calibration;
  HtmlTable table({"figure", "value", "what it says"}, 3);
  table.row({"source", fmt::format("stored, from {} views", h.views),
             "made by an earlier job; tested here, not solved again"});
  if (const auto& v = record.verified->verification) {
    table.row({"agreement of the views", fmt::format("χ² {:.1f}, allowed {:.1f}", v->chi2, v->chi2_limit),
               fmt::format("{} views must put the board at one place, within what covariance, arm and corners allow; "
                           "one right calibration in 1000 exceeds it",
                           v->views.size())});
    table.row(
        {"would have shown",
         fmt::format("{:.2f} mm, {:.2f} mrad", v->detectable.translation_m * 1e3, v->detectable.rotation_rad * 1e3),
         "smallest error of the calibration that these views find in 99 of 100 cases, worst direction"});
    table.row({"reprojection error in these views", fmt::format("{:.3f} px RMS", v->residual_rms_px),
               "the arm's own error included"});
    for (std::size_t i = 0; i < v->views.size(); ++i) {
      const VerifiedView& view = v->views[i];
      table.row({fmt::format("view {}", i + 1),
                 fmt::format("{:.3f} px, {:.2f} mm, {:.2f} mrad", view.residual_rms_px, view.board_shift_m * 1e3,
                             view.board_turn_rad * 1e3),
                 "corners, place and turn of the board against all views together"});
    }
  }
  table.row({"looks at the board", fmt::format("{}", record.verified->looks), "with those that did not show it"});
  table.row({"reprojection error then", fmt::format("{:.3f} px RMS", stored.reprojection_rms_px),
             fmt::format("of its own solve; closed form: {}", stored.solver)});
  table.row({"usable distance", fmt::format("{:.2f} m", h.usable_distance_m),
             "farthest object at which a 3σ error stays within the gripper's tolerance"});
  return table.html();
}

}  // namespace firstlook
