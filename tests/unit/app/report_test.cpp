/// The files of a run: the contract of result.json, what is written when, and that data never become markup.
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>

#include "app/report/done_text.hpp"
#include "app/report/html.hpp"
#include "app/report/picture_bytes.hpp"
#include "app/report/report_html.hpp"
#include "app/report/result_json.hpp"
#include "app/report/run_files.hpp"
#include "tests/unit/app/sample_record.hpp"

using namespace firstlook;
using Catch::Matchers::Contains;
using nlohmann::ordered_json;

namespace {

std::filesystem::path fresh_folder(const std::string& name) {
  const auto folder = std::filesystem::temp_directory_path() / ("firstlook_report_test_" + name);
  std::filesystem::remove_all(folder);
  return folder;
}

std::string text_of(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

std::vector<std::string> keys_of(const ordered_json& object) {
  std::vector<std::string> keys;
  for (const auto& item : object.items()) keys.push_back(item.key());
  return keys;
}

MapFiles sample_map() {
  MapFiles map;
  map.collision_map_bt = "bt";
  map.map_ot = "ot";
  map.map_ply = "ply";
  map.occupied = {{{0.5, 0.2, 0.0}, {0.6, 0.4, 0.3}}};
  return map;
}

using Keys = std::vector<std::string>;

}  // namespace

TEST_CASE("result.json keeps its schema", "[report]") {
  const ordered_json json = ordered_json::parse(result_json(sample_record()));
  CHECK(keys_of(json) == Keys{"outcome", "reason", "remedy", "seed", "cell", "phases", "decisions_hash", "hand_eye",
                              "depth_camera", "time_offset", "mapping", "safety", "robot", "memory", "wall", "truth"});
  CHECK(json["outcome"] == "done");
  CHECK(json["seed"] == 7);
  CHECK(json["phases"].size() == 6);
  CHECK(keys_of(json["phases"][0]) == Keys{"name", "start_s", "end_s"});

  const ordered_json& hand_eye = json["hand_eye"];
  for (const char* key :
       {"parent_link", "reprojection_rms_px", "holdout_rms_px", "views", "usable_distance_m", "verdict"}) {
    INFO(key);
    CHECK(hand_eye.contains(key));
  }
  CHECK(hand_eye["translation_m"].size() == 3);
  CHECK(hand_eye["quaternion_xyzw"].size() == 4);
  CHECK(hand_eye["sigma_translation_mm"].size() == 3);
  CHECK(hand_eye["sigma_rotation_mrad"].size() == 3);
  CHECK(hand_eye["covariance"].size() == 36);
  CHECK(hand_eye["reasons"].is_array());

  CHECK(keys_of(json["mapping"]) == Keys{"views", "resolution_m", "voxels", "grid_voxels", "frames", "planes", "fine",
                                         "holes", "occupied_forgotten", "remaining", "prior", "objects"});
  CHECK(keys_of(json["mapping"]["prior"]) == Keys{"still_occupied", "newly_occupied", "gone", "still_free",
                                                  "unseen_occupied", "unseen_free", "first_known"});
  CHECK(json["mapping"]["prior"]["gone"] == 75);
  CHECK(keys_of(json["mapping"]["objects"][1]) == Keys{"id", "shape", "bounds_room", "voxels", "box"});
  CHECK(json["mapping"]["objects"][1]["shape"] == "box");
  CHECK(keys_of(json["mapping"]["objects"][1]["box"]) == Keys{"center_m", "size_m", "quaternion_xyzw"});
  CHECK(json["mapping"]["views"] == 24);
  CHECK(keys_of(json["mapping"]["voxels"]) == Keys{"unknown", "free", "occupied"});
  CHECK(keys_of(json["mapping"]["grid_voxels"]) == Keys{"unknown", "free", "occupied"});
  CHECK(keys_of(json["mapping"]["remaining"][0]) == Keys{"voxels", "reason", "center_m"});
  CHECK(keys_of(json["safety"]) ==
        Keys{"clearance_m", "min_clearance_m", "min_clearance_calibrating_m", "min_clearance_mapping_m", "stops"});
  CHECK(json["safety"]["min_clearance_m"] == json["safety"]["min_clearance_calibrating_m"]);  // the smaller one
  CHECK(keys_of(json["safety"]["stops"][0]) == Keys{"time_s", "cause"});
  CHECK(keys_of(json["memory"]) == Keys{"budget_bytes", "peak_bytes", "loop_allocations_after_seal"});
  for (const char* key : {"started", "total_s", "stall_s", "real_time", "rss_bytes", "job_heap_peak_bytes"})
    CHECK(json["wall"].contains(key));
  CHECK(keys_of(json["truth"]) == Keys{"hand_eye_error_mm", "hand_eye_error_mrad", "hand_eye_mahalanobis2",
                                       "depth_camera_error_mm", "depth_camera_error_mrad", "color_stamps_error_s",
                                       "depth_stamps_error_s", "contacts", "unknown_entries", "coverage_of_observable",
                                       "to_95", "to_99", "false_free_voxels", "false_occupied_fraction", "regions"});
  CHECK(json["truth"]["to_95"] == ordered_json{{"time_s", 61.5}, {"views", 12}});
  CHECK(json["truth"]["to_99"].is_null());
}

TEST_CASE("what was found of depth camera and stamps is told, and what was not", "[report]") {
  const ordered_json json = ordered_json::parse(result_json(sample_record()));
  const ordered_json& depth = json["depth_camera"];
  CHECK(depth["source"] == "estimated");
  CHECK(depth["translation_m"][0].get<double>() == -0.0248);
  CHECK(depth["sigma_translation_mm"][0].get<double>() == Approx(0.1));
  CHECK(depth["sigma_rotation_mrad"][2].get<double>() == Approx(0.3));
  CHECK(depth["depth_scale"].get<double>() == 1.002);
  CHECK(depth["estimate"]["views_used"] == 15);
  CHECK(depth["estimate"]["untold"][0]["direction"] == "translation along x");
  CHECK(depth["estimate"]["stated"]["contradicted"] == true);
  CHECK(json["time_offset"]["color"]["offset_s"].get<double>() == -0.0301);
  CHECK(json["time_offset"]["color"]["frames"] == 36);
  CHECK(json["time_offset"]["depth"]["source"] == "given");
  CHECK(json["time_offset"]["depth"]["sigma_s"].is_null());
  const std::string page = report_html(sample_record());
  CHECK_THAT(page, Contains("-30.10 ± 0.10 ms"));
  CHECK_THAT(page, Contains("contradicted"));
  CHECK_THAT(page, Contains("too few frames &lt;on the way&gt;"));
}

TEST_CASE("sections that did not run are null, and numbers that are not finite, too", "[report]") {
  RunRecord record;
  record.reason = "the link was lost";
  record.safety = SafetyRecord{};
  record.truth = TruthRecord{};
  record.truth->hand_eye_error_mm = std::numeric_limits<double>::quiet_NaN();
  const ordered_json json = ordered_json::parse(result_json(record));
  CHECK(json["outcome"] == "faulted");
  for (const char* key : {"hand_eye", "mapping", "memory"}) CHECK(json[key].is_null());
  CHECK(json["safety"]["clearance_m"].is_null());
  CHECK(json["safety"]["min_clearance_m"].is_null());
  CHECK(json["truth"]["hand_eye_error_mm"].is_null());
  CHECK(json["truth"]["coverage_of_observable"].is_null());
  CHECK(json["truth"]["contacts"] == 0);
}

TEST_CASE("only wall differs between two runs of one record", "[report]") {
  RunRecord first = sample_record(), second = sample_record();
  second.wall = {"2027-02-02T02:02:02Z", 1, 2, true, 3, 4, 5, 6, "/elsewhere", 1, {}};
  ordered_json a = ordered_json::parse(result_json(first)), b = ordered_json::parse(result_json(second));
  CHECK(a["wall"] != b["wall"]);
  CHECK(a["wall"]["jobs"][0]["name"] == "choosing the next view");
  CHECK(a["wall"]["jobs"][0]["count"] == 48);
  CHECK(b["wall"]["jobs"].empty());
  a.erase("wall");
  b.erase("wall");
  CHECK(a.dump() == b.dump());
  CHECK(a.dump().find("2026") == std::string::npos);

  const std::string page_a = report_html(first), page_b = report_html(second);
  const auto wall_begin = page_a.find("<section id=\"machine\">");
  REQUIRE(wall_begin != std::string::npos);
  CHECK(page_a.substr(0, wall_begin) == page_b.substr(0, wall_begin));
  CHECK(page_a.substr(wall_begin) != page_b.substr(wall_begin));
  CHECK(page_a.find("135.4 ms", wall_begin) != std::string::npos);  // the mean of those 48
  CHECK(report_html(first) == page_a);

  first.cell = "/home/somebody/cells/mine.yaml";
  CHECK(ordered_json::parse(result_json(first))["cell"] == "mine.yaml");
}

TEST_CASE("a finished run leaves every file", "[report]") {
  const auto folder = fresh_folder("whole");
  const RunRecord record = sample_record();
  REQUIRE(check_run_folder(folder.string()));
  REQUIRE(write_run_files(folder.string(), record, sample_map()));
  for (const char* name : {"result.json", "views.csv", "report.html", "hand_eye.yaml", "camera_info.yaml",
                           "collision_map.bt", "map.ot", "map.ply", "ros/easy_handeye.yaml", "ros/easy_handeye2.calib",
                           "ros/camera_transform.launch", "ros/camera_transform.launch.py", "ros/camera.xacro",
                           "ros/collision_map_base.scene", "ros/collision_map_base_link.scene"}) {
    INFO(name);
    CHECK(std::filesystem::file_size(folder / name) > 0);
  }
  CHECK(text_of(folder / "result.json") == result_json(record));
  CHECK(std::filesystem::file_size(folder / "report.html") < 3'000'000);
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    CHECK(entry.path().string().find("tmp") == folder.string().find("tmp"));  // nothing half-written stays
  }
  CHECK(check_run_folder(folder.string()).error().fault == Fault::kOutputNotEmpty);
  std::filesystem::remove_all(folder);
}

TEST_CASE("a folder that cannot be written is an error with its name", "[report]") {
  const auto file = fresh_folder("file");
  std::ofstream(file) << "not a folder";
  CHECK_FALSE(check_run_folder(file.string()));
  const Status status = write_run_files((file / "run").string(), sample_record(), sample_map());
  REQUIRE_FALSE(status);
  CHECK(status.error().fault == Fault::kDiskWrite);
  CHECK_THAT(std::string(status.error().detail()), Contains("firstlook_report_test_file"));
  std::filesystem::remove(file);
}

TEST_CASE("nothing that a robot would load is made from a rejected calibration", "[report]") {
  const auto folder = fresh_folder("rejected");
  RunRecord record = sample_record();
  record.outcome = Outcome::kCalibrationRejected;
  record.hand_eye->verdict = Verdict::kRejected;
  record.hand_eye->reasons = {"views held out of the solve miss by 9.10 px, limit 2.00 px"};
  record.mapping.reset();
  REQUIRE(write_run_files(folder.string(), record, {}));
  CHECK_FALSE(std::filesystem::exists(folder / "ros"));
  CHECK_FALSE(std::filesystem::exists(folder / "collision_map.bt"));
  CHECK_THAT(text_of(folder / "hand_eye.yaml"), Contains("verdict: rejected"));
  CHECK_THAT(text_of(folder / "report.html"), Contains("Calibration rejected") && Contains("miss by 9.10 px"));
  std::filesystem::remove_all(folder);
}

TEST_CASE("a stored calibration is told as such everywhere, and its file can be used again", "[report]") {
  const auto folder = fresh_folder("stored");
  RunRecord record = sample_record();
  REQUIRE(write_run_files(folder.string(), record, {}));
  auto stored = read_hand_eye(folder / "hand_eye.yaml");
  if (!stored) FAIL(stored.error().detail());
  CHECK(stored->views == record.hand_eye->views);
  CHECK(stored->arm_model == "ur5");

  record.verified = VerifiedCalibration{*stored, 4, Verification{}};
  Verification& v = *record.verified->verification;
  v.chi2 = 11.5;
  v.chi2_limit = 32.9;
  v.degrees_of_freedom = 12;
  v.views.resize(3, VerifiedView{0.21, 0.0003, 0.0004});
  record.hand_eye->fits.clear();
  record.hand_eye->holdout_rms_px = 0.21;
  const ordered_json json = ordered_json::parse(result_json(record))["hand_eye"];
  CHECK(json["source"] == "stored");
  CHECK(json["views"] == stored->views);
  CHECK(json["views_given"] == stored->views_given);
  CHECK(json["holdout_rms_px"] == 0.21);
  CHECK(json["subset_spread"].is_null());
  CHECK(json["verification"]["views"] == 3);
  CHECK(json["verification"]["looks"] == 4);
  CHECK(json["verification"]["chi2"] == 11.5);
  CHECK(json["verification"]["residuals"][2]["board_shift_mm"] == Approx(0.3));
  CHECK_THAT(done_text(record), Contains("stored calibration") && Contains("holds on 3 views"));
  CHECK_THAT(report_html(record), Contains("stored, from") && Contains("χ² 11.5, allowed 32.9") &&
                                      Contains("took no part in it") && !Contains("spread over subsets"));

  const auto again = fresh_folder("stored_again");
  REQUIRE(write_run_files(again.string(), record, {}));
  CHECK(text_of(again / "hand_eye.yaml").size() > 500);
  CHECK(read_hand_eye(again / "hand_eye.yaml"));
  record.verified->calibration.accepted = false;
  record.verified->verification.reset();
  CHECK(ordered_json::parse(result_json(record))["hand_eye"]["verification"]["views"] == 0);
  CHECK_FALSE(report_html(record).empty());
  REQUIRE(write_run_files(again.string(), record, {}));
  CHECK(read_hand_eye(again / "hand_eye.yaml").error().fault == Fault::kStoredCalibration);
  std::filesystem::remove_all(folder);
  std::filesystem::remove_all(again);
}

TEST_CASE("views.csv has one row for each look", "[report]") {
  const std::string csv = views_csv(sample_record());
  CHECK(std::count(csv.begin(), csv.end(), '\n') == 25);
  CHECK_THAT(csv,
             Catch::Matchers::StartsWith("view,phase,time_s,q1_rad,q2_rad,q3_rad,q4_rad,q5_rad,q6_rad,gain_expected,"
                                         "gain_seen,unknown,free,occupied\n1,sweep,110,0,-1.57,"));
  CHECK(std::count(csv.begin(), csv.begin() + static_cast<std::ptrdiff_t>(csv.find('\n')), ',') == 13);
  CHECK_THAT(views_csv(RunRecord{}), Contains("q6_rad"));
}

TEST_CASE("hostile text stays text", "[report]") {
  const std::string evil = "</title><script>alert('x')</script>\"><img src=x onerror=alert(1)>&\x01\xff";
  RunRecord record = sample_record();
  record.reason = record.cell = record.decisions_hash = record.solver = evil;
  record.hand_eye->verdict = Verdict::kRejected;
  record.hand_eye->reasons = {evil};
  record.phases[0].name = evil;
  record.mapping->views[0].phase = evil;
  record.mapping->remaining[0].reason = evil;
  record.map_pictures[0].picture.caption = record.map_pictures[0].group = evil;
  record.map_pictures[0].labels[0].text = evil;
  record.safety->stops[0].cause = evil;
  record.memory->pools[0].name = evil;
  record.faults[0].detail = evil;
  record.provenance = {.version = evil, .arm_model = evil, .sensor = evil, .config_yaml = evil, .journal_hash = evil};
  record.wall.started = record.wall.folder = evil;
  const std::string page = report_html(record);
  CHECK(page.find("<script") == std::string::npos);
  CHECK(page.find("<img src=x") == std::string::npos);
  CHECK(page.find('\x01') == std::string::npos);
  CHECK(page.find('\xff') == std::string::npos);
  // Each of the 18 texts is there, escaped; the caption twice (attribute and text), cell and version in several places.
  std::size_t count = 0;
  for (std::size_t at = 0; (at = page.find("&lt;script&gt;alert(&#39;x&#39;)", at)) != std::string::npos; ++at) ++count;
  CHECK(count >= 18);
  CHECK_NOTHROW(ordered_json::parse(result_json(record)));
}

TEST_CASE("the page fetches nothing and tells the essentials", "[report]") {
  const std::string page = report_html(sample_record());
  CHECK(page.find("src=\"http") == std::string::npos);
  CHECK(page.find("href=\"http") == std::string::npos);
  CHECK(page.find("<link") == std::string::npos);
  CHECK(page.find("url(") == std::string::npos);
  CHECK_THAT(page, Contains("class=\"banner good\"") && Contains("84.10") && Contains("ros2 run tf2_ros"));
  CHECK_THAT(page, Contains("occluded: something stands between") && Contains("out of range: nearer") &&
                       Contains("E5005") && Contains("observed behind box, before exploration"));
  std::size_t pictures = 0;
  for (std::size_t at = 0; (at = page.find("data:image/", at)) != std::string::npos; ++at) ++pictures;
  CHECK(pictures == 19);
}

TEST_CASE("a page can be made of any record", "[report]") {
  RunRecord bare;
  CHECK_THAT(report_html(bare), Contains("Ended by a fault") && Contains("Nothing was mapped"));
  RunRecord odd = sample_record();
  odd.calibration_views[0].picture.pixels.resize(5);  // size and pixels do not agree
  odd.calibration_views[1].picture = {};              // --sensor fast
  odd.calibration_views[2].reprojected_px.clear();    // not solved
  odd.calibration_views[3].detected_px[0].x() = std::numeric_limits<double>::quiet_NaN();
  odd.map_pictures[0].picture.pixels.clear();
  odd.map_pictures[1].lines[0].points_px[1].x() = odd.map_pictures[1].views[0].at_px.y() =
      odd.map_pictures[1].labels[0].at_px.x() = std::numeric_limits<double>::quiet_NaN();
  odd.mapping->views.resize(1);
  odd.mapping->views[0].unknown = odd.mapping->views[0].free = odd.mapping->views[0].occupied = 0;
  odd.phases = {{"boot", 0, 0}};
  const std::string page = report_html(odd);
  for (const char* number : {">nan", " nan", "\"nan", "Mnan", ">inf", " inf", "\"inf"}) {
    CHECK(page.find(number) == std::string::npos);
  }
}

TEST_CASE("escaping keeps UTF-8 and mends the rest", "[report]") {
  CHECK(escape_html("a<b & \"c\" 'd'>") == "a&lt;b &amp; &quot;c&quot; &#39;d&#39;&gt;");
  CHECK(escape_html("± σ 中 \U0001F600") == "± σ 中 \U0001F600");
  CHECK(escape_html("\xC0\xAF") == "\uFFFD\uFFFD");              // overlong
  CHECK(escape_html("\xED\xA0\x80x") == "\uFFFD\uFFFD\uFFFDx");  // surrogate
  CHECK(escape_html("\xE2\x82") == "\uFFFD\uFFFD");              // cut short
  CHECK(grouped(1234567) == "1\u202F234\u202F567");
  CHECK(duration_text(125) == "2 min 05 s");
}

TEST_CASE("base64 agrees with RFC 4648", "[report]") {
  const auto encode = [](std::string_view text) { return base64(std::as_bytes(std::span(text.data(), text.size()))); };
  CHECK(encode("") == "");
  CHECK(encode("f") == "Zg==");
  CHECK(encode("fo") == "Zm8=");
  CHECK(encode("foo") == "Zm9v");
  CHECK(encode("foobar") == "Zm9vYmFy");
}

TEST_CASE("pictures are shrunk by whole blocks and encoded the same each time", "[report]") {
  GrayPicture picture{641, 4, std::vector<std::uint8_t>(641 * 4, 10)};
  for (std::size_t i = 0; i < picture.pixels.size(); i += 2) picture.pixels[i] = 20;
  double scale = 0;
  const GrayPicture small = shrink(picture, 320, scale);
  CHECK(scale == 1.0 / 3);
  CHECK(small.width == 213);
  CHECK(small.height == 1);
  CHECK(small.pixels.size() == 213);
  CHECK((small.pixels[0] == 14 || small.pixels[0] == 16));
  CHECK(encode_png(picture) == encode_png(picture));
  CHECK(encode_png(picture)[1] == std::byte{'P'});
  CHECK(encode_png(GrayPicture{3, 3, {1, 2}}).empty());
  CHECK(encode_png(RgbPicture{"", -1, 5, {}}).empty());
  CHECK(encode_jpeg(picture) == encode_jpeg(picture));
  CHECK(encode_jpeg(picture)[1] == std::byte{0xD8});  // start of image
  CHECK(encode_jpeg(GrayPicture{3, 3, {1, 2}}).empty());
  CHECK(encode_jpeg(GrayPicture{0, 3, {}}).empty());
}

TEST_CASE("figures of a validation that did not take place are absent", "[report]") {
  RunRecord record = sample_record();
  HandEyeResult& h = *record.hand_eye;
  h.holdout_rms_px = h.holdout_rms_m = h.usable_distance_m = 0;
  const ordered_json json = ordered_json::parse(result_json(record))["hand_eye"];
  CHECK(json["holdout_rms_px"].is_null());
  CHECK(json["holdout_rms_mm"].is_null());
  CHECK(json["usable_distance_m"].is_null());
  CHECK_THAT(report_html(record), Contains("not determined"));
}

TEST_CASE("the sentence of a finished job", "[report]") {
  RunRecord record = sample_record();
  CHECK(done_text(record).starts_with("camera known to 0.19 mm and 0.31 mrad (1 sigma, worst axis) from 16 views"));
  CHECK_THAT(done_text(record), Contains("; ") && Contains(" % of the space in reach known after 24 views"));
  record.hand_eye.reset();
  CHECK_THAT(done_text(record), Catch::Matchers::Matches("^[0-9.]+ % of the space.*"));
}
