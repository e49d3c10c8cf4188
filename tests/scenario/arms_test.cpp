/// Jobs with arms that are no UR: as many joints as it takes, from a file or built in.
#include "tests/support/job_run.hpp"

namespace firstlook {
using test::JobFolder;
using test::Json;

TEST_CASE("an arm with seven joints beside a torso calibrates and maps, touching nothing", "[scenario]") {
  const JobFolder folder;
  const auto run = folder.run({"run", "--cell", "pr2_like", "--seed", "1", "--sensor", "fast", "--out", "out"});
  INFO(run.err);
  CHECK(run.exit_code == 0);
  const Json result = folder.read_json("out/result.json");
  CHECK(result["outcome"] == "done");
  CHECK(result["hand_eye"]["verdict"] == "accepted");
  CHECK(result["truth"]["contacts"] == 0);
  CHECK(result["truth"]["unknown_entries"] == 0);
  CHECK(result["truth"]["coverage_of_observable"] > 0.9);
  CHECK(folder.run({"replay", "out/journal.flj"}).exit_code == 0);
}

TEST_CASE("an arm from a file does the whole job", "[scenario]") {
  const JobFolder folder;
  folder.write("cart.yaml", "arm: {file: " FIRSTLOOK_SOURCE_DIR "/app/config/example_arm.yaml}\n");
  const auto run = folder.run(
      {"run", "--cell", "empty", "--seed", "4", "--sensor", "fast", "--config", "cart.yaml", "--out", "out"});
  INFO(run.err);
  CHECK(run.exit_code == 0);
  const Json result = folder.read_json("out/result.json");
  test::check_safe(result);
  CHECK(result["outcome"] == "done");
  CHECK(result["truth"]["coverage_of_observable"] > 0.95);
}

TEST_CASE("the thesis's two-joint arm ends safely and says what its few views leave open", "[scenario]") {
  const JobFolder folder;
  const auto run = folder.run({"run", "--cell", "two_joint", "--seed", "1", "--sensor", "fast", "--out", "out"});
  INFO(run.err);
  const Json result = folder.read_json("out/result.json");
  CHECK(result["truth"]["contacts"] == 0);
  CHECK(result["truth"]["unknown_entries"] == 0);
  // The camera 600 mm behind the hand and 275 mm above it, found to some millimetres: two joints give few views.
  const Json& t = result["hand_eye"]["translation_m"];
  CHECK(t[1].get<double>() == Approx(-0.275).margin(0.015));
  CHECK(t[2].get<double>() == Approx(-0.600).margin(0.015));
  if (result["outcome"] == "done") return;
  CHECK(run.exit_code == 5);
  CHECK(result["outcome"] == "calibration_rejected");
  REQUIRE_FALSE(result["hand_eye"]["reasons"].empty());
}

}  // namespace firstlook
