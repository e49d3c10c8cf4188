#include "app/campaign/judge_cell.hpp"

#include <catch2/catch.hpp>
#include <csignal>

namespace firstlook {
using Catch::Matchers::Contains;

namespace {

const char* const kResult = R"({
  "outcome": "done", "reason": "all seen", "seed": 7,
  "phases": [{"name": "Boot", "start_s": 0, "end_s": 0.1}, {"name": "Ready", "start_s": 500, "end_s": 512.5}],
  "decisions_hash": "beef", "hand_eye": {"views": 15},
  "mapping": {"views": 60, "remaining": [{"voxels": 5, "reason": "occluded"}, {"voxels": 2, "reason": "out of reach"},
                                         {"voxels": 4, "reason": "occluded"}]},
  "safety": {"min_clearance_m": 0.02},
  "memory": {"peak_bytes": 1000, "loop_allocations_after_seal": 0}, "wall": {"stall_s": 3},
  "truth": {"contacts": 1, "unknown_entries": 2, "coverage_of_observable": 0.995,
            "to_95": {"time_s": 120.5, "views": 31}, "to_99": null, "hand_eye_error_mm": null}})";

CellTraces traces(int exit_code, const std::string& outcome = "done") {
  CellTraces t;
  t.end.exit_code = exit_code;
  t.limit_s = 60;
  std::string json = kResult;
  t.result_json = json.replace(json.find("done"), 4, outcome);
  t.console = "[ 1.0 s] Boot\n[ 2.0 s] Ready\n";
  return t;
}

CellRecord judged(const CellTraces& t) {
  const auto cell = judge_cell(t, 7);
  REQUIRE(cell);
  return *cell;
}

}  // namespace

TEST_CASE("figures are those of result.json", "[app][campaign]") {
  const CellRecord cell = judged(traces(0));
  CHECK(cell.outcome == CellOutcome::kDone);
  CHECK(cell.reason == "all seen");
  CHECK(cell.decisions_hash == "beef");
  CHECK(cell.figures.coverage_of_observable == 0.995);
  CHECK(cell.figures.robot_time_s == 512.5);
  CHECK(cell.figures.views == 60);
  CHECK(cell.figures.calibration_views == 15);
  CHECK(cell.figures.time_to_95_s == 120.5);
  CHECK(cell.figures.views_to_95 == 31);
  CHECK_FALSE(cell.figures.time_to_99_s);
  CHECK(cell.figures.min_clearance_m == 0.02);
  CHECK(cell.figures.contacts == 1);
  CHECK(cell.figures.unknown_entries == 2);
  CHECK(cell.touched());
  CHECK_FALSE(cell.figures.hand_eye_error_mm);
  CHECK_FALSE(cell.figures.false_free_voxels);
  CHECK(cell.remaining == std::vector<std::pair<std::string, std::uint64_t>>{{"occluded", 9}, {"out of reach", 2}});
}

TEST_CASE("an outcome has the exit code of its run", "[app][campaign]") {
  CHECK(judged(traces(5, "calibration_rejected")).outcome == CellOutcome::kCalibrationRejected);
  CHECK(judged(traces(6, "safely_stopped")).outcome == CellOutcome::kSafelyStopped);
  CHECK(judged(traces(70, "faulted")).outcome == CellOutcome::kFaulted);
  CHECK(judged(traces(4, "faulted")).outcome == CellOutcome::kFaulted);
  for (const auto& [exit_code, outcome] : {std::pair{70, "done"}, {0, "safely_stopped"}, {6, "done"}, {0, "faulted"}}) {
    const CellRecord cell = judged(traces(exit_code, outcome));
    CHECK(cell.outcome == CellOutcome::kFailed);
    CHECK_THAT(cell.reason, Contains(outcome) && Contains(std::to_string(exit_code)));
    CHECK_FALSE(cell.figures.coverage_of_observable);
  }
}

TEST_CASE("a crash is told with its signal and the last words", "[app][campaign]") {
  CellTraces t = traces(0);
  t.end.signal = SIGSEGV;
  CellRecord cell = judged(t);
  CHECK(cell.outcome == CellOutcome::kCrashed);
  CHECK_THAT(cell.reason, Contains("signal 11 (Segmentation fault)") && Contains("[ 2.0 s] Ready"));
  CHECK_FALSE(cell.figures.contacts);  // a crashed grader has not graded

  t = traces(70);
  t.result_json.reset();
  t.console = "a line\nfirstlook: ENSURE 2107 failed: count > 0 (a.cpp:3)\n";
  cell = judged(t);
  CHECK(cell.outcome == CellOutcome::kFailed);
  CHECK_THAT(cell.reason, Contains("exit code 70") && Contains("ENSURE 2107"));

  t.console.clear();
  CHECK(judged(t).reason == "exit code 70 and no result.json");
  t.console = std::string(100'000, 'x');
  CHECK(judged(t).reason.size() < 400);
}

TEST_CASE("a cell that was ended at its limit hangs, one that ended just before does not", "[app][campaign]") {
  CellTraces t = traces(0);
  t.at_limit = true;
  CHECK(judged(t).outcome == CellOutcome::kDone);
  t.end.signal = SIGKILL;
  const CellRecord cell = judged(t);
  CHECK(cell.outcome == CellOutcome::kHung);
  CHECK_THAT(cell.reason, Contains("60 s"));
}

TEST_CASE("a result that cannot be this cell's is a failure", "[app][campaign]") {
  for (const char* text : {"", "{", "[]", "{\"outcome\": \"done\"}", "{\"outcome\": \"hung\", \"seed\": 7}"}) {
    CellTraces t = traces(0);
    t.result_json = text;
    CHECK(judged(t).outcome == CellOutcome::kFailed);
  }
  const auto other = judge_cell(traces(0), 8);
  REQUIRE(other);
  CHECK(other->outcome == CellOutcome::kFailed);
}

TEST_CASE("a full disk says nothing about the cell", "[app][campaign]") {
  CellTraces t = traces(3, "safely_stopped");
  t.console = "firstlook: E1002 journal.flj: No space left on device\n  Free disk space\n";
  const auto cell = judge_cell(t, 7);
  REQUIRE_FALSE(cell);
  CHECK(cell.error().fault == Fault::kDiskWrite);
  CHECK_THAT(std::string(cell.error().detail()), Contains("No space left"));
  t.console = "firstlook: E6104 the cell cannot be used\n";
  t.result_json.reset();
  CHECK(judged(t).outcome == CellOutcome::kFailed);
}

}  // namespace firstlook
