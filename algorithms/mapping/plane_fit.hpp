/// Depth readings replaced by those of the plane through their neighbours: the thesis's plane fit before insertion
/// (appendix B). Walls and tables become as thin as the window makes them; off by default, since a map that is exact as
/// OctoMap's is one of the readings as they came.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "platform/core/camera_intrinsics.hpp"
#include "platform/core/image_view.hpp"

namespace firstlook {

struct PlaneFitOptions {
  int window_px = 0;         ///< side of the square window, odd, 3 to 31; 0: off
  double noise_floor_m = 0;  ///< standard deviation of a depth: hypot(noise_floor, noise_at_1m z^2)
  double noise_at_1m_m = 0;
  [[nodiscard]] bool is_on() const { return window_px > 0; }
};

/// The inverse depth of a plane is an affine function of the pixel, whatever the plane (an undistorted image): least
/// squares over a window without gaps leave the mean as the value in its middle, and sums over the window tell slope
/// and residual. All memory is taken at construction.
class PlaneFit {
 public:
  PlaneFit(const CameraIntrinsics& camera, const PlaneFitOptions& options);
  [[nodiscard]] static std::size_t required_bytes(const CameraIntrinsics& camera, const PlaneFitOptions& options);

  /// Replaces each reading whose window has a return in every pixel, all on one plane within the noise. Readings at
  /// edges, of small things and beside gaps stay as they are. @return how many were replaced
  std::uint32_t apply(ImageView<std::uint16_t> pixels, double units_per_m);

 private:
  /// Sums of n, d, d^2, u d, v d over the pixels above and to the left, d the inverse depth in 1/m.
  struct Sums {
    double n = 0, d = 0, dd = 0, ud = 0, vd = 0;
    Sums& operator+=(const Sums& other);
    Sums& operator-=(const Sums& other);
  };
  /// Those of the pixels above a row; the last window_px + 1 rows are kept.
  [[nodiscard]] std::span<Sums> sums_above(int row);
  void add_row(ImageView<const std::uint16_t> pixels, double units_per_m, int v);
  [[nodiscard]] Sums window(int u, int v);

  PlaneFitOptions options_;
  int width_ = 0;
  std::vector<Sums> sums_;  ///< rows of width + 1
};

}  // namespace firstlook
