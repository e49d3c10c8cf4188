/// A journal that was changed after the run is found out, and replay says where.
#include "tests/support/job_run.hpp"

namespace firstlook {
using test::JobFolder;
using test::ProgramResult;

TEST_CASE("a changed or shortened journal is found out", "[scenario]") {
  const JobFolder folder;
  REQUIRE(folder.run_job("run", {"--faults", "operator.stop_at=20"}).exit_code == 6);
  const std::string journal = folder.read("run/journal.flj");
  const auto replay = [&](const std::string& bytes) {
    folder.write("changed.flj", bytes);
    return folder.run({"replay", "changed.flj"});
  };
  CHECK(replay(journal).exit_code == 0);
  for (const double share : {0.001, 0.3, 0.6, 0.999}) {
    std::string flipped = journal;
    const auto at = static_cast<std::size_t>(share * static_cast<double>(journal.size()));
    flipped[at] = static_cast<char>(flipped[at] ^ 0x10);
    const ProgramResult found = replay(flipped);
    INFO(found.err);
    CHECK(found.exit_code == 3);
    CHECK(found.err.find("E1004") != std::string::npos);
    CHECK(found.err.find("byte ") != std::string::npos);
  }
  const ProgramResult cut = replay(journal.substr(0, journal.size() * 6 / 10));
  INFO(cut.err);
  CHECK(cut.exit_code == 3);
  CHECK(cut.err.find("cut short in record") != std::string::npos);
  CHECK(cut.err.find("before it agree, up to 1") != std::string::npos);
  CHECK(replay(journal.substr(0, 40)).exit_code == 3);
  CHECK(replay("").exit_code == 3);
  CHECK(replay(journal + "x").exit_code == 3);
  CHECK(folder.run({"replay", "nowhere.flj"}).exit_code == 3);
  CHECK(folder.run({"replay", "run"}).exit_code == 3);
}

}  // namespace firstlook
