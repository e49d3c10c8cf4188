#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "app/report/charts.hpp"
#include "app/report/html.hpp"
#include "app/report/sections.hpp"

namespace firstlook {
namespace {

struct Banner {
  std::string_view style, title;
};

Banner banner_of(const RunRecord& record) {
  switch (record.outcome) {
    case Outcome::kDone:
      return {"good", "Done"};
    case Outcome::kCalibrationRejected:
      return {"bad", "Calibration rejected"};
    case Outcome::kSafelyStopped:
      return {"caution", "Stopped safely"};
    case Outcome::kFaulted:
      return {"bad", "Ended by a fault"};
  }
  return {"bad", "Ended by a fault"};
}

std::string tile(std::string_view value, std::string_view label) {
  return fmt::format("<div class=\"tile\"><b>{}</b><span>{}</span></div>\n", escape_html(value), escape_html(label));
}

std::string tiles(const RunRecord& record) {
  std::string html;
  if (record.hand_eye) {
    const HandEyeResult& h = *record.hand_eye;
    html += tile(fmt::format("± {:.2f} mm", h.sigma_translation_m.maxCoeff() * 1e3),
                 "camera position, 1σ of the worst axis");
    html += tile(fmt::format("± {:.2f} mrad", h.sigma_rotation_rad.maxCoeff() * 1e3),
                 "camera rotation, 1σ of the worst axis");
    html += tile(fmt::format("{:.2f} m", h.usable_distance_m), "distance at which the gripper's tolerance holds");
  }
  if (record.mapping) {
    const VoxelCounts& v = record.mapping->voxels;
    const double total = static_cast<double>(std::max<std::size_t>(1, v.unknown + v.free + v.occupied));
    html += tile(fmt::format("{:.1f} %", 100.0 * static_cast<double>(v.free + v.occupied) / total),
                 "of the space in reach is known");
    html += tile(fmt::format("{}", record.mapping->views.size()), "views for the map");
  }
  if (record.safety && record.safety->min_clearance_m()) {
    html += tile(fmt::format("{:.0f} mm", *record.safety->min_clearance_m() * 1e3), "least distance to space not free");
  }
  double end = 0;
  for (const PhaseRecord& phase : record.phases) end = std::max(end, phase.end_s);
  if (end > 0) html += tile(duration_text(end), "from the button to the report");
  return html.empty() ? html : "<div class=\"tiles\">\n" + html + "</div>\n";
}

}  // namespace

std::string summary_section(const RunRecord& record) {
  const Banner banner = banner_of(record);
  std::string sentence = record.reason;
  if (!sentence.empty() && sentence[0] >= 'a' && sentence[0] <= 'z') {
    sentence[0] = static_cast<char>(sentence[0] - 'a' + 'A');
  }
  std::string html = fmt::format("<div class=\"banner {}\"><h2>{}</h2>\n<p>{}</p>\n", banner.style, banner.title,
                                 escape_html(sentence));
  if (!record.remedy.empty()) html += "<p>What to do: " + escape_html(record.remedy) + "</p>\n";
  if (record.hand_eye && record.hand_eye->verdict == Verdict::kRejected) {
    html += "<ul>\n";
    for (const std::string& reason : record.hand_eye->reasons) html += "<li>" + escape_html(reason) + "</li>\n";
    html += "</ul>\n";
  }
  html += "</div>\n" + tiles(record);
  if (!record.phases.empty()) {
    html += section("phases", "The job", "<div class=\"figure\">\n" + phase_chart(record.phases) + "</div>\n");
  }
  return html;
}

}  // namespace firstlook
