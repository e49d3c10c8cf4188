/// Maps, their objects and places as JSON: what `firstlook map --json` prints and result.json holds.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>

#include "algorithms/mapping/map_change.hpp"
#include "algorithms/mapping/map_planes.hpp"
#include "algorithms/mapping/objects.hpp"
#include "app/dataset/dataset_mapping.hpp"

namespace firstlook {

[[nodiscard]] nlohmann::ordered_json counts_json(const VoxelCounts& counts);

/// {"low": [x, y, z], "high": [x, y, z]} of the grid, m.
[[nodiscard]] nlohmann::ordered_json extents_json(const GridGeometry& geometry);

/// For each object id, shape, bounds_room, voxels and box {center_m, size_m, quaternion_xyzw}, in base (the map).
[[nodiscard]] nlohmann::ordered_json objects_json(const MapObjects& objects);

/// A key for each plane that there is.
[[nodiscard]] nlohmann::ordered_json planes_json(const PlaneCounts& counts);
/// The same in words, a line for each plane.
[[nodiscard]] std::string planes_text(const PlaneCounts& counts);

[[nodiscard]] nlohmann::ordered_json change_json(const MapChange& change);

/// One frame that went in, as `frames[]` of `firstlook map --json`.
[[nodiscard]] nlohmann::ordered_json frame_json(const FrameOutcome& frame);

/// What is known of a place.
struct PlaceKnown {
  Eigen::Vector3d point_m = Eigen::Vector3d::Zero();
  bool inside = false;  ///< of the grid; outside everything is unknown
  VoxelClass voxel_class = VoxelClass::kUnknown;
  std::optional<double> log_odds;  ///< OctoMap's, natural logarithm; empty: unknown
  std::optional<PlaceSeen> seen;   ///< empty: a stored map does not say
  std::optional<NearestOccupied> nearest;
  std::optional<int> object;  ///< whose voxel it is
  PlaneChoice planes;         ///< that the map has; what follows is theirs
  std::optional<Rgb> color;
  std::optional<ObjectShape> shape;  ///< of the object
  std::optional<int> sensor;         ///< that saw it last
};
[[nodiscard]] PlaceKnown look_up(const VoxelMap& map, const Eigen::Vector3d& point_m, const MapObjects* objects,
                                 const MapPlanes& planes = {});
[[nodiscard]] nlohmann::ordered_json place_json(const PlaceKnown& place);
/// The same in words, a line for each fact.
[[nodiscard]] std::string place_text(const PlaceKnown& place);
/// One line for each object.
[[nodiscard]] std::string objects_text(const MapObjects& objects);

}  // namespace firstlook
