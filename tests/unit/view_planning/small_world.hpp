/// A truth made of voxels, a perfect depth sensor in it, and the map that an arm builds of it.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "algorithms/kinematics/self_collision.hpp"
#include "algorithms/mapping/reach_zone.hpp"
#include "algorithms/motion/clearance.hpp"
#include "algorithms/view_planning/explore.hpp"
#include "algorithms/view_planning/ray_walk.hpp"

namespace firstlook::test {

inline GridGeometry small_grid() { return GridGeometry::covering({-1.5, -1.5, -0.3}, {1.5, 1.5, 1.5}, 0.05); }

inline DepthSensor small_sensor() {
  DepthSensor sensor;
  const double f = 60 / std::tan(28.5 * 0.017453292519943295);  // 57 degrees wide, as a Kinect
  sensor.intrinsics = {.width = 120, .height = 90, .fx = f, .fy = f, .cx = 59.5, .cy = 44.5};
  return sensor;
}

inline Transform<Flange, Depth> small_mount() {
  return {Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.0, -0.06, 0.05)};
}

/// What is really there.
struct Truth {
  GridGeometry geometry = small_grid();
  std::vector<std::uint8_t> solid = std::vector<std::uint8_t>(geometry.count(), 0);

  /// A closed room: floor, ceiling and four walls on the outermost voxels.
  static Truth room() {
    Truth t;
    for (std::size_t i = 0; i < t.solid.size(); ++i) {
      const Eigen::Vector3i v = t.geometry.voxel_at(i);
      const Eigen::Vector3i top = t.geometry.size - Eigen::Vector3i::Ones();
      t.solid[i] = (v.array() == 0).any() || (v.array() == top.array()).any() ? 1 : 0;
    }
    return t;
  }
  void add_box(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
    for (std::size_t i = 0; i < solid.size(); ++i) {
      const Eigen::Vector3d p = geometry.center_m(geometry.voxel_at(i));
      if ((p.array() > low.array()).all() && (p.array() < high.array()).all()) solid[i] = 1;
    }
  }
};

/// Depth of every pixel, millimetres; rays end 3 mm inside the first solid voxel.
inline std::vector<std::uint16_t> render(const Truth& truth, const DepthSensor& sensor,
                                         const Transform<Base, Depth>& base_T_depth) {
  const CameraIntrinsics& c = sensor.intrinsics;
  std::vector<std::uint16_t> depth(static_cast<std::size_t>(c.width * c.height), 0);
  for (int row = 0; row < c.height; ++row) {
    for (int column = 0; column < c.width; ++column) {
      const Eigen::Vector3d ray((column - c.cx) / c.fx, (row - c.cy) / c.fy, 1.0);
      double z_m = 0;
      walk_ray(truth.geometry, base_T_depth.translation(), base_T_depth * Eigen::Vector3d(5 * ray),
               [&](std::size_t i, double entry) {
                 if (truth.solid[i] == 0) return true;
                 z_m = 5 * entry + 0.003;
                 return false;
               });
      if (z_m >= sensor.range_min_m) {
        depth[static_cast<std::size_t>(row * c.width + column)] = static_cast<std::uint16_t>(std::lround(1000 * z_m));
      }
    }
  }
  return depth;
}

/// An arm in a truth, with what it knows.
struct SmallWorld {
  ArmModel arm = *find_arm_model("ur5");
  Truth truth;
  DepthSensor sensor = small_sensor();
  Transform<Flange, Depth> mount = small_mount();
  Body body = body_with_camera(arm, Transform<Flange, Camera>(small_mount().pose()));
  Clearance clearance = required_clearance({}).clearance();
  VoxelMap map{small_grid()};
  DistanceField field{small_grid(), 0.5};
  std::vector<std::uint8_t> free = std::vector<std::uint8_t>(small_grid().count(), 0);
  std::vector<std::uint8_t> zone = std::vector<std::uint8_t>(small_grid().count(), 0);
  FreeSpace space;
  Inserter inserter{small_grid(), small_sensor()};
  double now_s = 0;
  JointVector q;

  explicit SmallWorld(Truth t) : truth(std::move(t)), q(default_start(arm)) {
    map.set_safe_zone(space.zone);
    map.block(HalfSpace{.normal = -Eigen::Vector3d::UnitZ(), .offset_m = 0.25});  // below the cart's top nothing moves
    mark_reach_zone(map.geometry(), arm, body.capsules, 0.05, -0.05, zone);
    update();
  }
  SmallWorld(const SmallWorld&) = delete;

  void update() {
    map.free_mask(now_s, 600, free);
    field.update(free);
    space.field = &field;
    space.zone_intact = true;
    for (std::size_t i = 0; i < map.size(); ++i) {
      const Eigen::Vector3d p = map.geometry().center_m(map.geometry().voxel_at(i));
      if (space.zone.depth_m(p) > 0.05 && map.voxel_class(i) == VoxelClass::kOccupied) space.zone_intact = false;
    }
  }
  ViewContext context() const { return {arm, body, space, clearance, map, zone, mount, 0, 600}; }

  FrameChange look(const JointVector& at) {
    const auto base_T_depth = forward(arm, at).flange() * mount;
    const std::vector<std::uint16_t> depth = render(truth, sensor, base_T_depth);
    const DepthImage image{.pixels = {depth.data(), sensor.intrinsics.width, sensor.intrinsics.height},
                           .units_per_m = 1000};
    now_s += 1;
    const auto result = inserter.insert(map, image, base_T_depth, {}, now_s);
    return result ? result->change : FrameChange{};
  }
  /// Moves along a path, looks a few times on the way and at its end.
  void follow(const Path& path) {
    for (std::size_t i = 1; i < path.waypoints.size(); ++i) {
      for (const double t : {0.5, 1.0}) look(interpolate(path.waypoints[i - 1], path.waypoints[i], t));
    }
    q = path.waypoints.back();
    look(q);
    update();
  }

  /// Of the zone's voxels that are empty in truth and not below the cart's top: the share that the map knows.
  double coverage(const Eigen::Vector3d& low = Eigen::Vector3d::Constant(-9),
                  const Eigen::Vector3d& high = Eigen::Vector3d::Constant(9)) const {
    std::size_t all = 0;
    std::size_t known = 0;
    for (std::size_t i = 0; i < map.size(); ++i) {
      const Eigen::Vector3d p = map.geometry().center_m(map.geometry().voxel_at(i));
      if (zone[i] == 0 || truth.solid[i] != 0 || (p.array() < low.array()).any() || (p.array() > high.array()).any()) {
        continue;
      }
      ++all;
      known += map.voxel_class(i) == VoxelClass::kUnknown ? 0 : 1;
    }
    return all == 0 ? 1.0 : static_cast<double>(known) / static_cast<double>(all);
  }

  /// Dense check that shares no code with the certificate: no voxel centre inside a capsule may be anything but free
  /// for motion, at 100 places of every segment; links 0 and 1 are exempt inside the allowance.
  int entries_into_unknown(const Path& path) const {
    int entries = 0;
    for (std::size_t i = 1; i < path.waypoints.size(); ++i) {
      for (int k = 0; k <= 100; ++k) {
        entries += entries_at(interpolate(path.waypoints[i - 1], path.waypoints[i], k / 100.0));
      }
    }
    return entries;
  }
  int entries_at(const JointVector& at) const {
    const GridGeometry& g = map.geometry();
    int entries = 0;
    for (const Capsule& c : place(body.capsules, forward(arm, at))) {
      const Eigen::Vector3i low = g.voxel(c.a.cwiseMin(c.b).array() - c.radius_m);
      const Eigen::Vector3i high = g.voxel(c.a.cwiseMax(c.b).array() + c.radius_m);
      for (int z = low.z(); z <= high.z(); ++z) {
        for (int y = low.y(); y <= high.y(); ++y) {
          for (int x = low.x(); x <= high.x(); ++x) {
            const Eigen::Vector3i v(x, y, z);
            const Eigen::Vector3d p = g.center_m(v);
            if (segment_distance_m(p, p, c.a, c.b) >= c.radius_m) continue;
            const bool allowed = c.link <= 1 && std::hypot(p.x(), p.y()) <= body.allowance.radius_m &&
                                 p.z() >= body.allowance.z_low_m && p.z() <= body.allowance.z_high_m;
            const bool vouched = space.zone_intact && space.zone.depth_m(p) >= 0;
            if (!allowed && !vouched && !(g.contains(v) && free[g.index(v)] != 0)) ++entries;
          }
        }
      }
    }
    return entries;
  }
};

}  // namespace firstlook::test
