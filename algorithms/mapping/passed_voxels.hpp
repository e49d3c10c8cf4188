/// Which voxels the rays of a frame pass, asked voxel by voxel. Internal to algorithms/mapping.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>

#include "algorithms/mapping/depth_rays.hpp"
#include "algorithms/mapping/range_image.hpp"
#include "algorithms/mapping/ray_marker.hpp"

namespace firstlook {

/// Marks the same voxels as RayMarker does for every ray of a pinhole image, at a fraction of its cost: millions of
/// steps along rays become some ten thousand questions. A voxel of which the ray of the pixel at its middle goes on
/// beyond it is passed; one in front of which all rays of its footprint end is not; only the others are held against
/// the rays of their footprint. Those rays cut the voxel's box in the plane of slabs (Kay and Kajiya 1986) with an
/// allowance for rounding on either side; a ray between the two is walked as RayMarker walks. Made anew for each frame.
class PassedVoxels {
 public:
  /// @param hits   voxels that hold a hit: not asked about, their mark means nothing
  /// @param plane  VoxelMap::bit_words words; gets the marks
  PassedVoxels(const GridGeometry& geometry, DepthRays& rays, const RangeImage& image, const DepthImage& depth,
               const Transform<Base, Depth>& base_T_depth, std::span<const std::uint64_t> hits,
               std::span<std::uint64_t> plane);
  void mark();

 private:
  /// A voxel or brick in camera coordinates, with the half extents of its bounding box.
  struct Box {
    Eigen::Vector3d center_m;
    Eigen::Vector3d half_m;
    [[nodiscard]] double near_m() const { return center_m.z() - half_m.z(); }
    [[nodiscard]] double far_m() const { return center_m.z() + half_m.z(); }
  };
  struct Pixel {
    int u, v;
  };
  struct Question;
  [[nodiscard]] Eigen::Vector3d in_camera(const Eigen::Vector3d& voxel) const;
  [[nodiscard]] PixelRect footprint(const Box& box) const;
  [[nodiscard]] bool beside_image(const Box& box) const;
  void mark_brick(const Eigen::Vector3i& low);
  void mark_row(const Eigen::Vector3i& low);
  [[nodiscard]] bool is_out_of_reach(const Box& box) const;
  [[nodiscard]] bool is_passed(const Eigen::Vector3i& voxel) const;
  [[nodiscard]] std::uint64_t tiles_of_block(Question& question, int x, int y) const;
  [[nodiscard]] bool is_passed_in_tile(Question& question, int x, int y) const;
  [[nodiscard]] bool is_walked(const Pixel& pixel, const Eigen::Vector3i& voxel) const;

  const GridGeometry& geometry_;
  DepthRays& rays_;
  const RangeImage& image_;
  const DepthImage& depth_;
  const Transform<Base, Depth>& base_T_depth_;
  std::span<const std::uint64_t> hits_;
  std::span<std::uint64_t> plane_;
  RayMarker marker_;

  const CameraIntrinsics& camera_;
  Eigen::Matrix3d depth_R_base_;
  Eigen::Vector3d origin_m_;   ///< rounded to float as the rays' is
  double rounding_m_ = 0;      ///< no rounding of a ray's geometry, here or in OctoMap's walk, reaches this
  double pixel_diagonal_ = 0;  ///< slope between the rays of diagonal neighbours
  double half_m_ = 0;          ///< half a voxel
  Eigen::Vector3d voxel_half_m_, row_half_m_, brick_half_m_;  ///< half extents in camera axes
  double middle_far_m_ = 0;  ///< up to this depth the ray of the nearest pixel meets the voxel around any point
};

}  // namespace firstlook
