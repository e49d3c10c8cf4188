#include "app/report/color_picture.hpp"

#include "app/report/object_picture.hpp"

namespace firstlook {
namespace {

constexpr Rgb kNotSeen = {205, 207, 212};

}  // namespace

MapPicture color_picture(const VoxelMap& map, const ColorPlane& colors, const MapObjects& objects, double azimuth_rad,
                         std::string caption) {
  MapPicture p = empty_map_picture(std::move(caption), "Colours");
  const Viewpoint viewpoint = viewpoint_of(map.geometry(), p.picture, azimuth_rad);
  const std::vector<bool> hidden =
      walls_from_behind(objects, MapProjection(viewpoint, p.picture.width, p.picture.height));
  const auto color = [&](std::size_t index) {
    return hidden[objects.id_of[index]] ? std::nullopt : std::optional(colors.at(index).value_or(kNotSeen));
  };
  draw_map(map, viewpoint, {}, color, {p.picture.pixels.data(), p.picture.width, p.picture.height});
  return p;
}

std::vector<MapPicture> color_pictures(const VoxelMap& map, const ColorPlane& colors, const MapObjects& objects) {
  return {color_picture(map, colors, objects, -2.2, "seen from behind: from negative x and y"),
          color_picture(map, colors, objects, 0.9, "seen from the front: from positive x and y")};
}

}  // namespace firstlook
