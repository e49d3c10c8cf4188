#include "app/report/map_json.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

namespace firstlook {
namespace {

using Json = nlohmann::ordered_json;

Json vector_json(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

template <typename T>
Json or_null(const std::optional<T>& value) {
  return value ? Json(*value) : Json(nullptr);
}

std::string_view name_of(VoxelClass voxel_class) {
  constexpr std::string_view kNames[] = {"unknown", "free", "occupied"};
  return kNames[static_cast<std::size_t>(voxel_class)];
}

}  // namespace

Json counts_json(const VoxelCounts& counts) {
  return {{"unknown", counts.unknown}, {"free", counts.free}, {"occupied", counts.occupied}};
}

Json extents_json(const GridGeometry& g) {
  return {{"low", vector_json(g.first.cast<double>() * g.resolution_m)},
          {"high", vector_json((g.first + g.size).cast<double>() * g.resolution_m)}};
}

Json objects_json(const MapObjects& objects) {
  Json list = Json::array();
  for (const MapObject& object : objects.objects) {
    const Eigen::Quaterniond& q = object.box.rotation;
    list.push_back({{"id", object.id},
                    {"shape", to_string(object.shape)},
                    {"bounds_room", object.bounds_room},
                    {"voxels", object.voxels},
                    {"box",
                     {{"center_m", vector_json(object.box.center_m)},
                      {"size_m", vector_json(object.box.size_m)},
                      {"quaternion_xyzw", {q.x(), q.y(), q.z(), q.w()}}}}});
  }
  return list;
}

Json change_json(const MapChange& change) {
  return {{"still_occupied", change.still_occupied},
          {"newly_occupied", change.newly_occupied},
          {"gone", change.gone},
          {"still_free", change.still_free},
          {"unseen_occupied", change.unseen_occupied},
          {"unseen_free", change.unseen_free},
          {"first_known", change.first_known}};
}

Json frame_json(const FrameOutcome& frame) {
  return {{"stamp_s", frame.stamp_s},
          {"image", frame.image},
          {"pixels",
           {{"used", frame.inserted.pixels_used},
            {"beyond_range", frame.inserted.pixels_beyond},
            {"without_return", frame.inserted.pixels_empty},
            {"saturated", frame.pixels_saturated}}},
          {"voxels_missed", frame.inserted.change.voxels_missed},
          {"voxels_hit", frame.inserted.change.voxels_hit},
          {"voxels_discovered", frame.inserted.change.voxels_discovered},
          {"voxels", counts_json(frame.voxels)}};
}

Json planes_json(const PlaneCounts& counts) {
  Json planes = Json::object();
  if (counts.planes.color) planes["color"] = {{"voxels", counts.colored}, {"of_occupied", counts.occupied}};
  if (counts.planes.label) planes["label"] = {{"voxels", counts.labelled}};
  if (counts.planes.sensor) planes["sensor"] = {{"voxels", counts.seen_last_by}};
  return planes;
}

std::string planes_text(const PlaneCounts& counts) {
  std::string text;
  if (counts.planes.color) text += fmt::format("{} of the occupied voxels have a colour\n", counts.colored);
  if (counts.planes.label) text += fmt::format("{} voxels belong to an object\n", counts.labelled);
  for (std::size_t i = 0; i < counts.seen_last_by.size(); ++i)
    text += fmt::format("{} voxels were seen last by sensor {}\n", counts.seen_last_by[i], i + 1);
  return text;
}

PlaceKnown look_up(const VoxelMap& map, const Eigen::Vector3d& point_m, const MapObjects* objects,
                   const MapPlanes& planes) {
  PlaceKnown place;
  place.point_m = point_m;
  place.voxel_class = map.class_at(point_m);
  place.nearest = nearest_occupied(map, point_m, collision_class);
  place.planes = planes.choice();
  const GridGeometry& g = map.geometry();
  const Eigen::Vector3d low_m = g.first.cast<double>() * g.resolution_m;
  const Eigen::Vector3d high_m = (g.first + g.size).cast<double>() * g.resolution_m;
  if ((point_m.array() < low_m.array()).any() || (point_m.array() > high_m.array()).any()) return place;
  const Eigen::Vector3i voxel = g.voxel(point_m);
  if (!g.contains(voxel)) return place;
  place.inside = true;
  const std::size_t index = g.index(voxel);
  if (map.log_odds(index) != kUnknownLogOdds) place.log_odds = map.log_odds(index) * kLogOddsUnit;
  if (objects != nullptr && objects->id_of[index] != 0) place.object = static_cast<int>(objects->id_of[index]);
  if (planes.color && place.voxel_class == VoxelClass::kOccupied) place.color = planes.color->at(index);
  if (planes.label && planes.label->at(index).object != 0) place.shape = planes.label->at(index).shape;
  if (planes.sensor && planes.sensor->at(index) != 0) place.sensor = planes.sensor->at(index);
  return place;
}

Json place_json(const PlaceKnown& place) {
  Json nearest = nullptr, seen = nullptr;
  if (place.nearest)
    nearest = {{"center_m", vector_json(place.nearest->center_m)}, {"distance_m", place.nearest->distance_m}};
  if (place.seen)
    seen = {{"frames", place.seen->frames},
            {"frames_hit", place.seen->frames_hit},
            {"last_seen_s", or_null(place.seen->last_seen_s)},
            {"last_hit_s", or_null(place.seen->last_hit_s)}};
  Json json = {{"point_m", vector_json(place.point_m)},
               {"inside_map", place.inside},
               {"class", name_of(place.voxel_class)},
               {"log_odds", or_null(place.log_odds)},
               {"seen", seen},
               {"nearest_occupied", nearest},
               {"object", or_null(place.object)}};
  if (place.planes.color) json["color"] = or_null(place.color);
  if (place.planes.label) json["shape"] = place.shape ? Json(to_string(*place.shape)) : Json(nullptr);
  if (place.planes.sensor) json["sensor"] = or_null(place.sensor);
  return json;
}

std::string place_text(const PlaceKnown& place) {
  std::string text = fmt::format("({:g}, {:g}, {:g}) m is {}", place.point_m.x(), place.point_m.y(), place.point_m.z(),
                                 name_of(place.voxel_class));
  if (!place.inside) text += ": it lies outside the map";
  if (place.log_odds) text += fmt::format(", log-odds {:.2f}", *place.log_odds);
  text += "\n";
  if (place.seen) {
    const PlaceSeen& seen = *place.seen;
    text += seen.frames == 0
                ? "  no frame saw it\n"
                : fmt::format("  seen by {} frames, last at {:.3f} s; {}\n", seen.frames, *seen.last_seen_s,
                              seen.frames_hit == 0
                                  ? std::string("none hit it")
                                  : fmt::format("{} hit it, last at {:.3f} s", seen.frames_hit, *seen.last_hit_s));
  }
  if (place.nearest) {
    const Eigen::Vector3d& c = place.nearest->center_m;
    text += fmt::format("  the nearest occupied voxel is {:.3f} m away, at ({:.3f}, {:.3f}, {:.3f})\n",
                        place.nearest->distance_m, c.x(), c.y(), c.z());
  } else {
    text += "  no voxel of the map is occupied\n";
  }
  if (place.object)
    text += fmt::format("  it belongs to object {}{}{}\n", *place.object, place.shape ? ", shape " : "",
                        place.shape ? to_string(*place.shape) : "");
  if (place.color) {
    const Rgb& c = *place.color;
    text += fmt::format("  its colour is red {}, green {}, blue {}\n", c[0], c[1], c[2]);
  } else if (place.planes.color && place.voxel_class == VoxelClass::kOccupied) {
    text += "  the colour camera did not see it\n";
  }
  if (place.sensor) text += fmt::format("  sensor {} saw it last\n", *place.sensor);
  return text;
}

std::string objects_text(const MapObjects& objects) {
  std::string text;
  for (const MapObject& o : objects.objects) {
    const Eigen::Vector3d &c = o.box.center_m, &s = o.box.size_m;
    text += fmt::format("object {:3} {:5} {:7} voxels, {:.2f} x {:.2f} x {:.2f} m at ({:.2f}, {:.2f}, {:.2f}){}\n",
                        o.id, to_string(o.shape), o.voxels, s.x(), s.y(), s.z(), c.x(), c.y(), c.z(),
                        o.bounds_room ? ", bounds the room" : "");
  }
  return text + fmt::format("{} occupied voxels in pieces of fewer than {}\n", objects.specks, kObjectVoxelsMin);
}

}  // namespace firstlook
