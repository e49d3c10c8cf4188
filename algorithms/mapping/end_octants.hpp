/// Where the rays of a pinhole image end, eight pixels at a time. Internal to algorithms/mapping.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "algorithms/mapping/depth_rays.hpp"
#include "algorithms/mapping/range_image.hpp"
#include "platform/core/function_ref.hpp"

namespace firstlook {

/// Finds the octants in which the rays of frames end: the same as octomap_voxel() and octant_of() of DepthRays' ends,
/// at a fraction of the cost. Coordinates are floats; pixels whose voxel, octant or range rounding could decide, some
/// in a thousand, are computed as DepthRays does. Memory is taken at construction.
class EndOctants {
 public:
  /// Coarser depth values than these would overflow: thousands of kilometres.
  static constexpr double kUnitsPerMeterMin = 1e-6;

  EndOctants(const GridGeometry& geometry, const DepthSensor& sensor);
  [[nodiscard]] static std::size_t required_bytes(const DepthSensor& sensor);

  /// @param rays          of the same sensor, which is a pinhole
  /// @param depth         passed DepthRays::check(); units_per_m at least kUnitsPerMeterMin
  /// @param self_depth_m  as for DepthRays
  /// @param image         gets the reach of every row
  /// @param visit_row     gets 8 * voxel + octant of the hits inside the grid, row by row, runs of equal ones once
  PixelCounts find(const DepthRays& rays, const DepthImage& depth, const Transform<Base, Depth>& base_T_depth,
                   std::span<const float> self_depth_m, RangeImage& image,
                   FunctionRef<void(std::span<const std::int32_t>)> visit_row);

 private:
  void prepare_columns(const DepthRays& rays, const Eigen::Matrix3d& halves_R_depth);
  struct Decided {
    PixelKind kind = PixelKind::kEmpty;
    float reach_m = RangeImage::kNoRay;
    std::int32_t octant = -1;  ///< none, or outside the grid
  };
  [[nodiscard]] Decided decide(const DepthRays& rays, const RayFrame& frame, const DepthImage& depth,
                               const float* self_m, int u, int v) const;
  /// A row that may be read to the end of its last vector.
  template <typename T>
  const T* whole_vectors_of(const T* row, std::vector<T>& scratch) const;

  GridGeometry geometry_;
  std::size_t pixels_, width_;  ///< of a row, and that in whole vectors
  std::vector<float> columns_;  ///< what a pixel's column adds to its direction (three rows) and its length squared
  std::vector<std::uint16_t> values_;
  std::vector<float> self_m_;
  std::vector<std::int32_t> octants_, doubted_;
};

}  // namespace firstlook
