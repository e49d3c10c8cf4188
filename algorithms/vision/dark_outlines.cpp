/// The adapter to OpenCV's threshold. Areas and their outlines are ours.
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
      if (runs_[i].area == i) f(cv::Point(runs_[i].begin, runs_[i].row), boxes[i].size());
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
  [[nodiscard]] std::optional<std::vector<cv::Point>> follow(cv::Point first, std::size_t length_max) const {
    const std::uint8_t* const start = image_.ptr<std::uint8_t>(first.y) + first.x;
    std::vector<cv::Point> outline;
    std::size_t to = kLeft;
    do {
      to = (to - 1) % kNeighbours.size();
    } while (start[steps_[to]] == 0 && to != kLeft);
    if (to == kLeft) return std::vector<cv::Point>{first};  // a single pixel
    const std::uint8_t* const last = start + steps_[to];    // from where the outline comes back
    const std::uint8_t* here = start;
    for (cv::Point at = first;;) {
      if (outline.size() == length_max) return std::nullopt;
      outline.push_back(at);
      do {
        to = (to + 1) % kNeighbours.size();
      } while (here[steps_[to]] == 0);
      const std::uint8_t* const next = here + steps_[to];
      if (next == start && here == last) return outline;
      at += kNeighbours[to];
      here = next;
      to = (to + kNeighbours.size() / 2) % kNeighbours.size();  // seen from there, where it came from
    }
  }

 private:
  /// Counterclockwise in the picture, from the right.
  static constexpr std::size_t kLeft = 4;
  static inline const std::array<cv::Point, 8> kNeighbours = {
      {{1, 0}, {1, -1}, {0, -1}, {-1, -1}, {-1, 0}, {-1, 1}, {0, 1}, {1, 1}}};
  const cv::Mat& image_;
  std::array<std::ptrdiff_t, 8> steps_{};
};

}  // namespace

std::vector<std::vector<cv::Point>> dark_outlines(const cv::Mat& image, int window_px,
                                                  const std::function<bool(cv::Size)>& may_be) {
  constexpr double kDarker = 7;  // grey levels below the mean of the window
  cv::Mat dark, bordered;
  cv::adaptiveThreshold(image, dark, 255, cv::ADAPTIVE_THRESH_MEAN_C, cv::THRESH_BINARY_INV, window_px, kDarker);
  cv::copyMakeBorder(dark, bordered, 1, 1, 1, 1, cv::BORDER_CONSTANT, cv::Scalar(0));
  Areas areas(bordered);
  const OutlineFollower follower(bordered);
  std::vector<std::vector<cv::Point>> outlines;
  areas.for_each([&](cv::Point first, cv::Size box) {
    if (!may_be(box)) return;
    auto outline = follower.follow(first, static_cast<std::size_t>(4 * (box.width + box.height)));
    if (!outline) return;
    for (cv::Point& p : *outline) p -= cv::Point(1, 1);
    outlines.push_back(std::move(*outline));
  });
  return outlines;
}

}  // namespace firstlook
