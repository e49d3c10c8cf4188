/// The configuration: what it accepts, what it refuses and how well it says so.
#include "app/config/config.hpp"
#include "app/config/board_config.hpp"

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "app/cli/small_commands.hpp"
#include "app/config/board_config.hpp"
#include "app/config/config_keys.hpp"
#include "app/config/load_config.hpp"
#include "app/config/nearest_name.hpp"

using namespace firstlook;
using Catch::Matchers::Contains;

namespace {

std::string refused(std::string_view yaml, Fault fault) {
  const Result<Config> config = parse_config(yaml, "cart.yaml");
  INFO(yaml);
  REQUIRE_FALSE(config.has_value());
  CHECK(config.error().fault == fault);
  return std::string(config.error().detail());
}

/// A configuration that differs from the defaults in every key.
Config all_changed() {
  Config c;
  c.cell = "cells/my cell \"A\": #1.yaml";
  c.seed = 9007199254740992;
  c.workers = 4;
  c.start_source = "panel";
  c.arm = {"ur10e", "my arm.urdf", "torso", "tool0", "wrist_1", "tilted", 0.1 + 0.2, 1.0 / 3.0, 2.5};
  c.safe_zone = {0.7, 0.9};
  c.cart = {-0.123456789012345};
  c.base_allowance = {0.2, 0.1};
  c.keep_out = {{{-1, -2, 0}, {1, -1.5, 2}}, {{0.1, 0.2, 0.3}, {0.4, 0.5, 0.6}}};
  c.camera_envelope_radius_m = 0.15;
  c.parking_rad = JointVector{0, -1.5707963267948966, 1e-17, 0.5, -0.25, 3};
  c.board = {"charuco", 7, 5, 0.0251, 0.018, "5x5_100", 3, "yes", "thesis2014"};
  c.calibration = {"tsai-lenz",
                   "estimate",
                   "given",
                   2.5,
                   4.5,
                   "given",
                   "fixed48",
                   9,
                   53,
                   5,
                   0.3,
                   0.6,
                   0.5,
                   4,
                   0.2,
                   0.4,
                   0.5,
                   1.1,
                   1.2,
                   1.3,
                   1.4,
                   0.02,
                   0.5,
                   "yes",
                   13,
                   "given",
                   {0.1, 0.2, 0.3},
                   0.6,
                   6,
                   11,
                   "runs/first: one/hand_eye.yaml",
                   4};
  c.camera = {"/dev/v4l/by-id/usb-046d_0990-index0", 800, 600, "MJPG", 15, 5000, 3, 40, 4600, "camera_info.yaml"};
  c.panel = {"vcan0", 5, 0x80000001, 4294967295, 8, 9, 10, -1, "closes", 4, 5, 6, 7};
  c.depth = {"stereo",
             0.4,
             6,
             3.5,
             0.001,
             0.003,
             0.06,
             4,
             0.03,
             5,
             "cell.oni",
             "depth_info.yaml",
             {-0.025, 0.001, 0.002},
             {0.5, -0.3, 180}};
  JointVector tcp = JointVector::zero(6);
  tcp[2] = 0.12;
  c.robot = {"192.168.56.101", "192.168.56.1", 50012, 50011, 100, 1.25, tcp, "robot.yaml"};
  c.map = {0.02, {-1, -1, 0},    {1, 1, 1},       60,   30,   0.002,         "clear_when_corroborated",
           0.01, {-0.5, 0, 0.1}, {0.5, 0.4, 0.6}, -0.8, 0.03, "color,label", "earlier/map.ot"};
  c.explore = {61, 401, 2001, 9, 3, "thesis2014"};
  c.clearance = {0.001, 0.002, 0.03, 4};
  c.memory = {512};
  return c;
}

}  // namespace

TEST_CASE("printed configuration reads back as the same configuration", "[config]") {
  for (const Config& config : {Config{}, all_changed()}) {
    const std::string text = print_config(config);
    INFO(text);
    const Result<Config> again = parse_config(text, "printed");
    if (!again) FAIL(again.error().detail());
    CHECK(*again == config);
    CHECK(print_config(*again) == text);
  }
}

TEST_CASE("the table of keys covers every field", "[config]") {
  // all_changed() differs from the defaults wherever a choice exists; a field without a key would survive the round
  // trip of the test above only if it kept its default.
  Config defaults, changed = all_changed();
  const auto keys_defaults = config_keys(defaults), keys_changed = config_keys(changed);
  REQUIRE(keys_defaults.size() == keys_changed.size());
  for (std::size_t i = 0; i < keys_defaults.size(); ++i) {
    INFO(keys_defaults[i].path);
    CHECK_FALSE(keys_defaults[i].meaning.empty());
    if (keys_defaults[i].choices.size() == 1) continue;
    if (keys_defaults[i].path == "boards") continue;  // in place of `board`: several boards have a test of their own
    const bool same = std::visit(
        [](const auto* a, const auto* b) {
          if constexpr (std::is_same_v<decltype(a), decltype(b)>) return *a == *b;
          return false;
        },
        keys_defaults[i].field, keys_changed[i].field);
    CHECK_FALSE(same);
  }
}

TEST_CASE("an empty file gives the defaults", "[config]") {
  for (const char* yaml : {"", "# only a comment\n", "arm:\nmap:\n"}) {
    const Result<Config> config = parse_config(yaml, "cart.yaml");
    REQUIRE(config);
    CHECK(*config == Config{});
  }
}

TEST_CASE("an unknown key is named with place and nearest key", "[config]") {
  CHECK_THAT(refused("seed: 4\narm:\n  modle: ur5\n", Fault::kConfigUnknownKey),
             Contains("cart.yaml:3:3") && Contains("arm.modle") && Contains("did you mean arm.model?"));
  CHECK_THAT(refused("speed_max_m_s: 0.1\n", Fault::kConfigUnknownKey),
             Contains("cart.yaml:1:1: speed_max_m_s") && Contains("did you mean arm.speed_max_m_s?"));
  CHECK_THAT(refused("arms: {model: ur5}\n", Fault::kConfigUnknownKey), Contains("did you mean arm?"));
  CHECK_THAT(refused("<<: {seed: 3}\n", Fault::kConfigUnknownKey), Contains("1:1"));
}

TEST_CASE("wrong types, ranges and values are refused with the place and the range", "[config]") {
  CHECK_THAT(refused("arm: {speed_max_m_s: 7}", Fault::kConfigBadValue),
             Contains("cart.yaml:1:22") && Contains("is 7; must be between 0.01 and 1"));
  CHECK_THAT(refused("arm: {speed_max_m_s: -0.1}", Fault::kConfigBadValue), Contains("between"));
  CHECK_THAT(refused("arm: {speed_max_m_s: nan}", Fault::kConfigBadValue), Contains("finite"));
  CHECK_THAT(refused("arm: {speed_max_m_s: .nan}", Fault::kConfigBadValue), Contains("finite"));
  CHECK_THAT(refused("arm: {speed_max_m_s: inf}", Fault::kConfigBadValue), Contains("finite"));
  CHECK_THAT(refused("arm: {speed_max_m_s: 0.2m}", Fault::kConfigBadValue), Contains("finite"));
  CHECK_THAT(refused("arm: {speed_max_m_s: \"0.2\"}", Fault::kConfigBadValue), Contains("finite"));
  CHECK_THAT(refused("arm: {speed_max_m_s: }", Fault::kConfigBadValue), Contains("one number"));
  CHECK_THAT(refused("arm: {speed_max_m_s: [1]}", Fault::kConfigBadValue), Contains("one number"));
  CHECK_THAT(refused("arm: 3", Fault::kConfigBadValue), Contains("arm must be a map"));
  CHECK_THAT(refused("arm: {model: kuka}", Fault::kConfigBadValue), Contains("must be one of: ur3, ur5"));
  CHECK_THAT(refused("workers: 2.5", Fault::kConfigBadValue), Contains("whole number"));
  CHECK_THAT(refused("workers: 99999999999999999999", Fault::kConfigBadValue), Contains("whole number"));
  CHECK_THAT(refused("map: {low_m: [0, 0]}", Fault::kConfigBadValue), Contains("three numbers"));
  CHECK_THAT(refused("map: {low_m: [0, 0, nan]}", Fault::kConfigBadValue), Contains("finite"));
  CHECK_THAT(refused("keep_out: [{low_m: [0, 0, 0]}]", Fault::kConfigBadValue), Contains("high_m"));
  CHECK_THAT(refused("keep_out: [{low_m: [0,0,0], high_m: [1,1,1], x: 1}]", Fault::kConfigBadValue), Contains("else"));
  CHECK_THAT(refused("parking_rad: [0, 9, 0, 0, 0, 0]", Fault::kConfigBadValue), Contains("between"));
  CHECK_THAT(refused("- 1\n- 2\n", Fault::kConfigBadValue), Contains("map"));
}

TEST_CASE("a key given twice is refused", "[config]") {
  CHECK_THAT(refused("seed: 1\nseed: 2\n", Fault::kConfigBadValue), Contains("cart.yaml:2:1") && Contains("twice"));
  CHECK_THAT(refused("arm: {model: ur5}\narm: {model: ur3}\n", Fault::kConfigBadValue), Contains("twice"));
}

TEST_CASE("rules between keys hold", "[config]") {
  CHECK_THAT(refused("map: {low_m: [2, -1, 0]}", Fault::kConfigBadValue), Contains("map.low_m"));
  CHECK_THAT(refused("depth: {range_min_m: 3.5}", Fault::kConfigBadValue), Contains("range_trusted_m"));
  CHECK(parse_config("camera: {width: 1920, height: 1080}", "cart.yaml").has_value());
  CHECK_THAT(refused("camera: {width: 1920, height: 1200}", Fault::kConfigBadValue), Contains("2073600 pixels"));
  CHECK_THAT(refused("depth: {range_max_m: 2}", Fault::kConfigBadValue), Contains("range_max_m"));
  CHECK_THAT(refused("depth: {crop_m: 0.4}", Fault::kConfigBadValue), Contains("crop_m"));
  CHECK_THAT(refused("depth: {filter_voxel_m: 0.001}", Fault::kConfigBadValue), Contains("filter_voxel_m"));
  CHECK_THAT(refused("depth: {plane_fit_px: 4}", Fault::kConfigBadValue), Contains("plane_fit_px"));
  CHECK_THAT(refused("map: {ground_tolerance_m: -0.1}", Fault::kConfigBadValue), Contains("ground_tolerance_m"));
  CHECK_THAT(refused("map: {fine_resolution_m: 0.05}", Fault::kConfigBadValue), Contains("fine_resolution_m"));
  CHECK_THAT(refused("map: {fine_resolution_m: 0.01}", Fault::kConfigBadValue), Contains("one fine voxel"));
  CHECK_THAT(
      refused("map: {fine_resolution_m: 0.01, fine_low_m: [0, 0, 1], fine_high_m: [1, 1, 2]}", Fault::kConfigBadValue),
      Contains("inside"));
  CHECK_THAT(refused("calibration: {views_min: 31}", Fault::kConfigBadValue), Contains("views_max"));
  CHECK_THAT(refused("calibration: {views: fixed48}", Fault::kConfigBadValue), Contains("views_max to 52"));
  CHECK_THAT(refused("calibration: {views_min: 6}", Fault::kConfigBadValue), Contains("holdout_views"));
  CHECK_THAT(refused("keep_out: [{low_m: [1,0,0], high_m: [0,1,1]}]", Fault::kConfigBadValue), Contains("keep_out"));
}

TEST_CASE("a sensor sets the figures that no key sets, whichever source names it", "[config]") {
  const Result<Config> stereo = parse_config("depth: {range_trusted_m: 2.5, sensor: stereo}", "cart.yaml");
  REQUIRE(stereo);
  CHECK(stereo->depth.range_trusted_m == 2.5);
  CHECK(stereo->depth.range_min_m == 0.2);
  CHECK(stereo->depth.range_max_m == 10);
  CHECK(stereo->depth.baseline_m == 0.05);

  const auto file = std::filesystem::temp_directory_path() / "firstlook_sensor_test.yaml";
  std::ofstream(file) << "depth: {range_max_m: 4.2}\n";
  ConfigSources sources;
  sources.system_file = "/nowhere/firstlook.yaml";
  sources.file = file;
  sources.environment = {"FIRSTLOOK_DEPTH_SENSOR=time_of_flight"};
  const Result<LoadedConfig> loaded = load_config(sources);
  REQUIRE(loaded);
  CHECK(loaded->config.depth.range_max_m == 4.2);
  CHECK(loaded->config.depth.noise_floor_m == 0.0013);
  CHECK(loaded->config.depth.baseline_m == 0);
  for (const double z_m : {1.0, 2.0, 4.0}) {  // Fankhauser et al. 2015
    CHECK(loaded->config.depth.sigma_m(z_m) == Approx(1e-3 * (1.5 - 0.5 * z_m + 0.3 * z_m * z_m)).margin(1e-4));
  }

  CHECK_THAT(refused("depth: {sensor: sonar}", Fault::kConfigBadValue), Contains("kinect, xtion, time_of_flight"));
  CHECK_THAT(refused("depth: {sensor: xtion, range_min_m: 3.2}", Fault::kConfigBadValue), Contains("range_trusted_m"));
  Config by_default;
  set_sensor(*find_sensor_preset("kinect"), by_default.depth);
  CHECK(by_default == Config{});
  for (const SensorPreset& preset : sensor_presets()) {
    Config config;
    set_sensor(preset, config.depth);
    CHECK(broken_rule(config).empty());
  }
}

TEST_CASE("broken YAML is refused with its place, never thrown", "[config]") {
  CHECK_THAT(refused("arm: {model: ur5\n", Fault::kConfigUnreadable), Contains("cart.yaml:"));
  CHECK_THAT(refused("a: b: c", Fault::kConfigUnreadable), Contains("cart.yaml:1"));
  CHECK_THAT(refused("seed: 1\n---\nseed: 2\n", Fault::kConfigUnreadable), Contains("more than one document"));
  refused("? [1, 2]\n: 3\n", Fault::kConfigUnreadable);
  refused("cell: \"never closed", Fault::kConfigUnreadable);
}

TEST_CASE("any prefix of a valid file is read or refused, never worse", "[config]") {
  const std::string text = print_config(all_changed());
  for (std::size_t size = 0; size < text.size(); size += 7) (void)parse_config(text.substr(0, size), "cut.yaml");
}

TEST_CASE("flag beats environment beats file beats default", "[config]") {
  const auto file = std::filesystem::temp_directory_path() / "firstlook_config_test.yaml";
  std::ofstream(file) << "seed: 10\nworkers: 3\narm: {speed_max_m_s: 0.2}\n";
  ConfigSources sources;
  sources.system_file = "/nowhere/firstlook.yaml";
  CHECK(load_config(sources)->config == Config{});
  CHECK(load_config(sources)->file.empty());

  sources.file = file;
  sources.environment = {"HOME=/root", "FIRSTLOOK_WORKERS=4", "FIRSTLOOK_SEED=20", "FIRSTLOOK_MAP_LOW_M=[-1, -1, 0]"};
  sources.flags = {{"seed", "30", "--seed"}, {"cell", "a: b # c", "--cell"}};
  const Result<LoadedConfig> loaded = load_config(sources);
  REQUIRE(loaded);
  CHECK(loaded->config.arm.speed_max_m_s == 0.2);
  CHECK(loaded->config.workers == 4);
  CHECK(loaded->config.seed == 30);
  CHECK(loaded->config.cell == "a: b # c");
  CHECK(loaded->config.map.low_m == std::array<double, 3>{-1, -1, 0});
  CHECK(loaded->config.board == Config::Board{});
  CHECK(loaded->file == file.string());

  sources.environment = {"FIRSTLOOK_WORKER=4"};
  CHECK_THAT(std::string(load_config(sources).error().detail()),
             Contains("FIRSTLOOK_WORKER;") && Contains("FIRSTLOOK_WORKERS?"));
  sources.environment = {"FIRSTLOOK_WORKERS"};
  CHECK(load_config(sources).error().fault == Fault::kConfigBadValue);
  sources.environment = {};
  sources.flags = {{"seed", "-1", "--seed"}};
  CHECK_THAT(std::string(load_config(sources).error().detail()), Contains("--seed: seed is -1; must be between 0"));
  CHECK(load_config(sources).error().fault == Fault::kUsage);
  sources.flags = {};
  sources.file = "/nowhere/at/all.yaml";
  CHECK(load_config(sources).error().fault == Fault::kConfigUnreadable);
  std::filesystem::remove(file);
}

TEST_CASE("the nearest name", "[config]") {
  CHECK(edit_distance("", "abc") == 3);
  CHECK(edit_distance("kitten", "sitting") == 3);
  CHECK(edit_distance("modle", "model") == 1);
  const std::string_view names[] = {"arm.model", "map.resolution_m"};
  CHECK(nearest_name("resolution", names) == "map.resolution_m");
  CHECK(nearest_name("arm.mode", names) == "arm.model");
}

TEST_CASE("the program's version is the build's", "[config]") {
  std::ifstream file(std::filesystem::path(FIRSTLOOK_SOURCE_DIR) / "CMakeLists.txt");
  const std::string cmake((std::istreambuf_iterator<char>(file)), {});
  CHECK_THAT(cmake, Contains("project(firstlook VERSION " + version_text() + " "));
}

TEST_CASE("explain knows every fault and refuses the rest", "[config]") {
  CHECK(run_explain_command("E5004") == 0);
  CHECK(run_explain_command("5004") == 0);
  for (const char* wrong : {"", "E", "E9999", "5004x", "protective stop"}) CHECK(run_explain_command(wrong) == 2);
}

TEST_CASE("keys of a board and the board itself mean the same", "[app][config]") {
  Config::Board keys;
  CHECK_FALSE(names_a_board(keys));
  keys.detector = "thesis2014";
  CHECK_FALSE(names_a_board(keys));
  keys.type = "charuco";
  keys.legacy = "yes";
  CHECK(names_a_board(keys));
  const auto board = board_of(keys);
  REQUIRE(board);
  CHECK(board->legacy);
  Config::Board same;
  same.detector = "thesis2014_plain";
  set_board(*board, same);
  CHECK(same.detector == "thesis2014_plain");
  CHECK(board_of(same).value() == *board);
}

TEST_CASE("several boards are read strictly, printed, and read back", "[app][config]") {
  const std::string two =
      "boards:\n"
      "  - {name: door, type: apriltag, inner_columns: 5, inner_rows: 4, square_size_m: 0.05}\n"
      "  - {name: table 2, detector: thesis2014}\n";
  const auto config = parse_config(two, "a.yaml");
  REQUIRE(config);
  const auto targets = targets_of(*config);
  REQUIRE(targets);
  REQUIRE(targets->size() == 2);
  CHECK((*targets)[0].name == "door");
  CHECK((*targets)[0].board.type == TargetType::kMarkerGrid);
  CHECK((*targets)[1].board == BoardSpec{});
  CHECK(names_boards(*config));
  const std::string printed = print_config(*config);
  CHECK_THAT(printed, !Contains("\nboard:"));
  CHECK(parse_config(printed, "printed.yaml").value() == *config);
  CHECK_THAT(print_config(Config{}), Contains("boards: []"));

  const auto complaint = [](const std::string& yaml) {
    return std::string(parse_config(yaml, "a.yaml").error().detail());
  };
  CHECK_THAT(complaint(two + "board: {inner_rows: 7}\n"), Contains("'board' and 'boards'"));
  CHECK_THAT(complaint("boards:\n  - {name: a}\n  - {name: b}\n"), Contains("'a' and 'b'") && Contains("9x6"));
  CHECK_THAT(complaint("boards:\n  - {name: a}\n  - {name: a, type: apriltag}\n"), Contains("named 'a'"));
  CHECK_THAT(complaint("boards:\n  - {inner_rows: 7}\n"), Contains("boards[0].name is missing"));
  CHECK_THAT(complaint("boards:\n  - {name: a, inner_row: 7}\n"),
             Contains("a.yaml:2:") && Contains("boards[0].inner_row;") && Contains("inner_rows?"));
  CHECK_THAT(complaint("boards:\n  - {name: a, inner_rows: 70}\n"), Contains("boards[0].inner_rows is 70"));
  CHECK_THAT(complaint("boards:\n  - {name: \"a,b\"}\n"), Contains("comma"));
  CHECK_THAT(complaint("boards: {name: a}\n"), Contains("list"));
}

TEST_CASE("boards that a cell brings along keep the detector", "[app][config]") {
  Config config;
  config.board.detector = "thesis2014";
  const std::vector<NamedTarget> two = {{"a", BoardSpec{}}, {"b", BoardSpec{7, 4, 0.04}}};
  set_targets(two, config);
  REQUIRE(config.boards.size() == 2);
  CHECK(config.boards[1].board.detector == "thesis2014");
  CHECK(targets_of(config).value()[1].board == two[1].board);
}
