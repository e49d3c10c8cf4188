/// What a campaign finds on disk when it starts again: torn lines, other shards, other campaigns, other processes.
#include "app/campaign/state_file.hpp"

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "tests/support/temporary_folder.hpp"
#include "tests/unit/app/campaign/sample_cells.hpp"

namespace firstlook {
using Catch::Matchers::Contains;
using test::sample_cell;
using test::sample_identity;
using test::TemporaryFolder;

namespace {

std::string read(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}
void write(const std::filesystem::path& file, const std::string& text) {
  std::ofstream(file, std::ios::binary) << text;
}

/// A folder with these cells in one state file.
void fill(const TemporaryFolder& folder, const Shard& shard, const std::vector<int>& indices,
          const CampaignIdentity& identity = sample_identity()) {
  auto state = StateFile::open(folder.path(), shard, identity);
  REQUIRE(state);
  for (const int index : indices) REQUIRE(state->append(sample_cell(index, 0.99)));
}

std::vector<int> indices_in(const TemporaryFolder& folder) {
  const auto finished = read_finished_cells(folder.path(), sample_identity());
  REQUIRE(finished);
  std::vector<int> indices;
  for (const CellRecord& cell : finished->cells) indices.push_back(cell.index);
  return indices;
}

std::string refusal(const TemporaryFolder& folder, const CampaignIdentity& identity) {
  const auto finished = read_finished_cells(folder.path(), identity);
  REQUIRE_FALSE(finished);
  CHECK(finished.error().fault == Fault::kOutputNotEmpty);
  return std::string(finished.error().detail());
}

}  // namespace

TEST_CASE("a cell comes back from its line as it was", "[app][campaign]") {
  CellRecord cell = sample_cell(3, 0.98765432109876543);
  cell.outcome = CellOutcome::kSafelyStopped;
  cell.reason = "E5005 stopped: \"quoted\"\nsecond line \x01";
  cell.figures.hand_eye_error_mm.reset();
  cell.wall.kept = true;
  const std::string line = cell_line(cell);
  CHECK(line.find('\n') == std::string::npos);
  const auto back = parse_cell_line(line);
  REQUIRE(back);
  CHECK(back->index == 3);
  CHECK(back->seed == 13);
  CHECK(back->outcome == CellOutcome::kSafelyStopped);
  CHECK(back->reason == cell.reason);
  CHECK(back->decisions_hash == cell.decisions_hash);
  CHECK(back->remaining == cell.remaining);
  CHECK(back->wall.kept);
  CHECK(back->wall.total_s == cell.wall.total_s);
  CHECK(back->wall.processor_s == cell.wall.processor_s);
  CHECK(back->wall.peak_resident_bytes == cell.wall.peak_resident_bytes);
  for (const FigureColumn& column : kFigureColumns) {
    INFO(column.name);
    CHECK(back->figures.*column.value == cell.figures.*column.value);
  }
  for (const FigureColumn& column : kCountColumns) {
    INFO(column.name);
    CHECK(back->figures.*column.value == cell.figures.*column.value);
  }
}

TEST_CASE("finished cells of all shards come back by index", "[app][campaign]") {
  const TemporaryFolder folder("firstlook-campaign");
  CHECK(indices_in(folder).empty());
  fill(folder, {2, 2}, {5, 1, 3});
  fill(folder, {1, 2}, {4, 0});
  CHECK(std::filesystem::exists(folder.path() / "cells-2-of-2.jsonl"));
  CHECK(indices_in(folder) == std::vector<int>{0, 1, 3, 4, 5});
  fill(folder, {}, {2, 4});  // 4 twice, with one result
  CHECK(indices_in(folder) == std::vector<int>{0, 1, 2, 3, 4, 5});
}

TEST_CASE("wherever a power cut tears the file, the whole lines before stay", "[app][campaign]") {
  const TemporaryFolder folder("firstlook-campaign");
  fill(folder, {}, {0, 1});
  const auto file = folder.path() / "cells.jsonl";
  const std::string whole = read(file);
  std::vector<std::size_t> ends;
  for (std::size_t i = 0; i < whole.size(); ++i) {
    if (whole[i] == '\n') ends.push_back(i + 1);
  }
  REQUIRE(ends.size() == 3);
  for (std::size_t cut = 0; cut <= whole.size(); ++cut) {
    write(file, whole.substr(0, cut));
    const auto finished = read_finished_cells(folder.path(), sample_identity());
    REQUIRE(finished);
    const bool torn = cut != 0 && std::ranges::find(ends, cut) == ends.end();
    if (finished->cells.size() != (cut >= ends[2] ? 2U : cut >= ends[1] ? 1U : 0U) || finished->torn.empty() == torn) {
      FAIL("cut at " << cut);
    }
  }
  write(file, whole.substr(0, ends[2] - 10));
  fill(folder, {}, {1});
  CHECK(read(file) == whole);
  write(file, whole.substr(0, ends[2] - 10) + std::string(9, '\0') + "\n");  // room that was given, but not written
  fill(folder, {}, {1});
  CHECK(read(file) == whole);
  write(file, whole.substr(0, ends[0] - 10));
  fill(folder, {}, {0, 1});
  CHECK(read(file) == whole);
}

TEST_CASE("a broken line that is not the last is an error with its number", "[app][campaign]") {
  const TemporaryFolder folder("firstlook-campaign");
  fill(folder, {}, {0, 1});
  std::string text = read(folder.path() / "cells.jsonl");
  text.insert(text.find('\n') + 1, "{\"index\": 7}\n");
  write(folder.path() / "cells.jsonl", text);
  const auto finished = read_finished_cells(folder.path(), sample_identity());
  REQUIRE_FALSE(finished);
  CHECK(finished.error().fault == Fault::kDataMalformed);
  CHECK_THAT(std::string(finished.error().detail()), Contains("cells.jsonl:2"));
}

TEST_CASE("a folder of another campaign is refused with what differs", "[app][campaign]") {
  const TemporaryFolder folder("firstlook-campaign");
  fill(folder, {1, 2}, {0});
  CampaignIdentity other = sample_identity();
  other.first_seed = 11;
  CHECK_THAT(refusal(folder, other), Contains("--seed '10', not '11'"));
  other = sample_identity();
  other.sensor = "full";
  CHECK_THAT(refusal(folder, other), Contains("--sensor"));
  other = sample_identity();
  other.faults = "depth.drop=0.1";
  CHECK_THAT(refusal(folder, other), Contains("--faults '', not 'depth.drop=0.1'"));
  other = sample_identity();
  other.program = "0.2.0-1";
  CHECK_THAT(refusal(folder, other), Contains("program"));
  other = sample_identity();
  other.configuration = "3";
  CHECK_THAT(refusal(folder, other), Contains("FIRSTLOOK_"));
  CHECK(StateFile::open(folder.path(), {1, 2}, other).error().fault == Fault::kOutputNotEmpty);
}

TEST_CASE("one cell with two results is refused", "[app][campaign]") {
  const TemporaryFolder folder("firstlook-campaign");
  fill(folder, {1, 2}, {0});
  auto state = StateFile::open(folder.path(), {}, sample_identity());
  REQUIRE(state);
  CellRecord cell = sample_cell(0, 0.5);
  cell.decisions_hash = "different";
  REQUIRE(state->append(cell));
  CHECK_THAT(refusal(folder, sample_identity()), Contains("cell 0"));
}

TEST_CASE("a cell with the seed of another is refused", "[app][campaign]") {
  const TemporaryFolder folder("firstlook-campaign");
  auto state = StateFile::open(folder.path(), {}, sample_identity());
  REQUIRE(state);
  CellRecord cell = sample_cell(0, 0.5);
  cell.seed = 99;
  REQUIRE(state->append(cell));
  const auto finished = read_finished_cells(folder.path(), sample_identity());
  REQUIRE_FALSE(finished);
  CHECK(finished.error().fault == Fault::kDataMalformed);
}

TEST_CASE("two processes never run the same cells", "[app][campaign]") {
  const TemporaryFolder folder("firstlook-campaign");
  const auto first = StateFile::open(folder.path(), {1, 2}, sample_identity());
  REQUIRE(first);
  CHECK(StateFile::open(folder.path(), {2, 2}, sample_identity()).has_value());
  for (const Shard& same : {Shard{1, 2}, Shard{}, Shard{1, 4}}) {
    INFO(same.text());
    const auto refused = StateFile::open(folder.path(), same, sample_identity());
    REQUIRE_FALSE(refused);
    CHECK(refused.error().fault == Fault::kOutputNotEmpty);
  }
}

}  // namespace firstlook
