#include "app/report/object_picture.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace firstlook {
namespace {

using Color = std::array<std::uint8_t, 3>;

constexpr double kElevation_rad = 0.7;
constexpr int kWidth = 960, kHeight = 800;
constexpr double kBorder_px = 40;
constexpr Color kSpeck = {120, 120, 120};

/// Across the flat side of a plane, towards where the other objects' centres lie in the mean.
Eigen::Vector3d inward(const MapObject& plane, const MapObjects& objects) {
  int thin = 0;
  plane.box.size_m.minCoeff(&thin);
  const Eigen::Vector3d normal = plane.box.rotation.toRotationMatrix().col(thin);
  double side = 0;
  for (const MapObject& other : objects.objects)
    side += static_cast<double>(other.voxels) * normal.dot(other.box.center_m - plane.box.center_m);
  return side < 0 ? Eigen::Vector3d(-normal) : normal;
}

void outline(const MapObject& object, const MapProjection& projection, MapPicture& picture) {
  const auto corner = [&](int i) {
    const Eigen::Vector3d sign((i & 1) != 0 ? 1 : -1, (i & 2) != 0 ? 1 : -1, (i & 4) != 0 ? 1 : -1);
    const Eigen::Vector3d p = object.box.rotation * (sign.cwiseProduct(object.box.size_m) / 2);
    return projection.pixel(object.box.center_m + p);
  };
  for (int i = 0; i < 8; ++i)
    for (const int bit : {1, 2, 4})
      if ((i & bit) == 0) picture.lines.push_back({"part", {corner(i), corner(i | bit)}});
  picture.labels.push_back(
      {"place", fmt::format("{} {}", object.id, to_string(object.shape)), projection.pixel(object.box.center_m)});
}

}  // namespace

Color object_color(const MapObject& object) {
  if (object.bounds_room) return {205, 207, 212};
  constexpr Color kColors[] = {{31, 119, 180},  {255, 127, 14}, {44, 160, 44},   {214, 39, 40},
                               {148, 103, 189}, {140, 86, 75},  {227, 119, 194}, {188, 189, 34},
                               {23, 190, 207},  {57, 59, 121},  {231, 186, 82},  {99, 121, 57}};
  return kColors[static_cast<std::size_t>(object.id) % std::size(kColors)];
}

MapPicture empty_map_picture(std::string caption, std::string group) {
  MapPicture p;
  p.picture.caption = std::move(caption);
  p.picture.width = kWidth;
  p.picture.height = kHeight;
  p.picture.pixels.resize(static_cast<std::size_t>(kWidth) * kHeight * 3);
  p.group = std::move(group);
  return p;
}

Viewpoint viewpoint_of(const GridGeometry& g, const RgbPicture& picture, double azimuth_rad) {
  return Viewpoint::seeing(g.first.cast<double>() * g.resolution_m, (g.first + g.size).cast<double>() * g.resolution_m,
                           azimuth_rad, kElevation_rad, picture.width, picture.height, kBorder_px);
}

std::vector<bool> walls_from_behind(const MapObjects& objects, const MapProjection& projection) {
  std::vector<bool> hidden = {false};
  for (const MapObject& object : objects.objects)
    hidden.push_back(object.bounds_room && inward(object, objects).dot(projection.into()) > 0);
  return hidden;
}

MapPicture object_picture(const VoxelMap& map, const MapObjects& objects, double azimuth_rad, std::string caption) {
  MapPicture p = empty_map_picture(std::move(caption), "Objects");
  const Viewpoint viewpoint = viewpoint_of(map.geometry(), p.picture, azimuth_rad);
  const MapProjection projection(viewpoint, kWidth, kHeight);
  const std::vector<bool> hidden = walls_from_behind(objects, projection);
  std::vector<Color> color_of = {kSpeck};
  for (const MapObject& object : objects.objects) {
    color_of.push_back(object_color(object));
    if (!object.bounds_room) outline(object, projection, p);
  }
  const auto color = [&](std::size_t index) {
    const std::uint32_t id = objects.id_of[index];
    return hidden[id] ? std::nullopt : std::optional(color_of[id]);
  };
  draw_map(map, viewpoint, {}, color, {p.picture.pixels.data(), kWidth, kHeight});
  return p;
}

std::vector<MapPicture> object_pictures(const VoxelMap& map, const MapObjects& objects) {
  if (objects.objects.empty()) return {};
  return {object_picture(map, objects, -2.2, "seen from behind: from negative x and y"),
          object_picture(map, objects, 0.9, "seen from the front: from positive x and y")};
}

}  // namespace firstlook
