#include "algorithms/mapping/ply_reader.hpp"

#include <charconv>
#include <cmath>
#include <cstring>
#include <string>

namespace firstlook {
namespace {

constexpr std::size_t kHeaderMax = 4096;
constexpr std::string_view kHeaderEnd = "end_header\n";
constexpr std::string_view kPoint =
    "property float x\nproperty float y\nproperty float z\nproperty uchar red\nproperty uchar green\n"
    "property uchar blue\nproperty uchar class\n";
constexpr std::string_view kLabel = "property ushort label\nproperty uchar shape\n";
constexpr std::string_view kSensor = "property uchar sensor\n";
constexpr double kResolutionTolerance = 1e-5;  // as of octrees

struct Header {
  PlaneChoice planes;
  std::size_t points = 0;
  double resolution_m = 0;
};

/// Byte by byte, so that nothing of the points is taken.
Result<std::string> read_header_text(ByteSource source) {
  std::string text;
  std::byte byte{};
  while (!text.ends_with(kHeaderEnd)) {
    if (text.size() == kHeaderMax || source({&byte, 1}) == 0)
      return failure(Fault::kMapUnreadable, "no PLY: no 'end_header' in the first {} bytes", text.size());
    text += static_cast<char>(byte);
  }
  return text;
}

template <typename Number>
bool number_behind(std::string_view text, std::string_view words, Number& number) {
  const std::size_t at = text.find(words);
  if (at == std::string_view::npos) return false;
  const char* first = text.data() + at + words.size();
  return std::from_chars(first, text.data() + text.size(), number).ec == std::errc{};
}

Result<Header> read_header(ByteSource source) {
  const Result<std::string> text = read_header_text(source);
  if (!text) return std::unexpected(text.error());
  Header header;
  header.planes.color = text->find(kColorComment) != std::string::npos;
  std::string_view properties = *text;
  properties.remove_prefix(std::min(properties.find("property"), properties.size()));
  const auto take = [&properties](std::string_view lines) {
    const bool there = properties.starts_with(lines);
    if (there) properties.remove_prefix(lines.size());
    return there;
  };
  bool ours = text->starts_with("ply\nformat binary_little_endian 1.0\n") && take(kPoint);
  header.planes.label = take(kLabel);
  header.planes.sensor = take(kSensor);
  ours = ours && properties == kHeaderEnd && number_behind(*text, "element vertex ", header.points) &&
         number_behind(*text, "resolution ", header.resolution_m);
  if (!ours) return failure(Fault::kMapUnreadable, "no PLY that firstlook has written");
  return header;
}

template <typename Value>
Value take(std::span<const std::byte>& bytes) {
  Value value{};
  std::memcpy(&value, bytes.data(), sizeof value);
  bytes = bytes.subspan(sizeof value);
  return value;
}

void set_point(std::span<const std::byte> bytes, const GridGeometry& geometry, MapPlanes& planes) {
  Eigen::Vector3d center_m;
  for (int axis = 0; axis < 3; ++axis) center_m[axis] = static_cast<double>(take<float>(bytes));
  const auto color = take<Rgb>(bytes);
  (void)take<std::uint8_t>(bytes);                                                        // class
  const bool near_grid = (center_m.array().abs() < 32768 * geometry.resolution_m).all();  // not NaN, either
  const Eigen::Vector3i voxel = near_grid ? geometry.voxel(center_m) : Eigen::Vector3i::Constant(-1);
  if (!geometry.contains(voxel)) return;
  const std::size_t index = geometry.index(voxel);
  if (planes.color && color != kNoColor) planes.color->set(index, color);
  if (planes.label) {
    const auto object = take<std::uint16_t>(bytes);
    const auto shape = take<std::uint8_t>(bytes);
    if (object != 0 && shape >= 1 && shape <= 3) planes.label->set(index, {object, ObjectShape(shape - 1)});
  }
  if (planes.sensor) planes.sensor->set(index, take<std::uint8_t>(bytes));
}

}  // namespace

Result<MapPlanes> read_ply_planes(ByteSource source, const GridGeometry& geometry) {
  const Result<Header> header = read_header(source);
  if (!header) return std::unexpected(header.error());
  if (!header->planes.any()) return MapPlanes{};
  if (!(std::abs(header->resolution_m - geometry.resolution_m) <= kResolutionTolerance * geometry.resolution_m))
    return failure(Fault::kMapUnreadable, "voxels of {} m, but the map's have {} m", header->resolution_m,
                   geometry.resolution_m);
  MapPlanes planes(geometry, header->planes);
  std::array<std::byte, 3 * sizeof(float) + 4 + 3 + 1> record{};
  const std::size_t size = 3 * sizeof(float) + 4 + (planes.label ? 3 : 0) + (planes.sensor ? 1 : 0);
  for (std::size_t point = 0; point < header->points; ++point) {
    if (source(std::span(record).first(size)) != size)
      return failure(Fault::kMapUnreadable, "the file ends inside point {} of {}", point + 1, header->points);
    set_point(std::span(record).first(size), geometry, planes);
  }
  return planes;
}

}  // namespace firstlook
