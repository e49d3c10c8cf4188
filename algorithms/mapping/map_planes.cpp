#include "algorithms/mapping/map_planes.hpp"

#include <bit>

#include "platform/core/ensure.hpp"

namespace firstlook {

void ColorSum::add(const Rgb& color) {
  if (points == kPointsMax) {
    for (std::uint32_t& channel : sum) channel /= 2;
    points /= 2;
  }
  for (std::size_t i = 0; i < 3; ++i) sum[i] += color[i];
  ++points;
}

std::optional<Rgb> ColorSum::mean() const {
  if (points == 0) return std::nullopt;
  Rgb color{};
  for (std::size_t i = 0; i < 3; ++i)
    color[i] = static_cast<std::uint8_t>((std::uint64_t{sum[i]} + points / 2) / points);
  return color;
}

void LabelPlane::write(const MapObjects& objects) {
  ENSURE(3140, objects.id_of.size() == labels_.size());
  for (std::size_t i = 0; i < labels_.size(); ++i) {
    const std::uint32_t id = objects.id_of[i];
    const bool labelled = id != 0 && id <= VoxelLabel::kObjectsMax;
    labels_[i] = labelled ? VoxelLabel{static_cast<std::uint16_t>(id), objects.objects[id - 1].shape} : VoxelLabel{};
  }
}

void SensorPlane::note(std::span<const std::uint64_t> missed, std::span<const std::uint64_t> hit, std::uint8_t sensor) {
  ENSURE(3141, sensor > 0 && missed.size() == hit.size() && missed.size() == (sensors_.size() + 63) / 64);
  for (std::size_t word = 0; word < missed.size(); ++word) {
    for (std::uint64_t seen = missed[word] | hit[word]; seen != 0; seen &= seen - 1)
      sensors_[word * 64 + static_cast<std::size_t>(std::countr_zero(seen))] = sensor;
  }
}

std::optional<PlaneChoice> planes_from_words(std::string_view words) {
  PlaneChoice choice;
  if (words == "none") return choice;
  while (true) {
    const std::size_t comma = words.find(',');
    const std::string_view word = words.substr(0, comma);
    bool* plane = word == "color" ? &choice.color : word == "label" ? &choice.label : nullptr;
    if (word == "sensor") plane = &choice.sensor;
    if (plane == nullptr || *plane) return std::nullopt;
    *plane = true;
    if (comma == std::string_view::npos) return choice;
    words.remove_prefix(comma + 1);
  }
}

MapPlanes::MapPlanes(const GridGeometry& geometry, const PlaneChoice& choice) {
  if (choice.color) color.emplace(geometry);
  if (choice.label) label.emplace(geometry);
  if (choice.sensor) sensor.emplace(geometry);
}

PlaneCounts count_planes(const VoxelMap& map, const MapPlanes& planes) {
  PlaneCounts counts;
  counts.planes = planes.choice();
  for (std::size_t i = 0; i < map.size(); ++i) {
    const bool occupied = map.voxel_class(i) == VoxelClass::kOccupied;
    counts.occupied += occupied ? 1 : 0;
    counts.colored += occupied && planes.color && planes.color->at(i) ? 1 : 0;
    counts.labelled += planes.label && planes.label->at(i).object != 0 ? 1 : 0;
    const std::size_t sensor = planes.sensor ? planes.sensor->at(i) : 0;
    if (sensor > counts.seen_last_by.size()) counts.seen_last_by.resize(sensor);
    if (sensor > 0) ++counts.seen_last_by[sensor - 1];
  }
  return counts;
}

}  // namespace firstlook
