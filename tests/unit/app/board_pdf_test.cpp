#include "app/report/board_pdf.hpp"

#include <catch2/catch.hpp>
#include <sstream>

#include "algorithms/vision/target_detection.hpp"
#include "algorithms/vision/target_names.hpp"
#include "algorithms/vision/target_pattern.hpp"
#include "tests/unit/vision/draw_board.hpp"

using namespace firstlook;

namespace {

struct Rectangle {
  double x = 0, y = 0, width = 0, height = 0;  ///< mm, y up from the lower edge
};

std::vector<Rectangle> rectangles_of(const std::string& pdf) {
  std::vector<Rectangle> found;
  std::istringstream lines(pdf);
  for (std::string line; std::getline(lines, line);) {
    if (!line.ends_with(" re")) continue;
    std::istringstream numbers(line);
    Rectangle r;
    numbers >> r.x >> r.y >> r.width >> r.height;
    for (double* value : {&r.x, &r.y, &r.width, &r.height}) *value *= 25.4 / 72;
    found.push_back(r);
  }
  return found;
}

/// The sheet as a scanner sees it: a pixel is as dark as the part of it that ink covers, so that edges stand where the
/// PDF has them and not on the pixels' grid.
test::DrawnImage scan_of(const BoardSheet& sheet, double pixels_of_mm) {
  test::DrawnImage scan{{}, static_cast<int>(sheet.page.width_mm * pixels_of_mm), 0};
  scan.height = static_cast<int>(sheet.page.height_mm * pixels_of_mm);
  std::vector<double> ink(static_cast<std::size_t>(scan.width * scan.height), 0);
  for (const Rectangle& r : rectangles_of(sheet.pdf)) {
    const double left = r.x * pixels_of_mm, right = left + r.width * pixels_of_mm;
    const double low = scan.height - r.y * pixels_of_mm, top = low - r.height * pixels_of_mm;
    for (int v = static_cast<int>(top); v < low; ++v) {
      const double rows = std::min(low, v + 1.0) - std::max(top, static_cast<double>(v));
      for (int u = static_cast<int>(left); u < right; ++u) {
        const double columns = std::min(right, u + 1.0) - std::max(left, static_cast<double>(u));
        ink[static_cast<std::size_t>(v * scan.width + u)] += rows * columns;
      }
    }
  }
  for (const double share : ink) scan.pixels.push_back(static_cast<std::uint8_t>(std::lround(235 - 215 * share)));
  return scan;
}

}  // namespace

TEST_CASE("squares are printed at true size, in their places", "[app][board]") {
  const BoardSpec board = target_from_words({"checkerboard", 9, 6, 0.0236}).value();
  const auto sheet = board_sheet(board, find_page("A3"));
  REQUIRE(sheet);
  const auto rectangles = rectangles_of(sheet->pdf);
  REQUIRE(rectangles.size() == 35);
  const auto shapes = ink_shapes(board);
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    CHECK(rectangles[i].width == Approx(23.6).margin(0.001));
    CHECK(rectangles[i].height == Approx(23.6).margin(0.001));
    CHECK(rectangles[i].x - rectangles[0].x == Approx(1000 * (shapes[i].low_m - shapes[0].low_m).x()).margin(0.001));
    CHECK(rectangles[0].y - rectangles[i].y == Approx(1000 * (shapes[i].low_m - shapes[0].low_m).y()).margin(0.001));
  }
  CHECK(sheet->page.width_mm == 297);
  CHECK_FALSE(sheet->ambiguous);
  CHECK(board_sheet(board, find_page("A3"))->pdf == sheet->pdf);
  CHECK(sheet->pdf.find("squares of 23.6 mm") != std::string::npos);
}

TEST_CASE("the table of a PDF points at its objects", "[app][board]") {
  const std::string pdf = board_sheet(target_from_words({"circles", 7, 5, 0.03}).value(), std::nullopt)->pdf;
  const std::size_t table = pdf.rfind("xref\n0 6\n");
  REQUIRE(table != std::string::npos);
  CHECK(pdf.find("startxref\n" + std::to_string(table) + "\n%%EOF") != std::string::npos);
  for (int object = 1; object <= 5; ++object) {
    const std::size_t entry = table + 9 + static_cast<std::size_t>(object) * 20;
    const auto offset = static_cast<std::size_t>(std::stoul(pdf.substr(entry, 10)));
    CHECK(pdf.compare(offset, 8, std::to_string(object) + " 0 obj\n") == 0);
  }
}

TEST_CASE("pages are chosen, turned, and refused with the numbers", "[app][board]") {
  const auto board = [](double size_m) { return target_from_words({"checkerboard", 9, 6, size_m}).value(); };
  CHECK(board_sheet(board(0.015), std::nullopt)->page.name == "A4");
  CHECK(board_sheet(board(0.022), std::nullopt)->page.width_mm == 297);  // A4 across
  CHECK(board_sheet(board(0.030), std::nullopt)->page.name == "A3");
  CHECK(board_sheet(board(0.015), find_page("letter"))->page.name == "letter");
  const auto refused = board_sheet(board(0.030), find_page("a4"));
  REQUIRE_FALSE(refused);
  CHECK(refused.error().detail().find("A4 (198 x 285 mm printable)") != std::string::npos);
  CHECK_FALSE(board_sheet(board(0.2), std::nullopt));
  CHECK(board_sheet(board(0.1), find_page("1200x1000")));
  for (const char* name : {"A5", "100", "100x", "x100", "100x5", "1e9x10", "nanxnan", ""}) CHECK_FALSE(find_page(name));
  CHECK(board_sheet(target_from_words({"checkerboard", 8, 6, 0.02}).value(), std::nullopt)->ambiguous);
}

TEST_CASE("a print of the PDF is found by our detectors, its points right to 0.03 mm", "[app][board]") {
  constexpr double kPixelsOfMm = 6;
  for (const TargetWords& words : {TargetWords{"checkerboard", 9, 6, 0.0236}, TargetWords{"charuco", 6, 4, 0.03},
                                   TargetWords{"apriltag", 4, 3, 0.05}, TargetWords{"artoolkitplus", 3, 2, 0.07},
                                   TargetWords{"artoolkit", 1, 1, 0.12}}) {
    const BoardSpec board = target_from_words(words).value();
    const auto sheet = board_sheet(board, std::nullopt);
    CAPTURE(words.type);
    REQUIRE(sheet);
    const test::DrawnImage scan = scan_of(*sheet, kPixelsOfMm);
    const auto found = detect_target(scan.view(), board);
    REQUIRE(found);
    REQUIRE(found->ids.empty());
    // All distances from the first point.
    for (int i = 1; i < board.corners(); ++i) {
      const Eigen::Vector2d mm = (found->corners_px[static_cast<std::size_t>(i)] - found->corners_px[0]) / kPixelsOfMm;
      CHECK((mm - 1000 * (board.corner(i) - board.corner(0)).head<2>()).cwiseAbs().maxCoeff() < 0.03);
    }
  }
}
