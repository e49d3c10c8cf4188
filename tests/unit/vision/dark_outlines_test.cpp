#include "algorithms/vision/dark_outlines.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <opencv2/imgproc.hpp>

#include "platform/core/random.hpp"

namespace firstlook {
namespace {

using Outlines = std::vector<std::vector<Pixel>>;

GrayImage view(const cv::Mat& image) { return {image.data, image.cols, image.rows}; }

/// What cv::findContours makes of the same threshold: the outer outlines, in the order of their first pixels.
Outlines by_opencv(const cv::Mat& image, int window_px) {
  cv::Mat dark;
  cv::adaptiveThreshold(image, dark, 255, cv::ADAPTIVE_THRESH_MEAN_C, cv::THRESH_BINARY_INV, window_px, 7);
  std::vector<std::vector<cv::Point>> all;
  Outlines outer;
  std::vector<cv::Vec4i> tree;
  cv::findContours(dark, all, tree, cv::RETR_CCOMP, cv::CHAIN_APPROX_NONE);
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (tree[i][3] >= 0) continue;
    outer.emplace_back();
    for (const cv::Point& p : all[i]) outer.back().push_back({p.x, p.y});
  }
  std::sort(outer.begin(), outer.end(),
            [](const auto& a, const auto& b) { return std::pair(a[0].y, a[0].x) < std::pair(b[0].y, b[0].x); });
  return outer;
}

template <typename F>
Outlines collect(DarkOutlines& search, int window_px, const F& may_be) {
  Outlines outlines;
  search.for_each(window_px, may_be, [&](Outline o) { outlines.emplace_back(o.begin(), o.end()); });
  return outlines;
}

cv::Rect box_of(Outline outline) {
  cv::Rect box;
  for (const Pixel& p : outline) box |= cv::Rect(p.x, p.y, 1, 1);
  return box;
}

/// Those whose box is wanted and that are not twice as long as its edge.
template <typename F>
Outlines wanted(const Outlines& all, F&& may_be) {
  Outlines some;
  for (const auto& outline : all) {
    const cv::Size box = box_of(outline).size();
    const auto length_max = static_cast<std::size_t>(4 * (box.width + box.height));
    if (may_be(box.width, box.height) && outline.size() <= length_max) some.push_back(outline);
  }
  return some;
}

/// Noise of pixels as large as `grain_px`: specks, mazes and areas within areas.
cv::Mat noise(Random& random, int width, int height, double grain_px) {
  cv::Mat image(height, width, CV_8UC1);
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) image.at<std::uint8_t>(v, u) = static_cast<std::uint8_t>(random.below(256));
  }
  if (grain_px > 0) {
    cv::GaussianBlur(image, image, cv::Size(), grain_px);
    cv::normalize(image, image, 0, 255, cv::NORM_MINMAX);
  }
  return image;
}

}  // namespace

TEST_CASE("outlines of dark areas are those of OpenCV's contours") {
  Random random(1);
  std::size_t compared = 0, too_long = 0;
  for (int trial = 0; trial < 60; ++trial) {
    const int width = 20 + random.below(180), height = 20 + random.below(140);
    const cv::Mat image = noise(random, width, height, 0.7 * random.below(5));
    const int window_px = 11 + 2 * random.below(20), least = random.below(12);
    const auto may_be = [least](int w, int h) { return w * h >= least; };
    const Outlines all = by_opencv(image, window_px), expected = wanted(all, may_be);
    DarkOutlines search(view(image));
    const Outlines found = collect(search, window_px, may_be);
    REQUIRE(found == expected);
    // Nothing is left behind by the window before.
    REQUIRE(collect(search, 41, may_be) == wanted(by_opencv(image, 41), may_be));
    compared += found.size();
    too_long += wanted(all, [](int, int) { return true; }).size() < all.size() ? 1 : 0;
  }
  CHECK(compared > 2000);
  CHECK(too_long > 10);  // mazes were among them
}

TEST_CASE("outlines at the image's edge, of single pixels, of areas within rings") {
  const auto all = [](int, int) { return true; };
  cv::Mat image(60, 80, CV_8UC1, cv::Scalar(200));
  DarkOutlines search(view(image));
  CHECK(collect(search, 25, all).empty());
  image.at<std::uint8_t>(0, 0) = 0;
  image.at<std::uint8_t>(59, 79) = 0;
  cv::circle(image, {40, 30}, 20, cv::Scalar(20), 4);
  cv::rectangle(image, cv::Rect(36, 26, 8, 8), cv::Scalar(20), cv::FILLED);
  const Outlines found = collect(search, 25, all);
  CHECK(found == by_opencv(image, 25));
  REQUIRE(found.size() == 4);
  CHECK(found[0] == std::vector<Pixel>{{0, 0}});
  CHECK(box_of(found[2]) == cv::Rect(36, 26, 8, 8));
  CHECK(found[3] == std::vector<Pixel>{{79, 59}});
}

}  // namespace firstlook
