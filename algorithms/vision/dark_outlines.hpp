/// Outlines of the dark areas of an image, for the searches of squares and of discs.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "platform/core/function_ref.hpp"
#include "platform/core/image_view.hpp"

namespace firstlook {

struct Pixel {
  int x = 0, y = 0;
  bool operator==(const Pixel&) const = default;
};

/// A closed chain of neighbouring pixels.
using Outline = std::span<const Pixel>;

/// Finds the outer outlines of an image's dark areas; one object for all windows, whose memory it takes once.
///
/// The outlines are those of cv::findContours (Suzuki & Abe 1985) from the same first pixels, without those of the
/// holes, of which a noisy picture has 100,000: areas are told apart by runs (He, Chao, Suzuki 2008: two tables of
/// labels made one), of which only those of two rows are kept, and outlines are followed by a table of turns.
class DarkOutlines {
 public:
  /// Keeps a reference to the pixels.
  explicit DarkOutlines(GrayImage image);

  /// Visits the outer outlines of the areas (neighbours by edge or corner) that are darker than the mean of a window of
  /// `window_px` around each pixel, in the order of their first pixels. `may_be` is asked with the size of an area's
  /// bounding box, both pixels included: only outlines that it wants are followed. An outline that is twice as long as
  /// the one of its box is no polygon or ellipse that anybody searches: it is left out before its end, so that the time
  /// is bounded by the pixels whatever they show.
  void for_each(int window_px, FunctionRef<bool(int width, int height)> may_be, FunctionRef<void(Outline)> visit);

 private:
  /// Dark pixels side by side in a row, from `begin` to before `end`.
  struct Run {
    int begin = 0, end = 0;
    std::uint32_t area = 0;
  };
  /// What is known of an area, or of a part of one that has not met the others yet.
  struct Area {
    std::uint32_t part_of = 0;  ///< itself, or an area that began before it
    Pixel first;                ///< the leftmost pixel of its highest row
    int left = 0, right = 0, bottom = 0;
  };

  void mark_dark(int row);
  void find_runs(int row);
  void join_runs(int row);
  std::uint32_t whole_of(std::uint32_t area);
  std::uint32_t unite(std::uint32_t a, std::uint32_t b);
  [[nodiscard]] Outline follow(Pixel first, std::size_t length_max);
  [[nodiscard]] std::uint8_t* dark_row(int row) {
    return dark_.data() + static_cast<std::ptrdiff_t>(row + 1) * stride_ + 1;
  }

  GrayImage image_;
  std::ptrdiff_t stride_;
  /// 255, else 0; with a border of light pixels. Before: the means of the windows around each pixel.
  std::vector<std::uint8_t> dark_;
  std::vector<int> edges_;         ///< where runs of a row begin and end, by turns
  std::vector<Run> above_, here_;  ///< runs of two rows
  std::vector<Area> areas_;
  std::vector<Pixel> outline_;
};

}  // namespace firstlook
