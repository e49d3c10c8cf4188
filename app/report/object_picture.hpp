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

/// The map in parallel projection with each object in its colour, its box and its number. Walls seen from behind are
/// left out, so that the picture looks into the room.
[[nodiscard]] MapPicture object_picture(const VoxelMap& map, const MapObjects& objects, double azimuth_rad,
                                        std::string caption);

/// From behind and from the front, as the report's other pictures. None without objects.
[[nodiscard]] std::vector<MapPicture> object_pictures(const VoxelMap& map, const MapObjects& objects);

}  // namespace firstlook
