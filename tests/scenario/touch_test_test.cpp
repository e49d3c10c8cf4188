/// The touch test within a job: a person leads the arm onto corners of the board before the calibration counts.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tests/support/job_run.hpp"

namespace firstlook {
using Catch::Matchers::Contains;
using test::check_safe;
using test::JobFolder;
using test::Json;
using test::ProgramResult;

namespace {

ProgramResult calibrate_by_touch(const JobFolder& folder, const std::string& out, const std::string& tip,
                                 const std::vector<std::string>& more = {}) {
  folder.write("touch.yaml", "calibration: {touch_test: yes, touch_corners: 10, touch_tip: " + tip + "}\n");
  std::vector<std::string> words = {"--only", "calibrate", "--config", "touch.yaml"};
  words.insert(words.end(), more.begin(), more.end());
  return folder.run_job(out, words);
}

double norm(const Json& v) {
  double squared = 0;
  for (const Json& x : v) squared += x.get<double>() * x.get<double>();
  return std::sqrt(squared);
}

}  // namespace

TEST_CASE("a calibration is touched before it counts, and replays", "[scenario]") {
  const JobFolder folder;
  const std::string tip = GENERATE("given", "estimate");
  const std::string robot = tip == "given" ? "simulated" : "none";
  CAPTURE(tip);
  // The third touch is made on another corner than was asked for.
  const ProgramResult run = calibrate_by_touch(folder, "out", tip, {"--robot", robot, "--faults", "touch.mixed_up=3"});
  INFO(run.err);
  REQUIRE(run.exit_code == 0);
  const Json result = folder.read_json("out/result.json");
  check_safe(result);
  const Json& hand_eye = result["hand_eye"];
  CHECK(hand_eye["verdict"] == "accepted");
  const Json& touch = hand_eye["touch_test"];
  REQUIRE_FALSE(touch.is_null());
  CHECK(touch["agrees"] == true);
  CHECK(touch["touches_used"] == 9);
  CHECK(touch["touches"][2]["used"] == false);
  CHECK(touch["tip"]["source"] == (tip == "given" ? "given" : "estimated"));
  CHECK(norm(touch["error"]["translation_mm"]) < 4 * norm(touch["error_sigma"]["translation_mm"]));
  CHECK(norm(touch["error"]["translation_mm"]) < 5);
  CHECK(touch["horn_residual_rms_mm"].get<double>() < 0.8);
  CHECK(touch["views"].get<int>() >= 8);
  CHECK(touch["static_looks"].get<int>() >= 3 * 8);
  CHECK(norm(touch["error_deviation_static"]["translation_mm"]) > 0);
  // Looks are single pictures, views the means of three.
  CHECK(norm(touch["error_deviation_static"]["translation_mm"]) <
        2 * norm(touch["error_deviation_over_views"]["translation_mm"]));
  std::vector<std::string> phases;
  for (const Json& phase : result["phases"]) phases.push_back(phase["name"]);
  CHECK(std::find(phases.begin(), phases.end(), "TouchTest") != phases.end());
  CHECK_THAT(run.err, Contains("touch 10 of 10") && Contains("bring the arm back") && Contains("touches fit to"));
  CHECK_THAT(folder.read("out/report.html"), Contains("<h2>Touch test</h2>"));
  CHECK(folder.run({"replay", "out/journal.flj"}).exit_code == 0);
}

TEST_CASE("an arm left at the board is not moved: the job ends safely, and the calibration does not count",
          "[scenario]") {
  const JobFolder folder;
  const ProgramResult run = calibrate_by_touch(folder, "out", "given", {"--faults", "touch.left_there=1"});
  INFO(run.err);
  CHECK(run.exit_code == 6);
  CHECK_THAT(run.err, Contains("bring the arm into the safe zone") && Contains("E5013"));
  const Json result = folder.read_json("out/result.json");
  check_safe(result);
  CHECK(result["outcome"] == "safely_stopped");
  CHECK(result["hand_eye"]["verdict"] == "rejected");
  CHECK_THAT(result["hand_eye"]["reasons"][0].get<std::string>(), Contains("the touch test was not carried on"));
  CHECK_FALSE(std::filesystem::exists(folder / "out/ros"));
}

TEST_CASE("a stop and a protective stop while somebody leads the arm", "[scenario]") {
  const JobFolder folder;
  const ProgramResult whole = calibrate_by_touch(folder, "whole", "given");
  REQUIRE(whole.exit_code == 0);
  double from_s = 0, to_s = 0;
  const Json result = folder.read_json("whole/result.json");
  for (const Json& phase : result["phases"]) {
    if (phase["name"] != "TouchTest") continue;
    from_s = phase["start_s"];
    to_s = phase["end_s"];
  }
  REQUIRE(to_s - from_s > 20);
  const auto at = [&](const char* fault) { return std::string(fault) + fmt::format("={:.3f}", from_s + 8.2); };
  SECTION("stop") {
    const ProgramResult run = calibrate_by_touch(folder, "out", "given", {"--faults", at("operator.stop_at")});
    CHECK(run.exit_code == 6);
    CHECK_THAT(run.err, Contains("E5005"));
  }
  SECTION("protective stop") {
    const ProgramResult run = calibrate_by_touch(folder, "out", "given", {"--faults", at("arm.protective_stop_at")});
    CHECK(run.exit_code == 6);
    CHECK_THAT(run.err, Contains("E5004"));
  }
  check_safe(folder.read_json("out/result.json"));
}

}  // namespace firstlook
