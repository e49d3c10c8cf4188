#include "app/report/board_pdf.hpp"

#include <catch2/catch.hpp>
#include <sstream>

#include "algorithms/vision/target_detection.hpp"
#include "algorithms/vision/target_names.hpp"
#include "algorithms/vision/target_pattern.hpp"

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

TEST_CASE("a print of the PDF is found by our detectors, its points right to 0.1 mm", "[app][board]") {
  constexpr double kPixelsOfMm = 6;
  for (const TargetWords& words : {TargetWords{"checkerboard", 9, 6, 0.0236}, TargetWords{"charuco", 6, 4, 0.03},
                                   TargetWords{"apriltag", 4, 3, 0.05}, TargetWords{"artoolkitplus", 3, 2, 0.07},
                                   TargetWords{"artoolkit", 1, 1, 0.12}}) {
    const BoardSpec board = target_from_words(words).value();
    const auto sheet = board_sheet(board, std::nullopt);
    CAPTURE(words.type);
    REQUIRE(sheet);
    const int width = static_cast<int>(sheet->page.width_mm * kPixelsOfMm);
    const int height = static_cast<int>(sheet->page.height_mm * kPixelsOfMm);
    std::vector<std::uint8_t> pixels(static_cast<std::size_t>(width * height), 235);
    for (const Rectangle& r : rectangles_of(sheet->pdf)) {
      const auto pixel = [&](double mm) { return static_cast<int>(std::lround(mm * kPixelsOfMm)); };
      for (int v = height - pixel(r.y + r.height); v < height - pixel(r.y); ++v) {
        std::fill_n(pixels.begin() + v * width + pixel(r.x), pixel(r.x + r.width) - pixel(r.x), std::uint8_t{20});
      }
    }
    const auto found = detect_target({pixels.data(), width, height}, board);
    REQUIRE(found);
    REQUIRE(found->ids.empty());
    // Edges were put between pixels, at most half a pixel (0.083 mm) off; all distances from the first point.
    for (int i = 1; i < board.corners(); ++i) {
      const Eigen::Vector2d mm = (found->corners_px[static_cast<std::size_t>(i)] - found->corners_px[0]) / kPixelsOfMm;
      CHECK((mm - 1000 * (board.corner(i) - board.corner(0)).head<2>()).cwiseAbs().maxCoeff() < 0.1);
    }
  }
}
