/// Where the body may be: known free voxels, the safe zone, and what the configuration keeps out.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "algorithms/mapping/distance_field.hpp"
#include "algorithms/mapping/safe_zone.hpp"
#include "platform/core/fixed_vector.hpp"

namespace firstlook {

/// Axis-aligned box in base that nothing may enter.
struct KeepOutBox {
  Eigen::Vector3d low_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d high_m = Eigen::Vector3d::Zero();
  [[nodiscard]] double distance_m(const Eigen::Vector3d& p) const {
    return (low_m - p).cwiseMax(p - high_m).cwiseMax(0.0).norm();
  }
};

/// Half space that nothing may enter: allowed is normal . p >= offset_m, with a unit normal.
struct KeepOutPlane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  double offset_m = 0;
  [[nodiscard]] double distance_m(const Eigen::Vector3d& p) const { return normal.dot(p) - offset_m; }
};

/// What must remain between the body and what is not free. The distance field measures to voxel centres, so its
/// requirement holds half a voxel diagonal; zone and keep-outs are real surfaces. See clearance.hpp.
struct Clearance {
  double voxels_m = 0;
  double surface_m = 0;
};

inline constexpr std::size_t kKeepOutsMax = 16;

/// A view of the free space; cheap to copy. The field must outlive it.
struct FreeSpace {
  const DistanceField* field = nullptr;  ///< null before anything is mapped
  SafeZone zone;
  bool zone_intact = true;                 ///< false: the zone does not count, the field alone does
  const DistanceField* revoked = nullptr;  ///< distance to the voxels of the zone that a hit took away; null: none
  FixedVector<KeepOutBox, kKeepOutsMax> keep_out_boxes;
  FixedVector<KeepOutPlane, kKeepOutsMax> keep_out_planes;

  /// Distance from p to voxels that are not free, beyond what is required; -voxels_m when unknown.
  [[nodiscard]] double field_margin_m(const Eigen::Vector3d& p, const Clearance& need) const {
    return (field != nullptr ? field->distance_m(p) : 0.0) - need.voxels_m;
  }
  /// Distance from p to the surface of the safe zone, beyond what is required; -infinity when the zone does not count.
  /// The zone is convex: along a straight line this is smallest at an end.
  [[nodiscard]] double zone_surface_margin_m(const Eigen::Vector3d& p, const Clearance& need) const {
    return zone_intact ? zone.depth_m(p) - need.surface_m : -std::numeric_limits<double>::infinity();
  }
  /// Distance from p to the revoked voxels of the zone, beyond what is required; +infinity without any.
  [[nodiscard]] double revoked_margin_m(const Eigen::Vector3d& p, const Clearance& need) const {
    return revoked != nullptr ? revoked->distance_m(p) - need.voxels_m : std::numeric_limits<double>::infinity();
  }
  /// Distance from p to what the safe zone does not call free, beyond what is required.
  [[nodiscard]] double zone_margin_m(const Eigen::Vector3d& p, const Clearance& need) const {
    return std::min(zone_surface_margin_m(p, need), revoked_margin_m(p, need));
  }
  /// Distance from p to the nearest keep-out, beyond what is required; +infinity without any.
  [[nodiscard]] double keep_out_margin_m(const Eigen::Vector3d& p, const Clearance& need) const {
    double margin = std::numeric_limits<double>::infinity();
    for (const KeepOutBox& box : keep_out_boxes) margin = std::min(margin, box.distance_m(p) - need.surface_m);
    for (const KeepOutPlane& plane : keep_out_planes) margin = std::min(margin, plane.distance_m(p) - need.surface_m);
    return margin;
  }
  /// Lower bound of how much farther p is from anything not free than required. Free is what the zone or the field
  /// calls free; a keep-out is never free. A ball about p of this radius keeps the clearance everywhere.
  [[nodiscard]] double margin_m(const Eigen::Vector3d& p, const Clearance& need) const {
    return std::min(std::max(field_margin_m(p, need), zone_margin_m(p, need)), keep_out_margin_m(p, need));
  }
  /// margin_m for two requirements at the price of one: the field is asked once.
  [[nodiscard]] std::array<double, 2> margins_m(const Eigen::Vector3d& p, const std::array<Clearance, 2>& needs) const {
    const double nearest_m = field != nullptr ? field->distance_m(p) : 0.0;
    const double depth_m = zone.depth_m(p);
    const double revoked_m = revoked != nullptr ? revoked->distance_m(p) : std::numeric_limits<double>::infinity();
    const double keep_out_m = keep_out_margin_m(p, Clearance{});
    std::array<double, 2> margins{};
    for (std::size_t i = 0; i < margins.size(); ++i) {
      const double in_zone = zone_intact ? std::min(depth_m - needs[i].surface_m, revoked_m - needs[i].voxels_m)
                                         : -std::numeric_limits<double>::infinity();
      margins[i] = std::min(std::max(nearest_m - needs[i].voxels_m, in_zone), keep_out_m - needs[i].surface_m);
    }
    return margins;
  }
  /// Lower bound of the distance from p to anything not free (voxel centres, zone surface, keep-outs).
  [[nodiscard]] double clearance_m(const Eigen::Vector3d& p) const { return margin_m(p, Clearance{}); }
};

}  // namespace firstlook
