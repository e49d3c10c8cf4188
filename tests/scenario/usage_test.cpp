/// What the user got wrong: exit code 2 for the command line, 3 for files, a message that names the place, and no
/// folder left behind by a run that never started.
#include <unistd.h>

#include "tests/support/job_run.hpp"

namespace firstlook {
using Catch::Matchers::Contains;
using test::JobFolder;
using test::Json;
using test::ProgramResult;

namespace {

/// Runs in an empty folder and requires that it is as empty afterwards, that stdout is, and the exit code.
std::string refused(const JobFolder& folder, const std::vector<std::string>& words, int exit_code) {
  const auto before = folder.names();
  const ProgramResult run = folder.run(words);
  INFO(run.err);
  CHECK(run.exit_code == exit_code);
  CHECK(run.out.empty());
  CHECK(folder.names() == before);
  return run.err;
}

}  // namespace

TEST_CASE("wrong words on the command line", "[scenario]") {
  const JobFolder folder;
  CHECK_THAT(refused(folder, {}, 2), Contains("subcommand"));
  CHECK_THAT(refused(folder, {"run", "--bogus"}, 2), Contains("--bogus"));
  CHECK_THAT(refused(folder, {"run", "--sensor", "slow"}, 2), Contains("full,fast"));
  CHECK_THAT(refused(folder, {"run", "--seed", "abc"}, 2), Contains("--seed") && Contains("'abc'"));
  CHECK_THAT(refused(folder, {"run", "--seed", "nan"}, 2), Contains("'nan'"));
  CHECK_THAT(refused(folder, {"run", "--seed", "-1"}, 2), Contains("between 0"));
  CHECK_THAT(refused(folder, {"run", "--workers", "9"}, 2), Contains("between 1 and 4"));
  CHECK_THAT(refused(folder, {"map", "--dataset", "x", "--resolution", "nan"}, 2), Contains("--resolution"));
  CHECK_THAT(refused(folder, {"explain", "99"}, 2), Contains("E2005"));
}

TEST_CASE("unknown cells and faults start nothing", "[scenario]") {
  const JobFolder folder;
  CHECK_THAT(refused(folder, {"run", "--cell", "workshp"}, 3), Contains("workshp") && Contains("machine_tending"));
  CHECK_THAT(refused(folder, {"run", "--cell", "random:x"}, 3), Contains("whole number"));
  CHECK_THAT(refused(folder, {"run", "--faults", "depth.dorp=0.1"}, 2), Contains("'depth.drop'"));
  CHECK_THAT(refused(folder, {"run", "--faults", "depth.drop=nan"}, 2), Contains("depth.drop"));
  CHECK_THAT(refused(folder, {"run", "--faults", "operator.pause_at=3:inf"}, 2), Contains("operator.pause_at"));
  folder.write("cell.yaml", "board: {center_m: [1, 0, 0.4], faces: [-1, 0, 0.3]}\nsolid: 3\n");
  CHECK_THAT(refused(folder, {"run", "--cell", "cell.yaml"}, 3), Contains("cell.yaml:2:1") && Contains("'solids'"));
}

TEST_CASE("a configuration with a mistake is refused with its place", "[scenario]") {
  const JobFolder folder;
  const auto refused_config = [&](const std::string& yaml) {
    folder.write("cart.yaml", yaml);
    return refused(folder, {"run", "--cell", "empty", "--config", "cart.yaml"}, 3);
  };
  CHECK_THAT(refused_config("map:\n  resolutoin_m: 0.05\n"), Contains("cart.yaml:2:3") && Contains("map.resolution_m"));
  CHECK_THAT(refused_config("map:\n  resolution_m: .nan\n"), Contains("cart.yaml:2:17") && Contains("finite"));
  CHECK_THAT(refused_config("map: {resolution_m: five}\n"), Contains("cart.yaml:1:21") && Contains("'five'"));
  CHECK_THAT(refused_config("map: {resolution_m: 0.01}\n"), Contains("E3001") && Contains("MiB"));
  CHECK_THAT(refused_config("map: [\n"), Contains("cart.yaml:2:1"));
  CHECK_THAT(refused(folder, {"run", "--config", "nowhere.yaml"}, 3), Contains("nowhere.yaml"));
}

TEST_CASE("places where no run can be written", "[scenario]") {
  const JobFolder folder;
  folder.write("file", "not a folder");
  std::filesystem::create_directory(folder / "full");
  folder.write("full/precious", "results of yesterday");
  CHECK_THAT(refused(folder, {"run", "--cell", "empty", "--out", "full"}, 3), Contains("E6103") && Contains("full"));
  CHECK(folder.read("full/precious") == "results of yesterday");
  CHECK_THAT(refused(folder, {"run", "--cell", "empty", "--out", "file"}, 3), Contains("file"));
  CHECK_THAT(refused(folder, {"run", "--cell", "empty", "--out", "file/run"}, 3), Contains("E1002"));
  CHECK_THAT(refused(folder, {"run", "--cell", "empty", "--out", "/proc/run"}, 3), Contains("/proc/run"));
}

TEST_CASE("a disk that fills up is reported, and what fits is kept", "[scenario]") {
  JobFolder folder;
  const std::vector<std::string> stop = {"--faults", "operator.stop_at=20"};
  folder.options.file_bytes_max = 200'000;  // the journal does not fit, everything else does
  const ProgramResult journal_cut = folder.run_job("journal", stop);
  INFO(journal_cut.err);
  CHECK(journal_cut.exit_code == 3);
  CHECK_THAT(journal_cut.err, Contains("E1002") && Contains("journal.flj"));
  CHECK(folder.read_json("journal/result.json")["outcome"] == "safely_stopped");

  folder.options.file_bytes_max = 1000;  // not even the head of the journal
  const ProgramResult nothing = folder.run_job("nothing", stop);
  INFO(nothing.err);
  CHECK(nothing.exit_code == 3);
  CHECK_THAT(nothing.err, Contains("E1002") && Contains("File too large"));
  CHECK_FALSE(std::filesystem::exists(folder / "nothing/result.json"));
}

TEST_CASE("stdout that takes nothing is an error", "[scenario]") {
  JobFolder folder;
  folder.options.stdout_to = "/dev/full";
  const ProgramResult run = folder.run_job("run", {"--json", "--faults", "operator.stop_at=20"});
  CHECK(run.exit_code == 3);
  CHECK_THAT(run.err, Contains("stdout"));
  CHECK(folder.run({"config", "--defaults"}).exit_code == 3);
}

TEST_CASE("small commands", "[scenario]") {
  const JobFolder folder;
  const ProgramResult version = folder.run({"--version"});
  CHECK(version.exit_code == 0);
  CHECK_FALSE(version.out.empty());
  CHECK(folder.run({"run", "--help"}).exit_code == 0);
  CHECK_THAT(folder.run({"explain", "E5008"}).out, Contains("nobody pressed Play"));
  CHECK_THAT(folder.run({"states"}).out, Contains("stateDiagram"));
  // The defaults are a configuration that a run takes.
  folder.write("defaults.yaml", folder.run({"config", "--defaults"}).out);
  CHECK(folder.run_job("run", {"--config", "defaults.yaml", "--faults", "operator.stop_at=5"}).exit_code == 6);
}

}  // namespace firstlook
