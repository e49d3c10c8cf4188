/// What stands in a map: its occupied voxels as objects with shapes and boxes, and what moving one would do.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "algorithms/mapping/class_reading.hpp"
#include "algorithms/mapping/voxel_map.hpp"
#include "platform/core/result.hpp"

namespace firstlook {

enum class ObjectShape : std::uint8_t { kPlane, kBox, kOther };
/// "plane", "box", "other".
[[nodiscard]] std::string_view to_string(ObjectShape shape);

/// A box in base: its edges lie along the axes of `rotation`.
struct OrientedBox {
  Eigen::Vector3d center_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d size_m = Eigen::Vector3d::Zero();
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();

  [[nodiscard]] double volume_m3() const { return size_m.prod(); }
  [[nodiscard]] bool contains(const Eigen::Vector3d& point_m) const;
};

struct MapObject {
  int id = 0;  ///< from 1 on; the largest first, equal ones in the order of their first voxels
  ObjectShape shape = ObjectShape::kOther;
  bool bounds_room = false;  ///< a floor, wall or table that was seen from the side on which all the rest stands
  std::size_t voxels = 0;
  OrientedBox box;  ///< holds every voxel whole; turned about z, or tilted, where that makes it clearly smaller
};

struct MapObjects {
  std::vector<MapObject> objects;
  std::vector<std::uint32_t> id_of;  ///< for each voxel of the map; 0 is no object
  std::size_t specks = 0;            ///< occupied voxels in pieces too small for an object
};

inline constexpr std::size_t kObjectVoxelsMin = 8;

/// Takes the planes that bound the room out (they join everything), then the connected occupied voxels (by face, edge
/// or corner) of at least kObjectVoxelsMin. A plane is flat; a box has its voxels near the faces of its box, two faces
/// that meet are closed, and nothing inside is free. The same map gives the same objects.
[[nodiscard]] MapObjects find_objects(const VoxelMap& map, ClassReading reading);

struct ObjectMove {
  int id = 0;
  Eigen::Vector3d by_m = Eigen::Vector3d::Zero();  ///< rounded to whole voxels
};

/// The map after objects were moved by hand: where they stood becomes unknown, never free; where they stand now is
/// occupied with their log-odds, and what else is inside their boxes unknown. The grid grows where it must.
/// @return log-odds only; kUsage for an id that is not there, one moved twice, or a move that is not finite;
/// kMapTooLarge
[[nodiscard]] Result<VoxelMap> move_objects(const VoxelMap& map, const MapObjects& objects,
                                            std::span<const ObjectMove> moves, std::size_t voxels_max);

/// The occupied voxel whose centre is nearest to a point.
struct NearestOccupied {
  Eigen::Vector3d center_m = Eigen::Vector3d::Zero();
  double distance_m = 0;  ///< to its centre
};
/// Empty in a map without occupied voxels. Looks at every voxel.
[[nodiscard]] std::optional<NearestOccupied> nearest_occupied(const VoxelMap& map, const Eigen::Vector3d& point_m,
                                                              ClassReading reading);

}  // namespace firstlook
