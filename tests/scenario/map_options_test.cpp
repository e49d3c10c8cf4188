/// Kinds of sensor and options of the map, through the whole program.
#include <sstream>

#include "tests/support/job_run.hpp"

namespace firstlook {
using test::check_safe;
using test::JobFolder;
using test::Json;
using test::ProgramResult;

namespace {

/// A job with a short exploration and these keys besides.
Json run_with(const std::string& config) {
  const JobFolder folder;
  folder.write("keys.yaml", "explore: {views_max: 16}\n" + config);
  const ProgramResult run = folder.run_job("run", {"--config", "keys.yaml"});
  INFO(config << "\n" << run.err);
  CHECK(run.exit_code == 0);
  Json result = folder.read_json("run/result.json");
  check_safe(result);
  CHECK(result["truth"]["false_free_voxels"] == 0);
  CHECK(folder.run({"replay", "run/journal.flj"}).exit_code == 0);
  if (!result["mapping"]["fine"].is_null())
    CHECK(folder.read("run/fine_map.bt").starts_with("# Octomap OcTree binary"));
  return result;
}

}  // namespace

TEST_CASE("every kind of depth sensor maps a cell", "[scenario]") {
  for (const std::string sensor : {"xtion", "time_of_flight", "stereo"}) {
    INFO(sensor);
    const Json result = run_with("depth: {sensor: " + sensor + "}\n");
    CHECK(result["mapping"]["voxels"]["free"].get<int>() > 5000);
    CHECK(result["mapping"]["frames"]["refused"]["wrong_scale"] == 0);
    CHECK(result["hand_eye"]["verdict"] == "accepted");
  }
}

TEST_CASE("options of the map are off by default and do what they say", "[scenario]") {
  const Json plain = run_with("");
  CHECK(plain["mapping"]["fine"].is_null());
  CHECK(plain["mapping"]["holes"]["policy"] == "ignore");
  CHECK(plain["mapping"]["holes"]["pixels_open"] == 0);
  CHECK(plain["mapping"]["occupied_forgotten"] == 0);
  CHECK(plain["mapping"]["frames"]["pixels_left_out"] == 0);

  const Json all = run_with(
      "depth: {crop_m: 2.5, filter_voxel_m: 0.01}\n"
      "map: {occupied_max_age_s: 20, fine_resolution_m: 0.01, fine_low_m: [0.6, -0.3, -0.1], fine_high_m: [1.2, 0.3, "
      "0.5]}\n");
  CHECK(all["mapping"]["frames"]["pixels_left_out"].get<int>() > 1000);
  CHECK(all["mapping"]["occupied_forgotten"].get<int>() > 10);
  CHECK(all["mapping"]["fine"]["resolution_m"] == 0.01);
  const Json& fine = all["mapping"]["fine"]["voxels"];
  CHECK(fine["free"].get<int>() + fine["occupied"].get<int>() + fine["unknown"].get<int>() == 60 * 60 * 60);
  CHECK(fine["free"].get<int>() > 10000);
}

TEST_CASE("colours, labels and sensors of voxels", "[scenario]") {
  const JobFolder folder;
  const auto run = [&](const std::string& planes) {
    folder.write(planes + ".yaml", "explore: {views_max: 16}\nmap: {planes: \"" + planes + "\"}\n");
    const ProgramResult done = folder.run_job(planes, {"--config", planes + ".yaml"});
    INFO(done.err);
    CHECK(done.exit_code == 0);
    Json result = folder.read_json(planes + "/result.json");
    check_safe(result);
    CHECK(folder.run({"replay", planes + "/journal.flj"}).exit_code == 0);
    return result;
  };
  const Json plain = run("none");
  CHECK(plain["mapping"]["planes"].is_null());
  CHECK_FALSE(std::filesystem::exists(folder / "none/color_map.ot"));

  // What nobody looks at in colours costs nothing of the job: the same maps.
  const Json labelled = run("label,sensor");
  CHECK(labelled["decisions_hash"] == plain["decisions_hash"]);
  for (const std::string name : {"collision_map.bt", "map.ot", "views.csv"})
    CHECK(folder.read("none/" + name) == folder.read("label,sensor/" + name));
  const auto peak = [](const Json& result) { return result["memory"]["peak_bytes"].get<std::int64_t>(); };
  const auto voxels = [](const Json& result) {
    const Json& v = result["mapping"]["grid_voxels"];
    return v["unknown"].get<std::int64_t>() + v["free"].get<std::int64_t>() + v["occupied"].get<std::int64_t>();
  };
  CHECK(peak(labelled) == peak(plain) + 5 * voxels(plain));

  const Json all = run("color,label,sensor");
  const Json& planes = all["mapping"]["planes"];
  CHECK(planes["color"]["looks"].get<int>() >= 3);
  CHECK(2 * planes["color"]["voxels"].get<int>() > planes["color"]["of_occupied"].get<int>());
  CHECK(planes["label"]["voxels"].get<int>() > 100);
  CHECK(planes["sensor"]["voxels"].size() == 1);
  CHECK(folder.read("color,label,sensor/color_map.ot").find("\nid ColorOcTree\n") != std::string::npos);
  CHECK(folder.read("color,label,sensor/report.html").find("have a colour, from") != std::string::npos);
  REQUIRE(folder.run({"export", "color,label,sensor", "--to", "csv"}).exit_code == 0);
  const std::string csv = folder.read("color,label,sensor/export/csv/voxels.csv");
  CHECK(csv.starts_with("x_m,y_m,z_m,class,log_odds,red,green,blue,object,shape,sensor\n"));

  folder.write("wrong.yaml", "map: {planes: colour}\n");
  const ProgramResult wrong = folder.run_job("wrong", {"--config", "wrong.yaml"});
  CHECK(wrong.exit_code == 3);
  CHECK(wrong.err.find("map.planes must be none, or color, label, sensor") != std::string::npos);
}

TEST_CASE("the plane fit and a ground that clears only", "[scenario]") {
  // The empty cell's floor is 0.85 m below the base.
  const std::string extents = "low_m: [-1.5, -1.5, -1.0]";
  const JobFolder folder;
  const auto occupied_floor_voxels = [&](const std::string& name, const std::string& config) {
    folder.write(name + ".yaml", "explore: {views_max: 16}\n" + config);
    const ProgramResult run = folder.run_job(name, {"--config", name + ".yaml"});
    INFO(run.err);
    REQUIRE(run.exit_code == 0);
    check_safe(folder.read_json(name + "/result.json"));
    REQUIRE(folder.run({"export", name, "--to", "csv"}).exit_code == 0);
    std::istringstream rows(folder.read(name + "/export/csv/voxels.csv"));
    int count = 0;
    for (std::string row; std::getline(rows, row);) {
      const bool floor = row.find(",-0.875,") != std::string::npos || row.find(",-0.825,") != std::string::npos;
      count += floor && row.find(",occupied,") != std::string::npos ? 1 : 0;
    }
    return count;
  };
  CHECK(occupied_floor_voxels("plain", "map: {" + extents + "}\n") > 1000);
  CHECK(occupied_floor_voxels("fitted", "depth: {plane_fit_px: 7}\nmap: {" + extents +
                                            ", ground_height_m: -0.85, ground_tolerance_m: 0.06}\n") < 20);
  CHECK(folder.read_json("plain/result.json")["mapping"]["frames"]["pixels_fitted"] == 0);
  CHECK(folder.read_json("fitted/result.json")["mapping"]["frames"]["pixels_fitted"].get<int>() > 100000);
}

TEST_CASE("an arm that stands below the ground's top does not move", "[scenario]") {
  const JobFolder folder;
  folder.write("keys.yaml", "map: {ground_height_m: 0.3, ground_tolerance_m: 0.1}\n");
  const ProgramResult run = folder.run_job("run", {"--config", "keys.yaml"});
  INFO(run.err);
  CHECK(run.exit_code == 6);
  const Json result = folder.read_json("run/result.json");
  check_safe(result);
  CHECK(result["mapping"].is_null());
}

}  // namespace firstlook
