#include "app/config/mesh_points.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstring>
#include <filesystem>

#include "platform/linux/files.hpp"

namespace firstlook {
namespace {

using Points = std::vector<Eigen::Vector3d>;

constexpr std::size_t kFileBytesMax = 64 << 20;
constexpr std::size_t kHeadBytes = 84, kTriangleBytes = 50, kNormalBytes = 12;  // of a binary STL

/// Three numbers after a keyword; a false result: they are not there.
bool read_three(std::string_view text, Eigen::Vector3d& point) {
  const char* at = text.data();
  const char* const last = at + text.size();
  for (int i = 0; i < 3; ++i) {
    while (at != last && (*at == ' ' || *at == '\t' || *at == '+')) ++at;
    const auto [end, error] = std::from_chars(at, last, point[i]);
    if (error != std::errc{}) return false;
    at = end;
  }
  return point.allFinite();
}

/// Lines that begin with a keyword hold a vertex.
Result<Points> text_points(std::string_view text, std::string_view keyword, std::string_view name) {
  Points points;
  int line_number = 0;
  while (!text.empty()) {
    ++line_number;
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    line.remove_prefix(std::min(line.find_first_not_of(" \t"), line.size()));
    if (!line.starts_with(keyword)) continue;
    Eigen::Vector3d point;
    if (!read_three(line.substr(keyword.size()), point)) {
      return failure(Fault::kDataMalformed, "{:.120}:{}: three finite numbers must follow '{}'", name, line_number,
                     keyword.substr(0, keyword.size() - 1));
    }
    points.push_back(point);
  }
  if (points.empty()) return failure(Fault::kDataMalformed, "{:.120}: no vertex in it", name);
  return points;
}

Result<Points> binary_stl_points(std::string_view bytes, std::size_t triangles, std::string_view name) {
  static_assert(std::endian::native == std::endian::little);
  Points points;
  points.reserve(3 * triangles);
  for (std::size_t t = 0; t < triangles; ++t) {
    std::array<float, 9> xyz{};
    std::memcpy(xyz.data(), bytes.data() + kHeadBytes + t * kTriangleBytes + kNormalBytes, sizeof xyz);
    for (std::size_t v = 0; v < 9; v += 3) {
      points.emplace_back(xyz[v], xyz[v + 1], xyz[v + 2]);
      if (!points.back().allFinite()) {
        return failure(Fault::kDataMalformed, "{:.120}: triangle {}: a number is not finite", name, t);
      }
    }
  }
  if (points.empty()) return failure(Fault::kDataMalformed, "{:.120}: no vertex in it", name);
  return points;
}

Result<Points> stl_points(std::string_view bytes, std::string_view name) {
  // Binary files may begin with "solid", too: their length tells.
  if (bytes.size() >= kHeadBytes) {
    std::uint32_t triangles = 0;
    std::memcpy(&triangles, bytes.data() + 80, sizeof triangles);
    const std::size_t expected = kHeadBytes + kTriangleBytes * std::size_t{triangles};
    if (bytes.size() == expected) return binary_stl_points(bytes, triangles, name);
    if (!bytes.starts_with("solid")) {
      return failure(Fault::kDataMalformed, "{:.120}: {} bytes, but {} triangles take {}; the file is cut or no STL",
                     name, bytes.size(), triangles, expected);
    }
  }
  if (!bytes.starts_with("solid")) return failure(Fault::kDataMalformed, "{:.120}: no STL", name);
  if (bytes.find("endsolid") == std::string_view::npos) {
    return failure(Fault::kDataMalformed, "{:.120}: ends before 'endsolid'; the file is cut", name);
  }
  return text_points(bytes, "vertex ", name);
}

}  // namespace

Result<Points> parse_mesh_points(std::string_view bytes, std::string_view extension, std::string_view name) {
  if (extension == ".stl") return stl_points(bytes, name);
  if (extension == ".obj") return text_points(bytes, "v ", name);
  return failure(Fault::kDataMalformed, "{:.120}: meshes are read from .stl and .obj; convert this one", name);
}

Result<Points> read_mesh_points(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension();
  std::ranges::transform(extension, extension.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (extension != ".stl" && extension != ".obj") return parse_mesh_points({}, extension, path);
  const auto bytes = read_file(path, kFileBytesMax);
  if (!bytes) return std::unexpected(bytes.error());
  return parse_mesh_points({reinterpret_cast<const char*>(bytes->data()), bytes->size()}, extension, path);
}

}  // namespace firstlook
