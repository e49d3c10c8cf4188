/// A power cut after the calibration: the next start says what it has and goes on from there, never by itself.
#include <stdlib.h>  // NOLINT: setenv is POSIX

#include <csignal>

#include "tests/support/job_run.hpp"

namespace firstlook {
using Catch::Matchers::Contains;
using test::check_safe;
using test::JobFolder;
using test::Json;
using test::ProgramResult;

namespace {
constexpr const char* kOtherArm = R"(arm: ur5e
walls: {low_m: [-2.0, -1.9], high_m: [2.1, 2.0], height_m: 2.6}
board: {center_m: [0.89, 0.45, 0.42], faces: [-0.89, -0.45, 0.35]}
)";
}  // namespace

TEST_CASE("a part of the job is nothing to resume", "[scenario]") {
  const JobFolder folder;
  const ProgramResult run = folder.run_job("out", {"--resume", "--only", "calibrate"});
  CHECK(run.exit_code == 2);
  CHECK_THAT(run.err, Contains("--resume") && Contains("--only"));
}

TEST_CASE("a service that was started without a device leaves no folder, a job that began does", "[scenario]") {
  const JobFolder folder;
  const auto start = [&](const char* faults) {
    return folder.run({"run", "--cell", "empty", "--seed", "1", "--sensor", "fast", "--resume", "--faults", faults});
  };
  const ProgramResult missing = start("depth.stall_at=0");
  CHECK(missing.exit_code == 4);
  CHECK_THAT(missing.err, Contains("E5001"));
  CHECK(folder.names("runs").empty());
  const ProgramResult stopped = start("operator.stop_at=3");
  INFO(stopped.err);
  CHECK(stopped.exit_code == 6);
  REQUIRE(folder.names("runs").size() == 1);
  CHECK(std::filesystem::exists(folder / ("runs/" + folder.names("runs").front()) / "result.json"));
}

TEST_CASE("a service that waits records nothing and has no folder before its job", "[scenario]") {
  JobFolder folder;
  const std::vector<std::string> service = {"run", "--cell", "empty", "--seed", "1", "--sensor", "fast", "--resume"};
  const auto with = [&](const char* faults) {
    std::vector<std::string> words = service;
    words.insert(words.end(), {"--faults", faults});
    return words;
  };
  const auto job = [&](const char* faults) {
    const ProgramResult run = folder.run(with(faults));
    INFO(run.err);
    CHECK(run.exit_code == 6);
    const std::vector<std::string> runs = folder.names("runs");
    REQUIRE(runs.size() == 1);
    CHECK(runs.front() != "waiting");
    const std::string journal = "runs/" + runs.front() + "/journal.flj";
    const auto bytes = std::filesystem::file_size(folder / journal);
    const ProgramResult replayed = folder.run({"replay", journal});
    INFO(replayed.err);
    CHECK(replayed.exit_code == 0);
    check_safe(folder.read_json("runs/" + runs.front() + "/result.json"));
    std::filesystem::remove_all(folder / "runs");
    return bytes;
  };
  const auto at_once = job("operator.stop_at=20.5");
  const auto after_ten_minutes = job("operator.play_at=590.5,operator.stop_at=610.5");
  CHECK(after_ten_minutes < at_once + 4096);

  // The power is cut in Ready, again and again.
  folder.options.signal_at = "ready: press Play";
  folder.options.signal = SIGKILL;
  for (int i = 0; i < 2; ++i) {
    std::vector<std::string> words = with("operator.play_at=never");
    words.emplace_back("--real-time");
    REQUIRE(folder.run(words).exit_code == 128 + SIGKILL);
    CHECK(folder.names("runs") == std::vector<std::string>{"waiting"});
  }
  folder.options.signal_at.clear();
  CHECK(job("operator.stop_at=5") > 0);
}

TEST_CASE("a service that cannot open its devices names all of them until it is started again", "[scenario]") {
  const JobFolder folder;
  folder.write("cart.yaml", R"(robot: {host: 127.0.0.1, port_offset: 21000}
camera: {device: /dev/no-camera, width: 640, height: 480}
depth: {device: /nowhere/recording.oni}
panel: {can_interface: nocan0}
calibration: {intrinsics: estimate}
)");
  std::filesystem::create_directories(folder / "status");
  setenv("RUNTIME_DIRECTORY", (folder / "status").c_str(), 1);
  const ProgramResult run = folder.run({"run", "--config", "cart.yaml", "--real-time", "--resume"});
  unsetenv("RUNTIME_DIRECTORY");
  CHECK(run.exit_code == 4);
  const Json status = folder.read_json("status/status.json");
  CHECK(status["fault"] == 5001);
  std::vector<std::string> roles;
  for (const Json& device : status["missing"]) {
    roles.push_back(device["role"]);
    CHECK_FALSE(device["remedy"].get<std::string>().empty());
  }
  CHECK(roles == std::vector<std::string>{"panel", "colour camera", "depth camera", "arm", "pendant"});
  CHECK_FALSE(std::filesystem::exists(folder / "runs"));
}

TEST_CASE("a run that was killed while it mapped is taken up with its calibration", "[scenario]") {
  JobFolder folder;
  folder.options.signal_at = "view 6: expecting";
  folder.options.signal = SIGKILL;
  const ProgramResult killed = folder.run_job("runs/first");
  REQUIRE(killed.exit_code == 128 + SIGKILL);
  folder.options.signal_at.clear();
  CHECK_FALSE(std::filesystem::exists(folder / "runs/first/result.json"));
  REQUIRE(std::filesystem::exists(folder / "runs/first/checkpoint.yaml"));

  SECTION("tested first, then mapped; afterwards it is not offered again") {
    const ProgramResult resumed = folder.run_job("runs/second", {"--resume"});
    INFO(resumed.err);
    CHECK(resumed.exit_code == 0);
    CHECK_THAT(resumed.err, Contains("runs/first was cut off after its calibration") &&
                                Contains("ready: Play tests the stored calibration"));
    const Json result = folder.read_json("runs/second/result.json");
    check_safe(result);
    CHECK(result["hand_eye"]["source"] == "stored");
    CHECK(result["hand_eye"]["verification"]["views"].get<int>() >= 3);
    CHECK(result["mapping"]["views"].get<int>() > 10);
    CHECK_FALSE(std::filesystem::exists(folder / "runs/first/checkpoint.yaml"));
    CHECK_FALSE(std::filesystem::exists(folder / "runs/second/checkpoint.yaml"));
    const ProgramResult fresh = folder.run_job("third", {"--resume", "--faults", "operator.stop_at=5"});
    CHECK_THAT(fresh.err, !Contains("cut off"));
  }
  SECTION("stopped before its end it is offered again") {
    const ProgramResult stopped = folder.run_job("runs/second", {"--resume", "--faults", "operator.stop_at=30"});
    INFO(stopped.err);
    CHECK(stopped.exit_code == 6);
    CHECK(std::filesystem::exists(folder / "runs/first/checkpoint.yaml"));
  }
  SECTION("of another arm it is not taken: the whole job is done") {
    folder.write("cell.yaml", kOtherArm);
    const ProgramResult resumed = folder.run({"run", "--cell", "cell.yaml", "--seed", "1", "--sensor", "fast", "--out",
                                              "runs/second", "--resume", "--faults", "operator.stop_at=5"});
    INFO(resumed.err);
    CHECK_THAT(resumed.err, Contains("not taken up") && Contains("LocateBoard") && !Contains("VerifyCalibration"));
    CHECK_FALSE(std::filesystem::exists(folder / "runs/first/checkpoint.yaml"));
  }
}

}  // namespace firstlook
