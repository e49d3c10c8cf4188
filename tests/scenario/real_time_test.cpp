/// The job at the pace of the clock, with jobs on threads of their own.
#include <csignal>

#include "tests/support/job_run.hpp"

namespace firstlook {
using test::check_safe;
using test::JobFolder;
using test::Json;
using test::ProgramResult;

TEST_CASE("the job in real time, and its replay", "[scenario]") {
  const JobFolder folder;
  const ProgramResult run = folder.run_job("run", {"--real-time", "--faults", "operator.stop_at=8"});
  INFO(run.err);
  CHECK(run.exit_code == 6);
  const Json result = folder.read_json("run/result.json");
  check_safe(result);
  CHECK(result["phases"].back()["end_s"].get<double>() == Approx(8).margin(1));
  CHECK(result["wall"]["total_s"].get<double>() >= 8);
  // The board was found: jobs ran and their results came back while the arm went on reporting.
  CHECK(run.err.find("identifying") != std::string::npos);
  const ProgramResult replayed = folder.run({"replay", "run/journal.flj"});
  INFO(replayed.err);
  CHECK(replayed.exit_code == 0);
}

TEST_CASE("a job that was killed leaves a journal that says where it ends", "[scenario]") {
  JobFolder folder;
  folder.options.signal = SIGKILL;
  folder.options.signal_at = "calibration view 6";
  const ProgramResult killed = folder.run_job("run");
  REQUIRE(killed.exit_code == 128 + SIGKILL);
  CHECK_FALSE(std::filesystem::exists(folder / "run/result.json"));
  const ProgramResult replayed = folder.run({"replay", "run/journal.flj"});
  CHECK(replayed.exit_code == 3);
  CHECK(replayed.err.find("cut short in record") != std::string::npos);
}

}  // namespace firstlook
