#include "app/cli/export_command.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <optional>
#include <vector>

#include "algorithms/mapping/moveit_scene.hpp"
#include "algorithms/mapping/octomap_message.hpp"
#include "app/cli/exit_codes.hpp"
#include "app/dataset/dataset_mapping.hpp"
#include "app/dataset/hand_eye_file.hpp"
#include "app/dataset/map_file.hpp"
#include "app/report/map_csv.hpp"
#include "app/report/map_files.hpp"
#include "app/report/ros_files.hpp"
#include "platform/linux/files.hpp"

namespace firstlook {
namespace {

constexpr std::size_t kTextMax = 1 << 20;
constexpr std::string_view kMapFrame = "base";  // of a run's map: the controller's, not ROS's base_link

/// What a run left behind.
struct Found {
  std::optional<StoredCalibration> hand_eye;
  std::string camera_info;
  std::optional<VoxelMap> collision_map;  ///< collision_map.bt: to plan with
  std::optional<VoxelMap> map;            ///< map.ot: with log-odds
  MapPlanes planes;                       ///< of map, from map.ply
};

Result<std::optional<VoxelMap>> read_map(const std::filesystem::path& file) {
  if (!std::filesystem::exists(file)) return std::optional<VoxelMap>();
  Result<VoxelMap> map = read_map_file(file, kOfflineVoxelsMax);
  if (!map) return std::unexpected(map.error());
  return std::optional(std::move(*map));
}

Result<Found> find(const std::filesystem::path& run) {
  if (!std::filesystem::is_directory(run)) return failure(Fault::kDataMissing, "{}: no such folder", run.string());
  Found found;
  if (std::filesystem::exists(run / "hand_eye.yaml")) {
    Result<StoredCalibration> hand_eye = read_hand_eye(run / "hand_eye.yaml");
    if (!hand_eye && hand_eye.error().fault != Fault::kStoredCalibration) return std::unexpected(hand_eye.error());
    if (hand_eye)
      found.hand_eye = std::move(*hand_eye);
    else
      fmt::print(stderr, "left out: {}\n", hand_eye.error().detail());
  }
  if (std::filesystem::exists(run / "camera_info.yaml")) {
    Result<std::string> text = read_text_file((run / "camera_info.yaml").string(), kTextMax);
    if (!text) return std::unexpected(text.error());
    found.camera_info = std::move(*text);
  }
  for (const auto& [name, map] :
       {std::pair{"collision_map.bt", &found.collision_map}, std::pair{"map.ot", &found.map}}) {
    Result<std::optional<VoxelMap>> read = read_map(run / name);
    if (!read) return std::unexpected(read.error());
    *map = std::move(*read);
  }
  if (found.map) {
    Result<MapPlanes> planes = read_planes_beside(run / "map.ot", found.map->geometry());
    if (planes)
      found.planes = std::move(*planes);
    else
      fmt::print(stderr, "planes left out: {}\n", planes.error().detail());
  }
  return found;
}

/// Files that appear one after the other in a folder that is made for the first; the first error stays.
class Folder {
 public:
  explicit Folder(std::string path) : path_(std::move(path)) {}

  void add(std::string_view name, FunctionRef<void(ByteSink)> write) {
    if (status_ && files_.empty()) status_ = make_directories(path_);
    if (!status_) return;
    const std::string file = fmt::format("{}/{}", path_, name);
    status_ = write_streamed(file, write);
    if (status_) files_.push_back(file);
  }
  void add(std::string_view name, std::string_view text) {
    add(name, [text](ByteSink sink) { sink(std::as_bytes(std::span(text))); });
  }
  [[nodiscard]] const Status& status() const { return status_; }
  [[nodiscard]] const std::vector<std::string>& files() const { return files_; }

 private:
  std::string path_;
  Status status_;
  std::vector<std::string> files_;
};

void add_calibration(const Found& found, std::span<const std::string_view> names, Folder& folder) {
  if (!found.camera_info.empty()) folder.add("camera_info.yaml", found.camera_info);
  if (!found.hand_eye) return;
  for (const NamedFile& file : ros_calibration_files(found.hand_eye->flange_T_camera))
    if (std::ranges::find(names, file.name) != names.end()) folder.add(file.name, file.text);
}

/// The message as YAML to publish and as the bytes of the wire, binary and full.
void add_messages(const Found& found, void (*write_wire)(const OctomapContent&, ByteSink), std::string_view extension,
                  Folder& folder) {
  const auto add = [&](std::string_view name, const OctomapContent& content) {
    folder.add(fmt::format("{}.yaml", name), [&](ByteSink sink) { write_octomap_yaml(content, sink); });
    folder.add(fmt::format("{}.{}", name, extension), [&](ByteSink sink) { write_wire(content, sink); });
  };
  if (found.collision_map) add("octomap_binary", {*found.collision_map, octomap_class, 16, kMapFrame});
  if (found.map) add("octomap_full", {*found.map, nullptr, 16, kMapFrame});
}

void to_ros2(const Found& found, Folder& folder) {
  constexpr std::array<std::string_view, 3> kNames = {"easy_handeye2.calib", "camera_transform.launch.py",
                                                      "camera.xacro"};
  add_calibration(found, kNames, folder);
  add_messages(found, write_octomap_ros2, "cdr", folder);
}

void to_ros1(const Found& found, Folder& folder) {
  constexpr std::array<std::string_view, 3> kNames = {"easy_handeye.yaml", "camera_transform.launch", "camera.xacro"};
  add_calibration(found, kNames, folder);
  add_messages(found, write_octomap_ros1, "ros1", folder);
}

void to_moveit(const Found& found, Folder& folder) {
  if (!found.collision_map) return;
  for (const NamedFile& file : ros_scene_files(merge_occupied(*found.collision_map, octomap_class)))
    folder.add(file.name, file.text);
}

void to_ur(const Found& found, Folder& folder) {
  if (!found.hand_eye) return;
  folder.add(
      "hand_eye.script",
      fmt::format("# Hand-eye calibration, written by firstlook: pose of the camera (z forward, x right, y down) "
                  "in the flange,\n# that is get_actual_tcp_pose() with the TCP set to zero; metres and rotation "
                  "vector.\nglobal flange_T_camera = {}\n# A point that the camera sees, in base:\n#   "
                  "pose_trans(get_actual_tcp_pose(), pose_trans(flange_T_camera, p[x, y, z, 0, 0, 0]))\n",
                  ur_pose_text(found.hand_eye->flange_T_camera)));
}

void to_csv(const Found& found, Folder& folder) {
  if (found.hand_eye) folder.add("hand_eye.csv", hand_eye_csv(*found.hand_eye));
  if (found.map) folder.add("voxels.csv", [&](ByteSink sink) { write_voxels_csv(*found.map, sink, found.planes); });
  if (!found.collision_map) return;
  folder.add("boxes.csv", boxes_csv(merge_occupied(*found.collision_map, octomap_class)));
  folder.add("objects.csv", objects_csv(find_objects(*found.collision_map, octomap_class)));
}

struct Target {
  std::string_view name;
  std::string_view needs;
  void (*write)(const Found&, Folder&);
};
constexpr std::array<Target, 5> kTargets = {{
    {"ros2", "an accepted hand_eye.yaml, camera_info.yaml, collision_map.bt or map.ot", to_ros2},
    {"ros1", "an accepted hand_eye.yaml, camera_info.yaml, collision_map.bt or map.ot", to_ros1},
    {"moveit", "collision_map.bt", to_moveit},
    {"ur", "an accepted hand_eye.yaml", to_ur},
    {"csv", "an accepted hand_eye.yaml, collision_map.bt or map.ot", to_csv},
}};

Status export_run(const ExportCommandOptions& options, const Target& target, std::vector<std::string>& files) {
  const Result<Found> found = find(options.run);
  if (!found) return std::unexpected(found.error());
  Folder folder((options.out.empty() ? options.run / "export" / options.to : options.out).string());
  target.write(*found, folder);
  files = folder.files();
  if (!folder.status()) return folder.status();
  if (files.empty())
    return failure(Fault::kDataMissing, "{}: nothing for {} in it: it needs {}", options.run.string(), target.name,
                   target.needs);
  return {};
}

}  // namespace

int run_export_command(const ExportCommandOptions& options) {
  const auto target = std::ranges::find(kTargets, options.to, &Target::name);
  if (target == kTargets.end()) {
    fmt::print(stderr, "--to {}: ros2, ros1, moveit, ur or csv\n", options.to);
    return kExitUsage;
  }
  std::vector<std::string> files;
  const Status status = export_run(options, *target, files);
  for (const std::string& file : files) fmt::print("{}\n", file);
  if (status) return kExitDone;
  fmt::print(stderr, "{}\n", describe(status.error()));
  return kExitData;
}

}  // namespace firstlook
