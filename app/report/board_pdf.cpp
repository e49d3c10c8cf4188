#include "app/report/board_pdf.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <vector>

#include "algorithms/vision/target_names.hpp"
#include "algorithms/vision/target_pattern.hpp"

namespace firstlook {
namespace {

constexpr double kPointsOfMm = 72 / 25.4;
constexpr double kPrinterMargin_mm = 6;  // that no common printer prints on
constexpr double kText_mm = 8, kRuler_mm = 12, kRulerStep_mm = 10;

const std::array<PageSize, 3> kPages = {{{"A4", 210, 297}, {"letter", 215.9, 279.4}, {"A3", 297, 420}}};

/// What the target needs of a page, without printer margins.
struct Needs {
  double width_mm = 0, height_mm = 0;
};

Needs needs_of(const BoardSpec& board) {
  const Eigen::Vector2d ink_mm = 1000 * ink_extent(board).size_m;
  const double quiet_mm = 1000 * quiet_zone_m(board);
  return {ink_mm.x() + 2 * quiet_mm + kRuler_mm, ink_mm.y() + 2 * quiet_mm + kText_mm + kRuler_mm};
}

bool fits(const Needs& needs, const PageSize& page) {
  return needs.width_mm <= page.width_mm - 2 * kPrinterMargin_mm &&
         needs.height_mm <= page.height_mm - 2 * kPrinterMargin_mm;
}

PageSize turned(const PageSize& page) { return {page.name, page.height_mm, page.width_mm}; }

/// The page upright or across, whichever holds the target.
std::optional<PageSize> laid_out(const Needs& needs, const PageSize& page) {
  if (fits(needs, page)) return page;
  if (fits(needs, turned(page))) return turned(page);
  return std::nullopt;
}

Result<PageSize> choose_page(const BoardSpec& board, const std::optional<PageSize>& given) {
  const Needs needs = needs_of(board);
  if (given) {
    if (const auto page = laid_out(needs, *given)) return *page;
    return failure(Fault::kConfigBadValue,
                   "{:.0f} x {:.0f} mm with margin and ruler does not fit {} ({:.0f} x {:.0f} mm printable)",
                   needs.width_mm, needs.height_mm, given->name, given->width_mm - 2 * kPrinterMargin_mm,
                   given->height_mm - 2 * kPrinterMargin_mm);
  }
  for (const PageSize& candidate : kPages) {
    if (const auto page = laid_out(needs, candidate)) return *page;
  }
  return failure(Fault::kConfigBadValue,
                 "{:.0f} x {:.0f} mm with margin and ruler does not fit A3 (285 x 408 mm printable): give a --page "
                 "WIDTHxHEIGHT in mm",
                 needs.width_mm, needs.height_mm);
}

/// Drawing operators of one page; y goes down from the upper edge, in mm.
class Canvas {
 public:
  explicit Canvas(const PageSize& page) : page_(page) {}

  void rectangle(double x, double y, double width, double height) {
    text_ += fmt::format("{:.4f} {:.4f} {:.4f} {:.4f} re\n", points(x), points(page_.height_mm - y - height),
                         points(width), points(height));
  }
  /// Four Bezier curves; off a circle by at most 0.03 % of the radius.
  void disc(double x, double y, double radius) {
    constexpr double kHandle = 0.5522847498;
    const auto at = [&](double dx, double dy) {
      return fmt::format("{:.4f} {:.4f}", points(x + dx * radius), points(page_.height_mm - y - dy * radius));
    };
    constexpr std::array<std::array<double, 2>, 5> kRound = {{{1, 0}, {0, 1}, {-1, 0}, {0, -1}, {1, 0}}};
    text_ += at(1, 0) + " m\n";
    for (std::size_t i = 0; i < 4; ++i) {
      const auto [ax, ay] = kRound[i];
      const auto [bx, by] = kRound[i + 1];
      text_ += at(ax + kHandle * bx, ay + kHandle * by) + " " + at(bx + kHandle * ax, by + kHandle * ay) + " " +
               at(bx, by) + " c\n";
    }
  }
  /// All shapes since the last fill as one area: neighbours show no seam.
  void fill() { text_ += "f\n"; }
  void line(double x0, double y0, double x1, double y1, double width) {
    text_ += fmt::format("{:.4f} w {:.4f} {:.4f} m {:.4f} {:.4f} l S\n", points(width), points(x0),
                         points(page_.height_mm - y0), points(x1), points(page_.height_mm - y1));
  }
  void write(double x, double y, double size_mm, std::string_view words) {
    std::string safe;
    for (const char c : words) {
      if (c == '(' || c == ')' || c == '\\') safe += '\\';
      safe += c;
    }
    text_ += fmt::format("BT /F1 {:.4f} Tf {:.4f} {:.4f} Td ({}) Tj ET\n", points(size_mm), points(x),
                         points(page_.height_mm - y), safe);
  }
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  [[nodiscard]] static double points(double mm) { return mm * kPointsOfMm; }
  PageSize page_;
  std::string text_;
};

void draw_ink(const BoardSpec& board, double center_x, double center_y, Canvas& canvas) {
  const Eigen::Vector2d shift = Eigen::Vector2d(center_x, center_y) - 1000 * ink_extent(board).center_m;
  for (const InkShape& shape : ink_shapes(board)) {
    const Eigen::Vector2d low = 1000 * shape.low_m + shift, size = 1000 * (shape.high_m - shape.low_m);
    if (shape.kind == InkShape::Kind::kDisc) {
      canvas.disc(low.x() + size.x() / 2, low.y() + size.y() / 2, size.x() / 2);
    } else {
      canvas.rectangle(low.x(), low.y(), size.x(), size.y());
    }
  }
  canvas.fill();
}

/// A ruler of whole centimetres from (x, y) to the right or upwards.
void draw_ruler(double x, double y, double length_mm, bool upwards, Canvas& canvas) {
  const int steps = static_cast<int>(length_mm / kRulerStep_mm);
  const auto line = [&](double along, double out, double width) {
    if (upwards) return canvas.line(x, y - along, x + out, y - along, width);
    canvas.line(x + along, y, x + along, y - out, width);
  };
  if (upwards) {
    canvas.line(x, y, x, y - steps * kRulerStep_mm, 0.1);
  } else {
    canvas.line(x, y, x + steps * kRulerStep_mm, y, 0.1);
  }
  for (int i = 0; i <= steps; ++i) line(i * kRulerStep_mm, i % 5 == 0 ? 3.0 : 2.0, 0.1);
  const std::string words = fmt::format("{} mm", steps * static_cast<int>(kRulerStep_mm));
  if (upwards) {
    canvas.write(x, y - steps * kRulerStep_mm - 1, 2.5, words);
  } else {
    canvas.write(x + steps * kRulerStep_mm + 1, y, 2.5, words);
  }
}

/// The smallest file that readers accept: catalog, pages, page, contents, font, and where each of them begins.
std::string pdf_file(const PageSize& page, const std::string& contents) {
  const std::array<std::string, 5> objects = {
      "<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>",
      "<< /Type /Pages /Kids [3 0 R] /Count 1 >>",
      fmt::format(
          "<< /Type /Page /Parent 2 0 R /MediaBox [0 0 {:.4f} {:.4f}] /Contents 4 0 R /Resources << /Font << /F1 "
          "5 0 R >> >> >>",
          page.width_mm * kPointsOfMm, page.height_mm * kPointsOfMm),
      fmt::format("<< /Length {} >>\nstream\n{}endstream", contents.size(), contents),
      "<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica >>"};
  std::string file = "%PDF-1.6\n";
  std::vector<std::size_t> offsets;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    offsets.push_back(file.size());
    file += fmt::format("{} 0 obj\n{}\nendobj\n", i + 1, objects[i]);
  }
  const std::size_t table = file.size();
  file += fmt::format("xref\n0 {}\n0000000000 65535 f \n", objects.size() + 1);
  for (const std::size_t offset : offsets) file += fmt::format("{:010} 00000 n \n", offset);
  file += fmt::format("trailer\n<< /Size {} /Root 1 0 R >>\nstartxref\n{}\n%%EOF\n", objects.size() + 1, table);
  return file;
}

}  // namespace

std::optional<PageSize> find_page(std::string_view name) {
  std::string lower(name);
  std::ranges::transform(lower, lower.begin(),
                         [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; });
  if (lower == "a4") return kPages[0];
  if (lower == "letter") return kPages[1];
  if (lower == "a3") return kPages[2];
  double width = 0, height = 0;
  const char* const end = lower.data() + lower.size();
  const auto [middle, first] = std::from_chars(lower.data(), end, width);
  if (first != std::errc() || middle == end || *middle != 'x') return std::nullopt;
  const auto [last, second] = std::from_chars(middle + 1, end, height);
  constexpr double kLeast_mm = 10, kMost_mm = 5000;
  const auto in_range = [](double mm) { return mm >= kLeast_mm && mm <= kMost_mm; };
  if (second != std::errc() || last != end || !in_range(width) || !in_range(height)) return std::nullopt;
  return PageSize{lower, width, height};
}

Result<BoardSheet> board_sheet(const BoardSpec& board, const std::optional<PageSize>& given) {
  if (const Status fine = check_board(board); !fine) return std::unexpected(fine.error());
  const auto page = choose_page(board, given);
  if (!page) return std::unexpected(page.error());
  Canvas canvas(*page);
  canvas.write(kPrinterMargin_mm, kPrinterMargin_mm + 3, 2.8, "firstlook board: " + describe(board));
  canvas.write(kPrinterMargin_mm, kPrinterMargin_mm + 6.5, 2.4,
               "Print at 100 % (no scaling), check both rulers, glue flat, measure and enter the size you measured.");
  const double free_top = kPrinterMargin_mm + kText_mm, free_bottom = page->height_mm - kPrinterMargin_mm - kRuler_mm;
  draw_ink(board, (page->width_mm + kRuler_mm) / 2, (free_top + free_bottom) / 2, canvas);
  const double corner_x = kPrinterMargin_mm + 1, corner_y = page->height_mm - kPrinterMargin_mm - 1;
  draw_ruler(corner_x, corner_y, page->width_mm - 2 * kPrinterMargin_mm - 15, false, canvas);
  draw_ruler(corner_x, corner_y, page->height_mm - 2 * kPrinterMargin_mm - kText_mm - 8, true, canvas);
  return BoardSheet{pdf_file(*page, canvas.text()), *page, !board.is_orientation_unique()};
}

}  // namespace firstlook
