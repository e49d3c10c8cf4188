/// What may be kept for each voxel beside its log-odds: a colour, the object it belongs to, the sensor that saw it
/// (thesis, appendix B-1). All of it is off by default, costs nothing then, and never has a say in what is free.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "algorithms/mapping/objects.hpp"

namespace firstlook {

using Rgb = std::array<std::uint8_t, 3>;          ///< red, green, blue
inline constexpr Rgb kNoColor = {255, 255, 255};  ///< of files for voxels without one, as OctoMap has it

/// By which a PLY says that its colours are not those of heights.
inline constexpr std::string_view kColorComment = "comment red green blue: the mean colour of the points";

/// The exact mean of colours: whole sums, so that the order of the points does not matter.
struct ColorSum {
  static constexpr std::uint32_t kPointsMax = 1U << 24;  ///< 255 times as much fits 32 bits; then the past is halved
  std::array<std::uint32_t, 3> sum{};
  std::uint32_t points = 0;

  void add(const Rgb& color);
  /// Rounded to the nearest; empty without a point.
  [[nodiscard]] std::optional<Rgb> mean() const;
};

/// The mean colour of the points that hit each voxel. A voxel that was hit and is free again keeps its colour.
class ColorPlane {
 public:
  explicit ColorPlane(const GridGeometry& geometry) : sums_(geometry.count()) {}
  void add(std::size_t index, const Rgb& color) { sums_[index].add(color); }
  [[nodiscard]] std::optional<Rgb> at(std::size_t index) const { return sums_[index].mean(); }
  void set(std::size_t index, const Rgb& color) { sums_[index] = {{color[0], color[1], color[2]}, 1}; }

 private:
  std::vector<ColorSum> sums_;
};

/// The object that a voxel belongs to, as find_objects numbers them; 0 is none.
struct VoxelLabel {
  static constexpr std::uint32_t kObjectsMax = 65535;  ///< later ones have no label: the smallest of all
  std::uint16_t object = 0;
  ObjectShape shape = ObjectShape::kOther;
  bool operator==(const VoxelLabel&) const = default;
};
/// Of files: 0 for no object, else 1 plane, 2 box, 3 other.
[[nodiscard]] inline std::uint8_t shape_number(const VoxelLabel& label) {
  return static_cast<std::uint8_t>(label.object == 0 ? 0 : static_cast<int>(label.shape) + 1);
}

class LabelPlane {
 public:
  explicit LabelPlane(const GridGeometry& geometry) : labels_(geometry.count()) {}
  /// At the end of mapping. @param objects  of a map of the same geometry
  void write(const MapObjects& objects);
  void set(std::size_t index, const VoxelLabel& label) { labels_[index] = label; }
  [[nodiscard]] const VoxelLabel& at(std::size_t index) const { return labels_[index]; }

 private:
  std::vector<VoxelLabel> labels_;
};

/// The sensor whose frame saw each voxel last, free or occupied.
class SensorPlane {
 public:
  explicit SensorPlane(const GridGeometry& geometry) : sensors_(geometry.count()) {}
  /// @param missed, hit  the planes of VoxelMap::apply  @param sensor  from 1 on
  void note(std::span<const std::uint64_t> missed, std::span<const std::uint64_t> hit, std::uint8_t sensor);
  void set(std::size_t index, std::uint8_t sensor) { sensors_[index] = sensor; }
  /// 0: none.
  [[nodiscard]] std::uint8_t at(std::size_t index) const { return sensors_[index]; }

 private:
  std::vector<std::uint8_t> sensors_;
};

/// Which of them there are.
struct PlaneChoice {
  bool color = false, label = false, sensor = false;
  [[nodiscard]] bool any() const { return color || label || sensor; }
  [[nodiscard]] std::size_t bytes_per_voxel() const {
    return (color ? sizeof(ColorSum) : 0) + (label ? sizeof(VoxelLabel) : 0) + (sensor ? 1 : 0);
  }
  bool operator==(const PlaneChoice&) const = default;
};

/// "none", or words of "color", "label" and "sensor" with commas between them; empty for anything else.
[[nodiscard]] std::optional<PlaneChoice> planes_from_words(std::string_view words);

/// The planes of one map, over the same voxels. Memory is taken at construction only.
struct MapPlanes {
  MapPlanes() = default;
  MapPlanes(const GridGeometry& geometry, const PlaneChoice& choice);
  [[nodiscard]] static std::size_t required_bytes(const GridGeometry& geometry, const PlaneChoice& choice) {
    return geometry.count() * choice.bytes_per_voxel();
  }
  [[nodiscard]] PlaneChoice choice() const { return {color.has_value(), label.has_value(), sensor.has_value()}; }

  std::optional<ColorPlane> color;
  std::optional<LabelPlane> label;
  std::optional<SensorPlane> sensor;
};

/// What the planes hold: occupied voxels with a colour, voxels of objects, voxels seen last by each sensor.
struct PlaneCounts {
  PlaneChoice planes;
  std::size_t occupied = 0;
  std::size_t colored = 0;
  std::size_t labelled = 0;
  std::vector<std::size_t> seen_last_by;  ///< sensor 1, 2 .. up to the last that saw anything last
};
[[nodiscard]] PlaneCounts count_planes(const VoxelMap& map, const MapPlanes& planes);

}  // namespace firstlook
