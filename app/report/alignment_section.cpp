#include <fmt/format.h>

#include <algorithm>

#include "app/report/alignment_json.hpp"
#include "app/report/html.hpp"
#include "app/report/sections.hpp"

namespace firstlook {
namespace {

std::string untold_text(const std::vector<UntoldDirection>& untold) {
  if (untold.empty()) return "the board told every direction";
  std::string text = "not told by the board, as stated: ";
  for (std::size_t i = 0; i < untold.size(); ++i) text += (i == 0 ? "" : ", ") + untold[i].name;
  return text;
}

std::string belief_text(const DepthToColor& estimate) {
  if (!estimate.belief.contradicted()) return "what its maker states agrees within its sigmas";
  return fmt::format(
      "what its maker states is contradicted (chi-square {:.1f}, allowed {:.1f}): was the depth camera bent or its "
      "data "
      "sheet that of another?",
      estimate.belief.chi2, estimate.belief.chi2_limit);
}

std::string excess_text(const DepthToColor& estimate) {
  if (!(estimate.excess.offset_m > 0)) return "noise and corners explain it";
  return fmt::format("beyond noise and corners {:.2f} mm and {:.2f} mrad: the sensor's own errors",
                     estimate.excess.offset_m * 1e3, estimate.excess.tilt_rad * 1e3);
}

void depth_rows(const DepthCameraRecord& depth, HtmlTable& table) {
  const Vector7d sigma = depth.mount.covariance.diagonal().cwiseSqrt();
  const std::string sure = depth.source == ValueSource::kGiven && depth.reason.empty()
                               ? std::string("taken as exact")
                               : fmt::format("± {:.2f} mm, {:.2f} mrad (1σ, worst axis)",
                                             1e3 * sigma.head<3>().maxCoeff(), 1e3 * sigma.segment<3>(3).maxCoeff());
  if (!depth.estimate) {
    table.row({"depth camera on the colour camera", fmt::format("{}, {}", name_of(depth.source), sure), depth.reason});
    return;
  }
  const DepthToColor& e = *depth.estimate;
  table.row({"depth camera on the colour camera",
             fmt::format("{:.2f} mm, {:.2f} mrad from where it was stated; {}", e.moved.head<3>().norm() * 1e3,
                         e.moved.tail<3>().norm() * 1e3, sure),
             belief_text(e) + "; " + untold_text(e.untold)});
  table.row({"its depths", fmt::format("{:.4f} ± {:.4f} times the truth", depth.mount.depth_scale, sigma[6]),
             fmt::format("corrected in the map; noise {:.2f} mm at 1 m", e.noise_at_1m * 1e3)});
  const auto used = std::ranges::count_if(e.stops, [](const DepthStopFit& stop) { return stop.used; });
  table.row({"the board's plane in depth images",
             fmt::format("{:.2f} mm RMS at {} of {} views", e.offset_rms_m * 1e3, used, depth.views), excess_text(e)});
}

void stamp_row(std::string_view camera, const StampRecord& stamps, HtmlTable& table) {
  const std::string name = fmt::format("stamps of the {} camera", camera);
  if (stamps.source == ValueSource::kGiven) {
    table.row({name, "as they are", stamps.reason});
    return;
  }
  const std::string value = fmt::format("{:+.2f} ± {:.2f} ms", stamps.offset_s * 1e3, stamps.sigma_s * 1e3);
  if (!stamps.estimate) {
    table.row({name, value, "added to have the arm's time; as stored"});
    return;
  }
  table.row({name, value,
             fmt::format("added to have the arm's time; from {} frames on the way in {} motions, up to {:.0f} mm/s",
                         stamps.estimate->frames, stamps.estimate->motions, stamps.estimate->speed_max_m_s * 1e3)});
}

}  // namespace

std::string alignment_table(const RunRecord& record) {
  if (!record.alignment) return {};
  HtmlTable table({"sensors to each other", "value", "what it says"}, 3);
  depth_rows(record.alignment->depth_camera, table);
  stamp_row("colour", record.alignment->color_stamps, table);
  stamp_row("depth", record.alignment->depth_stamps, table);
  return table.html();
}

}  // namespace firstlook
