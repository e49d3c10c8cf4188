/// How far the rays of a frame reach, laid out for those who ask about areas of the image. Internal to
/// algorithms/mapping.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace firstlook {

/// A quantity for each pixel (level 0), for cells of 2 x 2 pixels (level 1), 4 x 4, and so on. All levels lie in one
/// array with one stride, so that questions about different levels are one vector of indices. Up to eight numbers may
/// be read from any place of a row on; what lies beside the image is what fill() said.
class Pyramid {
 public:
  Pyramid(int width, int height, int first_level);
  [[nodiscard]] static std::size_t required_bytes(int width, int height, int first_level);

  [[nodiscard]] const float* data() const { return values_.data(); }
  [[nodiscard]] int stride() const { return stride_; }
  /// The first row of a level is rows() - (rows() >> (level - first_level())).
  [[nodiscard]] int rows() const { return rows_; }
  [[nodiscard]] int first_level() const { return first_level_; }
  [[nodiscard]] std::size_t index(int level, int x, int y) const {
    return static_cast<std::size_t>(rows_ - (rows_ >> (level - first_level_)) + y) * static_cast<std::size_t>(stride_) +
           static_cast<std::size_t>(x);
  }
  [[nodiscard]] float at(int level, int x, int y) const { return values_[index(level, x, y)]; }
  [[nodiscard]] float* row(int level, int y) { return values_.data() + index(level, 0, y); }
  [[nodiscard]] const float* row(int level, int y) const { return values_.data() + index(level, 0, y); }

 private:
  int stride_, rows_, first_level_;
  std::vector<float> values_;
};

/// Depth of each ray's end along the optical axis (m), and its bounds over areas. Memory is taken at construction.
class RangeImage {
 public:
  static constexpr float kNoRay = -1;  ///< of pixels without a ray, and of what lies beside the image

  RangeImage(int width, int height);
  [[nodiscard]] static std::size_t required_bytes(int width, int height);

  /// A row of pixels to be filled, kNoRay for those without a ray; up to eight of these may follow it. After the last
  /// row of a frame: build_levels().
  [[nodiscard]] float* row(int v) { return farthest_.row(0, v); }
  void set_row(int v, std::span<const float> reach_m);
  void build_levels();

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  [[nodiscard]] int level_max() const { return level_max_; }  ///< one cell covers the image
  [[nodiscard]] float at(int u, int v) const { return farthest_.at(0, u, v); }
  [[nodiscard]] float farthest() const { return farthest_.at(level_max_, 0, 0); }
  /// Of each cell, from level 0 on.
  [[nodiscard]] const Pyramid& cell_farthest() const { return farthest_; }
  /// Of each cell and the eight around it, from level 1 on. The nearest is that of cells of 2 x 2 pixels, each of which
  /// reaches as far as its farthest pixel does: single pixels without a return hide nothing.
  [[nodiscard]] const Pyramid& around_farthest() const { return around_farthest_; }
  [[nodiscard]] const Pyramid& around_nearest() const { return around_nearest_; }

 private:
  int width_, height_, level_max_;
  Pyramid farthest_, nearest_, around_farthest_, around_nearest_;
  std::vector<float> nothing_;  ///< a row beside the image
  std::vector<float> scratch_;  ///< a row with a cell beside the image before it
};

}  // namespace firstlook
