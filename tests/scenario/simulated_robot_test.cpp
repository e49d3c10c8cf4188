/// The job over the protocols of a UR controller in virtual time: the controller in the same process, or in lockstep in
/// another one.
#include "tests/support/ur_sim_process.hpp"

namespace firstlook {
using namespace test;

namespace {

constexpr const char* kSameFiles[] = {"collision_map.bt", "map.ot",        "map.ply",
                                      "views.csv",        "hand_eye.yaml", "camera_info.yaml"};

void check_same(const JobFolder& folder, const std::string& one, const std::string& other) {
  for (const char* file : kSameFiles) {
    INFO(file);
    CHECK(folder.read(one + "/" + file) == folder.read(other + "/" + file));
  }
  Json a = folder.read_json(one + "/result.json"), b = folder.read_json(other + "/result.json");
  a.erase("wall");
  b.erase("wall");
  CHECK(a == b);
}

}  // namespace

TEST_CASE("a whole job over the robot's protocols, in one process and in two", "[scenario]") {
  const JobFolder folder;
  const ProgramResult inside = folder.run_job("inside", {"--robot", "simulated", "--workers", "1"});
  INFO(inside.err);
  REQUIRE(inside.exit_code == 0);
  const Json result = folder.read_json("inside/result.json");
  CHECK(result["outcome"] == "done");
  CHECK(result["truth"]["false_free_voxels"] == 0);
  check_safe(result);
  CHECK(result["robot"]["model"] == "ur5");
  CHECK(result["robot"]["streams_broken"] == 0);
  CHECK(result["robot"]["play_to_consent_s"].get<double>() < 1);
  CHECK(result["robot"]["stop_stands_within_s"].get<double>() < 1);
  CHECK(folder.run({"replay", "inside/journal.flj"}).exit_code == 0);

  const UrSim robot({"--cell", "empty", "--seed", "1", "--lockstep"});
  folder.write("site.yaml", "robot: {port_offset: " + std::to_string(robot.offset) + "}\n");
  const ProgramResult outside =
      folder.run_job("outside", {"--robot", "127.0.0.1", "--config", "site.yaml", "--workers", "2"});
  INFO(outside.err);
  REQUIRE(outside.exit_code == 0);
  check_same(folder, "inside", "outside");
}

TEST_CASE("what happens to arm, link and operator happens to the simulated controller", "[scenario]") {
  const auto ends = [](const std::string& faults) {
    const JobFolder folder;
    const ProgramResult run =
        folder.run_job("run", {"--only", "calibrate", "--robot", "simulated", "--faults", faults});
    INFO(faults << "\n" << run.err);
    const Json result = folder.read_json("run/result.json");
    check_safe(result);
    CHECK(folder.run({"replay", "run/journal.flj"}).exit_code == 0);
    if (run.exit_code == 0) return std::string("done");
    CHECK(run.exit_code == 6);
    CHECK(result["safety"]["stops"].size() == 1);
    return result["reason"].get<std::string>().substr(0, 5);
  };
  CHECK(ends("operator.stop_at=20") == "E5005");
  CHECK(ends("arm.protective_stop_at=20") == "E5004");
  CHECK(ends("arm.emergency_stop_at=20") == "E5004");
  CHECK(ends("link.lost_at=20") == "E5002");
  CHECK(ends("operator.play_at=never") == "E5008");
  CHECK(ends("operator.pause_at=20:300") == "done");
}

TEST_CASE("what a simulated controller cannot be", "[scenario]") {
  const JobFolder folder;
  CHECK(folder.run({"ur-sim", "--lockstep"}).exit_code == 2);
  folder.write("touch.yaml", "calibration: {touch_test: yes}\n");
  CHECK(folder.run_job("run", {"--robot", "simulated", "--config", "touch.yaml"}).exit_code == 2);
  const UrSim robot({"--cell", "empty", "--seed", "1", "--lockstep"});
  folder.write("site.yaml", "robot: {port_offset: " + std::to_string(robot.offset) + "}\n");
  const ProgramResult faults =
      folder.run_job("run", {"--robot", "127.0.0.1", "--config", "site.yaml", "--faults", "operator.stop_at=9"});
  CHECK(faults.exit_code == 2);
}

}  // namespace firstlook
