/// `firstlook campaign` as a user runs it. The cells are short: the operator stops the job after two seconds.
#include <csignal>

#include "tests/support/job_run.hpp"

namespace firstlook {
using Catch::Matchers::Contains;
using test::JobFolder;
using test::Json;
using test::ProgramResult;

namespace {

const std::string kShort = "operator.stop_at=2";

std::vector<std::string> words(const std::string& cells, const std::string& out,
                               const std::vector<std::string>& more = {}) {
  std::vector<std::string> all = {"campaign", "--cells", cells, "--seed", "3", "--faults",
                                  kShort,     "--out",   out,   "--jobs", "2"};
  all.insert(all.end(), more.begin(), more.end());
  return all;
}

/// The summary without what differs from run to run.
Json steady(Json summary) {
  summary.erase("wall");
  return summary;
}

/// A state file's lines for cells.
std::vector<Json> cells_in(const JobFolder& folder, const std::string& file) {
  std::istringstream lines(folder.read(file));
  std::vector<Json> cells;
  std::string line;
  std::getline(lines, line);
  while (std::getline(lines, line)) cells.push_back(Json::parse(line));
  return cells;
}

}  // namespace

TEST_CASE("a campaign of two cells, and each is the run that its command says", "[scenario]") {
  const JobFolder folder;
  const ProgramResult first = folder.run(words("2", "c"));
  INFO(first.err);
  CHECK(first.exit_code == 0);
  CHECK_THAT(first.out, Contains("2 of 2 cells") && Contains("2 safely stopped"));
  const Json summary = folder.read_json("c/summary.json");
  CHECK(summary["cells"] == Json({{"asked", 2}, {"finished", 2}, {"missing", 0}, {"broken", 0}}));
  CHECK(summary["outcomes"]["safely_stopped"] == 2);
  CHECK(summary["safety"]["cells_graded"] == 2);
  CHECK_THAT(summary["reasons"][0]["reason"].get<std::string>(), Contains("E5005"));
  CHECK(summary["reasons"][0]["seeds"] == Json({3, 4}));
  CHECK(folder.names("c/kept") == std::vector<std::string>{"seed-3", "seed-4"});
  CHECK_FALSE(std::filesystem::exists(folder / "c/work"));

  REQUIRE(summary["reasons"][0]["command"] ==
          "firstlook run --cell random:3 --seed 3 --sensor fast --workers 1 --faults operator.stop_at=2");
  CHECK(folder
            .run({"run", "--cell", "random:3", "--seed", "3", "--sensor", "fast", "--workers", "1", "--faults", kShort,
                  "--out", "alone"})
            .exit_code == 6);
  const auto cells = cells_in(folder, "c/cells.jsonl");
  REQUIRE(cells.size() == 2);
  const auto& of_seed_3 = cells[0]["seed"] == 3 ? cells[0] : cells[1];
  CHECK(of_seed_3["decisions_hash"] == folder.read_json("alone/result.json")["decisions_hash"]);
}

TEST_CASE("a campaign goes on where it stopped, and may grow", "[scenario]") {
  JobFolder folder;
  folder.options.signal_at = "cell ";
  folder.options.signal = SIGTERM;
  const ProgramResult stopped = folder.run(words("40", "c"));
  INFO(stopped.err);
  CHECK(stopped.exit_code == 6);
  CHECK_THAT(stopped.err, Contains("the same command goes on"));
  const std::size_t before = cells_in(folder, "c/cells.jsonl").size();
  CHECK(before >= 1);
  CHECK(before < 40);
  CHECK_FALSE(std::filesystem::exists(folder / "c/work"));

  folder.options.signal_at.clear();
  const auto few = std::to_string(before + 1);
  CHECK(folder.run(words(few, "c", {"--merge"})).exit_code == 3);
  folder.write("c/cells.jsonl", folder.read("c/cells.jsonl") + "{\"index\": 7, \"se");  // a power cut
  const ProgramResult resumed = folder.run(words(few, "c"));
  CHECK(resumed.exit_code == 0);
  CHECK_THAT(resumed.err, Contains("not whole") && Contains(std::to_string(before) + " cells are finished, 1 to go"));
  CHECK(cells_in(folder, "c/cells.jsonl").size() == before + 1);
  CHECK(folder.run(words(few, "c", {"--merge"})).exit_code == 0);
}

TEST_CASE("shards of a Slurm array say together what one process says", "[scenario]") {
  const JobFolder folder;
  REQUIRE(folder.run(words("3", "whole")).exit_code == 0);
  for (const char* task : {"1", "2"}) {
    const ProgramResult shard =
        test::run_program("/usr/bin/env",
                          {"PROGRAM=" FIRSTLOOK_PROGRAM, "CELLS=3", "FIRST_SEED=3", "OUT=shards", "FAULTS=" + kShort,
                           "SLURM_ARRAY_TASK_COUNT=2", std::string("SLURM_ARRAY_TASK_ID=") + task,
                           "SLURM_CPUS_PER_TASK=1", "bash", FIRSTLOOK_SOURCE_DIR "/tests/campaign/slurm_array.sbatch"},
                          folder.options);
    INFO(shard.err);
    CHECK(shard.exit_code == 0);
  }
  CHECK(folder.read_json("shards/summary-1-of-2.json")["campaign"]["shard"] == "1/2");
  CHECK(folder.read_json("shards/summary-1-of-2.json")["cells"]["asked"] == 2);
  const ProgramResult merged = folder.run(words("3", "shards", {"--merge", "--json", "-"}));
  CHECK(merged.exit_code == 0);
  CHECK(steady(Json::parse(merged.out)) == steady(folder.read_json("whole/summary.json")));
}

TEST_CASE("a cell that takes too long is a result", "[scenario]") {
  const JobFolder folder;
  const ProgramResult hung = folder.run({"campaign", "--cells", "1", "--out", "c", "--cell-limit", "0.2"});
  INFO(hung.err);
  CHECK(hung.exit_code == 70);
  const Json summary = folder.read_json("c/summary.json");
  CHECK(summary["outcomes"]["hung"] == 1);
  CHECK_THAT(summary["reasons"][0]["reason"].get<std::string>(), Contains("0.2 s"));
  CHECK(std::filesystem::exists(folder / "c/kept/seed-1/console.txt"));
}

TEST_CASE("what a campaign refuses", "[scenario]") {
  JobFolder folder;
  const auto refused = [&](const std::vector<std::string>& all, int exit_code) {
    const ProgramResult run = folder.run(all);
    INFO(run.err);
    CHECK(run.exit_code == exit_code);
    CHECK(run.out.empty());
    return run.err;
  };
  CHECK_THAT(refused({"campaign"}, 2), Contains("--cells"));
  CHECK_THAT(refused(words("0", "c"), 2), Contains("--cells 0"));
  CHECK_THAT(refused(words("2", "c", {"--shard", "5/4"}), 2), Contains("--shard 5/4"));
  CHECK_THAT(refused(words("2", "c", {"--shard", "1/2", "--merge"}), 2), Contains("--merge"));
  CHECK_THAT(refused({"campaign", "--cells", "2", "--faults", "depth.dorp=1"}, 2), Contains("'depth.drop'"));
  CHECK_THAT(refused(words("2", "/proc/campaign"), 3), Contains("/proc/campaign"));
  CHECK_THAT(refused(words("2", "c", {"--json", "nowhere/summary.json"}), 3), Contains("nowhere"));
  CHECK_THAT(refused(words("2", "c", {"--merge"}), 3), Contains("no finished cells"));
  CHECK(folder.names().empty());

  REQUIRE(folder.run(words("1", "c")).exit_code == 0);
  const std::string before = folder.read("c/cells.jsonl");
  CHECK_THAT(refused({"campaign", "--cells", "1", "--seed", "3", "--out", "c"}, 3),
             Contains("E6103") && Contains("--faults 'operator.stop_at=2', not ''"));
  CHECK_THAT(refused({"campaign", "--cells", "1", "--seed", "4", "--out", "c", "--faults", kShort}, 3),
             Contains("--seed '3', not '4'"));
  CHECK(folder.read("c/cells.jsonl") == before);

  folder.options.file_bytes_max = 20'000;  // the runs' files do not fit, the campaign's own do
  CHECK_THAT(refused(words("1", "full"), 3), Contains("E1002") && Contains("seed 3"));
  CHECK(cells_in(folder, "full/cells.jsonl").empty());
}

}  // namespace firstlook
