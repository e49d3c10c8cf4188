#include "app/shell/narrate_result.hpp"

#include <fmt/format.h>

namespace firstlook {
namespace {

void narrate_alignment(const AlignmentRecord& alignment, Narrator& narrator) {
  const DepthToColor& depth = *alignment.depth_camera.estimate;
  const Vector7d sigma = alignment.depth_camera.mount.covariance.diagonal().cwiseSqrt();
  std::string line =
      fmt::format("sensors   depth camera {:.2f} ± {:.2f} mm, {:.2f} ± {:.2f} mrad from where it was stated",
                  1e3 * depth.moved.head<3>().norm(), 1e3 * sigma.head<3>().maxCoeff(),
                  1e3 * depth.moved.tail<3>().norm(), 1e3 * sigma.segment<3>(3).maxCoeff());
  const auto add = [&line](std::string_view camera, const StampRecord& stamps) {
    if (!stamps.estimate) return;
    line += fmt::format("; {} stamps {:+.2f} ± {:.2f} ms", camera, 1e3 * stamps.offset_s, 1e3 * stamps.sigma_s);
  };
  add("colour", alignment.color_stamps);
  add("depth", alignment.depth_stamps);
  narrator.line(line);
  if (depth.belief.contradicted()) {
    narrator.line(
        fmt::format("warning   what is stated of the depth camera is wrong: chi-square {:.1f}, allowed {:.1f}",
                    depth.belief.chi2, depth.belief.chi2_limit));
  }
}

}  // namespace

void narrate_result(const RunRecord& record, Narrator& narrator) {
  narrator.clear_progress();
  narrator.line(fmt::format("{}: {}", name_of(record.outcome), record.reason));
  if (!record.remedy.empty()) narrator.line("to do     " + record.remedy);
  if (record.hand_eye) {
    const Eigen::Vector3d t = 1000 * record.hand_eye->flange_T_camera.translation();
    const Eigen::Vector3d s = 1000 * record.hand_eye->sigma_translation_m;
    narrator.line(fmt::format("hand-eye  x {:.2f} ± {:.2f}  y {:.2f} ± {:.2f}  z {:.2f} ± {:.2f} mm {}from {} views",
                              t.x(), s.x(), t.y(), s.y(), t.z(), s.z(), record.verified ? "as stored, " : "",
                              record.hand_eye->views));
    if (record.verified && record.verified->verification) {
      const Verification& v = *record.verified->verification;
      narrator.line(fmt::format("verified  on {} views: chi-square {:.1f}, allowed {:.1f}; {:.2f} px, {:.2f} mm RMS",
                                v.views.size(), v.chi2, v.chi2_limit, v.residual_rms_px, v.residual_rms_m * 1e3));
    }
    if (const auto& touched = record.hand_eye->touch_test) {
      narrator.line(fmt::format("touched   camera off by {:.2f} ± {:.2f} mm, {:.2f} ± {:.2f} mrad by {} of {} touches",
                                touched->mean.head<3>().norm() * 1e3, touched->mean_sigma.head<3>().norm() * 1e3,
                                touched->mean.tail<3>().norm() * 1e3, touched->mean_sigma.tail<3>().norm() * 1e3,
                                touched->board.used, touched->board.fits.size()));
    }
    if (record.alignment && record.alignment->depth_camera.estimate) narrate_alignment(*record.alignment, narrator);
    for (const std::string& reason : record.hand_eye->reasons) narrator.line("rejected  " + reason);
  }
  if (record.mapping) {
    const VoxelCounts& v = record.mapping->voxels;
    narrator.line(fmt::format("map       {} free, {} occupied, {} unknown voxels of {} m in reach after {} views",
                              v.free, v.occupied, v.unknown, record.mapping->resolution_m,
                              record.mapping->views.size()));
  }
  if (record.truth) {
    const TruthRecord& t = *record.truth;
    std::string line = "truth     ";
    if (t.hand_eye_error_mm && t.hand_eye_error_mrad) {
      line += fmt::format("hand-eye off by {:.2f} mm, {:.2f} mrad; ", *t.hand_eye_error_mm, *t.hand_eye_error_mrad);
    }
    line += fmt::format("{} contacts, {} entries into unknown space", t.contacts, t.unknown_entries);
    if (record.mapping && t.coverage_of_observable) {
      line += fmt::format("; {:.1f} % of the observable voxels known", 100 * *t.coverage_of_observable);
    }
    narrator.line(line);
  }
}

}  // namespace firstlook
