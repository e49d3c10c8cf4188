/// What may be left out of a depth frame before it goes into a map: the thesis's range crop and voxel filter
/// (appendix B). Both make insertion cheaper and the map poorer, so both are off by default.
#pragma once

#include <cstdint>
#include <vector>

#include "algorithms/mapping/depth_rays.hpp"

namespace firstlook {

struct DepthFilterOptions {
  double crop_m = 0;   ///< returns farther from the sensor neither clear nor mark; 0: off
  double voxel_m = 0;  ///< of all returns that end in one cube of this edge the first (row by row) is kept; 0: off
  [[nodiscard]] bool is_on() const { return crop_m > 0 || voxel_m > 0; }
};

struct DepthFilterResult {
  std::uint32_t pixels_cropped = 0;
  std::uint32_t pixels_thinned = 0;
};

/// Turns the pixels that are left out into pixels without a return. The cubes of the voxel filter cover the map's
/// grid; returns that end outside of it, or beyond the trusted range, are kept. All memory is taken at construction.
class DepthFilter {
 public:
  DepthFilter(const GridGeometry& map, const DepthSensor& sensor, const DepthFilterOptions& options);
  [[nodiscard]] static std::size_t required_bytes(const GridGeometry& map, const DepthSensor& sensor,
                                                  const DepthFilterOptions& options);

  /// @param pixels  of a frame that DepthRays::check() or FrameGate has passed
  DepthFilterResult apply(ImageView<std::uint16_t> pixels, double units_per_m,
                          const Transform<Base, Depth>& base_T_depth);

 private:
  DepthFilterOptions options_;
  DepthRays rays_;
  GridGeometry cubes_;
  std::vector<std::uint64_t> taken_;
};

}  // namespace firstlook
