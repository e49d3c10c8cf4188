/// The pieces that the report's diagrams are made of, as SVG text.
#pragma once

#include <string>
#include <string_view>

namespace firstlook::svg {

// Colours that remain apart with the common kinds of colour blindness (Okabe and Ito 2008).
inline constexpr std::string_view kBlue = "#0072b2", kOrange = "#d55e00", kGreen = "#009e73", kGrey = "#6b7280";

/// 1, 2 or 5 times a power of ten: about `count` steps up to `top`.
[[nodiscard]] double nice_step(double top, int count);

/// The start of a chart whose coordinates are px of `width` x `height`; `label` is a sentence of ours.
[[nodiscard]] std::string open(double width, double height, std::string_view label);
/// @param anchor  start, middle or end; @param style  further attributes, e.g. class="note"
[[nodiscard]] std::string text_at(double x, double y, std::string_view anchor, std::string_view text,
                                  std::string_view style = "");
/// @param name  class of the style sheet
[[nodiscard]] std::string line(double x1, double y1, double x2, double y2, std::string_view name);

}  // namespace firstlook::svg
