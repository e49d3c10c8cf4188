#include "app/report/report_html.hpp"

#include <fmt/format.h>

#include "app/report/html.hpp"
#include "app/report/sections.hpp"

namespace firstlook {
namespace {

std::string navigation(const RunRecord& record) {
  std::string html = "<nav>";
  const auto link = [&](std::string_view id, std::string_view text) {
    html += fmt::format("<a href=\"#{}\">{}</a>", id, text);
  };
  link("hand-eye", "Hand-eye");
  if (record.hand_eye && record.hand_eye->touch_test) link("touch-test", "Touch test");
  if (!record.calibration_views.empty()) link("calibration-views", "Board views");
  link("map", "Map");
  if (record.mapping) {
    link("remaining", "Unknown");
    link("views", "Views");
  }
  link("safety", "Safety");
  if (record.truth) link("truth", "Truth");
  if (record.memory) link("memory", "Memory");
  link("provenance", "Provenance");
  return html + "</nav>\n";
}

}  // namespace

std::string report_html(const RunRecord& record) {
  const std::string title = fmt::format("firstlook report: {}, seed {}", escape_html(record.cell), record.seed);
  std::string html = page_head(title);
  html += fmt::format(
      "<body>\n<main>\n<header><h1>Cell {}, seed {}</h1><span class=\"brand\">firstlook {} · report</span></header>\n",
      escape_html(record.cell), record.seed, escape_html(record.provenance.version));
  html += navigation(record);
  html += summary_section(record);
  html += hand_eye_section(record);
  html += touch_test_section(record);
  html += calibration_views_section(record);
  html += map_section(record);
  html += remaining_section(record);
  html += mapping_views_section(record);
  html += safety_section(record);
  html += truth_section(record);
  html += memory_section(record);
  html += provenance_section(record);
  html += wall_section(record);
  return html + "</main>\n</body>\n</html>\n";
}

}  // namespace firstlook
