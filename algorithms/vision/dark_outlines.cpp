/// The adapter to OpenCV's box filter: its types end here. Areas and their outlines are ours.
#include "algorithms/vision/dark_outlines.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <opencv2/imgproc.hpp>
#include <utility>

namespace firstlook {
namespace {

static_assert(std::endian::native == std::endian::little);  // several pixels are read as one number

/// Counterclockwise in the picture, from the right.
constexpr std::array<Pixel, 8> kNeighbours = {{{1, 0}, {1, -1}, {0, -1}, {-1, -1}, {-1, 0}, {-1, 1}, {0, 1}, {1, 1}}};
constexpr std::size_t kLeft = 4;

/// Bit of a pixel's surroundings (see `surroundings`) that is set when a neighbour is dark.
constexpr std::size_t bit_of(const Pixel& neighbour) {
  return static_cast<std::size_t>(3 * (neighbour.x + 1) + neighbour.y + 1);
}

/// The 3x3 pixels around one as a number of nine bits, column by column.
std::size_t surroundings(const std::uint8_t* pixel, std::ptrdiff_t stride) {
  // Each row's word begins with the pixel on the left; its last byte is not looked at.
  std::uint32_t rows[3];
  for (std::ptrdiff_t v = 0; v < 3; ++v) std::memcpy(&rows[v], pixel + (v - 1) * stride - 1, sizeof rows[v]);
  constexpr std::uint32_t kOneOfEach = 0x010101;
  const std::uint32_t bits = (rows[0] & kOneOfEach) | (rows[1] & kOneOfEach) << 1U | (rows[2] & kOneOfEach) << 2U;
  return (bits & 0x7U) | (bits >> 5U & 0x38U) | (bits >> 10U & 0x1C0U);
}

/// For each direction and surroundings: the next direction counterclockwise that leads to a dark pixel.
constexpr auto kTurns = [] {
  std::array<std::array<std::uint8_t, 512>, 8> turns{};
  for (std::size_t from = 0; from < 8; ++from) {
    for (std::size_t around = 0; around < 512; ++around) {
      std::size_t to = (from + 1) % 8;
      while (to != from && (around >> bit_of(kNeighbours[to]) & 1U) == 0) to = (to + 1) % 8;
      turns[from][around] = static_cast<std::uint8_t>(to);
    }
  }
  return turns;
}();

}  // namespace

DarkOutlines::DarkOutlines(GrayImage image)
    : image_(image),
      stride_(image.width + 4),  // light pixels on both sides, and what `surroundings` reads beyond them
      dark_(static_cast<std::size_t>(stride_) * static_cast<std::size_t>(image.height + 2)) {}

/// Makes dark pixels of the means, as cv::adaptiveThreshold with ADAPTIVE_THRESH_MEAN_C and THRESH_BINARY_INV.
void DarkOutlines::mark_dark(int row) {
  constexpr int kDarker = 7;  // grey levels below the mean of the window
  const int width = image_.width;
  const std::uint8_t* const pixels = &image_.at(0, row);
  std::uint8_t* const dark = dark_row(row);
  for (int u = 0; u < width; ++u) dark[u] = dark[u] - pixels[u] >= kDarker ? 255 : 0;
}

void DarkOutlines::find_runs(int row) {
  // Eight pixels at a time where nothing changes; the last ones look at the border, where the last run ends.
  constexpr int kStep = 8;
  constexpr std::uint64_t kOneOfEach = 0x8080808080808080;
  const std::uint8_t* const dark = dark_row(row);
  edges_.clear();
  int u = 0;
  for (; u + kStep <= image_.width; u += kStep) {
    std::uint64_t before = 0, here = 0;
    std::memcpy(&before, dark + u - 1, sizeof before);
    std::memcpy(&here, dark + u, sizeof here);
    for (std::uint64_t changes = (before ^ here) & kOneOfEach; changes != 0; changes &= changes - 1) {
      edges_.push_back(u + std::countr_zero(changes) / 8);
    }
  }
  for (; u <= image_.width; ++u) {
    if (dark[u] != dark[u - 1]) edges_.push_back(u);
  }
}

std::uint32_t DarkOutlines::whole_of(std::uint32_t area) {
  while (areas_[area].part_of != area) area = areas_[area].part_of = areas_[areas_[area].part_of].part_of;
  return area;
}

std::uint32_t DarkOutlines::unite(std::uint32_t a, std::uint32_t b) {
  if (a == b) return a;
  Area& whole = areas_[std::min(a, b)];
  Area& part = areas_[std::max(a, b)];
  part.part_of = std::min(a, b);
  whole.left = std::min(whole.left, part.left);
  whole.right = std::max(whole.right, part.right);
  whole.bottom = std::max(whole.bottom, part.bottom);
  return part.part_of;
}

/// Makes runs of the edges, which go on with the areas of those above that they touch, also by a corner.
void DarkOutlines::join_runs(int row) {
  std::swap(above_, here_);
  here_.clear();
  auto above = above_.cbegin();
  for (std::size_t i = 0; i + 1 < edges_.size(); i += 2) {
    Run run{edges_[i], edges_[i + 1], static_cast<std::uint32_t>(areas_.size())};
    while (above != above_.cend() && above->end < run.begin) ++above;
    if (above == above_.cend() || above->begin > run.end) {
      areas_.push_back({run.area, {run.begin, row}, run.begin, run.end, row});
    } else {
      run.area = whole_of(above->area);
      // The last one above may touch the next run, too.
      while (above + 1 != above_.cend() && (above + 1)->begin <= run.end) {
        ++above;
        run.area = unite(run.area, whole_of(above->area));
      }
      Area& area = areas_[run.area];
      area.left = std::min(area.left, run.begin);
      area.right = std::max(area.right, run.end);
      area.bottom = row;
    }
    here_.push_back(run);
  }
}

/// From the first pixel of an area once around it; empty when that takes more than `length_max` pixels.
Outline DarkOutlines::follow(Pixel first, std::size_t length_max) {
  if (outline_.size() < length_max) outline_.resize(length_max);
  std::array<std::ptrdiff_t, 8> steps{};
  for (std::size_t i = 0; i < 8; ++i) steps[i] = kNeighbours[i].y * stride_ + kNeighbours[i].x;
  const std::uint8_t* const start = dark_row(first.y) + first.x;
  outline_[0] = first;
  std::size_t to = kLeft;
  do {
    to = (to - 1) % kNeighbours.size();
  } while (start[steps[to]] == 0 && to != kLeft);
  if (to == kLeft) return Outline(outline_).first(1);  // a single pixel
  const std::uint8_t* const last = start + steps[to];  // from where the outline comes back
  const std::uint8_t* here = start;
  Pixel at = first;
  for (std::size_t length = 0; length < length_max;) {
    outline_[length++] = at;
    to = kTurns[to][surroundings(here, stride_)];
    const std::uint8_t* const next = here + steps[to];
    if (next == start && here == last) return Outline(outline_).first(length);
    at = {at.x + kNeighbours[to].x, at.y + kNeighbours[to].y};
    here = next;
    to = (to + kNeighbours.size() / 2) % kNeighbours.size();  // seen from there, where it came from
  }
  return {};
}

void DarkOutlines::for_each(int window_px, FunctionRef<bool(int width, int height)> may_be,
                            FunctionRef<void(Outline)> visit) {
  // OpenCV has no read-only header for foreign pixels; nothing writes to it.
  const cv::Mat pixels(image_.height, image_.width, CV_8UC1, const_cast<std::uint8_t*>(image_.data));
  cv::Mat mean(image_.height, image_.width, CV_8UC1, dark_row(0), static_cast<std::size_t>(stride_));
  cv::boxFilter(pixels, mean, CV_8U, cv::Size(window_px, window_px), cv::Point(-1, -1), true,
                cv::BORDER_REPLICATE | cv::BORDER_ISOLATED);
  areas_.clear();
  here_.clear();
  for (int row = 0; row < image_.height; ++row) {
    mark_dark(row);
    find_runs(row);
    join_runs(row);
  }
  for (std::uint32_t i = 0; i < areas_.size(); ++i) {
    const Area& area = areas_[i];
    const int width = area.right - area.left, height = area.bottom - area.first.y + 1;
    if (area.part_of != i || !may_be(width, height)) continue;
    const Outline outline = follow(area.first, static_cast<std::size_t>(4 * (width + height)));
    if (!outline.empty()) visit(outline);
  }
}

}  // namespace firstlook
