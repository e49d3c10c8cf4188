/// The job over the protocols of a UR controller in virtual time: the controller in the same process, or in lockstep in
/// another one.
#include "app/config/ur_calibration_file.hpp"
#include "tests/support/ur_correction.hpp"
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
  CHECK(inside.err.find("ur5 with a simulated controller") != std::string::npos);
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

TEST_CASE("a touch test by way of the controller's freedrive, in one process and in two", "[scenario]") {
  const JobFolder folder;
  const UrSim robot({"--cell", "empty", "--seed", "1", "--lockstep"});
  const std::string touch = "calibration: {touch_test: yes, touch_corners: 6}\n";
  folder.write("inside.yaml", touch);
  folder.write("outside.yaml", touch + "robot: {port_offset: " + std::to_string(robot.offset) + "}\n");
  const std::vector<std::string> words = {"--only", "calibrate", "--faults", "touch.mixed_up=3"};
  const auto run = [&](const std::string& name, std::vector<std::string> more) {
    more.insert(more.end(), words.begin(), words.end());
    return folder.run_job(name, more);
  };
  const ProgramResult inside = run("inside", {"--robot", "simulated", "--config", "inside.yaml"});
  INFO(inside.err);
  REQUIRE(inside.exit_code == 0);
  const Json result = folder.read_json("inside/result.json");
  check_safe(result);
  const Json& test = result["hand_eye"]["touch_test"];
  CHECK(test["agrees"] == true);
  CHECK(test["touches"][2]["used"] == false);
  CHECK(result["robot"]["model"] == "ur5");
  CHECK(folder.run({"replay", "inside/journal.flj"}).exit_code == 0);
  const ProgramResult outside = run("outside", {"--robot", "127.0.0.1", "--config", "outside.yaml"});
  INFO(outside.err);
  REQUIRE(outside.exit_code == 0);
  Json one = result, other = folder.read_json("outside/result.json");
  one.erase("wall");
  other.erase("wall");
  CHECK(one == other);
}

TEST_CASE("who moves the arm of a cell", "[scenario]") {
  const JobFolder folder;
  const auto told = [&](const std::string& out, const std::vector<std::string>& more) {
    std::vector<std::string> words = {"--only", "calibrate", "--faults", "operator.stop_at=3"};
    words.insert(words.end(), more.begin(), more.end());
    const ProgramResult run = folder.run_job(out, words);
    INFO(run.err);
    CHECK(run.exit_code == 6);
    CHECK(folder.run({"replay", out + "/journal.flj"}).exit_code == 0);
    const bool own = folder.read_json(out + "/result.json")["robot"].is_null();
    CHECK((run.err.find("with a simulated controller") == std::string::npos) == own);
    return std::string(own ? "cell" : "controller");
  };
  CHECK(told("auto", {"--robot", "auto"}) == "controller");
  CHECK(told("simulated", {"--robot", "simulated"}) == "controller");
  CHECK(told("none", {"--robot", "none"}) == "cell");
  const auto two_joint = [&](const char* robot) {
    return folder.run({"run", "--cell", "two_joint", "--robot", robot, "--sensor", "fast", "--only", "calibrate",
                       "--faults", "operator.stop_at=3", "--out", robot + std::string("2")});
  };
  const ProgramResult other = two_joint("auto");
  CHECK(other.exit_code == 6);
  CHECK(other.err.find("two_joint: the cell's own arm, no UR controller") != std::string::npos);
  CHECK(two_joint("simulated").exit_code == 2);
  CHECK(folder.run_job("own", {"--robot", "none", "--robot-at", "20=reboot"}).exit_code == 2);
  folder.write("file.yaml", "robot: {calibration_file: robot.yaml}\n");
  CHECK(folder.run_job("file", {"--robot", "none", "--config", "file.yaml"}).exit_code == 3);
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
    // A turn of the loop and a cycle of a CB3; of a link the silence that tells, besides.
    const Json answered_s = result["robot"]["stop_answered_within_s"];
    const Json lost_s = result["robot"]["link_loss_answered_within_s"];
    if (!answered_s.is_null()) CHECK(answered_s.get<double>() <= 0.0101);
    if (!lost_s.is_null()) CHECK(lost_s.get<double>() <= 0.1101);
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

namespace {

/// Somebody who watches a whole job: it is done, or stopped safely, and can say why.
std::string whole_job(const std::vector<std::string>& happens) {
  const JobFolder folder;
  std::vector<std::string> words = {"--robot", "simulated"};
  for (const std::string& what : happens) words.insert(words.end(), {"--robot-at", what});
  const ProgramResult run = folder.run_job("run", words);
  INFO(run.err);
  const Json result = folder.read_json("run/result.json");
  check_safe(result);
  CHECK(folder.run({"replay", "run/journal.flj"}).exit_code == 0);
  const Json answered_s = result["robot"]["stop_answered_within_s"];
  if (!answered_s.is_null()) CHECK(answered_s.get<double>() <= 0.0101);
  if (run.exit_code == 0) {
    CHECK(result["truth"]["false_free_voxels"] == 0);
    return "done";
  }
  CHECK(run.exit_code == 6);
  CHECK(result["safety"]["stops"].size() == 1);
  return result["reason"].get<std::string>().substr(0, 5);
}

}  // namespace

TEST_CASE("in lockstep what is to happen to the robot happens in the job's time, as in one process", "[scenario]") {
  const JobFolder folder;
  const std::string what = "20.3=system-emergency-stop";
  const ProgramResult inside =
      folder.run_job("inside", {"--only", "calibrate", "--robot", "simulated", "--robot-at", what});
  CHECK(inside.exit_code == 6);
  const UrSim robot({"--cell", "empty", "--seed", "1", "--lockstep", "--at", what});
  folder.write("site.yaml", "robot: {port_offset: " + std::to_string(robot.offset) + "}\n");
  const ProgramResult outside =
      folder.run_job("outside", {"--only", "calibrate", "--robot", "127.0.0.1", "--config", "site.yaml"});
  CHECK(outside.exit_code == 6);
  const Json one = folder.read_json("inside/result.json"), other = folder.read_json("outside/result.json");
  CHECK(one["reason"].get<std::string>().starts_with("E5004"));
  CHECK(one["safety"] == other["safety"]);
  CHECK(one["robot"] == other["robot"]);
}

TEST_CASE("whole jobs meet what can happen to a robot: done, or stopped with a reason", "[scenario]") {
  CHECK(whole_job({"40=pause", "220=play", "250=pause", "252=play"}) == "done");
  CHECK(whole_job({"35.3=protective-stop-paused"}) == "E5004");
  CHECK(whole_job({"120=unplug", "120.6=plug"}) == "E5002");
  CHECK(whole_job({"61.7=reboot"}) == "E5002");
  CHECK(whole_job({"90=open-safeguard", "93=close-safeguard"}) == "E5004");
  CHECK(whole_job({"30=slider=0.3", "60=slider=1", "75=clock=3600"}) == "done");
}

TEST_CASE("a whole job on an e-Series, a factory correction that is another's is refused", "[scenario]") {
  const JobFolder folder;
  folder.write("cell.yaml",
               "arm: ur5e\nwalls: {low_m: [-2.0, -1.9], high_m: [2.1, 2.0], height_m: 2.6}\n"
               "board: {center_m: [0.89, 0.45, 0.42], faces: [-0.89, -0.45, 0.35]}\n");
  const auto run = [&](const std::string& out, const std::vector<std::string>& more) {
    std::vector<std::string> words = {"run",  "--cell", "cell.yaml", "--seed",  "3",        "--sensor",
                                      "fast", "--out",  out,         "--robot", "simulated"};
    words.insert(words.end(), more.begin(), more.end());
    return folder.run(words);
  };
  const ProgramResult done = run("run", {});
  INFO(done.err);
  REQUIRE(done.exit_code == 0);
  const Json result = folder.read_json("run/result.json");
  check_safe(result);
  CHECK(result["robot"]["model"] == "ur5e");
  CHECK(result["robot"]["software"].get<std::string>().starts_with("5."));
  CHECK(result["robot"]["kinematics"]["file"].is_null());
  CHECK(result["robot"]["kinematics"]["ur_calibration_hash"].get<std::string>().starts_with("calib_"));

  // A controller in this process is installed as the site's is said to be.
  folder.write("tcp.yaml", "robot: {tcp_offset: [0, 0, 0.1, 0, 0, 0], payload_kg: 1.5}\n");
  const ProgramResult tcp = run("tcp", {"--config", "tcp.yaml", "--faults", "operator.stop_at=3"});
  INFO(tcp.err);
  CHECK(tcp.exit_code == 6);
  CHECK(folder.read_json("tcp/result.json")["reason"].get<std::string>().starts_with("E5005"));
  // The published UR5e: not this robot.
  folder.write("published.yaml",
               "kinematics:\n  shoulder: {x: 0, y: 0, z: 0.1625, roll: 0, pitch: 0, yaw: 0}\n"
               "  upper_arm: {x: 0, y: 0, z: 0, roll: 1.570796327, pitch: 0, yaw: 0}\n"
               "  forearm: {x: -0.425, y: 0, z: 0, roll: 0, pitch: 0, yaw: 0}\n"
               "  wrist_1: {x: -0.3922, y: 0, z: 0.1333, roll: 0, pitch: 0, yaw: 0}\n"
               "  wrist_2: {x: 0, y: -0.0997, z: 0, roll: 1.570796327, pitch: 0, yaw: 0}\n"
               "  wrist_3: {x: 0, y: 0.0996, z: 0, roll: 1.570796326589793, pitch: 3.141592653589793, yaw: "
               "3.141592653589793}\n  hash: calib_12788084448423163542\n");
  folder.write("other.yaml", "robot: {calibration_file: published.yaml}\n");
  const ProgramResult other = run("other", {"--config", "other.yaml"});
  CHECK(other.exit_code == 3);
  CHECK(other.err.find("robot.calibration_file") != std::string::npos);
  CHECK(other.err.find("calib_12788084448423163542") != std::string::npos);
}

namespace {

/// The kinematics that a controller tells on its primary interface.
std::array<DhRow, 6> told_rows(const UrSim& robot) {
  Connection primary(robot, 30001);
  std::array<DhRow, 6> rows{};
  for (bool found = false; !found;) {
    REQUIRE(primary.receive());
    for (const UrPacket& packet : take_packets(primary.received)) {
      if (packet.type != 16) continue;
      std::string parts = packet.content;
      for (const UrPacket& part : take_packets(parts)) {
        if (part.type != 5) continue;
        found = true;
        for (std::size_t j = 0; j < 6; ++j) {
          const auto column = [&](std::size_t i) { return double_at(part.content, 24 + 48 * i + 8 * j); };
          rows[j] = {.theta_offset_rad = column(0), .d_m = column(2), .a_m = column(1), .alpha_rad = column(3)};
        }
      }
    }
  }
  return rows;
}

}  // namespace

TEST_CASE("a job on a robot whose factory correction comes from a file of ROS", "[scenario]") {
  const JobFolder folder;
  std::string hash;
  {
    const UrSim robot({"--cell", "empty", "--seed", "1", "--running"});
    const auto rows = told_rows(robot);
    hash = ur_calibration_hash(rows);
    folder.write("robot.yaml", UrCorrection(rows).yaml(hash));
  }
  folder.write("site.yaml", "robot: {calibration_file: robot.yaml}\n");
  const ProgramResult run =
      folder.run_job("run", {"--only", "calibrate", "--robot", "simulated", "--config", "site.yaml"});
  INFO(run.err);
  REQUIRE(run.exit_code == 0);
  const Json kinematics = folder.read_json("run/result.json")["robot"]["kinematics"];
  CHECK(kinematics["ur_calibration_hash"] == hash);
  CHECK(kinematics["file"]["path"] == "robot.yaml");
  CHECK(kinematics["file"]["hash_agrees"] == true);
  CHECK(kinematics["file"]["flange_off_m"].get<double>() < 1e-9);
  CHECK(folder.read("run/report.html").find(hash) != std::string::npos);
  const ProgramResult another = folder.run({"run", "--cell", "random:2", "--seed", "1", "--sensor", "fast", "--out",
                                            "another", "--robot", "simulated", "--config", "site.yaml"});
  CHECK(another.exit_code == 3);  // another robot
  CHECK(another.err.find("robot.calibration_file") != std::string::npos);
}

TEST_CASE("what a simulated controller cannot be or is not", "[scenario]") {
  const JobFolder folder;
  CHECK(folder.run({"ur-sim", "--lockstep"}).exit_code == 2);
  const UrSim robot({"--cell", "empty", "--seed", "1", "--lockstep"});
  folder.write("site.yaml", "robot: {port_offset: " + std::to_string(robot.offset) + "}\n");
  const ProgramResult faults =
      folder.run_job("run", {"--robot", "127.0.0.1", "--config", "site.yaml", "--faults", "operator.stop_at=9"});
  CHECK(faults.exit_code == 2);
  folder.write("tcp.yaml",
               "robot: {tcp_offset: [0, 0, 0.1, 0, 0, 0], port_offset: " + std::to_string(robot.offset) + "}\n");
  const ProgramResult tcp = folder.run_job("tcp", {"--robot", "127.0.0.1", "--config", "tcp.yaml"});
  CHECK(tcp.exit_code == 3);
  CHECK(tcp.err.find("robot.tcp_offset") != std::string::npos);
}

}  // namespace firstlook
