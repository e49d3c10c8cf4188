/// The whole job as a user starts it: every file is there, the figures are in bounds, and it repeats byte for byte.
#include <Eigen/Geometry>
#include <array>
#include <cmath>

#include "tests/support/job_run.hpp"

namespace firstlook {
using test::check_safe;
using test::JobFolder;
using test::Json;
using test::ProgramResult;

namespace {

void check_sections(const Json& result) {
  for (const char* name : {"outcome", "reason", "seed", "cell", "phases", "decisions_hash", "hand_eye", "mapping",
                           "safety", "memory", "wall", "truth"}) {
    INFO(name);
    CHECK(result.contains(name));
  }
  for (const char* name :
       {"parent_link", "translation_m", "quaternion_xyzw", "sigma_translation_mm", "sigma_rotation_mrad", "covariance",
        "reprojection_rms_px", "holdout_rms_px", "views", "usable_distance_m", "verdict", "reasons"}) {
    INFO(name);
    CHECK(result["hand_eye"].contains(name));
  }
  CHECK(result["hand_eye"]["covariance"].size() == 36);
  for (const char* name : {"views", "resolution_m", "voxels", "remaining"}) CHECK(result["mapping"].contains(name));
  for (const char* name : {"clearance_m", "min_clearance_m", "stops"}) CHECK(result["safety"].contains(name));
  for (const char* name : {"started", "total_s", "stall_s", "rss_bytes"}) CHECK(result["wall"].contains(name));
  double end_s = 0;
  for (const Json& phase : result["phases"]) {
    CHECK(phase["start_s"] == end_s);
    end_s = phase["end_s"];
  }
}

Json without_wall(Json result) {
  result.erase("wall");
  return result;
}

Eigen::Vector3d vector_of(const Json& json) {
  const auto v = json.get<std::array<double, 3>>();
  return {v[0], v[1], v[2]};
}
Eigen::Quaterniond quaternion_of(const Json& json) {
  const auto q = json.get<std::array<double, 4>>();
  return {q[3], q[0], q[1], q[2]};
}

/// One transform within one sigma of the other, axis by axis; the rotation as a whole.
void check_same_hand_eye(const Json& a, const Json& b) {
  const Eigen::Vector3d shift_mm = 1e3 * (vector_of(a["translation_m"]) - vector_of(b["translation_m"]));
  const Eigen::Vector3d sigma_mm = vector_of(a["sigma_translation_mm"]);
  for (int i = 0; i < 3; ++i) CHECK(std::abs(shift_mm[i]) < sigma_mm[i]);
  const double turn_mrad =
      1e3 * quaternion_of(a["quaternion_xyzw"]).angularDistance(quaternion_of(b["quaternion_xyzw"]));
  CHECK(turn_mrad < vector_of(a["sigma_rotation_mrad"]).maxCoeff());
}

void check_dataset(const JobFolder& folder, const std::string& dataset, const Json& hand_eye) {
  const ProgramResult calibrated = folder.run({"calibrate", "--dataset", dataset, "--strict", "--json"});
  INFO(calibrated.err);
  REQUIRE(calibrated.exit_code == 0);
  const Json again = Json::parse(calibrated.out);
  CHECK(again["verdict"] == "accepted");
  CHECK(again["views"] == hand_eye["views"]);
  check_same_hand_eye(hand_eye, again);
}

}  // namespace

TEST_CASE("the whole job, with one worker and with two, recorded or not", "[scenario]") {
  const JobFolder folder;
  const ProgramResult one = folder.run_job("one", {"--workers", "1"});
  INFO(one.err);
  REQUIRE(one.exit_code == 0);
  CHECK(one.out.empty());
  const ProgramResult two = folder.run_job("two", {"--workers", "2", "--record", "--json"});
  REQUIRE(two.exit_code == 0);

  const Json result = folder.read_json("one/result.json");
  check_sections(result);
  check_safe(result);
  CHECK(result["outcome"] == "done");
  CHECK(result["truth"]["hand_eye_error_mm"] < 1.0);
  CHECK(result["truth"]["hand_eye_error_mrad"] < 2.0);
  CHECK(result["truth"]["coverage_of_observable"] >= 0.95);
  CHECK(result["safety"]["min_clearance_m"] > 0.0);

  // stdout is one JSON document, the one in the file; everything else is on stderr.
  CHECK(Json::parse(two.out) == folder.read_json("two/result.json"));
  CHECK(two.err.find("Explore") != std::string::npos);
  CHECK(two.err.find('{') == std::string::npos);

  CHECK(without_wall(folder.read_json("two/result.json")) == without_wall(result));
  for (const char* file : {"collision_map.bt", "map.ot", "map.ply", "views.csv", "hand_eye.yaml", "camera_info.yaml",
                           "ros/easy_handeye.yaml", "ros/easy_handeye2.calib", "ros/camera_transform.launch",
                           "ros/camera_transform.launch.py", "ros/camera.xacro", "ros/collision_map_base.scene",
                           "ros/collision_map_base_link.scene"}) {
    INFO(file);
    CHECK_FALSE(folder.read("one/" + std::string(file)).empty());
    CHECK(folder.read("one/" + std::string(file)) == folder.read("two/" + std::string(file)));
  }
  CHECK(folder.read("one/report.html").find("</html>") != std::string::npos);

  for (const char* run : {"one", "two"}) {
    const ProgramResult replayed = folder.run({"replay", run + std::string("/journal.flj")});
    INFO(replayed.err);
    CHECK(replayed.exit_code == 0);
    CHECK(replayed.out.find(result["decisions_hash"].get<std::string>()) != std::string::npos);
  }
  check_dataset(folder, "two/dataset", result["hand_eye"]);
}

TEST_CASE("recorded pictures give the same hand-eye transform again", "[scenario]") {
  const JobFolder folder;
  const ProgramResult run =
      folder.run({"run", "--cell", "empty", "--only", "calibrate", "--record", "--out", "pictures"});
  INFO(run.err);
  REQUIRE(run.exit_code == 0);
  const Json result = folder.read_json("pictures/result.json");
  check_safe(result);
  CHECK(result["mapping"].is_null());
  CHECK(folder.names("pictures/dataset/images").size() == result["hand_eye"]["views"].get<std::size_t>());
  check_dataset(folder, "pictures/dataset", result["hand_eye"]);
}

TEST_CASE("a colour camera of full HD is calibrated within the budget", "[scenario]") {
  const JobFolder folder;
  folder.write("cell.yaml", R"(
walls: {low_m: [-2.0, -1.9], high_m: [2.1, 2.0], height_m: 2.6}
board: {center_m: [0.89, 0.45, 0.42], faces: [-0.89, -0.45, 0.35]}
camera:
  color: {width: 1920, height: 1080, fx: 1400, fy: 1400, cx: 962, cy: 541, k1: 0.03, k2: -0.05}
solids:
  - {name: board's post, cylinder: {radius_m: 0.015, height_m: 1.21}, position_m: [0.95, 0.49, -0.245]}
)");
  folder.write("cart.yaml", "map: {planes: color}\n");  // colours need room beside grey values
  const ProgramResult run =
      folder.run({"run", "--cell", "cell.yaml", "--config", "cart.yaml", "--only", "calibrate", "--out", "hd"});
  INFO(run.err);
  REQUIRE(run.exit_code == 0);
  const Json result = folder.read_json("hd/result.json");
  check_safe(result);
  CHECK(result["truth"]["hand_eye_error_mm"].get<double>() < 0.5);
  CHECK(result["truth"]["hand_eye_error_mrad"].get<double>() < 0.5);
  CHECK_THAT(folder.read("hd/camera_info.yaml"), Catch::Matchers::Contains("image_width: 1920"));
}

}  // namespace firstlook
