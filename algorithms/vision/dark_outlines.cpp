/// The adapter to OpenCV's filters: its types end here. Areas and their outlines are ours.
#include "algorithms/vision/dark_outlines.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <opencv2/imgproc.hpp>
#include <optional>

namespace firstlook {
namespace {

/// Dark pixels side by side in a row, from `begin` to before `end`. An area is known by the first of its runs.
struct Run {
  int row = 0, begin = 0, end = 0;
  std::uint32_t area = 0;  ///< index of a run of the same area, never behind this one
};

/// The areas of a binary image, told apart by runs.
class Areas {
 public:
  /// `dark` is 0 or 255.
  explicit Areas(const cv::Mat& dark) {
    std::size_t above = 0;  // the first run of the row above
    for (int row = 0; row < dark.rows; ++row) {
      const std::size_t here = runs_.size();
      add_runs(dark, row);
      join(above, here);
      above = here;
    }
  }

  /// Calls `f(first pixel, size of the bounding box)` for each area, in the order of the first pixels.
  template <typename F>
  void for_each(F&& f) {
    std::vector<cv::Rect> boxes(runs_.size());
    for (std::uint32_t i = 0; i < runs_.size(); ++i) {
      const Run& run = runs_[i];
      boxes[first_of(i)] |= cv::Rect(run.begin, run.row, run.end - run.begin, 1);
    }
    for (std::uint32_t i = 0; i < runs_.size(); ++i) {
      if (runs_[i].area == i) f(Pixel{runs_[i].begin, runs_[i].row}, boxes[i].size());
    }
  }

 private:
  void add_runs(const cv::Mat& dark, int row) {
    const auto* const begin = dark.ptr<std::uint8_t>(row);
    const auto* const end = begin + dark.cols;
    for (const std::uint8_t* at = begin; at < end;) {
      const auto* const first =
          static_cast<const std::uint8_t*>(std::memchr(at, 255, static_cast<std::size_t>(end - at)));
      if (first == nullptr) return;
      const auto* const light =
          static_cast<const std::uint8_t*>(std::memchr(first, 0, static_cast<std::size_t>(end - first)));
      at = light == nullptr ? end : light;
      runs_.push_back({row, static_cast<int>(first - begin), static_cast<int>(at - begin),
                       static_cast<std::uint32_t>(runs_.size())});
    }
  }

  /// Runs that touch, also by a corner, of the row [above, here) and of the row [here, end).
  void join(std::size_t above, std::size_t here) {
    if (above == here || runs_[above].row + 1 != runs_.back().row) return;
    for (std::size_t a = above, b = here; a < here && b < runs_.size();) {
      if (runs_[a].begin <= runs_[b].end && runs_[b].begin <= runs_[a].end) {
        unite(static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b));
      }
      if (runs_[a].end < runs_[b].end) {
        ++a;
      } else {
        ++b;
      }
    }
  }

  std::uint32_t first_of(std::uint32_t run) {
    while (runs_[run].area != run) run = runs_[run].area = runs_[runs_[run].area].area;
    return run;
  }

  void unite(std::uint32_t a, std::uint32_t b) {
    const std::uint32_t first_a = first_of(a), first_b = first_of(b);
    runs_[std::max(first_a, first_b)].area = std::min(first_a, first_b);
  }

  std::vector<Run> runs_;
};

/// Follows outlines in a binary image that has a border of light pixels.
class OutlineFollower {
 public:
  explicit OutlineFollower(const cv::Mat& bordered) : image_(bordered) {
    for (std::size_t i = 0; i < kNeighbours.size(); ++i) {
      steps_[i] = kNeighbours[i].y * static_cast<std::ptrdiff_t>(image_.step) + kNeighbours[i].x;
    }
  }

  /// From the first pixel of an area (the leftmost of its highest) once around it; empty when that takes more than
  /// `length_max` pixels.
  [[nodiscard]] std::optional<Outline> follow(Pixel first, std::size_t length_max) const {
    const std::uint8_t* const start = image_.ptr<std::uint8_t>(first.y) + first.x;
    Outline outline;
    std::size_t to = kLeft;
    do {
      to = (to - 1) % kNeighbours.size();
    } while (start[steps_[to]] == 0 && to != kLeft);
    if (to == kLeft) return Outline{first};               // a single pixel
    const std::uint8_t* const last = start + steps_[to];  // from where the outline comes back
    const std::uint8_t* here = start;
    for (Pixel at = first;;) {
      if (outline.size() == length_max) return std::nullopt;
      outline.push_back(at);
      do {
        to = (to + 1) % kNeighbours.size();
      } while (here[steps_[to]] == 0);
      const std::uint8_t* const next = here + steps_[to];
      if (next == start && here == last) return outline;
      at = {at.x + kNeighbours[to].x, at.y + kNeighbours[to].y};
      here = next;
      to = (to + kNeighbours.size() / 2) % kNeighbours.size();  // seen from there, where it came from
    }
  }

 private:
  /// Counterclockwise in the picture, from the right.
  static constexpr std::size_t kLeft = 4;
  static constexpr std::array<Pixel, 8> kNeighbours = {
      {{1, 0}, {1, -1}, {0, -1}, {-1, -1}, {-1, 0}, {-1, 1}, {0, 1}, {1, 1}}};
  const cv::Mat& image_;
  std::array<std::ptrdiff_t, 8> steps_{};
};

}  // namespace

namespace {

/// cv::adaptiveThreshold with ADAPTIVE_THRESH_MEAN_C and THRESH_BINARY_INV, without its table: 255 where a pixel is at
/// least so much darker than the mean of its window.
cv::Mat darker_than_around(const cv::Mat& image, int window_px, int grays) {
  cv::Mat mean, dark;
  cv::boxFilter(image, mean, CV_8U, cv::Size(window_px, window_px), cv::Point(-1, -1), true,
                cv::BORDER_REPLICATE | cv::BORDER_ISOLATED);
  cv::subtract(mean, image, mean);  // 0 where the pixel is lighter
  cv::compare(mean, grays, dark, cv::CMP_GE);
  return dark;
}

}  // namespace

std::vector<Outline> dark_outlines(GrayImage image, int window_px,
                                   const std::function<bool(int width, int height)>& may_be) {
  constexpr int kDarker = 7;  // grey levels below the mean of the window
  // OpenCV has no read-only header for foreign pixels; nothing writes to it.
  const cv::Mat pixels(image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.data));
  cv::Mat bordered;
  cv::copyMakeBorder(darker_than_around(pixels, window_px, kDarker), bordered, 1, 1, 1, 1, cv::BORDER_CONSTANT,
                     cv::Scalar(0));
  Areas areas(bordered);
  const OutlineFollower follower(bordered);
  std::vector<Outline> outlines;
  areas.for_each([&](Pixel first, cv::Size box) {
    if (!may_be(box.width, box.height)) return;
    auto outline = follower.follow(first, static_cast<std::size_t>(4 * (box.width + box.height)));
    if (!outline) return;
    for (Pixel& p : *outline) p = {p.x - 1, p.y - 1};
    outlines.push_back(std::move(*outline));
  });
  return outlines;
}

}  // namespace firstlook
