#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "app/report/charts.hpp"
#include "app/report/html.hpp"
#include "app/report/map_figures.hpp"
#include "app/report/sections.hpp"

namespace firstlook {
namespace {

constexpr std::size_t kClustersShown = 20;

std::string litres(std::uint64_t voxels, double resolution_m) {
  return fmt::format("{:.1f}", static_cast<double>(voxels) * resolution_m * resolution_m * resolution_m * 1e3);
}

std::string counts_table(const MappingRecord& m) {
  HtmlTable table({"class", "in the reach of the arm", "litres", "share", "in the whole grid", "litres", "share"}, 1);
  const auto share = [](std::size_t count, const VoxelCounts& v) {
    const double total = static_cast<double>(std::max<std::size_t>(1, v.unknown + v.free + v.occupied));
    return fmt::format("{:.1f} %", 100 * static_cast<double>(count) / total);
  };
  const auto row = [&](std::string name, std::size_t VoxelCounts::* count) {
    const std::size_t zone = m.voxels.*count, grid = m.grid_voxels.*count;
    table.row({std::move(name), grouped(zone), litres(zone, m.resolution_m), share(zone, m.voxels), grouped(grid),
               litres(grid, m.resolution_m), share(grid, m.grid_voxels)});
  };
  row("free", &VoxelCounts::free);
  row("occupied", &VoxelCounts::occupied);
  row("unknown", &VoxelCounts::unknown);
  return table.html();
}

std::string objects_table(const MapObjects& objects) {
  if (objects.objects.empty()) return {};
  HtmlTable table({"object", "shape", "voxels", "size, m", "centre in base, m"}, 2);
  for (const MapObject& o : objects.objects) {
    const Eigen::Vector3d &s = o.box.size_m, &c = o.box.center_m;
    table.row({fmt::format("{}", o.id), std::string(to_string(o.shape)) + (o.bounds_room ? ", bounds the room" : ""),
               grouped(o.voxels), fmt::format("{:.2f} x {:.2f} x {:.2f}", s.x(), s.y(), s.z()),
               fmt::format("{:.2f}, {:.2f}, {:.2f}", c.x(), c.y(), c.z())});
  }
  return "<h3>The objects in their boxes</h3>\n" + table.html() +
         fmt::format(
             "<p class=\"hint\">Connected occupied voxels in their boxes; {} more in pieces of fewer than {}."
             "</p>\n",
             grouped(objects.specks), kObjectVoxelsMin);
}

std::string prior_table(const MapChange& change, double resolution_m) {
  HtmlTable table({"against the earlier map, in the reach of the arm", "voxels", "litres"}, 1);
  const auto row = [&](std::string text, std::size_t voxels) {
    table.row({std::move(text), grouped(voxels), litres(voxels, resolution_m)});
  };
  row("newly occupied: it was free", change.newly_occupied);
  row("gone: it was occupied", change.gone);
  row("still occupied", change.still_occupied);
  row("was occupied, not seen this time: unknown", change.unseen_occupied);
  row("was free, not seen this time: unknown", change.unseen_free);
  row("known for the first time", change.first_known);
  return "<h3>What changed</h3>\n" + table.html();
}

constexpr std::string_view kMapLegend =
    "<p class=\"hint\"><span class=\"dot sweep\"></span> views of the sweep, <span class=\"dot explore\"></span> of "
    "the "
    "exploration, joined in order; occupied voxels in the colours of their height; <span class=\"dot unknown\"></span> "
    "unknown in the reach of the arm. In layers: occupied dark, free light, unknown out of reach grey. Lines on the "
    "floor "
    "every 0.5 m; axes of the controller's <code>base</code>. Select a picture to enlarge it.</p>\n";

/// The words of result.json as a person says them; any other text stays as it is.
std::string reason_text(const std::string& reason) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 4> kTexts = {{
      {"occluded", "occluded: something stands between it and every place that the camera could take"},
      {"out_of_range", "out of range: nearer to the camera than the sensor sees, or farther than it is trusted"},
      {"out_of_reach", "out of reach: the arm could see it only from space that is not known to be free"},
      {"no_return", "no return: looked at several times without an answer"},
  }};
  for (const auto& [word, text] : kTexts) {
    if (reason == word) return std::string(text);
  }
  return reason;
}

std::string joints_text(const JointVector& joints_rad) {
  std::string text;
  for (int i = 0; i < joints_rad.size(); ++i) {
    // Adding 0 to a rounded value turns -0 into 0.
    text += fmt::format("{}{:.0f}", i == 0 ? "" : "  ", std::round(joints_rad[i] * 180.0 / std::numbers::pi) + 0.0);
  }
  return text;
}

struct ReasonSum {
  std::string reason;
  std::uint64_t clusters = 0, voxels = 0;
};

std::vector<ReasonSum> sums_by_reason(const std::vector<RemainingRecord>& remaining) {
  std::vector<ReasonSum> sums;
  for (const RemainingRecord& cluster : remaining) {
    auto sum = std::find_if(sums.begin(), sums.end(), [&](const ReasonSum& s) { return s.reason == cluster.reason; });
    if (sum == sums.end()) sum = sums.insert(sums.end(), ReasonSum{cluster.reason});
    ++sum->clusters;
    sum->voxels += cluster.voxels;
  }
  std::stable_sort(sums.begin(), sums.end(),
                   [](const ReasonSum& a, const ReasonSum& b) { return a.voxels > b.voxels; });
  return sums;
}

/// "3 were dropped: 2 pose uncertain, 1 unreadable", or that none was.
std::string refused_text(const MappingRecord& m) {
  if (m.frames_dropped() == 0) return "none was dropped";
  std::string text = fmt::format("{} were dropped", grouped(m.frames_dropped()));
  std::string_view separator = ": ";
  for (std::size_t i = 0; i < kFrameFlaws; ++i) {
    if (m.frames_refused[i] == 0) continue;
    std::string words(to_string(static_cast<FrameFlaw>(i)));
    std::ranges::replace(words, '_', ' ');
    text += fmt::format("{}{} {}", separator, grouped(m.frames_refused[i]), words);
    separator = ", ";
  }
  return text;
}

/// What is kept for each voxel besides, a sentence for each plane.
std::string planes_hint(const PlanesRecord& record) {
  const PlaneCounts& c = record.counts;
  std::string text;
  if (c.planes.color) {
    text += fmt::format(
        " {} of {} occupied voxels have a colour, from {} looks: <code>map.ply</code>, <code>color_map.ot</code>; grey "
        "in the pictures is what the colour camera did not see.",
        grouped(c.colored), grouped(c.occupied), grouped(record.looks_colored));
  }
  if (c.planes.label) text += fmt::format(" {} voxels have the label of their object.", grouped(c.labelled));
  for (std::size_t i = 0; i < c.seen_last_by.size(); ++i)
    text += fmt::format(" {} voxels were seen last by sensor {}.", grouped(c.seen_last_by[i]), i + 1);
  return fmt::format("<p class=\"hint\">Kept for each voxel:{}</p>\n", text);
}

}  // namespace

std::string map_section(const RunRecord& record) {
  if (!record.mapping) return section("map", "The map", paragraph("Nothing was mapped in this run."));
  const MappingRecord& m = *record.mapping;
  std::string body;
  if (const std::string figures = map_figures(record.map_pictures); !figures.empty()) {
    body += std::string(kMapLegend) + figures;
  }
  body +=
      "<h3>In the reach of the arm, view by view</h3>\n<div class=\"figure\">\n" + voxel_chart(m.views) + "</div>\n";
  body += "<h3>At the end</h3>\n" + counts_table(m);
  if (m.since_prior) body += prior_table(*m.since_prior, m.resolution_m);
  body += objects_table(m.objects);
  body += fmt::format("<p class=\"hint\">Voxels of {:.0f} mm. {} depth frames went into the map; {}.</p>\n",
                      m.resolution_m * 1e3, grouped(m.frames_integrated), refused_text(m));
  if (m.holes.policy != "ignore") {
    body += fmt::format(
        "<p class=\"hint\">Pixels without a return: {} were taken for open space and cleared {} voxels, where two "
        "poses "
        "agreed. Something dark that was never seen in front of anything cannot be told from open space.</p>\n",
        grouped(m.holes.pixels_open), grouped(m.holes.voxels_cleared));
  }
  if (m.pixels_left_out > 0) {
    body += fmt::format("<p class=\"hint\">{} returns were left out by range crop and voxel filter.</p>\n",
                        grouped(m.pixels_left_out));
  }
  if (m.pixels_fitted > 0) {
    body += fmt::format("<p class=\"hint\">{} returns were moved onto the plane of their neighbours.</p>\n",
                        grouped(m.pixels_fitted));
  }
  if (m.planes) body += planes_hint(*m.planes);
  if (m.fine) {
    body += fmt::format(
        "<p class=\"hint\">Finer map of a part, <code>fine_map.bt</code>, voxels of {:.0f} mm: {} free, {} occupied, "
        "{} "
        "unknown.</p>\n",
        m.fine->resolution_m * 1e3, grouped(m.fine->voxels.free), grouped(m.fine->voxels.occupied),
        grouped(m.fine->voxels.unknown));
  }
  if (m.occupied_forgotten > 0) {
    body +=
        fmt::format("<p class=\"hint\">{} occupied voxels were not seen for so long that they became unknown.</p>\n",
                    grouped(m.occupied_forgotten));
  }
  body +=
      "<p class=\"hint\">Files: <code>collision_map.bt</code> and <code>map.ot</code> (OctoMap), <code>map.ply</code> "
      "(points), <code>ros/*.scene</code> (MoveIt). Unknown space is an obstacle: a planner must treat it so, "
      "too.</p>\n";
  return section("map", "The map", body);
}

std::string mapping_views_section(const RunRecord& record) {
  if (!record.mapping || record.mapping->views.empty()) return {};
  HtmlTable table({"view", "phase", "time", "joints, degrees", "gain expected", "gain seen", "unknown left"}, 4);
  int number = 0;
  for (const MappingViewRecord& view : record.mapping->views) {
    table.row({fmt::format("{}", ++number), view.phase, duration_text(view.time_s), joints_text(view.joints_rad),
               view.gain_expected > 0
                   ? grouped(static_cast<std::uint64_t>(std::llround(std::min(view.gain_expected, 1e12))))
                   : std::string("–"),
               grouped(view.gain_seen), grouped(view.unknown)});
  }
  return section(
      "views", "The views in order",
      table.html("dense") +
          "<p class=\"hint\">Voxels in the reach of the arm. Expected is how many unknown ones the view was thought to "
          "reach when it was chosen, were nothing hidden behind other unknown ones; seen is by how much the unknown "
          "ones became fewer since the row above, on the way there and at the view. A last row \"end\" is the last "
          "frame on the way to where the arm stopped.</p>\n");
}

std::string remaining_section(const RunRecord& record) {
  if (!record.mapping) return {};
  const MappingRecord& m = *record.mapping;
  if (m.remaining.empty()) {
    return section("remaining", "What stays unknown", paragraph("No cluster of unknown voxels touches free space."));
  }
  HtmlTable sums({"why", "clusters", "voxels", "litres"}, 1);
  for (const ReasonSum& sum : sums_by_reason(m.remaining)) {
    sums.row({reason_text(sum.reason), grouped(sum.clusters), grouped(sum.voxels), litres(sum.voxels, m.resolution_m)});
  }
  HtmlTable largest({"voxels", "litres", "centre in base, m", "why"}, 4);
  for (std::size_t i = 0; i < std::min(kClustersShown, m.remaining.size()); ++i) {
    const RemainingRecord& cluster = m.remaining[i];
    largest.row(
        {grouped(cluster.voxels), litres(cluster.voxels, m.resolution_m),
         fmt::format("{:.2f}, {:.2f}, {:.2f}", cluster.center_m.x(), cluster.center_m.y(), cluster.center_m.z()),
         reason_text(cluster.reason)});
  }
  std::string body =
      "<p>Clusters of unknown voxels that touch free space. They are obstacles for every motion.</p>\n" + sums.html();
  if (std::ranges::any_of(m.remaining, [](const RemainingRecord& r) { return r.reason == "no_return"; })) {
    body +=
        "<p>Without a return a ray proves nothing. What helps: something that returns behind that space within the "
        "sensor's range – a floor, a wall, a screen put up for the job – for every ray that ends on it clears its way; "
        "views that look down, so that rays end on the floor; or <code>map.holes: clear_when_corroborated</code>, "
        "where "
        "nothing dark or shiny can stand in the open.</p>\n";
  }
  body += fmt::format("<details><summary>The largest {}</summary>\n{}</details>\n",
                      std::min(kClustersShown, m.remaining.size()), largest.html());
  return section("remaining", "What stays unknown", body);
}

}  // namespace firstlook
