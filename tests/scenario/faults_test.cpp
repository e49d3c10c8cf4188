/// What goes wrong in a cell, and how the job ends then: outcome, exit code, reason, and never a contact.
#include <csignal>

#include "tests/support/job_run.hpp"

namespace firstlook {
using test::check_safe;
using test::JobFolder;
using test::Json;
using test::ProgramResult;

namespace {

struct Expected {
  int exit_code;
  const char* outcome;
  const char* code;  ///< the reason begins with it; empty for a job that is done
};
constexpr Expected kDone{0, "done", ""};
Expected stopped(const char* code) { return {6, "safely_stopped", code}; }
Expected rejected(const char* code) { return {5, "calibration_rejected", code}; }

bool begins_with(const Json& text, const std::string& begin) { return text.get<std::string>().starts_with(begin); }

/// Runs the job with these faults; a short exploration is enough to come to its end.
Json run_with(const std::string& faults, const Expected& expected, const std::vector<std::string>& more = {},
              const std::string& config = {}) {
  const JobFolder folder;
  folder.write("short.yaml", "explore: {views_max: 12}\n" + config);
  std::vector<std::string> words = {"--config", "short.yaml", "--faults", faults};
  words.insert(words.end(), more.begin(), more.end());
  const ProgramResult run = folder.run_job("run", words);
  INFO(faults << "\n" << run.err);
  CHECK(run.exit_code == expected.exit_code);
  const Json result = folder.read_json("run/result.json");
  CHECK(result["outcome"] == expected.outcome);
  CHECK(begins_with(result["reason"], expected.code));
  check_safe(result);
  CHECK(folder.run({"replay", "run/journal.flj"}).exit_code == 0);
  return result;
}

double phase_start_s(const Json& result, const std::string& name) {
  for (const Json& phase : result["phases"]) {
    if (phase["name"] == name) return phase["start_s"];
  }
  return -1;
}

/// When mapping begins in this job: where a run of the calibration alone leaves off. Mapping takes longer than the
/// 20 s at most that the tests add to it, with the views that run_with() allows.
double mapping_start_s() {
  static const double start_s = [] {
    const JobFolder folder;
    REQUIRE(folder.run_job("run", {"--only", "calibrate"}).exit_code == 0);
    return phase_start_s(folder.read_json("run/result.json"), "Park");
  }();
  return start_s;
}
std::string in_mapping(const std::string& fault, double after_s) {
  return fault + "=" + std::to_string(mapping_start_s() + after_s);
}

/// The job stops once, at a time within 0.2 s after the fault, for its reason.
void check_stop(const Json& result, double at_s) {
  REQUIRE(result["safety"]["stops"].size() == 1);
  const Json& stop = result["safety"]["stops"][0];
  CHECK(stop["cause"] == result["reason"]);
  CHECK(stop["time_s"].get<double>() == Approx(at_s).margin(0.2));
  CHECK(result["phases"].back()["name"] == "Stopped");
}

}  // namespace

TEST_CASE("a person, the robot or the network stops the job at once", "[scenario]") {
  check_stop(run_with("operator.stop_at=20", stopped("E5005")), 20);
  const Json deaf = run_with("panel.lost_at=20", stopped("E5014 lost the button panel"));
  check_stop(deaf, 20);
  CHECK_THAT(deaf["remedy"].get<std::string>(), Catch::Contains("CAN bus") && Catch::Contains("firstlook check"));
  check_stop(run_with("arm.protective_stop_at=20", stopped("E5004")), 20);
  check_stop(run_with("arm.emergency_stop_at=20", stopped("E5004")), 20);
  check_stop(run_with("arm.emergency_stop_at=0.2", stopped("E5004")), 0.2);
}

TEST_CASE("a lost link is one, whether the arm moves, waits or has not begun", "[scenario]") {
  check_stop(run_with("link.lost_at=0.3", stopped("E5002")), 0.3);
  check_stop(run_with("link.lost_at=6.9", stopped("E5002")), 6.9);
  check_stop(run_with("link.lost_at=20", stopped("E5002")), 20);
}

TEST_CASE("a stop or a silent depth camera while mapping", "[scenario]") {
  check_stop(run_with(in_mapping("link.lost_at", 15), stopped("E5002")), mapping_start_s() + 15);
  check_stop(run_with(in_mapping("arm.emergency_stop_at", 17), stopped("E5004")), mapping_start_s() + 17);
  const Json stalled = run_with(in_mapping("depth.stall_at", 16), stopped("E5003"));
  CHECK(stalled["safety"]["stops"].size() == 1);
  CHECK(stalled["safety"]["stops"][0]["time_s"].get<double>() < mapping_start_s() + 20);
}

TEST_CASE("a pause is waited for, but not for ever", "[scenario]") {
  const Json resumed = run_with("operator.pause_at=20:5", kDone);
  CHECK(phase_start_s(resumed, "Paused") == Approx(20).margin(0.1));
  const Json given_up = run_with("operator.pause_at=20", stopped("E5009"));
  CHECK(given_up["safety"]["stops"][0]["time_s"].get<double>() == Approx(3620).margin(1));
}

TEST_CASE("a pause of an hour is as short in the journal as one of seconds, and replays", "[scenario]") {
  const JobFolder folder;
  folder.write("short.yaml", "explore: {views_max: 3}\n");
  const auto journal_bytes = [&](const std::string& faults, int exit_code) {
    const ProgramResult run = folder.run_job(faults, {"--config", "short.yaml", "--faults", faults});
    INFO(run.err);
    CHECK(run.exit_code == exit_code);
    const ProgramResult replayed = folder.run({"replay", faults + "/journal.flj"});
    INFO(replayed.err);
    CHECK(replayed.exit_code == 0);
    CHECK(replayed.out.find("stopped at its cap") == std::string::npos);
    check_safe(folder.read_json(faults + "/result.json"));
    return std::filesystem::file_size(folder / (faults + "/journal.flj"));
  };
  const std::string calibrating = "operator.pause_at=20", mapping = in_mapping("operator.pause_at", 10);
  const auto seconds = journal_bytes(calibrating + ":5", 0);
  CHECK(journal_bytes(calibrating + ":3590", 0) < seconds + seconds / 10);
  CHECK(journal_bytes(calibrating, 6) < seconds);
  CHECK(journal_bytes(mapping + ":3590", 0) < seconds + seconds / 4);  // what was known free is looked at again
}

TEST_CASE("after a long pause the surroundings are looked at again", "[scenario]") {
  const Json result = run_with(in_mapping("operator.pause_at", 20) + ":70", kDone);
  CHECK(phase_start_s(result, "Paused") == Approx(mapping_start_s() + 20).margin(0.1));
}

TEST_CASE("nobody presses Play: the job does not wait for ever", "[scenario]") {
  const Json result = run_with("operator.play_at=never", stopped("E5008"));
  CHECK(result["hand_eye"].is_null());
  CHECK(phase_start_s(result, "LocateBoard") == -1);
}

TEST_CASE("a board that is not there, a camera that is not on the arm", "[scenario]") {
  CHECK(run_with("board.absent=1", stopped("E2005"))["hand_eye"].is_null());
  CHECK(run_with("camera.fixed=1", rejected("E2006"))["hand_eye"].is_null());
}

TEST_CASE("an arm that starts outside of its safe zone does not move, and is told what to do", "[scenario]") {
  const JobFolder folder;
  folder.write("narrow.yaml",
               "safe_zone: {radius_m: 0.3, height_m: 0.8}\n"
               "board: {center_m: [0.9, 0, 0.4], faces: [-1, 0, 0.3]}\n");
  const ProgramResult run = folder.run({"run", "--cell", "narrow.yaml", "--sensor", "fast", "--out", "run"});
  INFO(run.err);
  CHECK(run.exit_code == 6);
  const Json result = folder.read_json("run/result.json");
  CHECK(begins_with(result["reason"], "E4002"));
  CHECK_THAT(result["reason"].get<std::string>(),
             Catch::Contains("start: ") && Catch::Contains("mm short of what must remain"));
  const std::string remedy = result["remedy"];
  CHECK(remedy.find("Jog the arm into the safe zone") != std::string::npos);
  CHECK(run.err.find(remedy) != std::string::npos);
  CHECK(folder.read("run/report.html").find(remedy) != std::string::npos);
  CHECK(result["hand_eye"].is_null());
  CHECK(result["safety"]["stops"].empty());
  CHECK(result["truth"]["contacts"] == 0);
}

TEST_CASE("a board that moves rejects the calibration, or the map", "[scenario]") {
  const Json early = run_with("board.move_at=" + std::to_string(0.5 * mapping_start_s()), rejected("E2007"));
  CHECK(early["hand_eye"]["verdict"] == "rejected");
  CHECK(early["mapping"].is_null());
  run_with(in_mapping("board.move_at", 10), stopped("E2008"));
}

TEST_CASE("a camera that states wrong intrinsics is found out, or has them estimated", "[scenario]") {
  const std::string wrong = "color.focal=0.002,color.center=1";
  const Json given = run_with(wrong, rejected("E2007"));
  CHECK(given["hand_eye"]["likely_mistake"]["mistake"] == "intrinsics");
  CHECK(given["truth"]["hand_eye_mahalanobis2"] > 20.1);
  const Json estimated = run_with(wrong, kDone, {}, "calibration: {intrinsics: estimate}\n");
  CHECK(estimated["truth"]["hand_eye_mahalanobis2"] < 20.1);
  CHECK(estimated["truth"]["hand_eye_error_mm"] < 0.5);
  CHECK(estimated["hand_eye"]["intrinsics"]["sigma"]["fx_px"] < 0.5);
}

TEST_CASE("a depth camera that sits elsewhere and stamps that are off are found, and the map uses what was found",
          "[scenario]") {
  const Json result = run_with("depth.shift=5,depth.tilt=8,color.clock=-0.02,depth.clock=0.04", kDone);
  const Json& truth = result["truth"];
  CHECK(truth["depth_camera_error_mm"] < 1.5);
  CHECK(truth["depth_camera_error_mrad"] < 2);
  CHECK(std::abs(truth["color_stamps_error_s"].get<double>()) < 1e-3);
  CHECK(std::abs(truth["depth_stamps_error_s"].get<double>()) < 2e-3);
  CHECK(truth["false_free_voxels"] == 0);
  CHECK(result["depth_camera"]["source"] == "estimated");
  CHECK(result["depth_camera"]["estimate"]["moved_mm"].get<double>() == Approx(5).margin(1.5));
  CHECK(result["time_offset"]["color"]["offset_s"].get<double>() == Approx(0.02).margin(1e-3));
  CHECK(result["time_offset"]["depth"]["offset_s"].get<double>() == Approx(-0.04).margin(2e-3));

  const Json apart = run_with("color.clock=0.15,depth.clock=-0.15", kDone);
  CHECK(apart["time_offset"]["color"]["offset_s"].get<double>() == Approx(-0.15).margin(1e-3));
  CHECK(apart["time_offset"]["depth"]["offset_s"].get<double>() == Approx(0.15).margin(2e-3));

  const Json bent = run_with("depth.tilt=40", kDone);
  CHECK(bent["depth_camera"]["estimate"]["stated"]["contradicted"] == true);
  CHECK(bent["truth"]["depth_camera_error_mrad"] < 2);
}

TEST_CASE("a stored calibration brings depth camera and stamps along", "[scenario]") {
  const JobFolder folder;
  folder.write("short.yaml", "explore: {views_max: 2}\n");
  const std::string faults = "depth.shift=5,depth.tilt=8,depth.clock=0.04";
  REQUIRE(folder.run_job("cal", {"--only", "calibrate", "--faults", faults}).exit_code == 0);
  const ProgramResult map = folder.run_job(
      "map", {"--only", "map", "--calibration", "cal/hand_eye.yaml", "--config", "short.yaml", "--faults", faults});
  INFO(map.err);
  REQUIRE(map.exit_code == 0);
  const Json made = folder.read_json("cal/result.json"), used = folder.read_json("map/result.json");
  check_safe(used);
  CHECK(used["depth_camera"]["source"] == "stored");
  CHECK(used["time_offset"]["depth"]["source"] == "stored");
  CHECK(used["time_offset"]["depth"]["offset_s"] == made["time_offset"]["depth"]["offset_s"]);
  CHECK(used["truth"]["depth_camera_error_mm"] == made["truth"]["depth_camera_error_mm"]);
}

TEST_CASE("cameras that were never there, or stop, or hang, or have a wrong clock", "[scenario]") {
  const Expected missing{4, "faulted", "E5001"};
  run_with("color.stall_at=0", missing);
  run_with("depth.stall_at=0", missing);
  run_with("color.stall_at=20", stopped("E5003"));
  run_with("color.clock=0.25", stopped("E5010"));
  run_with("depth.clock=-0.3", stopped("E5010"));
  run_with("depth.clock=-5", stopped("E5010"));
}

TEST_CASE("a depth camera that repeats its picture is found out before it can mislead", "[scenario]") {
  const Json frozen = run_with(in_mapping("depth.freeze_at", 17), stopped("E5011"));
  CHECK(frozen["safety"]["stops"][0]["time_s"].get<double>() < mapping_start_s() + 22);
  CHECK(frozen["truth"]["false_free_voxels"] == 0);
}

TEST_CASE("lost frames cost time, not the job", "[scenario]") { run_with("depth.drop=0.3,color.drop=0.3", kDone); }

TEST_CASE("an obstacle that appears in reach is seen and kept clear of", "[scenario]") {
  const Json result = run_with(in_mapping("obstacle.appear_at", 20), kDone);
  CHECK(result["mapping"]["voxels"]["occupied"].get<int>() > 0);
}

TEST_CASE("Ctrl-C ends the job safely, also while a device is missing", "[scenario]") {
  JobFolder folder;
  folder.options.signal = SIGINT;
  folder.options.signal_at = "self test";
  const ProgramResult booting = folder.run_job("boot", {"--real-time", "--faults", "color.stall_at=0"});
  INFO(booting.err);
  CHECK(booting.exit_code == 6);
  CHECK(begins_with(folder.read_json("boot/result.json")["reason"], "E5005"));
  folder.options.signal = SIGTERM;
  folder.options.signal_at = "identifying";
  const ProgramResult running = folder.run_job("run");
  CHECK(running.exit_code == 6);
  check_safe(folder.read_json("run/result.json"));
  CHECK(folder.run({"replay", "run/journal.flj"}).exit_code == 0);
}

}  // namespace firstlook
