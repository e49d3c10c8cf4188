#include <fmt/format.h>

#include <algorithm>

#include "app/report/html.hpp"
#include "app/report/sections.hpp"

namespace firstlook {
namespace {

std::string millimetres(double metres) { return fmt::format("{:.1f}", metres * 1e3); }

std::string clearance_table(const ClearanceTerms& c) {
  HtmlTable table({"term of the clearance", "mm"}, 1);
  table.row({"half a voxel diagonal", millimetres(c.half_voxel_diagonal_m)});
  table.row({fmt::format("3σ of what was seen: hand-eye {:.1f}, depth {:.1f}, depth camera {:.1f}, tracking {:.1f} mm "
                         "(1σ each)",
                         c.sigma_hand_eye_m * 1e3, c.sigma_depth_m * 1e3, c.sigma_depth_camera_m * 1e3,
                         c.sigma_tracking_m * 1e3),
             millimetres(c.uncertainty_m)});
  table.row({"sag under payload", millimetres(c.payload_sag_m)});
  table.row({"stopping distance", millimetres(c.stopping_m)});
  table.row({"required from the centre of every voxel that is not known free", millimetres(c.voxels_m)});
  table.row({"required from configured surfaces (safe zone, keep-out boxes)", millimetres(c.surface_m)});
  return table.html();
}

std::string distance_html(const SafetyRecord& s) {
  if (!s.min_clearance_m()) return {};
  HtmlTable table({"least distance of the moving body to space not free", "mm"}, 1);
  if (s.min_clearance_calibrating_m) {
    table.row({"calibrating: with the camera's envelope, to the surface of the safe zone and keep-out boxes",
               millimetres(*s.min_clearance_calibrating_m)});
  }
  if (s.min_clearance_mapping_m) {
    table.row({"mapping: with the camera, to the nearest corner of voxels not known free and to these surfaces",
               millimetres(*s.min_clearance_mapping_m)});
  }
  return table.html() +
         "<p class=\"hint\">Measured by the guardian at every report of the arm while it moved, on points 25 mm apart "
         "all "
         "over the body. The required distance is planned for; the stopping distance in it may be used up, and to "
         "voxels "
         "half a diagonal of it is already taken off here.</p>\n";
}

std::string stops_html(const std::vector<StopRecord>& stops) {
  if (stops.empty()) return paragraph("The arm was never stopped.");
  HtmlTable table({"time", "the arm was stopped because"}, 2);
  for (const StopRecord& stop : stops) table.row({duration_text(stop.time_s), stop.cause});
  return table.html();
}

std::string faults_html(const std::vector<FaultRecord>& faults) {
  if (faults.empty()) return {};
  HtmlTable table({"time", "code", "what", "detail", "what to do"}, 5);
  for (const FaultRecord& fault : faults) {
    const FaultRow& row = fault_row(fault.fault);
    table.row({duration_text(fault.time_s), fmt::format("E{}", static_cast<int>(fault.fault)), std::string(row.text),
               fault.detail, std::string(row.remedy)});
  }
  return "<h3>Fault log</h3>\n" + table.html();
}

}  // namespace

std::string safety_section(const RunRecord& record) {
  std::string body;
  if (record.safety) {
    const SafetyRecord& s = *record.safety;
    if (s.clearance) body += clearance_table(*s.clearance);
    body += distance_html(s);
    body += stops_html(s.stops);
  } else {
    body += paragraph("The arm did not move in this run.");
  }
  body += faults_html(record.faults);
  body +=
      "<p class=\"hint\">A map is not presence sensing: it shows what stood there when it was looked at. People must "
      "be guarded by the cell's own safety devices.</p>\n";
  return section("safety", "Safety", body);
}

std::string truth_section(const RunRecord& record) {
  if (!record.truth) return {};
  const TruthRecord& t = *record.truth;
  HtmlTable table({"figure", "value"}, 1);
  const auto row = [&](std::string name, const std::optional<double>& value, std::string_view unit, double factor = 1) {
    table.row({std::move(name), value ? fmt::format("{:.3g}{}", *value * factor, unit) : "not determined"});
  };
  row("hand-eye error, translation", t.hand_eye_error_mm, " mm");
  row("hand-eye error, rotation", t.hand_eye_error_mrad, " mrad");
  row("the same against the stated covariance (squared, 6 expected)", t.hand_eye_mahalanobis2, "");
  table.row({"contacts of the true body with the scene", grouped(t.contacts)});
  table.row({"entries of the true body into space not known free", grouped(t.unknown_entries)});
  row("seen of what could be observed", t.coverage_of_observable, " %", 100);
  const auto way = [](const std::optional<TruthRecord::Way>& w) {
    return w ? fmt::format("{:.0f} s of mapping, {} views", w->time_s, w->views) : "not reached";
  };
  if (t.coverage_of_observable) {
    table.row({"95 % of it were known after", way(t.to_95)});
    table.row({"99 % of it were known after", way(t.to_99)});
  }
  table.row({"voxels called free that hold something",
             t.false_free_voxels ? grouped(*t.false_free_voxels) : "not determined"});
  row("of the space in reach called occupied with nothing within a voxel", t.false_occupied_fraction, " %", 100);
  for (const TruthRecord::Region& region : t.regions) {
    std::string name = region.name;
    std::replace(name.begin(), name.end(), '_', ' ');
    table.row({"known of what could be observed " + name + ", before exploration and at the end",
               fmt::format("{:.0f} % and {:.0f} %", 100 * region.known_after_sweep, 100 * region.known)});
  }
  return section(
      "truth", "Graded against the simulated cell",
      "<p>The simulator knows the truth. The job never reads it; it only grades the result.</p>\n" + table.html());
}

}  // namespace firstlook
