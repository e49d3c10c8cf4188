/// What `firstlook export` leaves is read back by other rules than it was written by.
#include "app/cli/export_command.hpp"

#include <octomap/octomap.h>
#include <unistd.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>

#include "app/dataset/hand_eye_file.hpp"
#include "app/report/map_files.hpp"
#include "tests/support/moveit_scene_reader.hpp"
#include "tests/support/temporary_folder.hpp"

namespace firstlook {
namespace {

namespace fs = std::filesystem;

std::string read_text(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

std::size_t lines_of(const fs::path& file) {
  const std::string text = read_text(file);
  return static_cast<std::size_t>(std::ranges::count(text, '\n'));
}

VoxelMap small_map() {
  VoxelMap map(GridGeometry{0.05, {-10, -8, 0}, {24, 20, 12}}, VoxelMap::Planes::kLogOddsOnly);
  for (std::size_t i = 0; i < map.size(); ++i) {
    const Eigen::Vector3i v = map.geometry().voxel_at(i);
    if (v.x() < 20) map.set(i, VoxelClass::kFree, 0);
    if (v.x() >= 4 && v.x() < 10 && v.y() >= 3 && v.y() < 9 && v.z() < 5) map.set(i, VoxelClass::kOccupied, 0);
  }
  return map;
}

int export_to(const fs::path& run, const std::string& to) {
  std::fflush(stdout);
  const int saved = dup(STDOUT_FILENO);
  REQUIRE(std::freopen("/dev/null", "w", stdout) != nullptr);
  const int code = run_export_command({run, to, {}});
  std::fflush(stdout);
  dup2(saved, STDOUT_FILENO);
  close(saved);
  return code;
}

StoredCalibration calibration(bool accepted) {
  StoredCalibration c;
  c.accepted = accepted;
  c.arm_model = "ur5";
  c.kinematics = kinematics_checksum(*find_arm_model("ur5"));
  c.flange_T_camera = Transform<Flange, Camera>(Eigen::Quaterniond(0.99, 0.1, -0.02, 0.03), {0.001, -0.07, 0.06});
  c.covariance = 1e-8 * Matrix6d::Identity();
  c.corner_sigma_px = 0.025;
  c.arm_sigma = {1.1e-4, 1.9e-4};
  c.intrinsics = {640, 480, 537.33, 538.35, 321.61, 252.18, 0, 0, 0, 0, 0};
  c.solver = "park-martin";
  c.views = c.views_given = 15;
  c.reprojection_rms_px = 0.024;
  c.usable_distance_m = 28.4;
  return c;
}

}  // namespace

TEST_CASE("a map is exported for every program that takes one", "[app][export][octomap]") {
  const test::TemporaryFolder run("firstlook-export");
  const VoxelMap map = small_map();
  REQUIRE(write_map_files(run.path().string(), map, 16));
  const VoxelCounts counts = map.counts();

  REQUIRE(export_to(run.path(), "moveit") == 0);
  for (const auto& [name, turned] : {std::pair{"collision_map_base.scene", 1}, {"collision_map_base_link.scene", -1}}) {
    std::ifstream stream(run.path() / "export/moveit" / name);
    test::Scene scene;
    REQUIRE(test::read_scene(stream, scene));
    REQUIRE(scene.objects.size() == 1);
    REQUIRE(scene.objects[0].boxes.size() == 1);
    const Eigen::Vector3d center = scene.objects[0].boxes[0].pose.translation();
    CHECK(center.isApprox(Eigen::Vector3d(turned * -0.15, turned * -0.1, 0.125), 1e-6));
  }

  REQUIRE(export_to(run.path(), "csv") == 0);
  CHECK(lines_of(run.path() / "export/csv/voxels.csv") == 1 + counts.free + counts.occupied);
  CHECK(lines_of(run.path() / "export/csv/boxes.csv") == 2);
  CHECK(read_text(run.path() / "export/csv/objects.csv").find("\n1,box,0,180,") != std::string::npos);

  for (const std::string to : {"ros1", "ros2"}) {
    REQUIRE(export_to(run.path(), to) == 0);
    const std::string wire =
        read_text(run.path() / "export" / to / (to == "ros1" ? "octomap_full.ros1" : "octomap_full.cdr"));
    // OctoMap reads the end of the message, which is its data.
    octomap::OcTree tree(0.05);
    const std::string ot = read_text(run.path() / "map.ot");
    const std::string nodes = ot.substr(ot.find("data\n") + 5);
    REQUIRE(wire.ends_with(nodes));
    std::istringstream data(nodes);
    tree.readData(data);
    tree.expand();
    CHECK(tree.getNumLeafNodes() == counts.free + counts.occupied);
    CHECK(read_text(run.path() / "export" / to / "octomap_binary.yaml").find("frame_id: base\nbinary: true\n") !=
          std::string::npos);
  }
  CHECK(export_to(run.path(), "ur") == 3);  // there is no calibration in this folder
}

TEST_CASE("a calibration is exported unless its run rejected it", "[app][export]") {
  const test::TemporaryFolder run("firstlook-export");
  std::ofstream(run.path() / "hand_eye.yaml") << hand_eye_yaml(calibration(true));
  REQUIRE(export_to(run.path(), "ur") == 0);
  CHECK(read_text(run.path() / "export/ur/hand_eye.script").find("global flange_T_camera = p[0.001000, -0.070000,") !=
        std::string::npos);
  REQUIRE(export_to(run.path(), "ros2") == 0);
  CHECK(fs::exists(run.path() / "export/ros2/easy_handeye2.calib"));
  CHECK_FALSE(fs::exists(run.path() / "export/ros2/easy_handeye.yaml"));
  REQUIRE(export_to(run.path(), "ros1") == 0);
  CHECK(fs::exists(run.path() / "export/ros1/camera_transform.launch"));
  REQUIRE(export_to(run.path(), "csv") == 0);
  CHECK(lines_of(run.path() / "export/csv/hand_eye.csv") == 2);
  CHECK(export_to(run.path(), "moveit") == 3);
  std::ofstream(run.path() / "hand_eye.yaml") << hand_eye_yaml(calibration(false));
  CHECK(export_to(run.path(), "ur") == 3);
}

TEST_CASE("what cannot be exported is said", "[app][export][hostile]") {
  const test::TemporaryFolder run("firstlook-export");
  CHECK(export_to(run.path() / "none", "csv") == 3);
  CHECK(export_to(run.path(), "csv") == 3);
  CHECK(export_to(run.path(), "ros3") == 2);
  std::ofstream(run.path() / "map.ot") << "# Octomap OcTree file\nid OcTree\nsize 3\nres 0.05\ndata\nxx";
  CHECK(export_to(run.path(), "csv") == 3);
  fs::remove(run.path() / "map.ot");
  REQUIRE(write_map_files(run.path().string(), small_map(), 16));
  CHECK(run_export_command({run.path(), "csv", run.path() / "map.ot" / "below"}) == 3);
}

}  // namespace firstlook
