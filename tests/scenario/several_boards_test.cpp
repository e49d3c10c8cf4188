/// The whole calibration in a cell with several boards, no two of which must be in one picture.
#include <fmt/format.h>

#include <algorithm>

#include "algorithms/calibration/calibration_view.hpp"
#include "hal/sim/cell_file.hpp"
#include "tests/support/job_run.hpp"

namespace firstlook {
using test::JobFolder;
using test::Json;

namespace {

/// Two boards side by side and one behind the arm.
const std::string kCell = R"(walls: {low_m: [-2, -2], high_m: [2, 2], height_m: 2.6}
boards:
  - {name: grid, type: apriltag, inner_columns: 5, inner_rows: 4, square_size_m: 0.05,
     center_m: [0.89, 0.45, 0.42], faces: [-0.89, -0.45, 0.35]}
  - {name: checker, inner_columns: 9, inner_rows: 6, square_size_m: 0.03,
     center_m: [0.66, 0.76, 0.42], faces: [-0.66, -0.76, 0.35]}
  - {name: behind, inner_columns: 7, inner_rows: 4, square_size_m: 0.035,
     center_m: [-0.74, 0.67, 0.42], faces: [0.74, -0.67, 0.35]}
)";

Pose pose_of(const Json& json) {
  const auto t = json["translation_m"].get<std::vector<double>>();
  const auto q = json["quaternion_xyzw"].get<std::vector<double>>();
  Pose pose = Pose::Identity();
  pose.translation() = Eigen::Vector3d(t[0], t[1], t[2]);
  pose.linear() = Eigen::Quaterniond(q[3], q[0], q[1], q[2]).toRotationMatrix();
  return pose;
}

/// Each axis of an estimate within `sigmas` of the truth.
void check_pose(const Json& json, const Pose& truth, double sigmas) {
  const Vector6d off = pose_difference(truth, pose_of(json));
  for (int axis = 0; axis < 3; ++axis) {
    const auto at = static_cast<std::size_t>(axis);
    CHECK(1e3 * std::abs(off[axis]) < sigmas * json["sigma_translation_mm"][at].get<double>());
    CHECK(1e3 * std::abs(off[3 + axis]) < sigmas * json["sigma_rotation_mrad"][at].get<double>());
  }
}

void check_result(const Json& result) {
  const Json& hand_eye = result["hand_eye"];
  CHECK(result["outcome"] == "done");
  CHECK(hand_eye["verdict"] == "accepted");
  CHECK(result["truth"]["hand_eye_mahalanobis2"] < 22.5);  // 0.1 % of right ones exceed it
  CHECK(result["truth"]["contacts"] == 0);
  CHECK(result["truth"]["unknown_entries"] == 0);
  const auto scene = sim::parse_cell(kCell, "cell.yaml", 1).value();
  REQUIRE(hand_eye["targets"].size() == 3);
  CHECK_THAT(std::string(result["reason"]), Catch::Contains("views of 3 boards"));
  REQUIRE(hand_eye["mutual_poses"].size() == 3);
  for (std::size_t k = 0; k < 3; ++k) {
    CHECK(hand_eye["targets"][k]["name"] == scene.boards[k].name);
    CHECK(hand_eye["targets"][k]["views"] >= 3);
  }
  const auto truth_of = [&](const Json& name) {
    return std::ranges::find(scene.boards, name.get<std::string>(), &sim::BoardPlacement::name)->base_T_board;
  };
  for (const Json& mutual : hand_eye["mutual_poses"]) {
    check_pose(mutual, (truth_of(mutual["from"]).inverse() * truth_of(mutual["to"])).pose(), 4.5);
    for (std::size_t axis = 0; axis < 3; ++axis) CHECK(mutual["sigma_translation_mm"][axis] < 1.0);
  }
}

}  // namespace

TEST_CASE("several boards: found, solved together with their mutual poses, replayed", "[scenario]") {
  const JobFolder folder;
  folder.write("cell.yaml", kCell);
  const auto run = [&](const std::string& out, const std::vector<std::string>& more) {
    std::vector<std::string> words = {"run", "--cell", "cell.yaml", "--seed", "1", "--only", "calibrate", "--out", out};
    words.insert(words.end(), more.begin(), more.end());
    return folder.run(words);
  };
  const auto full = run("full", {"--record"});
  INFO(full.err);
  REQUIRE(full.exit_code == 0);
  const Json result = folder.read_json("full/result.json");
  check_result(result);
  CHECK_THAT(folder.read("full/report.html"), Catch::Contains("Where the targets are") && Catch::Contains("behind"));
  CHECK(folder.run({"replay", "full/journal.flj"}).exit_code == 0);

  // The recording solves to the same within what single pictures differ from the mean of three frames.
  const auto again = folder.run({"calibrate", "--dataset", "full/dataset", "--json"});
  INFO(again.err);
  REQUIRE(again.exit_code == 0);
  const Json solved = Json::parse(again.out);
  CHECK(solved["views"] == result["hand_eye"]["views"]);
  CHECK(solved["views_given"] == result["hand_eye"]["views_given"]);
  check_pose(solved, pose_of(result["hand_eye"]), 1.5);
  for (std::size_t i = 0; i < 3; ++i) {
    check_pose(solved["mutual_poses"][i], pose_of(result["hand_eye"]["mutual_poses"][i]), 2);
  }

  const auto fast = run("fast", {"--sensor", "fast", "--record"});
  INFO(fast.err);
  REQUIRE(fast.exit_code == 0);
  const Json by_corners = folder.read_json("fast/result.json");
  check_result(by_corners);
  // Corners are recorded as they were averaged: the same result to their digits.
  const auto corners = folder.run({"calibrate", "--dataset", "fast/dataset", "--json"});
  REQUIRE(corners.exit_code == 0);
  check_pose(Json::parse(corners.out), pose_of(by_corners["hand_eye"]), 0.2);
}

TEST_CASE("one of several boards that moved between calibration and the end rejects the map", "[scenario]") {
  const JobFolder folder;
  folder.write("cell.yaml", kCell);
  const std::vector<std::string> job = {"run", "--cell", "cell.yaml", "--seed", "1", "--sensor", "fast", "--out"};
  const auto and_more = [&](std::vector<std::string> more) {
    more.insert(more.begin(), job.begin(), job.end());
    return folder.run(more);
  };
  REQUIRE(and_more({"calibrated", "--only", "calibrate"}).exit_code == 0);
  const Json phases = folder.read_json("calibrated/result.json")["phases"];
  const auto park = std::ranges::find(phases, "Park", [](const Json& phase) { return phase["name"]; });
  REQUIRE(park != phases.end());
  const double mapping_s = (*park)["start_s"].get<double>() + 20;  // some time after mapping has begun
  const auto moved = and_more({"out", "--faults", fmt::format("board.move_at={},board.number=3", mapping_s)});
  INFO(moved.err);
  CHECK(moved.exit_code == 6);
  CHECK_THAT(std::string(folder.read_json("out/result.json")["reason"]), Catch::Contains("board moved"));
}

TEST_CASE("boards of the configuration hang where the cell has boards of their names", "[scenario]") {
  const JobFolder folder;
  folder.write("cell.yaml", kCell);
  folder.write("one.yaml", "cell: cell.yaml\nboard: {type: charuco}\n");
  const auto refused = folder.run({"run", "--config", "one.yaml", "--out", "a"});
  CHECK(refused.exit_code == 3);
  CHECK_THAT(refused.err, Catch::Contains("grid, checker, behind"));
  folder.write("two.yaml", "cell: cell.yaml\nboards:\n  - {name: checker}\n  - {name: door, type: apriltag}\n");
  CHECK_THAT(folder.run({"run", "--config", "two.yaml", "--out", "b"}).err, Catch::Contains("a board 'door'"));
}

}  // namespace firstlook
