/// Touches in recorded data: read strictly, tested, told in result.json and the report.
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "app/cli/calibrate_command.hpp"
#include "app/dataset/calibration_dataset.hpp"
#include "tests/support/recorded_data.hpp"
#include "tests/unit/calibration/synthetic_touches.hpp"

using namespace firstlook;
using Catch::Matchers::Contains;
using test::DataFolder;
using test::Setup;
using test::Toucher;
namespace fs = std::filesystem;

namespace {

/// Views and, of the first of them, four more looks from the same place.
void write_views(const DataFolder& folder, const Setup& s, Random& random, const CameraIntrinsics& said_camera) {
  std::string poses = test::kPosesHeader, corners = "image,column,row,u_px,v_px\n";
  CalibrationView first;
  for (int i = 0; i < 19; ++i) {
    const Pose flange = test::flange_for(s, test::random_camera_T_board(s, random));
    CalibrationView view = test::observe(s, flange, random);
    if (i == 0) first = view;
    if (i >= 15) {  // the same place
      const Eigen::Vector2d scatter(0.05, 0.05);
      view = first;
      for (Eigen::Vector2d& px : view.corners_px) {
        px += scatter.cwiseProduct(Eigen::Vector2d(random.normal(), random.normal()));
      }
    }
    poses += fmt::format("{}.png,{}\n", i, test::numbers(view.base_T_flange.pose()));
    for (int c = 0; c < s.board.corners(); ++c) {
      const Eigen::Vector2d& px = view.corners_px[static_cast<std::size_t>(c)];
      corners += test::corner_row(i, c, s.board.inner_columns, px);
    }
  }
  folder.write("board.yaml", board_yaml(s.board));
  folder.write("camera_info.yaml", test::camera_yaml(said_camera));
  folder.write("poses.csv", poses);
  folder.write("corners.csv", corners);
}

std::string touches_csv(const BoardSpec& board, const std::vector<Touch>& touches) {
  std::string text = "column,row,x,y,z,qx,qy,qz,qw\n";
  for (const Touch& t : touches) {
    text += fmt::format("{},{},{}\n", t.corner % board.inner_columns, t.corner / board.inner_columns,
                        test::numbers(t.base_T_flange.pose()));
  }
  return text;
}

std::string tip_yaml(const TipOffset& tip) {
  const Eigen::Vector3d& p = tip.flange_p_tip_m;
  return fmt::format("flange_p_tip_m: [{}, {}, {}]\nsigma_m: {}\n", p.x(), p.y(), p.z(), tip.sigma_m);
}

struct Outcome {
  int code = 0;
  nlohmann::json hand_eye, touch;
  std::string report;
};

Outcome calibrate(const DataFolder& folder, const std::string& out) {
  CalibrateCommandOptions options;
  options.dataset = folder.path().string();
  options.out = (folder.path() / out).string();
  options.strict = true;
  Outcome outcome;
  outcome.code = run_calibrate_command(options);
  if (outcome.code == 3) return outcome;
  outcome.hand_eye = nlohmann::json::parse(folder.read(out + "/result.json"))["hand_eye"];
  outcome.touch = outcome.hand_eye["touch_test"];
  outcome.report = folder.read(out + "/report.html");
  return outcome;
}

}  // namespace

TEST_CASE("touches of recorded data test the calibration, the tip given or estimated", "[app][calibration]") {
  const Setup s;
  const Toucher toucher;
  const DataFolder folder;
  Random random(81);
  write_views(folder, s, random, s.camera);
  const Outcome untouched = calibrate(folder, "untouched");
  CHECK(untouched.code == 0);
  CHECK(untouched.touch.is_null());
  CHECK_THAT(untouched.report, !Contains("Touch test"));

  auto touches = test::touch(s, toucher, test::spread_corners(s.board, 2), random);
  const int stood_on = touches[5].corner;
  touches[5].corner += 1;
  folder.write("touches.csv", touches_csv(s.board, touches));
  for (const bool tip_given : {false, true}) {
    CAPTURE(tip_given);
    if (tip_given) folder.write("tip.yaml", tip_yaml(test::measured_tip(toucher, 2e-4, random)));
    const Outcome good = calibrate(folder, tip_given ? "given" : "estimated");
    CHECK(good.code == 0);
    CHECK(good.hand_eye["verdict"] == "accepted");
    CHECK(good.touch["agrees"] == true);
    CHECK(good.touch["tip"]["source"] == (tip_given ? "given" : "estimated"));
    for (std::size_t i = 0; i < 3; ++i) {
      const double tip_off =
          good.touch["tip"]["flange_p_tip_m"][i].get<double>() - toucher.flange_p_tip_m[static_cast<Eigen::Index>(i)];
      CHECK(std::abs(tip_off) < 5e-3 * good.touch["tip"]["sigma_mm"][i].get<double>());
      const double error = good.touch["error"]["translation_mm"][i],
                   sigma = good.touch["error_sigma"]["translation_mm"][i];
      CHECK(std::abs(error) < 4 * sigma);
    }
    CHECK(good.touch["touches_used"] == 11);
    CHECK(good.touch["touches"][5]["used"] == false);
    CHECK(good.touch["touches"][5]["stood_on_point"] == stood_on);
    CHECK(good.touch["horn_residual_rms_mm"].get<double>() == Approx(0.5).margin(0.2));
    CHECK(good.touch["views"] == 15);
    CHECK(good.touch["static_looks"] == 5);
    CHECK(good.touch["errors"].size() == 19);
    const auto& over_views = good.touch["error_deviation_over_views"]["translation_mm"];
    const auto& at_rest = good.touch["error_deviation_static"]["translation_mm"];
    CHECK(at_rest[2].get<double>() > 0.01);
    CHECK(at_rest[0].get<double>() < over_views[0].get<double>());
    CHECK_THAT(good.report, Contains("<h2>Touch test</h2>") && Contains("left out: the tip stood on corner (") &&
                                Contains("std over views") && !Contains("nan"));
  }
}

TEST_CASE("touches that contradict the calibration reject it, with the reason", "[app][calibration]") {
  const Setup s;
  const Toucher toucher;
  const DataFolder folder;
  Random random(82);
  write_views(folder, s, random, s.camera);
  CHECK(calibrate(folder, "untouched").code == 0);
  Setup moved = s;  // after the views
  moved.base_T_board.pretranslate(Eigen::Vector3d(0, 0.004, 0));
  folder.write("touches.csv",
               touches_csv(s.board, test::touch(moved, toucher, test::spread_corners(s.board, 2), random)));
  folder.write("tip.yaml", tip_yaml({toucher.flange_p_tip_m, 1e-4}));
  const Outcome bad = calibrate(folder, "touched");
  CHECK(bad.code == 5);
  CHECK(bad.hand_eye["verdict"] == "rejected");
  CHECK_THAT(bad.hand_eye["reasons"][0].get<std::string>(), Contains("the touch test contradicts the calibration"));
  CHECK_FALSE(fs::exists(folder.path() / "touched/ros"));
  CHECK_THAT(bad.report, Contains("the touch test contradicts the calibration"));
}

TEST_CASE("broken touches are refused with file and line", "[app][calibration][hostile]") {
  const Setup s;
  const DataFolder folder;
  Random random(83);
  write_views(folder, s, random, s.camera);
  const auto touches = test::touch(s, {}, test::spread_corners(s.board, 2), random);
  const std::string good = touches_csv(s.board, touches);
  const auto refusal = [&](const std::string& csv) {
    folder.write("touches.csv", csv);
    const auto data = read_calibration_dataset(folder.path());
    return data ? std::string("read") : std::string(data.error().detail());
  };
  const std::string head = "column,row,x,y,z,qx,qy,qz,qw\n", pose = "0.5,0,0.3,0,0,0,1\n";
  CHECK(refusal(good) == "read");
  CHECK_THAT(refusal("column,row,x,y,z,qx,qy,qz\n"), Contains("touches.csv:1: no column 'qw'"));
  CHECK_THAT(refusal(head), Contains("touches.csv: no touches"));
  CHECK_THAT(refusal(head + "8,0," + pose), Contains("touches.csv:2: corner column 8 row 0 on a board of 8x6"));
  CHECK_THAT(refusal(head + "0,-1," + pose), Contains("column 0 row -1"));
  CHECK_THAT(refusal(head + "1.5,0," + pose), Contains("column 1.5"));
  CHECK_THAT(refusal(head + "0,0,500,0,300,0,0,0,1\n"), Contains("touches.csv:2: a position 583 m away"));
  CHECK_THAT(refusal(head + "0,0,0.5,0,0.3,0,0,0,2\n"), Contains("a quaternion of length 2.0000"));
  CHECK_THAT(refusal(head + "0,x," + pose), Contains("touches.csv:2: row is 'x', not a finite number"));
  std::string many = head;
  for (int i = 0; i < 21; ++i) many += fmt::format("{},{},{}", i % 8, i / 8, pose);
  CHECK_THAT(refusal(many), Contains("touches.csv: 21 touches, at most 20 are taken"));

  folder.write("touches.csv", good);
  const auto tip_refusal = [&](const std::string& yaml) {
    folder.write("tip.yaml", yaml);
    const auto data = read_calibration_dataset(folder.path());
    return data ? std::string("read") : std::string(data.error().detail());
  };
  CHECK(tip_refusal("flange_p_tip_m: [0, 0, 0.14]\n") == "read");
  CHECK_THAT(tip_refusal("flange_p_tip_m: [0, 0, 140]\n"), Contains("tip.yaml:1: a tip 140 m from the flange"));
  CHECK_THAT(tip_refusal("flange_p_tip_m: [0, 0]\n"), Contains("tip.yaml:1: flange_p_tip_m has 2 numbers"));
  CHECK_THAT(tip_refusal("flange_p_tip_m: [0, 0, .nan]\n"), Contains("tip.yaml:1"));
  CHECK_THAT(tip_refusal("sigma_m: 0.001\n"), Contains("no key 'flange_p_tip_m'"));
  CHECK_THAT(tip_refusal("flange_p_tip_m: [0, 0, 0.1]\nsigma: 1\n"), Contains("tip.yaml:2: unknown key 'sigma'"));
  CHECK_THAT(tip_refusal("flange_p_tip_m: [0, 0, 0.1]\nsigma_m: -1\n"), Contains("tip.yaml:2: sigma_m must lie in"));
  fs::remove(folder.path() / "tip.yaml");

  // Read well, but of one orientation: nothing tells the tip.
  test::Toucher stiff;
  stiff.tilt_max_rad = 0;
  folder.write("touches.csv", touches_csv(s.board, test::touch(s, stiff, test::spread_corners(s.board, 2), random)));
  CHECK(calibrate(folder, "stiff").code == 3);

  fs::remove(folder.path() / "touches.csv");
  folder.write("tip.yaml", "flange_p_tip_m: [0, 0, 0.14]\n");
  const auto unused = read_calibration_dataset(folder.path());
  REQUIRE(unused);
  CHECK_THAT(unused->notes.back(), Contains("tip.yaml: not used"));
}

TEST_CASE("pose pairs are tested by touch when the board's size is known", "[app][calibration]") {
  const Setup s;
  const Toucher toucher;
  const DataFolder folder;
  Random random(84);
  std::string rows =
      "flange_x,flange_y,flange_z,flange_qx,flange_qy,flange_qz,flange_qw,"
      "board_x,board_y,board_z,board_qx,board_qy,board_qz,board_qw\n";
  for (const PosePair& pair : test::observe_pairs(s, 20, random)) {
    rows += test::numbers(pair.base_T_flange.pose()) + "," + test::numbers(pair.camera_T_board.pose()) + "\n";
  }
  folder.write("pairs.csv", rows);
  folder.write("touches.csv", touches_csv(s.board, test::touch(s, toucher, test::spread_corners(s.board, 2), random)));
  const auto sizeless = read_calibration_dataset(folder.path());
  REQUIRE_FALSE(sizeless);
  CHECK(sizeless.error().fault == Fault::kDataMissing);
  CHECK_THAT(std::string(sizeless.error().detail()), Contains("board.yaml: touches.csv needs it"));
  folder.write("board.yaml", board_yaml(s.board));
  const Outcome tested = calibrate(folder, "out");
  CHECK(tested.code == 0);
  CHECK(tested.touch["agrees"] == true);
}
