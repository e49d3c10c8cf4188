#include "app/report/map_figures.hpp"

#include <fmt/format.h>

#include "algorithms/mapping/height_color.hpp"
#include "app/report/html.hpp"
#include "app/report/picture_bytes.hpp"

namespace firstlook {
namespace {

std::string line_svg(const MapPicture::Line& line) {
  std::string d;
  for (const Eigen::Vector2d& p : line.points_px) {
    if (!p.allFinite()) return {};
    d += fmt::format("{}{:.1f} {:.1f}", d.empty() ? 'M' : 'L', p.x(), p.y());
  }
  return fmt::format("<path class=\"{}\" d=\"{}\"/>\n", line.style, d);
}

std::string text_svg(std::string_view style, const Eigen::Vector2d& at_px, double size_px, const std::string& text) {
  if (!at_px.allFinite()) return {};
  // 0.35: from the middle of a digit down to the baseline.
  return fmt::format("<text class=\"{}\" x=\"{:.1f}\" y=\"{:.1f}\" font-size=\"{:g}\">{}</text>\n", style, at_px.x(),
                     at_px.y() + 0.35 * size_px, size_px, escape_html(text));
}

std::string views_svg(const MapPicture& p) {
  std::string dots, numbers;
  const double radius_px = p.picture.width / 240.0;
  for (const MapPicture::View& view : p.views) {
    if (!view.at_px.allFinite()) continue;
    dots += fmt::format("<circle class=\"{}\" cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{:.1f}\"/>\n", view.style, view.at_px.x(),
                        view.at_px.y(), radius_px);
    if (view.number_px) numbers += text_svg("number", *view.number_px, p.text_px, fmt::format("{}", view.number));
  }
  return dots + numbers;
}

/// The colours of heights in the upper right corner, from the lowest voxels to the highest.
std::string height_scale(const MapPicture& p) {
  if (!p.heights_m) return {};
  constexpr int kSteps = 24;
  const double x = p.picture.width - 30, top = 22, height = 0.24 * p.picture.height;
  std::string svg = fmt::format(
      "<g class=\"scale\"><rect class=\"frame\" x=\"{:.1f}\" y=\"{:.1f}\" width=\"18\" "
      "height=\"{:.1f}\"/>\n",
      x, top, height);
  for (int i = 0; i < kSteps; ++i) {
    const auto c = height_color((i + 0.5) / kSteps);
    svg += fmt::format("<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"18\" height=\"{:.1f}\" fill=\"rgb({},{},{})\"/>\n", x,
                       top + height * (kSteps - 1 - i) / kSteps, height / kSteps + 0.6, c[0], c[1], c[2]);
  }
  const auto [low, high] = *p.heights_m;
  for (const double fraction : {0.0, 0.5, 1.0}) {
    svg += fmt::format("<text class=\"end\" x=\"{:.1f}\" y=\"{:.1f}\" font-size=\"{:g}\">{:.2f} m</text>\n", x - 6,
                       top + height * (1 - fraction) + 0.35 * p.text_px, p.text_px, low + fraction * (high - low));
  }
  return svg + "</g>\n";
}

std::string figure(const MapPicture& p, int number) {
  const std::vector<std::byte> png = encode_png(p.picture);
  if (png.empty()) return {};
  std::string svg = fmt::format(
      "<svg class=\"map\" viewBox=\"-0.5 -0.5 {0} {1}\" role=\"img\" aria-label=\"{2}\">\n<image x=\"-0.5\" "
      "y=\"-0.5\" width=\"{0}\" height=\"{1}\" href=\"data:image/png;base64,{3}\"/>\n",
      p.picture.width, p.picture.height, escape_html(p.picture.caption), base64(png));
  for (const MapPicture::Line& line : p.lines) svg += line_svg(line);
  svg += views_svg(p);
  for (const MapPicture::Label& label : p.labels) svg += text_svg(label.style, label.at_px, p.text_px, label.text);
  svg += height_scale(p) + "</svg>";
  return fmt::format(
      "<figure class=\"shot\" id=\"map{0}\"><a href=\"#map{0}\">{1}</a><figcaption>{2}</figcaption>"
      "<a class=\"close\" href=\"#map\">close</a></figure>\n",
      number, svg, escape_html(p.picture.caption));
}

}  // namespace

std::string map_figures(std::span<const MapPicture> pictures, int first_number) {
  std::string html, group;
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    const MapPicture& p = pictures[i];
    const bool first = i == 0 || p.group != pictures[i - 1].group;
    const bool last = i + 1 == pictures.size() || p.group != pictures[i + 1].group;
    if (first) {
      group = fmt::format("<div class=\"group {}\"><h3>{}</h3>\n<div class=\"side\">\n",
                          p.layout == MapPicture::Layout::kWide   ? "wide"
                          : p.layout == MapPicture::Layout::kHalf ? "half"
                                                                  : "two",
                          escape_html(p.group));
    }
    group += figure(p, first_number + static_cast<int>(i));
    if (last) html += group + "</div></div>\n";
  }
  return html.empty() ? html : "<div class=\"maps\">\n" + html + "</div>\n";
}

}  // namespace firstlook
