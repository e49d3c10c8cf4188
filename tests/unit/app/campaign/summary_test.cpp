#include "app/campaign/summary.hpp"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "app/campaign/campaign.hpp"
#include "tests/unit/app/campaign/sample_cells.hpp"

namespace firstlook {
using Catch::Matchers::Contains;
using test::sample_campaign;
using test::sample_cell;
using Json = nlohmann::ordered_json;

namespace {

/// Twelve cells of fourteen, with one of each kind that is not as it should be.
CampaignCells mixed() {
  std::vector<CellRecord> cells;
  for (int i = 0; i < 12; ++i) cells.push_back(sample_cell(i, i < 10 ? 1 - 0.001 * i : 0.97));
  cells[3].figures.contacts = 2;
  cells[4].figures.unknown_entries = 5;
  cells[11].outcome = CellOutcome::kCrashed;
  cells[11].reason = "signal 11";
  cells[11].figures = {};
  cells[11].decisions_hash.clear();
  return sample_campaign(cells, 14);
}

}  // namespace

TEST_CASE("quantiles are those of NumPy", "[app][campaign]") {
  CHECK_FALSE(distribution({}));
  const auto one = distribution({3});
  REQUIRE(one);
  CHECK(one->min == 3);
  CHECK(one->p5 == 3);
  CHECK(one->max == 3);
  const auto d = distribution({10, 1, 2, 7, 4});  // np.quantile([1, 2, 4, 7, 10], [0.05, 0.5, 0.95])
  REQUIRE(d);
  CHECK(d->cells == 5);
  CHECK(d->min == 1);
  CHECK(d->p5 == Approx(1.2));
  CHECK(d->median == 4);
  CHECK(d->p95 == Approx(9.4));
  CHECK(d->max == 10);
  CHECK(d->mean == Approx(4.8));
  CHECK(distribution({1, 2})->median == Approx(1.5));
}

TEST_CASE("the summary counts cells by how they ended", "[app][campaign]") {
  const Json json = Json::parse(summary_json(mixed()));
  CHECK(json["cells"] == Json({{"asked", 14}, {"finished", 12}, {"missing", 2}, {"broken", 3}}));
  CHECK(json["outcomes"]["done"] == 11);
  CHECK(json["outcomes"]["crashed"] == 1);
  CHECK(json["outcomes"]["hung"] == 0);
  REQUIRE(json["reasons"].size() == 1);
  CHECK(json["reasons"][0]["reason"] == "signal 11");
  CHECK(json["reasons"][0]["seeds"] == Json({21}));
  CHECK(json["safety"]["cells_graded"] == 11);
  CHECK(json["safety"]["contacts"] == 2);
  CHECK(json["safety"]["unknown_entries"] == 5);
  REQUIRE(json["safety"]["cells_with_contacts_or_entries"].size() == 2);
  CHECK(json["safety"]["cells_with_contacts_or_entries"][0]["seed"] == 13);
}

TEST_CASE("coverage is a share of all cells, with the reasons of the others", "[app][campaign]") {
  const Json json = Json::parse(summary_json(mixed()));
  CHECK(json["coverage"]["at_least_0_99"]["cells"] == 10);
  CHECK(json["coverage"]["at_least_0_99"]["share"].get<double>() == Approx(10.0 / 12));
  CHECK(json["coverage"]["at_least_0_95"]["cells"] == 11);
  const Json& below = json["coverage"]["below_0_99"];
  REQUIRE(below.size() == 2);
  CHECK(below[0]["seed"] == 20);
  CHECK(below[0]["remaining"]["occluded"] == 12);
  CHECK(below[1]["coverage_of_observable"].is_null());
  CHECK(below[1]["reason"] == "signal 11");
}

TEST_CASE("the worst ten come with the command that reproduces them", "[app][campaign]") {
  const Json json = Json::parse(summary_json(mixed()));
  const Json& coverage = json["worst"]["coverage_of_observable"];
  REQUIRE(coverage.size() == 10);
  CHECK(coverage[0]["seed"] == 20);
  CHECK(coverage[1]["seed"] == 19);
  CHECK(coverage[0]["command"] == "firstlook run --cell random:20 --seed 20 --sensor fast --workers 1");
  CHECK(json["worst"]["robot_time_s"][0]["seed"] == 20);
  CHECK(json["worst"]["robot_time_s"][0]["value"] == 110.5);
  CHECK(json["worst"]["false_free_voxels"][0]["seed"] == 10);  // equal: the first
  CHECK(json["figures"]["views"]["cells"] == 11);
  CHECK(json["figures"]["views"]["median"] == 45);
  CHECK(json["figures"]["calibration_views"].is_null());
}

TEST_CASE("only wall differs between computers", "[app][campaign]") {
  CampaignCells slow = mixed();
  for (CellRecord& cell : slow.finished) cell.wall = {99, 98, 97, true};
  Json a = Json::parse(summary_json(mixed())), b = Json::parse(summary_json(slow));
  CHECK(a != b);
  CHECK(b["wall"]["kept_seeds"].size() == 12);
  CHECK(b["wall"]["cells_per_minute_per_core"]["by_clock"].get<double>() == Approx(60.0 / 99));
  CHECK(b["wall"]["cells_per_minute_per_core"]["by_processor_time"].get<double>() == Approx(60.0 / 98));
  a.erase("wall");
  b.erase("wall");
  CHECK(a == b);
}

TEST_CASE("what breaks a campaign", "[app][campaign]") {
  const auto broken = [](auto change) {
    CellRecord cell = sample_cell(0, 1);
    change(cell);
    const CampaignCells cells = sample_campaign({cell}, 1);
    return std::pair(cells.broken(), notable(cell));
  };
  CHECK(broken([](CellRecord&) {}) == std::pair(0, false));
  CHECK(broken([](CellRecord& c) { c.outcome = CellOutcome::kSafelyStopped; }) == std::pair(0, true));
  CHECK(broken([](CellRecord& c) { c.outcome = CellOutcome::kCalibrationRejected; }) == std::pair(0, true));
  CHECK(broken([](CellRecord& c) { c.figures.contacts = 1; }) == std::pair(1, true));
  CHECK(broken([](CellRecord& c) { c.figures.unknown_entries = 1; }) == std::pair(1, true));
  CHECK(broken([](CellRecord& c) { c.reason.clear(); }) == std::pair(1, false));
  for (const CellOutcome bad :
       {CellOutcome::kFaulted, CellOutcome::kCrashed, CellOutcome::kHung, CellOutcome::kFailed}) {
    CHECK(broken([bad](CellRecord& c) { c.outcome = bad; }) == std::pair(1, true));
  }
}

TEST_CASE("the table names what must be looked at", "[app][campaign]") {
  const std::string table = summary_table(mixed());
  CHECK_THAT(table, Contains("12 of 14 cells") && Contains("11 done, 1 crashed"));
  CHECK_THAT(table, Contains("2 contacts, 5 entries") && Contains("10 of 12 cells know 99 %"));
  CHECK_THAT(table, Contains("seed 13: done, CONTACT OR ENTRY") && Contains("random:21"));
  CHECK_THAT(summary_table(sample_campaign({}, 3)), Contains("none finished"));
  CHECK(Json::parse(summary_json(sample_campaign({}, 3)))["cells"]["missing"] == 3);
}

}  // namespace firstlook
