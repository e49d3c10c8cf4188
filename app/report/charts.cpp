#include "app/report/charts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

#include "app/report/html.hpp"
#include "app/report/svg.hpp"

namespace firstlook {
namespace {

using svg::kBlue, svg::kGreen, svg::kGrey, svg::kOrange;
using svg::line, svg::nice_step, svg::text_at;

constexpr double kPhaseShown_s = 0.05;

/// Places of a drawing area inside an SVG and the value ranges that it shows.
struct Plot {
  double left, top, width, height;
  double x_low, x_high, y_high;  // y begins at 0
  [[nodiscard]] double x(double value) const { return left + (value - x_low) / (x_high - x_low) * width; }
  [[nodiscard]] double y(double value) const { return top + height - value / y_high * height; }
  [[nodiscard]] double bottom() const { return top + height; }
  [[nodiscard]] double right() const { return left + width; }
};

std::string axis_y(const Plot& plot, double step, auto&& label) {
  std::string svg;
  for (int i = 0; step * i <= plot.y_high * 1.0001; ++i) {
    const double y = plot.y(step * i);
    svg += line(plot.left, y, plot.right(), y, i == 0 ? "axis" : "grid");
    svg += text_at(plot.left - 6, y + 4, "end", label(step * i));
  }
  return svg;
}

/// Labels at the right end of lines, moved apart where they would overlap.
std::string end_labels(const Plot& plot, std::vector<std::pair<double, std::string>> labels) {
  std::sort(labels.begin(), labels.end());
  std::string svg;
  double previous = -1e9;
  // From the top down; the last may end up a little below its line, never on another label.
  for (auto& [y, text] : labels) {
    y = std::max(y, previous + 15);
    previous = y;
  }
  const double overflow = std::max(0.0, previous - plot.bottom() - 4);
  for (const auto& [y, text] : labels)
    svg += fmt::format("{}", text_at(plot.right() + 8, y - overflow + 4, "start", text));
  return svg;
}

std::string thousands(double value) {
  return value >= 10000 ? fmt::format("{:.0f} k", value / 1000) : fmt::format("{:.0f}", value);
}

/// A word below the part of the plot that belongs to one phase, and a line where it begins.
std::string phase_bands(const Plot& plot, std::span<const MappingViewRecord> views) {
  std::string svg;
  std::size_t start = 0;
  for (std::size_t i = 1; i <= views.size(); ++i) {
    if (i < views.size() && views[i].phase == views[start].phase) continue;
    const double from = plot.x(static_cast<double>(start) + (start == 0 ? 1.0 : 0.5));
    if (start > 0) svg += line(from, plot.top - 14, from, plot.bottom(), "mark");
    svg += text_at(from + 4, plot.top - 5, "start", views[start].phase, "class=\"note\"");
    start = i;
  }
  return svg;
}

}  // namespace

std::string voxel_chart(std::span<const MappingViewRecord> views) {
  if (views.empty()) return {};
  struct Series {
    std::string_view name, colour;
    std::uint64_t MappingViewRecord::* count;
  };
  const std::array<Series, 3> all = {{{"unknown", kGrey, &MappingViewRecord::unknown},
                                      {"free", kBlue, &MappingViewRecord::free},
                                      {"occupied", kOrange, &MappingViewRecord::occupied}}};
  std::uint64_t top = 1;
  for (const MappingViewRecord& view : views) top = std::max({top, view.unknown, view.free, view.occupied});
  const double step = nice_step(static_cast<double>(top), 5);
  const double views_shown = std::max(2.0, static_cast<double>(views.size()));
  const Plot plot{62, 26, 560, 260, 1, views_shown, step * std::ceil(static_cast<double>(top) / step)};

  std::string svg = svg::open(760, 330, "Voxels unknown, free and occupied against the number of views");
  svg += axis_y(plot, step, thousands);
  const int view_step = std::max(1, static_cast<int>(nice_step(views_shown, 10)));
  for (int i = view_step == 1 ? 1 : view_step; i <= static_cast<int>(views_shown); i += view_step) {
    svg += text_at(plot.x(i), plot.bottom() + 18, "middle", fmt::format("{}", i));
  }
  svg += text_at(plot.left + plot.width / 2, plot.bottom() + 38, "middle", "view", "class=\"note\"");
  svg += text_at(plot.left - 50, plot.top - 12, "start", "voxels", "class=\"note\"");
  svg += phase_bands(plot, views);
  std::vector<std::pair<double, std::string>> labels;
  for (const Series& series : all) {
    std::string points;
    for (std::size_t i = 0; i < views.size(); ++i) {
      points += fmt::format("{}{:.1f} {:.1f}", i == 0 ? "M" : "L", plot.x(static_cast<double>(i) + 1),
                            plot.y(static_cast<double>(views[i].*series.count)));
    }
    svg += fmt::format("<path class=\"line\" stroke=\"{}\" d=\"{}\"/>\n", series.colour, points);
    const std::uint64_t last = views.back().*series.count;
    labels.emplace_back(plot.y(static_cast<double>(last)), fmt::format("{} {}", series.name, grouped(last)));
    const double x = plot.x(static_cast<double>(views.size()));
    svg += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3.5\" fill=\"{}\"/>\n", x,
                       plot.y(static_cast<double>(last)), series.colour);
  }
  svg += end_labels(plot, std::move(labels));
  return svg + "</svg>\n";
}

std::string view_rms_chart(std::span<const CalibrationViewRecord> views) {
  if (views.empty()) return {};
  double top = 0.01;
  bool held_out = false;
  for (const CalibrationViewRecord& view : views) {
    top = std::max({top, view.rms_px, view.holdout_px.value_or(0)});
    held_out = held_out || view.holdout_px;
  }
  const double step = nice_step(top, 4);
  const Plot plot{
      48, 26, 430, 200, 0.5, static_cast<double>(views.size()) + 0.5, step * std::ceil(top / step * 0.9999)};
  std::string svg = svg::open(490, 270, "Reprojection error of each calibration view");
  svg += axis_y(plot, step, [](double v) { return fmt::format("{:.3g}", v); });
  const double slot = plot.width / static_cast<double>(views.size());
  const auto bar = [&](double x, double width, double value, std::string_view colour) {
    svg += fmt::format("<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" rx=\"2\" fill=\"{}\"/>\n", x,
                       plot.y(value), width, plot.bottom() - plot.y(value), colour);
  };
  for (std::size_t i = 0; i < views.size(); ++i) {
    const double x = plot.x(static_cast<double>(i) + 1);
    bar(x - slot * 0.4, slot * (held_out ? 0.4 : 0.8), views[i].rms_px,
        views[i].counted && views[i].used ? kBlue : kGrey);
    if (views[i].holdout_px) bar(x, slot * 0.4, *views[i].holdout_px, kOrange);
    if (views.size() <= 20 || (i + 1) % 5 == 0)
      svg += text_at(x, plot.bottom() + 17, "middle", fmt::format("{}", i + 1));
  }
  svg += text_at(plot.left + plot.width / 2, plot.bottom() + 36, "middle", "calibration view", "class=\"note\"");
  svg += text_at(4, 14, "start", "RMS, px", "class=\"note\"");
  if (held_out) {
    svg += fmt::format("<rect x=\"200\" y=\"4\" width=\"11\" height=\"11\" fill=\"{}\"/>", kBlue) +
           text_at(216, 14, "start", "solved with it");
    svg += fmt::format("<rect x=\"320\" y=\"4\" width=\"11\" height=\"11\" fill=\"{}\"/>", kOrange) +
           text_at(336, 14, "start", "solved without it");
  }
  return svg + "</svg>\n";
}

std::string residual_chart(std::span<const CalibrationViewRecord> views) {
  std::vector<Eigen::Vector2d> residuals;
  std::vector<double> lengths;
  for (const CalibrationViewRecord& view : views) {
    if (!view.counted || !view.used) continue;
    for (std::size_t i = 0; i < std::min(view.detected_px.size(), view.reprojected_px.size()); ++i) {
      const Eigen::Vector2d r = view.detected_px[i] - view.reprojected_px[i];
      if (!r.allFinite()) continue;
      residuals.push_back(r);
      lengths.push_back(r.norm());
    }
  }
  if (residuals.empty()) return {};
  std::sort(lengths.begin(), lengths.end());
  // The outermost ring holds 99 % of the dots; the rest stands on the rim.
  const double reach = std::max(1e-3, lengths[lengths.size() * 99 / 100]);
  const double ring = nice_step(reach, 3);
  const double limit = ring * std::ceil(reach / ring * 0.9999);
  constexpr double kCentre = 130, kRadius = 104;
  std::string svg = svg::open(300, 270, "Reprojection error of every corner");
  for (double r = ring; r <= limit * 1.0001; r += ring) {
    svg += fmt::format("<circle class=\"ring\" cx=\"{}\" cy=\"{}\" r=\"{:.1f}\"/>\n", kCentre, kCentre,
                       r / limit * kRadius);
  }
  svg += line(kCentre - kRadius, kCentre, kCentre + kRadius, kCentre, "grid");
  svg += line(kCentre, kCentre - kRadius, kCentre, kCentre + kRadius, "grid");
  std::string dots;
  for (const Eigen::Vector2d& r : residuals) {
    const double scale = std::min(1.0, limit / std::max(r.norm(), 1e-12)) / limit * kRadius;
    dots += fmt::format("M{:.1f} {:.1f}h0", kCentre + r.x() * scale, kCentre + r.y() * scale);
  }
  svg += fmt::format("<path class=\"dots\" stroke=\"{}\" d=\"{}\"/>\n", kBlue, dots);
  for (double r = ring; r <= limit * 1.0001; r += ring) {
    const std::string distance = fmt::format("{:.3g} px", r);
    svg += text_at(kCentre + 3, kCentre - r / limit * kRadius - 3, "start", distance, "class=\"note\"");
  }
  svg += text_at(kCentre, 262, "middle", fmt::format("{} corners", residuals.size()), "class=\"note\"");
  return svg + "</svg>\n";
}

std::string phase_chart(std::span<const PhaseRecord> all_phases) {
  // A state that was only passed through is no phase that a reader looks for.
  std::vector<PhaseRecord> phases;
  std::copy_if(all_phases.begin(), all_phases.end(), std::back_inserter(phases),
               [](const PhaseRecord& phase) { return !(phase.end_s - phase.start_s < kPhaseShown_s); });
  if (phases.empty()) return {};
  double begin = 0, end = 0;  // time counts from the start of the program
  for (const PhaseRecord& phase : phases) {
    begin = std::min(begin, phase.start_s);
    end = std::max(end, phase.end_s);
  }
  const double step = nice_step(std::max(end - begin, 1e-3), 8);
  const double row = 24;
  const Plot plot{120, 10, 560, row * static_cast<double>(phases.size()), begin, std::max(end, begin + 1e-3), 1};
  std::string svg = svg::open(760, plot.bottom() + 30, "Phases of the job over time");
  for (double t = step * std::ceil(begin / step); t <= end + 1e-9; t += step) {
    svg += line(plot.x(t), plot.top, plot.x(t), plot.bottom(), "grid");
    svg += text_at(plot.x(t), plot.bottom() + 18, "middle", fmt::format("{:g} s", t));
  }
  for (std::size_t i = 0; i < phases.size(); ++i) {
    const double y = plot.top + row * static_cast<double>(i);
    const double x = plot.x(phases[i].start_s);
    const double width = std::max(2.0, plot.x(phases[i].end_s) - x);
    svg += text_at(plot.left - 8, y + 16, "end", phases[i].name);
    svg += fmt::format("<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"14\" rx=\"3\" fill=\"{}\"/>\n", x,
                       y + 5, width, kGreen);
    svg +=
        text_at(x + width + 5, y + 16, "start", duration_text(phases[i].end_s - phases[i].start_s), "class=\"note\"");
  }
  return svg + "</svg>\n";
}

std::string memory_chart(const MemoryRecord& memory) {
  std::vector<PoolRecord> rows;
  rows.push_back({"budget", memory.budget_bytes, memory.peak_bytes});
  rows.insert(rows.end(), memory.pools.begin(), memory.pools.end());
  std::uint64_t top = 1;
  for (const PoolRecord& pool : rows) top = std::max({top, pool.reserved_bytes, pool.peak_bytes});
  const double row = 24;
  const Plot plot{190, 6, 340, row * static_cast<double>(rows.size()), 0, static_cast<double>(top), 1};
  std::string svg = svg::open(760, plot.bottom() + 10, "Memory reserved and used");
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const PoolRecord& pool = rows[i];
    const double y = plot.top + row * static_cast<double>(i);
    const auto bar = [&](std::uint64_t bytes, std::string_view colour) {
      svg += fmt::format("<rect x=\"{}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"14\" rx=\"3\" fill=\"{}\"/>\n",
                         plot.left, y + 5, plot.x(static_cast<double>(bytes)) - plot.left, colour);
    };
    svg += text_at(plot.left - 8, y + 16, "end", pool.name);
    bar(pool.reserved_bytes, "#d7dde5");
    if (pool.declared) {
      bar(pool.peak_bytes, "#9aa5b1");
      svg += text_at(plot.right() + 10, y + 16, "start", fmt::format("{}, declared", mib_text(pool.reserved_bytes)));
      continue;
    }
    bar(pool.peak_bytes, pool.peak_bytes > pool.reserved_bytes ? kOrange : kGreen);
    svg += text_at(plot.right() + 10, y + 16, "start",
                   fmt::format("{} of {}", mib_text(pool.peak_bytes), mib_text(pool.reserved_bytes)));
  }
  return svg + "</svg>\n";
}

std::string corner_picture(const CalibrationViewRecord& view, const CornerPicture& picture) {
  // Pixel centres are integers: the frame reaches from -0.5 to width - 0.5.
  std::string svg =
      fmt::format("<svg class=\"shot\" viewBox=\"-0.5 -0.5 {} {}\" role=\"img\" aria-label=\"calibration view\">\n",
                  picture.width, picture.height);
  svg += fmt::format("<rect x=\"-0.5\" y=\"-0.5\" width=\"{}\" height=\"{}\" fill=\"#2b3038\"/>\n", picture.width,
                     picture.height);
  if (!picture.jpeg_base64.empty()) {
    svg += fmt::format(
        "<image x=\"-0.5\" y=\"-0.5\" width=\"{}\" height=\"{}\" preserveAspectRatio=\"none\" "
        "href=\"data:image/jpeg;base64,{}\"/>\n",
        picture.picture_width, picture.picture_height, picture.jpeg_base64);
  }
  std::string rings, crosses;
  for (const Eigen::Vector2d& p : view.detected_px) {
    if (p.allFinite()) rings += fmt::format("M{:.1f} {:.1f}a5 5 0 1 0 10 0a5 5 0 1 0-10 0", p.x() - 5, p.y());
  }
  for (const Eigen::Vector2d& p : view.reprojected_px) {
    if (p.allFinite()) crosses += fmt::format("M{:.1f} {:.1f}h8m-4-4v8", p.x() - 4, p.y());
  }
  svg += fmt::format("<path class=\"detected\" d=\"{}\"/><path class=\"reprojected\" d=\"{}\"/>\n", rings, crosses);
  return svg + "</svg>\n";
}

}  // namespace firstlook
