#include "app/dataset/map_file.hpp"

#include <cmath>
#include <fstream>

#include "algorithms/mapping/octree_writer.hpp"
#include "algorithms/mapping/ply_reader.hpp"

namespace firstlook {
namespace {

constexpr double kMiB = 1024.0 * 1024.0;
constexpr double kResolutionTolerance = 1e-5;  // OctoMap prints resolutions with six digits

/// Calls read(ByteSource) with the bytes of a file from its start; errors get its name.
template <typename Read>
auto with_file(const std::filesystem::path& file, Read read) -> decltype(read(std::declval<ByteSource>())) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream || !std::filesystem::is_regular_file(file))
    return failure(Fault::kDataMissing, "{}: no such file", file.string());
  const auto source = [&stream](std::span<std::byte> out) {
    stream.read(reinterpret_cast<char*>(out.data()), static_cast<std::streamsize>(out.size()));
    return static_cast<std::size_t>(stream.gcount());
  };
  auto result = read(source);
  if (!result) return failure(result.error().fault, "{}: {}", file.string(), result.error().detail());
  return result;
}

Result<std::uint64_t> fill(const std::filesystem::path& file, int depth, const GridGeometry& geometry,
                           std::vector<std::int8_t>& log_odds) {
  return with_file(file, [&](ByteSource source) { return read_octree(source, depth, geometry, log_odds); });
}

/// The depth at which the file's voxels are as large as the grid's.
Result<int> depth_for(const OctreeInfo& info, double resolution_m) {
  const double levels = std::round(std::log2(resolution_m / info.resolution_m));
  const double found_m = std::ldexp(info.resolution_m, static_cast<int>(levels));
  if (levels < 0 || levels >= kOctreeDepth || std::abs(found_m - resolution_m) > kResolutionTolerance * resolution_m)
    return failure(Fault::kMapUnreadable, "voxels of {} m do not make the grid's of {} m: 1, 2, 4, 8 .. of them must",
                   info.resolution_m, resolution_m);
  return kOctreeDepth - static_cast<int>(levels);
}

std::string box_text(const GridGeometry& g) {
  const Eigen::Vector3d low = g.first.cast<double>() * g.resolution_m;
  const Eigen::Vector3d high = (g.first + g.size).cast<double>() * g.resolution_m;
  return fmt::format("({:.2f}, {:.2f}, {:.2f}) to ({:.2f}, {:.2f}, {:.2f}) m", low.x(), low.y(), low.z(), high.x(),
                     high.y(), high.z());
}

bool overlap(const GridGeometry& a, const GridGeometry& b) {
  return ((a.first + a.size).array() > b.first.array()).all() && ((b.first + b.size).array() > a.first.array()).all();
}

}  // namespace

Result<VoxelMap> read_map_file(const std::filesystem::path& file, std::size_t voxels_max) {
  const Result<OctreeInfo> info = with_file(file, survey_octree);
  if (!info) return std::unexpected(info.error());
  if (info->known_voxels == 0) return failure(Fault::kMapUnreadable, "{}: it holds no voxels", file.string());
  const GridGeometry grid = info->grid(kOctreeDepth);
  const double voxels = grid.size.cast<double>().prod();
  if (voxels > static_cast<double>(voxels_max))
    return failure(Fault::kMapTooLarge, "{}: {} x {} x {} voxels of {} m need {:.0f} MiB; at most {:.0f} MiB are taken",
                   file.string(), grid.size.x(), grid.size.y(), grid.size.z(), grid.resolution_m, voxels / kMiB,
                   static_cast<double>(voxels_max) / kMiB);
  std::vector<std::int8_t> log_odds(grid.count());
  const Result<std::uint64_t> outside = fill(file, kOctreeDepth, grid, log_odds);
  if (!outside) return std::unexpected(outside.error());
  return VoxelMap(grid, std::move(log_odds));
}

Result<MapInGrid> read_map_file_into(const std::filesystem::path& file, const GridGeometry& geometry) {
  const Result<OctreeInfo> info = with_file(file, survey_octree);
  if (!info) return std::unexpected(info.error());
  const Result<int> depth = depth_for(*info, geometry.resolution_m);
  if (!depth) return failure(Fault::kMapUnreadable, "{}: {}", file.string(), depth.error().detail());
  const GridGeometry own = info->grid(*depth);
  if (!overlap(own, geometry))
    return failure(Fault::kMapUnreadable, "{}: it spans {}, the map {}: they do not meet", file.string(), box_text(own),
                   box_text(geometry));
  std::vector<std::int8_t> log_odds(geometry.count());
  const Result<std::uint64_t> outside = fill(file, *depth, geometry, log_odds);
  if (!outside) return std::unexpected(outside.error());
  return MapInGrid{VoxelMap(geometry, std::move(log_odds)), *outside};
}

Result<MapPlanes> read_planes_beside(const std::filesystem::path& file, const GridGeometry& geometry) {
  const std::filesystem::path ply = file.parent_path() / "map.ply";
  if (!std::filesystem::is_regular_file(ply)) return MapPlanes{};
  return with_file(ply, [&](ByteSource source) { return read_ply_planes(source, geometry); });
}

}  // namespace firstlook
