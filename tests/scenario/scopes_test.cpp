/// Parts of the job: calibrate now, then verify or map with what was stored; and every way in which that is refused.
#include <sstream>

#include "tests/support/job_run.hpp"

namespace firstlook {
using Catch::Matchers::Contains;
using test::check_safe;
using test::JobFolder;
using test::Json;
using test::ProgramResult;

namespace {

const std::string kStored = "calibrated/hand_eye.yaml";

std::vector<std::string> phases_of(const Json& result) {
  std::vector<std::string> names;
  for (const Json& phase : result["phases"]) names.push_back(phase["name"]);
  return names;
}

void check_stored(const Json& result, const Json& made) {
  const Json& hand_eye = result["hand_eye"];
  CHECK(hand_eye["source"] == "stored");
  CHECK(hand_eye["translation_m"] == made["translation_m"]);
  CHECK(hand_eye["covariance"] == made["covariance"]);
  CHECK(hand_eye["views"] == made["views"]);
  CHECK(hand_eye["verification"]["views"].get<int>() >= 3);
  CHECK(hand_eye["verification"]["degrees_of_freedom"] == 6 * (hand_eye["verification"]["views"].get<int>() - 1));
}

void replace(const JobFolder& folder, const std::string& from, const std::string& to) {
  std::string text = folder.read(kStored);
  REQUIRE(text.find(from) != std::string::npos);
  folder.write("changed.yaml", text.replace(text.find(from), from.size(), to));
}

}  // namespace

TEST_CASE("calibrate, then verify and map with what was stored", "[scenario]") {
  const JobFolder folder;
  const ProgramResult calibrated = folder.run_job("calibrated", {"--only", "calibrate"});
  INFO(calibrated.err);
  REQUIRE(calibrated.exit_code == 0);
  const Json made = folder.read_json("calibrated/result.json")["hand_eye"];
  CHECK(made["source"] == "solved");
  CHECK(made["verification"].is_null());

  SECTION("verify") {
    const ProgramResult run = folder.run_job(
        "verified", {"--only", "verify", "--calibration", kStored, "--faults", "operator.pause_at=14:3"});
    INFO(run.err);
    CHECK(run.exit_code == 0);
    CHECK_THAT(run.err, Contains("the stored calibration") && Contains("chi-square") && Contains("as stored"));
    const Json result = folder.read_json("verified/result.json");
    check_safe(result);
    check_stored(result, made);
    CHECK(result["outcome"] == "done");
    CHECK_THAT(result["reason"].get<std::string>(), Contains("stored calibration"));
    CHECK(result["hand_eye"]["verdict"] == "accepted");
    CHECK(result["mapping"].is_null());
    CHECK(phases_of(result) == std::vector<std::string>{"Boot", "Ready", "LocateBoard", "VerifyCalibration", "Paused",
                                                        "VerifyCalibration", "Park", "Report"});
    // What was verified can be used again, and the replay does not need the file.
    CHECK(folder.run_job("again", {"--only", "verify", "--calibration", "verified/hand_eye.yaml"}).exit_code == 0);
    std::filesystem::remove(folder / kStored);
    CHECK(folder.run({"replay", "verified/journal.flj"}).exit_code == 0);
  }
  SECTION("map, the calibration named in the configuration") {
    folder.write("cart.yaml", "calibration: {stored: " + kStored + "}\n");
    const ProgramResult run = folder.run_job("mapped", {"--only", "map", "--config", "cart.yaml"});
    INFO(run.err);
    CHECK(run.exit_code == 0);
    const Json result = folder.read_json("mapped/result.json");
    check_safe(result);
    check_stored(result, made);
    CHECK(result["outcome"] == "done");
    CHECK(result["truth"]["coverage_of_observable"].get<double>() > 0.95);
    CHECK(std::filesystem::exists(folder / "mapped/collision_map.bt"));
    CHECK(folder.run({"replay", "mapped/journal.flj"}).exit_code == 0);
  }
  SECTION("another mount is rejected, with figure and limit, and cannot be used again") {
    const ProgramResult run = folder.run({"run", "--cell", "empty", "--seed", "2", "--sensor", "fast", "--only", "map",
                                          "--calibration", kStored, "--out", "other"});
    INFO(run.err);
    CHECK(run.exit_code == 5);
    CHECK_THAT(run.err, Contains("rejected  the views put the board at different places") && Contains("allowed"));
    const Json result = folder.read_json("other/result.json");
    check_safe(result);
    CHECK(result["outcome"] == "calibration_rejected");
    CHECK(result["hand_eye"]["verdict"] == "rejected");
    CHECK(result["hand_eye"]["reasons"].size() >= 1);
    CHECK(result["mapping"].is_null());
    CHECK_FALSE(std::filesystem::exists(folder / "other/ros"));
    const ProgramResult refused =
        folder.run_job("refused", {"--only", "verify", "--calibration", "other/hand_eye.yaml"});
    CHECK(refused.exit_code == 3);
    CHECK_THAT(refused.err, Contains("E6105") && Contains("rejected by the run that made it"));
  }
  SECTION("files that cannot be used are refused before anything starts") {
    const auto refused = [&](const std::string& file, int exit_code) {
      const ProgramResult run = folder.run_job("refused", {"--only", "map", "--calibration", file});
      INFO(run.err);
      CHECK(run.exit_code == exit_code);
      CHECK_FALSE(std::filesystem::exists(folder / "refused"));
      return run.err;
    };
    CHECK_THAT(refused("nowhere.yaml", 3), Contains("E6101") && Contains("nowhere.yaml"));
    replace(folder, "parent_frame: tool0", "parent_frame: flange");
    CHECK_THAT(refused("changed.yaml", 3), Contains("E6102") && Contains("changed.yaml:") && Contains("only tool0"));
    replace(folder, "arm_model: ur5", "arm_model: ur10");
    CHECK_THAT(refused("changed.yaml", 3), Contains("E6105 the stored calibration cannot be used: changed.yaml") &&
                                               Contains("ur10, this one is ur5") && Contains("--only calibrate"));
  }
}

TEST_CASE("the scopes on the command line", "[scenario]") {
  const JobFolder folder;
  const auto refused = [&](const std::vector<std::string>& more) {
    const ProgramResult run = folder.run_job("out", more);
    CHECK(run.exit_code == 2);
    CHECK_FALSE(std::filesystem::exists(folder / "out"));
    return run.err;
  };
  for (const char* scope : {"map", "verify"}) {
    CHECK_THAT(refused({"--only", scope}), Contains("E6201") && Contains("--calibration FILE") &&
                                               Contains("--only calibrate --out DIR") &&
                                               Contains("calibration.stored"));
  }
  CHECK_THAT(refused({"--calibration", "hand_eye.yaml"}), Contains("--only map and --only verify"));
  CHECK_THAT(refused({"--only", "calibrate", "--calibration", "x"}), Contains("--only map and --only verify"));
  CHECK_THAT(refused({"--only", "dance"}), Contains("verify"));
  CHECK_THAT(refused({"--views", "greedy"}), Contains("greedy") && Contains("thesis2014") && Contains("firstlook"));
  CHECK(folder.run_job("views", {"--views", "firstlook", "--faults", "operator.stop_at=3"}).exit_code == 6);
}

TEST_CASE("views as the thesis chose them: slower to the same, and as safe", "[scenario]") {
  const JobFolder folder;
  for (const std::string views : {"firstlook", "thesis2014"}) {
    INFO(views);
    const ProgramResult run =
        folder.run({"run", "--cell", "empty", "--seed", "2", "--sensor", "fast", "--views", views, "--out", views});
    REQUIRE(run.exit_code == 0);
    const Json truth = folder.read_json(views + "/result.json")["truth"];
    CHECK(truth["contacts"] == 0);
    CHECK(truth["unknown_entries"] == 0);
    CHECK(truth["coverage_of_observable"] > 0.9);
    CHECK(folder.run({"replay", views + "/journal.flj"}).exit_code == 0);
  }
  const auto time_to_95_s = [&](const std::string& views) {
    const Json truth = folder.read_json(views + "/result.json")["truth"];
    return truth["to_95"].is_null() ? 1e9 : truth["to_95"]["time_s"].get<double>();
  };
  CHECK(time_to_95_s("firstlook") < 0.9 * time_to_95_s("thesis2014"));
  // The sweep goes on only while it tells more than a chosen view; the thesis's goes on to its end.
  const auto sweep_views = [&](const std::string& views) {
    std::istringstream rows(folder.read(views + "/views.csv"));
    int count = 0;
    for (std::string row; std::getline(rows, row);) count += row.find(",sweep,") != std::string::npos ? 1 : 0;
    return count;
  };
  CHECK(sweep_views("firstlook") == 1);
  CHECK(sweep_views("thesis2014") > 8);
}

}  // namespace firstlook
