/// The objects of a map in colours.
#pragma once

#include <array>
#include <cstdint>

#include "algorithms/mapping/map_image.hpp"
#include "algorithms/mapping/objects.hpp"
#include "app/report/run_record.hpp"

namespace firstlook {

/// The colour of an object's number in pictures and lists; those that bound the room are grey.
[[nodiscard]] std::array<std::uint8_t, 3> object_color(const MapObject& object);

/// What pictures that look into the room share: their size and group, where they are seen from, and for each number of
/// an object (0: none) whether it is a wall seen from behind.
[[nodiscard]] MapPicture empty_map_picture(std::string caption, std::string group);
[[nodiscard]] Viewpoint viewpoint_of(const GridGeometry& geometry, const RgbPicture& picture, double azimuth_rad);
[[nodiscard]] std::vector<bool> walls_from_behind(const MapObjects& objects, const MapProjection& projection);

/// The map in parallel projection with each object in its colour, its box and its number. Walls seen from behind are
/// left out, so that the picture looks into the room.
[[nodiscard]] MapPicture object_picture(const VoxelMap& map, const MapObjects& objects, double azimuth_rad,
                                        std::string caption);

/// From behind and from the front, as the report's other pictures. None without objects.
[[nodiscard]] std::vector<MapPicture> object_pictures(const VoxelMap& map, const MapObjects& objects);

}  // namespace firstlook
