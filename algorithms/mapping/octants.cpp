#include "algorithms/mapping/octants.hpp"

#include <array>
#include <bit>

#include "algorithms/vision/camera_model.hpp"

namespace firstlook {
namespace {

/// One frame, held against octants.
class FrameProbe {
 public:
  FrameProbe(const GridGeometry& geometry, const RangeImage& image, const DepthSensor& sensor, bool pinhole,
             const Transform<Base, Depth>& base_T_depth)
      : geometry_(geometry),
        image_(image),
        camera_(sensor.intrinsics),
        pinhole_(pinhole),
        depth_T_base_(base_T_depth.inverse()) {
    const double half_m = geometry.resolution_m / 4;  // of an octant's edge
    const Eigen::Matrix3d depth_R_base = depth_T_base_.rotation();
    half_depth_m_ = depth_R_base.row(2).cwiseAbs().sum() * half_m;
    // Within its inscribed ball a ray crosses the octant for certain: half a pixel's diagonal must fit in.
    far_m_ = 2 * half_m / std::hypot(1 / camera_.fx, 1 / camera_.fy);
    for (unsigned i = 0; i < middles_m_.size(); ++i) {
      middles_m_[i] = depth_R_base * Eigen::Vector3d((i & 1) != 0 ? half_m : -half_m, (i & 2) != 0 ? half_m : -half_m,
                                                     (i & 4) != 0 ? half_m : -half_m);
    }
  }

  /// Of these octants of a voxel, those that a ray crosses.
  [[nodiscard]] std::uint8_t crossed(std::size_t voxel, std::uint8_t octants) const {
    const Eigen::Vector3d center_m = depth_T_base_ * geometry_.center_m(geometry_.voxel_at(voxel));
    unsigned crossed = 0;
    for (unsigned rest = octants; rest != 0; rest &= rest - 1) {
      const auto octant = static_cast<unsigned>(std::countr_zero(rest));
      if (is_crossed(center_m + middles_m_[octant])) crossed |= 1U << octant;
    }
    return static_cast<std::uint8_t>(crossed);
  }

 private:
  [[nodiscard]] bool is_crossed(const Eigen::Vector3d& middle_m) const {
    if (middle_m.z() <= half_depth_m_ || middle_m.z() > far_m_) return false;
    Eigen::Vector2d pixel(middle_m.x() / middle_m.z() * camera_.fx + camera_.cx,
                          middle_m.y() / middle_m.z() * camera_.fy + camera_.cy);
    if (!pinhole_) {
      const auto projected = project(camera_, middle_m);
      if (!projected) return false;
      pixel = *projected;
    }
    if (!(pixel.x() > -0.5 && pixel.y() > -0.5)) return false;
    const auto u = static_cast<int>(pixel.x() + 0.5), v = static_cast<int>(pixel.y() + 0.5);
    if (u >= image_.width() || v >= image_.height()) return false;
    return static_cast<double>(image_.at(u, v)) > middle_m.z() + half_depth_m_;
  }

  const GridGeometry& geometry_;
  const RangeImage& image_;
  const CameraIntrinsics& camera_;
  bool pinhole_;
  Transform<Depth, Base> depth_T_base_;
  std::array<Eigen::Vector3d, 8> middles_m_;  ///< of the octants from the voxel's, camera axes
  double half_depth_m_ = 0;                   ///< from an octant's middle to its far corner, along the optical axis
  double far_m_ = 0;                          ///< beyond this depth pixels are too coarse
};

}  // namespace

void note_crossed_octants(VoxelMap& map, std::span<const std::uint64_t> missed, std::span<const std::uint64_t> hit,
                          const RangeImage& image, const DepthSensor& sensor, bool pinhole,
                          const Transform<Base, Depth>& base_T_depth) {
  if (!map.has_motion_planes()) return;
  const FrameProbe probe(map.geometry(), image, sensor, pinhole, base_T_depth);
  for (std::size_t word = 0; word < missed.size(); ++word) {
    for (std::uint64_t bits = missed[word] & ~hit[word]; bits != 0; bits &= bits - 1) {
      const std::size_t index = word * 64 + static_cast<std::size_t>(std::countr_zero(bits));
      const std::uint8_t open = map.octants(index).not_crossed();
      if (open != 0) map.note_crossed(index, probe.crossed(index, open));
    }
  }
}

}  // namespace firstlook
