#include <fmt/format.h>

#include "app/report/charts.hpp"
#include "app/report/html.hpp"
#include "app/report/sections.hpp"

namespace firstlook {

std::string memory_section(const RunRecord& record) {
  if (!record.memory) return {};
  std::string body = "<div class=\"figure\">\n" + memory_chart(*record.memory) + "</div>\n";
  body += paragraph(
      fmt::format("Allocations of the loop after it was sealed: {}.", record.memory->loop_allocations_after_seal));
  return section("memory", "Memory", body);
}

std::string provenance_section(const RunRecord& record) {
  const Provenance& p = record.provenance;
  HtmlTable table({"", ""}, 2);
  table.row({"firstlook", p.version});
  table.row({"arm", p.arm_model});
  table.row({"cell", record.cell});
  table.row({"seed", fmt::format("{}", record.seed)});
  if (!p.sensor.empty()) table.row({"simulated sensors", p.sensor});
  table.row({"decisions", record.decisions_hash});
  if (!p.journal_hash.empty()) table.row({"journal", p.journal_hash});
  std::string body = table.html();
  if (!p.config_yaml.empty()) {
    body += "<details><summary>Configuration of this run</summary>\n<pre>" + escape_html(p.config_yaml) +
            "</pre></details>\n";
  }
  return section("provenance", "Where these figures come from", body);
}

std::string wall_section(const RunRecord& record) {
  const WallRecord& w = record.wall;
  HtmlTable table({"", ""}, 2);
  table.row({"started (UTC)", w.started});
  table.row({"took", duration_text(w.total_s)});
  table.row({"time of the job in which the arm waited for the computer", duration_text(w.stall_s)});
  table.row({"resident memory", mib_text(w.rss_bytes)});
  table.row({"workers", fmt::format("{}", w.workers)});
  table.row({"folder", w.folder});
  return section(
      "machine", "This computer",
      table.html() + paragraph("Everything above is the same for every run with this seed; these figures are not."));
}

}  // namespace firstlook
