/// Points of a picture to which more are added, to ask for those nearby.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace firstlook {

class PointBuckets {
 public:
  /// Points outside the picture are kept with those of its border.
  PointBuckets(int width, int height, double bucket_px)
      : bucket_px_(bucket_px),
        columns_(static_cast<int>(width / bucket_px) + 1),
        rows_(static_cast<int>(height / bucket_px) + 1),
        newest_(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_), kNone) {}

  /// Points count up from 0.
  void add(const Eigen::Vector2d& at) {
    std::uint32_t& newest = newest_[bucket(place(at.x(), columns_), place(at.y(), rows_))];
    before_.push_back(newest);
    newest = static_cast<std::uint32_t>(before_.size() - 1);
  }

  /// Whether `is_it(index)` says so of any point within `reach_px` of `at` in x and y (it is asked about some beyond).
  template <typename F>
  [[nodiscard]] bool any_near(const Eigen::Vector2d& at, double reach_px, F&& is_it) const {
    const int c0 = place(at.x() - reach_px, columns_), c1 = place(at.x() + reach_px, columns_);
    const int r0 = place(at.y() - reach_px, rows_), r1 = place(at.y() + reach_px, rows_);
    for (int r = r0; r <= r1; ++r) {
      for (int c = c0; c <= c1; ++c) {
        for (std::uint32_t p = newest_[bucket(c, r)]; p != kNone; p = before_[p]) {
          if (is_it(std::size_t{p})) return true;
        }
      }
    }
    return false;
  }

 private:
  static constexpr std::uint32_t kNone = UINT32_MAX;
  [[nodiscard]] int place(double x, int count) const {
    return static_cast<int>(std::clamp(x / bucket_px_, 0.0, count - 1.0));
  }
  [[nodiscard]] std::size_t bucket(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(column);
  }

  double bucket_px_;
  int columns_, rows_;
  std::vector<std::uint32_t> newest_;  ///< point of each bucket
  std::vector<std::uint32_t> before_;  ///< for each point the one before it in its bucket
};

}  // namespace firstlook
