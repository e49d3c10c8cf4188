#include "algorithms/mapping/objects.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "algorithms/mapping/object_boxes.hpp"
#include "algorithms/mapping/room_planes.hpp"

namespace firstlook {
namespace {

constexpr double kMiB = 1024.0 * 1024.0;
constexpr std::uint32_t kOpen = 0xFFFFFFFF;  // an occupied voxel that belongs to nothing yet

/// The open voxels that a first one is connected with by faces, edges or corners.
std::vector<std::size_t> grow(const GridGeometry& g, std::size_t first, std::vector<std::uint32_t>& id_of,
                              std::uint32_t id) {
  std::vector<std::size_t> voxels = {first};
  id_of[first] = id;
  for (std::size_t next = 0; next < voxels.size(); ++next) {
    const Eigen::Vector3i v = g.voxel_at(voxels[next]);
    const Eigen::Vector3i low = (v - Eigen::Vector3i::Ones()).cwiseMax(0);
    const Eigen::Vector3i high = (v + Eigen::Vector3i::Ones()).cwiseMin(g.size - Eigen::Vector3i::Ones());
    for (int z = low.z(); z <= high.z(); ++z) {
      for (int y = low.y(); y <= high.y(); ++y) {
        for (int x = low.x(); x <= high.x(); ++x) {
          const std::size_t index = g.index({x, y, z});
          if (id_of[index] != kOpen) continue;
          id_of[index] = id;
          voxels.push_back(index);
        }
      }
    }
  }
  return voxels;
}

MapObject make_object(const VoxelMap& map, std::span<const std::size_t> voxels, bool bounds_room) {
  const GridGeometry& g = map.geometry();
  std::vector<Eigen::Vector3d> centers_m;
  centers_m.reserve(voxels.size());
  for (const std::size_t index : voxels) centers_m.push_back(g.center_m(g.voxel_at(index)));
  MapObject object;
  object.voxels = voxels.size();
  object.bounds_room = bounds_room;
  object.box = fit_box(centers_m, g.resolution_m);
  object.shape = bounds_room ? ObjectShape::kPlane : shape_of(centers_m, object.box, map);
  return object;
}

/// The largest first; their ids by that order, in the voxels, too.
void number(MapObjects& found) {
  std::vector<std::uint32_t> order(found.objects.size()), new_id(found.objects.size() + 1, 0);
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<std::uint32_t>(i);
  std::ranges::stable_sort(
      order, [&](std::uint32_t a, std::uint32_t b) { return found.objects[a].voxels > found.objects[b].voxels; });
  std::vector<MapObject> sorted;
  for (const std::uint32_t old : order) {
    sorted.push_back(found.objects[old]);
    sorted.back().id = static_cast<int>(sorted.size());
    new_id[old + 1] = static_cast<std::uint32_t>(sorted.size());
  }
  found.objects = std::move(sorted);
  for (std::uint32_t& id : found.id_of) id = new_id[id];
}

/// A voxel of the moved map: its coordinates in the old grid, and what it is.
struct Placed {
  Eigen::Vector3i voxel;
  std::int8_t log_odds;
};

/// Where moved objects come to stand.
struct Destination {
  std::vector<Placed> voxels;
  std::vector<OrientedBox> boxes;
};

Result<Destination> take_up(VoxelMap& map, const MapObjects& found, std::span<const ObjectMove> moves) {
  const GridGeometry& g = map.geometry();
  Destination destination;
  std::vector<const ObjectMove*> move_of(found.objects.size() + 1, nullptr);
  for (const ObjectMove& move : moves) {
    if (move.id < 1 || move.id > static_cast<int>(found.objects.size()))
      return failure(Fault::kUsage, "object {}: the map has objects 1 to {}", move.id, found.objects.size());
    if (!move.by_m.allFinite() || move.by_m.cwiseAbs().maxCoeff() > 1e3)
      return failure(Fault::kUsage, "object {}: moves are at most 1000 m", move.id);
    if (std::exchange(move_of[static_cast<std::size_t>(move.id)], &move) != nullptr)
      return failure(Fault::kUsage, "object {}: moved twice", move.id);
    OrientedBox box = found.objects[static_cast<std::size_t>(move.id) - 1].box;
    box.center_m += (move.by_m / g.resolution_m).array().round().matrix() * g.resolution_m;
    destination.boxes.push_back(box);
  }
  for (std::size_t i = 0; i < map.size(); ++i) {
    const ObjectMove* move = move_of[found.id_of[i]];
    if (move == nullptr) continue;
    const Eigen::Vector3i steps = (move->by_m / g.resolution_m).array().round().cast<int>();
    destination.voxels.push_back({g.voxel_at(i) + steps, std::max(map.log_odds(i), std::int8_t{0})});
    map.set(i, VoxelClass::kUnknown, 0);
  }
  return destination;
}

GridGeometry grown(const GridGeometry& g, std::span<const Placed> placed) {
  Eigen::Vector3i low = Eigen::Vector3i::Zero(), high = g.size;
  for (const Placed& p : placed) {
    low = low.cwiseMin(p.voxel);
    high = high.cwiseMax(p.voxel + Eigen::Vector3i::Ones());
  }
  return {g.resolution_m, g.first + low, high - low};
}

}  // namespace

std::string_view to_string(ObjectShape shape) {
  constexpr std::string_view kNames[] = {"plane", "box", "other"};
  return kNames[static_cast<std::size_t>(shape)];
}

bool OrientedBox::contains(const Eigen::Vector3d& point_m) const {
  const Eigen::Vector3d p = rotation.conjugate() * (point_m - center_m);
  return (p.cwiseAbs().array() <= size_m.array() / 2 + 1e-9).all();
}

MapObjects find_objects(const VoxelMap& map, ClassReading reading) {
  std::vector<std::size_t> occupied;
  for (std::size_t i = 0; i < map.size(); ++i)
    if (reading(map, i) == VoxelClass::kOccupied) occupied.push_back(i);
  MapObjects found;
  found.id_of.assign(map.size(), 0);
  for (const std::size_t index : occupied) found.id_of[index] = kOpen;

  const std::vector<std::uint8_t> plane_of = find_room_planes(map, occupied);
  for (std::uint8_t plane = 1; std::ranges::count(plane_of, plane) > 0; ++plane) {
    std::vector<std::size_t> voxels;
    for (std::size_t i = 0; i < occupied.size(); ++i)
      if (plane_of[i] == plane) voxels.push_back(occupied[i]);
    found.objects.push_back(make_object(map, voxels, true));
    for (const std::size_t index : voxels) found.id_of[index] = static_cast<std::uint32_t>(found.objects.size());
  }
  for (const std::size_t index : occupied) {
    if (found.id_of[index] != kOpen) continue;
    const std::vector<std::size_t> voxels =
        grow(map.geometry(), index, found.id_of, static_cast<std::uint32_t>(found.objects.size()) + 1);
    if (voxels.size() >= kObjectVoxelsMin) {
      found.objects.push_back(make_object(map, voxels, false));
      continue;
    }
    found.specks += voxels.size();
    for (const std::size_t speck : voxels) found.id_of[speck] = 0;
  }
  number(found);
  return found;
}

Result<VoxelMap> move_objects(const VoxelMap& map, const MapObjects& objects, std::span<const ObjectMove> moves,
                              std::size_t voxels_max) {
  VoxelMap left = map;
  const Result<Destination> destination = take_up(left, objects, moves);
  if (!destination) return std::unexpected(destination.error());
  const GridGeometry& from = map.geometry();
  const GridGeometry to = grown(from, destination->voxels);
  if (const double voxels = to.size.cast<double>().prod(); voxels > static_cast<double>(voxels_max))
    return failure(Fault::kMapTooLarge, "the move needs {} x {} x {} voxels, {:.0f} MiB; at most {:.0f} MiB are taken",
                   to.size.x(), to.size.y(), to.size.z(), voxels / kMiB, static_cast<double>(voxels_max) / kMiB);
  std::vector<std::int8_t> log_odds(to.count(), kUnknownLogOdds);
  const auto place_of = [&](const Eigen::Vector3i& old) { return to.index(old + from.first - to.first); };
  for (std::size_t i = 0; i < left.size(); ++i) log_odds[place_of(from.voxel_at(i))] = left.log_odds(i);
  for (std::size_t i = 0; i < log_odds.size(); ++i) {
    if (log_odds[i] == kUnknownLogOdds || classify(log_odds[i]) != VoxelClass::kFree) continue;
    const Eigen::Vector3d center_m = to.center_m(to.voxel_at(i));
    const auto inside = [&](const OrientedBox& box) { return box.contains(center_m); };
    if (std::ranges::any_of(destination->boxes, inside)) log_odds[i] = kUnknownLogOdds;
  }
  for (const Placed& p : destination->voxels) {
    std::int8_t& value = log_odds[place_of(p.voxel)];
    value = std::max(value, p.log_odds);
  }
  return VoxelMap(to, std::move(log_odds));
}

std::optional<NearestOccupied> nearest_occupied(const VoxelMap& map, const Eigen::Vector3d& point_m,
                                                ClassReading reading) {
  std::optional<NearestOccupied> nearest;
  for (std::size_t i = 0; i < map.size(); ++i) {
    if (reading(map, i) != VoxelClass::kOccupied) continue;
    const Eigen::Vector3d center_m = map.geometry().center_m(map.geometry().voxel_at(i));
    const double distance_m = (center_m - point_m).norm();
    if (!nearest || distance_m < nearest->distance_m) nearest = NearestOccupied{center_m, distance_m};
  }
  return nearest;
}

}  // namespace firstlook
