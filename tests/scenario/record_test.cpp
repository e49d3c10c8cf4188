/// What a run tells about itself: its files agree with each other, and every figure means what app/report/README.md
/// says.
#include <cmath>
#include <sstream>

#include "tests/support/job_run.hpp"

namespace firstlook {
using test::JobFolder;
using test::Json;

namespace {

struct Row {
  std::string phase;
  double time_s = 0, expected = 0, seen = 0, unknown = 0, free = 0, occupied = 0;
};

std::vector<Row> rows_of(const std::string& csv) {
  std::istringstream file(csv);
  std::vector<Row> rows;
  std::string line;
  std::getline(file, line);  // header
  while (std::getline(file, line)) {
    std::istringstream stream(line);
    std::vector<std::string> cells;
    for (std::string cell; std::getline(stream, cell, ',');) cells.push_back(cell);
    REQUIRE(cells.size() == 14);
    rows.push_back({cells[1], std::stod(cells[2]), std::stod(cells[9]), std::stod(cells[10]), std::stod(cells[11]),
                    std::stod(cells[12]), std::stod(cells[13])});
  }
  return rows;
}

/// Pearson's; of the looks that something was expected of.
double correlation_of_gains(const std::vector<Row>& rows) {
  double n = 0, x = 0, y = 0, xx = 0, yy = 0, xy = 0;
  for (const Row& r : rows) {
    if (r.expected <= 0) continue;
    n += 1, x += r.expected, y += r.seen;
    xx += r.expected * r.expected, yy += r.seen * r.seen, xy += r.expected * r.seen;
  }
  return (n * xy - x * y) / std::sqrt((n * xx - x * x) * (n * yy - y * y));
}

void check_views(const std::vector<Row>& rows, const Json& mapping) {
  REQUIRE(rows.size() > 20);
  CHECK(mapping["views"] == rows.size());
  const Row& last = rows.back();
  CHECK(last.phase == "end");
  CHECK(mapping["voxels"]["unknown"] == last.unknown);
  CHECK(mapping["voxels"]["free"] == last.free);
  CHECK(mapping["voxels"]["occupied"] == last.occupied);
  const double zone = last.unknown + last.free + last.occupied;
  double unknown = zone;
  for (const Row& r : rows) {
    CHECK(r.unknown + r.free + r.occupied == zone);
    CHECK(r.seen == unknown - r.unknown);
    unknown = r.unknown;
  }
  CHECK(rows.front().expected == 0);
  CHECK(correlation_of_gains(rows) > 0.8);
  const Json& grid = mapping["grid_voxels"];
  for (const char* name : {"unknown", "free", "occupied"}) {
    CHECK(grid[name].get<double>() >= mapping["voxels"][name].get<double>());
  }
}

void check_safety(const Json& safety) {
  const double calibrating_m = safety["min_clearance_calibrating_m"], mapping_m = safety["min_clearance_mapping_m"];
  CHECK(safety["min_clearance_m"] == std::min(calibrating_m, mapping_m));
  CHECK(calibrating_m > 0);
  CHECK(mapping_m > 0);
  // Both are distances, not margins: nothing stood nearer than what the calibration's motions keep from surfaces, and
  // the arm, which starts inside the safe zone, is never far from all that is not free.
  CHECK(calibrating_m < 0.2);
  CHECK(mapping_m < safety["clearance_m"].get<double>());
}

}  // namespace

TEST_CASE("the record of a run agrees with itself", "[scenario]") {
  const JobFolder folder;
  REQUIRE(folder.run_job("out").exit_code == 0);
  const Json result = folder.read_json("out/result.json");

  CHECK(result["outcome"] == "done");
  const std::string reason = result["reason"];
  CHECK(reason.starts_with("camera known to "));
  CHECK(reason.ends_with(" views"));

  std::vector<std::string> phases;
  double end_s = 0;
  for (const Json& phase : result["phases"]) {
    phases.push_back(phase["name"]);
    CHECK(phase["start_s"] == end_s);
    end_s = phase["end_s"];
  }
  CHECK(phases == std::vector<std::string>{"Boot", "Ready", "LocateBoard", "IdentifyLink", "Collect", "Solve",
                                           "Validate", "Sweep", "Explore", "VerifyBoard", "Park", "Report"});

  check_views(rows_of(folder.read("out/views.csv")), result["mapping"]);
  check_safety(result["safety"]);
  CHECK(result["hand_eye"]["holdout_rms_px"] > result["hand_eye"]["reprojection_rms_px"]);
  const Json& wall = result["wall"];
  CHECK(wall["real_time"] == false);
  // One look with its integration (80 ms) for each view and one choice (100 ms at least) before the next.
  CHECK(wall["stall_s"] > 0.18 * (result["mapping"]["views"].get<double>() - 2));
  CHECK(wall["stall_s"] < 0.5 * end_s);
  CHECK(wall["job_heap_peak_bytes"] > 100'000);
  CHECK(wall["boot_heap_bytes"] > 10'000'000);
  CHECK(wall["boot_heap_bytes"] < result["memory"]["budget_bytes"]);
}

}  // namespace firstlook
