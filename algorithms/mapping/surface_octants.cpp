#include "algorithms/mapping/surface_octants.hpp"

#include <bit>

#include "algorithms/vision/camera_model.hpp"

namespace firstlook {
namespace {

/// One frame, held against octants.
class FrameProbe {
 public:
  FrameProbe(const GridGeometry& geometry, const RangeImage& image, const DepthSensor& sensor,
             const Transform<Base, Depth>& base_T_depth)
      : geometry_(geometry),
        image_(image),
        camera_(sensor.intrinsics),
        depth_T_base_(base_T_depth.inverse()),
        half_m_(geometry.resolution_m / 4),
        half_depth_m_(depth_T_base_.rotation().row(2).cwiseAbs().sum() * half_m_),
        half_pixel_(std::hypot(1 / camera_.fx, 1 / camera_.fy) / 2) {}

  /// Of these octants of a voxel, those that no ray was seen to cross.
  [[nodiscard]] std::uint8_t left_of(std::size_t voxel, std::uint8_t octants) const {
    const Eigen::Vector3d center_m = geometry_.center_m(geometry_.voxel_at(voxel));
    unsigned left = octants;
    for (unsigned rest = octants; rest != 0; rest &= rest - 1) {
      const auto octant = static_cast<unsigned>(std::countr_zero(rest));
      const Eigen::Vector3d towards((octant & 1) != 0 ? 1 : -1, (octant & 2) != 0 ? 1 : -1, (octant & 4) != 0 ? 1 : -1);
      if (is_crossed(center_m + half_m_ * towards)) left &= ~(1U << octant);
    }
    return static_cast<std::uint8_t>(left);
  }

 private:
  [[nodiscard]] bool is_crossed(const Eigen::Vector3d& middle_m) const {
    const Eigen::Vector3d p_m = depth_T_base_ * middle_m;
    // Within its inscribed ball a ray crosses the octant for certain.
    if (p_m.z() <= half_depth_m_ || half_pixel_ * p_m.z() > half_m_) return false;
    const auto pixel = project(camera_, p_m);
    if (!pixel) return false;
    const auto u = static_cast<int>(std::floor(pixel->x() + 0.5)), v = static_cast<int>(std::floor(pixel->y() + 0.5));
    if (u < 0 || v < 0 || u >= image_.width() || v >= image_.height()) return false;
    return static_cast<double>(image_.at(u, v)) > p_m.z() + half_depth_m_;
  }

  const GridGeometry& geometry_;
  const RangeImage& image_;
  const CameraIntrinsics& camera_;
  Transform<Depth, Base> depth_T_base_;
  double half_m_;        ///< half an octant's edge
  double half_depth_m_;  ///< from its middle to its far corner, along the optical axis
  double half_pixel_;    ///< slope from the middle of a pixel to its corner
};

}  // namespace

void clear_passed_octants(VoxelMap& map, std::span<const std::uint64_t> missed, std::span<const std::uint64_t> hit,
                          const RangeImage& image, const DepthSensor& sensor,
                          const Transform<Base, Depth>& base_T_depth) {
  const FrameProbe probe(map.geometry(), image, sensor, base_T_depth);
  for (std::size_t word = 0; word < missed.size(); ++word) {
    for (std::uint64_t bits = missed[word] & ~hit[word]; bits != 0; bits &= bits - 1) {
      const std::size_t index = word * 64 + static_cast<std::size_t>(std::countr_zero(bits));
      const std::uint8_t octants = map.surface_octants(index);
      if (octants != 0) map.set_surface_octants(index, probe.left_of(index, octants));
    }
  }
}

}  // namespace firstlook
