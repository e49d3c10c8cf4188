/// The job on a robot over TCP: `firstlook ur-sim` in one process, `firstlook run --robot` in another.
#include <thread>

#include "tests/support/ur_sim_process.hpp"

namespace firstlook {
using namespace test;
using Catch::Matchers::Contains;

namespace {

/// A cell with its robot, which asks for firstlook's program at free ports.
struct Site {
  Site()
      : program_port(free_port()),
        robot({"--cell", "empty", "--seed", "1", "--running", "--external-control",
               "127.0.0.1:" + std::to_string(program_port)}) {
    folder.write("site.yaml", "robot: {port_offset: " + std::to_string(robot.offset) +
                                  ", program_port: " + std::to_string(program_port) +
                                  ", control_port: " + std::to_string(program_port + 1) + "}\n");
  }
  [[nodiscard]] ProgramResult run(const std::vector<std::string>& more) const {
    std::vector<std::string> words = {"--robot", "127.0.0.1", "--config", "site.yaml"};
    words.insert(words.end(), more.begin(), more.end());
    return folder.run_job("run", words);
  }
  int program_port;
  UrSim robot;
  JobFolder folder;
};

}  // namespace

TEST_CASE("Play on the robot's pendant starts the job, Stop ends it", "[scenario]") {
  Site site;
  std::string stopped;
  std::thread person([&] {
    Connection dashboard(site.robot, 29999);
    static_cast<void>(dashboard.line());
    static_cast<void>(dashboard.ask("load external_control.urp"));
    // Until firstlook is there: a request for the program lasts for two seconds.
    for (int i = 0; i < 100 && dashboard.ask("running") != "Program running: true"; ++i) {
      static_cast<void>(dashboard.ask("play"));
      std::this_thread::sleep_for(std::chrono::seconds(3));
    }
    std::this_thread::sleep_for(std::chrono::seconds(10));
    stopped = dashboard.ask("stop");
  });
  const ProgramResult run = site.run({"--only", "calibrate"});
  person.join();
  INFO(run.err);
  CHECK(stopped == "Stopped");
  CHECK(run.exit_code == 6);
  const Json result = site.folder.read_json("run/result.json");
  check_safe(result);
  CHECK_THAT(result["reason"].get<std::string>(), Contains("E5005"));
  CHECK(run.err.find("LocateBoard") != std::string::npos);
  CHECK(result["robot"]["model"] == "ur5");
  CHECK(result["robot"]["kinematics"]["checksums"].size() == 6);
  CHECK(result["robot"]["streams_broken"] == 0);
  CHECK(result["robot"]["play_to_consent_s"].get<double>() < 1);
  const ProgramResult replayed = site.folder.run({"replay", "run/journal.flj"});
  INFO(replayed.err);
  CHECK(replayed.exit_code == 0);
}

TEST_CASE("a robot that is not there is refused before anything moves", "[scenario]") {
  const JobFolder folder;
  folder.write("site.yaml", "robot: {port_offset: " + std::to_string(free_offset()) + "}\n");
  const ProgramResult nobody = folder.run_job("run", {"--robot", "127.0.0.1", "--config", "site.yaml"});
  CHECK(nobody.exit_code == 4);
  CHECK_THAT(nobody.err, Contains("E5001") && Contains("127.0.0.1"));
}

TEST_CASE("the robot's program as a file", "[scenario]") {
  const JobFolder folder;
  const ProgramResult written = folder.run({"ur-script", "--host", "192.168.1.10", "-o", "cart.script"});
  CHECK(written.exit_code == 0);
  const std::string script = folder.read("cart.script");
  CHECK_THAT(script, Contains("socket_open(\"192.168.1.10\", 50001, \"firstlook\")") && !Contains("%"));
  CHECK(folder.run({"ur-script", "--host", "192.168.1.10", "-o", "-"}).out == script);
  CHECK(folder.run({"ur-script"}).exit_code == 2);
  CHECK(folder.run({"ur-script", "--host", "cart\") popup(\"", "-o", "-"}).exit_code == 2);
}

}  // namespace firstlook
