#include "app/report/map_files.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "algorithms/mapping/class_reading.hpp"
#include "algorithms/mapping/octree_writer.hpp"
#include "algorithms/mapping/ply_writer.hpp"
#include "platform/linux/files.hpp"

namespace firstlook {

Status write_streamed(const std::string& path, FunctionRef<void(ByteSink)> write) {
  Result<AtomicFile> file = AtomicFile::create(path);
  if (!file) return std::unexpected(file.error());
  const auto sink = [&file](std::span<const std::byte> bytes) { (void)file->write(bytes); };  // commit tells
  write(sink);
  return file->commit();
}

Status write_map_files(const std::string& folder, const VoxelMap& map, int depth, const MapPlanes& planes) {
  Status status = make_directories(folder);
  const auto add = [&](std::string_view name, FunctionRef<void(ByteSink)> write) {
    if (status) status = write_streamed(fmt::format("{}/{}", folder, name), write);
  };
  add("collision_map.bt", [&](ByteSink sink) { write_bt(map, collision_class, depth, sink); });
  add("map.ot", [&](ByteSink sink) { write_ot(map, depth, sink); });
  if (planes.color) add("color_map.ot", [&](ByteSink sink) { write_color_ot(map, *planes.color, depth, sink); });
  add("map.ply", [&](ByteSink sink) { write_ply(map, false, sink, planes); });
  return status;
}

std::string frames_csv(std::span<const FrameOutcome> frames) {
  std::string csv = "frame,line,stamp_s,image,unknown,free,occupied,points,refused\n";
  int number = 0;
  for (const FrameOutcome& frame : frames) {
    std::string reason = frame.refused;
    std::ranges::replace(reason, '"', '\'');
    csv += fmt::format("{},{},{:.6f},{},{},{},{},{},{}\n", ++number, frame.line, frame.stamp_s, frame.image,
                       frame.voxels.unknown, frame.voxels.free, frame.voxels.occupied, frame.inserted.pixels_used,
                       reason.empty() ? "" : fmt::format("\"{}\"", reason));
  }
  return csv;
}

}  // namespace firstlook
