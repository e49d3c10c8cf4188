/// `firstlook map --planes`: colours from rgb.txt, labels, sensors; and what is wrong with recordings of colours.
#include <fmt/format.h>
#include <png.h>

#include <catch2/catch.hpp>
#include <fstream>
#include <nlohmann/json.hpp>

#include "app/cli/export_command.hpp"
#include "app/cli/map_command.hpp"
#include "app/dataset/color_dataset.hpp"
#include "app/dataset/dataset_mapping.hpp"
#include "app/report/picture_bytes.hpp"
#include "platform/linux/files.hpp"
#include "tests/support/printed_map.hpp"
#include "tests/support/temporary_folder.hpp"

namespace firstlook {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;
using test::print_map;
using test::Printed;
using test::read_text;

constexpr int kWidth = 32, kHeight = 24;

void write_text(const fs::path& file, const std::string& text) { std::ofstream(file, std::ios::binary) << text; }

void write_depth(const fs::path& file, std::uint16_t value) {
  const std::vector<std::uint16_t> pixels(static_cast<std::size_t>(kWidth) * kHeight, value);
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  png.width = kWidth;
  png.height = kHeight;
  png.format = PNG_FORMAT_LINEAR_Y;
  REQUIRE(png_image_write_to_file(&png, file.c_str(), 0, pixels.data(), 0, nullptr) != 0);
}

/// Left half red, right half green.
void write_color(const fs::path& file, int width = kWidth, int height = kHeight) {
  RgbPicture picture;
  picture.width = width;
  picture.height = height;
  for (int i = 0; i < width * height; ++i)
    for (const int channel : {0, 1, 2})
      picture.pixels.push_back(static_cast<std::uint8_t>(channel == (i % width < width / 2 ? 0 : 1) ? 220 : 10));
  REQUIRE(write_file_atomically(file.string(), encode_png(picture)));
}

const std::string kCamera =
    "image_width: {}\nimage_height: {}\ncamera_name: camera\n"
    "camera_matrix: {{rows: 3, cols: 3, data: [{}, 0, {}, 0, {}, {}, 0, 0, 1]}}\n"
    "distortion_model: plumb_bob\n"
    "distortion_coefficients: {{rows: 1, cols: 5, data: [0, 0, 0, 0, 0]}}\n";

std::string camera_info(int scale) {
  return fmt::format(fmt::runtime(kCamera), kWidth * scale, kHeight * scale, 30.0 * scale, 16.0 * scale - 0.5,
                     30.0 * scale, 12.0 * scale - 0.5);
}

/// Two looks at a wall 1 m ahead.
struct Recording {
  test::TemporaryFolder folder{"firstlook-planes"};
  fs::path at = folder.path();

  explicit Recording(std::uint16_t depth = 5000) {
    fs::create_directory(at / "depth");
    fs::create_directory(at / "rgb");
    for (const std::string name : {"1.png", "2.png"}) {
      write_depth(at / "depth" / name, depth);
      write_color(at / "rgb" / name);
    }
    write_text(at / "camera_info.yaml", camera_info(1));
    write_text(at / "depth.txt", "1.00 depth/1.png\n2.00 depth/2.png\n");
    write_text(at / "rgb.txt", "# stamp file\n2.01 rgb/2.png\n0.99 rgb/1.png\n");
    write_text(at / "groundtruth.txt", "1.00 0 0 0 0 0 0 1\n2.00 0 0 0 0 0 0 1\n");
  }
  [[nodiscard]] Result<ColorDataset> read() const {
    const auto depth = read_mapping_dataset(at);
    REQUIRE(depth);
    return read_color_dataset(at, *depth);
  }
  [[nodiscard]] std::string error() const {
    const auto color = read();
    return color ? "read without error" : std::string(color.error().detail());
  }
};

struct PrintedJson : Printed {
  [[nodiscard]] Json json() const { return Json::parse(text); }
};

PrintedJson run(MapCommandOptions options, const fs::path& scratch) {
  options.json = true;
  return {print_map(options, scratch)};
}

MapCommandOptions with_planes(const fs::path& dataset, const std::string& planes) {
  MapCommandOptions options;
  options.datasets = {dataset};
  options.planes = planes;
  return options;
}

bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

}  // namespace

TEST_CASE("colours of a recording are in the map, its files and its answers", "[app][dataset][planes]") {
  const Recording data;
  MapCommandOptions options = with_planes(data.at, "color,label,sensor");
  options.out = data.at / "out";
  options.at = "-0.275,0.025,1.0";
  const Json result = run(options, data.at).json();
  const Json& planes = result["planes"];
  CHECK(planes["color"]["voxels"] == result["voxels"]["occupied"]);
  CHECK(planes["label"]["voxels"] == result["voxels"]["occupied"]);
  CHECK(planes["sensor"]["voxels"][0] == result["voxels"]["occupied"].get<int>() + result["voxels"]["free"].get<int>());
  CHECK(result["place"]["class"] == "occupied");
  CHECK(result["place"]["color"] == Json({220, 10, 10}));
  CHECK(result["place"]["shape"] == "plane");
  CHECK(result["place"]["sensor"] == 1);
  CHECK(result["frames"][1]["color"]["pixels"] == kWidth * kHeight);
  CHECK(result["frames"][1]["color"]["refused"].is_null());
  options.at = "0.275,0.025,1.0";
  CHECK(run(options, data.at).json()["place"]["color"] == Json({10, 220, 10}));

  CHECK(contains(read_text(data.at / "out/color_map.ot"), "\nid ColorOcTree\n"));
  CHECK(contains(read_text(data.at / "out/map.ot"), "\nid OcTree\n"));
  CHECK(fs::file_size(data.at / "out/color.png") > 1000);

  // A stored map has the planes of the map.ply beside it.
  MapCommandOptions stored;
  stored.from = data.at / "out/map.ot";
  stored.at = "0.275,0.025,1.0";
  const Json place = run(stored, data.at).json()["place"];
  CHECK(place["color"] == Json({10, 220, 10}));
  CHECK(place["sensor"] == 1);
  fs::remove(data.at / "out/map.ply");
  CHECK_FALSE(run(stored, data.at).json()["place"].contains("color"));
}

TEST_CASE("planes are columns of the exported voxels", "[app][dataset][planes][export]") {
  const Recording data;
  for (const auto& [words, head] : {std::pair<std::string, std::string>{"none", "log_odds\n"},
                                    {"color", "log_odds,red,green,blue\n"},
                                    {"label,sensor", "log_odds,object,shape,sensor\n"}}) {
    MapCommandOptions options = with_planes(data.at, words);
    options.out = data.at / words;
    REQUIRE(run(options, data.at).exit_code == 0);
    std::fflush(stdout);
    REQUIRE(run_export_command({options.out, "csv", {}}) == 0);
    const std::string csv = read_text(options.out / "export/csv/voxels.csv");
    CHECK(csv.starts_with("x_m,y_m,z_m,class," + head));
    if (words == "color") CHECK(contains(csv, ",220,10,10\n"));
    if (words == "label,sensor") CHECK(contains(csv, ",1,plane,1\n"));
  }
}

TEST_CASE("without planes nothing changes", "[app][dataset][planes]") {
  const Recording data;
  fs::remove(data.at / "rgb.txt");
  MapCommandOptions off = with_planes(data.at, "none");
  off.out = data.at / "off";
  const Json plain = run(off, data.at).json();
  CHECK_FALSE(plain.contains("planes"));
  CHECK_FALSE(plain["frames"][0].contains("color"));
  CHECK_FALSE(fs::exists(data.at / "off/color_map.ot"));
  write_text(data.at / "rgb.txt", "1.00 rgb/1.png\n2.00 rgb/2.png\n");
  MapCommandOptions on = with_planes(data.at, "color,label,sensor");
  on.out = data.at / "on";
  REQUIRE(run(on, data.at).exit_code == 0);
  for (const char* name : {"map.ot", "collision_map.bt", "frames.csv"})
    CHECK(read_text(data.at / "off" / name) == read_text(data.at / "on" / name));
}

TEST_CASE("pictures belong to the depth frame nearest in time", "[app][dataset][planes]") {
  const Recording data;
  auto color = data.read();
  REQUIRE(color);
  CHECK(color->of_frame[0].line == 3);
  CHECK(color->of_frame[1].line == 2);
  write_text(data.at / "rgb.txt", "1.000 rgb/1.png\n1.981 rgb/1.png\n2.019 rgb/2.png\n2.021 rgb/1.png\n");
  color = data.read();
  CHECK(color->of_frame[1].line == 2);
  write_text(data.at / "rgb.txt", "1.000 rgb/1.png\n1.97 rgb/1.png\n2.03 rgb/2.png\n");
  color = data.read();
  CHECK(color->of_frame[1].file.empty());
  CHECK(color->frames_without() == 1);
  const Json result = run(with_planes(data.at, "color"), data.at).json();
  CHECK(result["frames"][0]["color"]["pixels"] == kWidth * kHeight);
  CHECK(result["frames"][1]["color"]["pixels"] == 0);
  CHECK(contains(result["frames"][1]["color"]["refused"], "no picture within 0.02 s"));
}

TEST_CASE("what is wrong with rgb.txt is said", "[app][dataset][planes][hostile]") {
  const Recording data;
  write_text(data.at / "rgb.txt", "1.0 rgb/1.png\nx rgb/1.png\n1.5\n2.0 rgb/none.png\n-1 rgb/2.png\n");
  const auto color = data.read();
  REQUIRE(color);
  REQUIRE(color->refused.size() == 4);
  CHECK(color->refused[0].reason == "rgb.txt:2: 'x' is not a finite number");
  CHECK(color->refused[1].reason == "rgb.txt:3: 1 columns instead of 'timestamp filename'");
  CHECK(color->refused[2].reason == "rgb.txt:4: rgb/none.png: no such file");
  CHECK(run(with_planes(data.at, "color"), data.at).json()["pictures_refused"].size() == 4);
  write_text(data.at / "rgb.txt", "x rgb/1.png\n");
  CHECK(contains(data.error(), "rgb.txt: no picture within 0.02 s of a depth frame; the first: rgb.txt:1: 'x'"));
  write_text(data.at / "rgb.txt", "");
  CHECK(contains(data.error(), "rgb.txt: no picture"));
  fs::remove(data.at / "rgb.txt");
  CHECK(contains(data.error(), "rgb.txt: no such file"));
  CHECK(run(with_planes(data.at, "color"), data.at).exit_code == 3);
  CHECK(run(with_planes(data.at, "sensor"), data.at).exit_code == 0);
}

TEST_CASE("a frame whose picture is broken is mapped without colours", "[app][dataset][planes][hostile]") {
  const Recording data;
  const std::string whole = read_text(data.at / "rgb/2.png");
  for (const std::string& broken : {std::string("no picture"), whole.substr(0, whole.size() / 2), std::string()}) {
    write_text(data.at / "rgb/2.png", broken);
    const PrintedJson printed = run(with_planes(data.at, "color"), data.at);
    REQUIRE(printed.exit_code == 0);
    const Json result = printed.json();
    CHECK(result["frames"].size() == 2);
    CHECK(contains(result["frames"][1]["color"]["refused"], "rgb.txt:2: "));
    CHECK(result["planes"]["color"]["voxels"].get<int>() > 100);
  }
}

TEST_CASE("a colour camera of another size needs a file that tells of it", "[app][dataset][planes]") {
  const Recording data;
  for (const std::string name : {"1.png", "2.png"}) write_color(data.at / "rgb" / name, 2 * kWidth, 2 * kHeight);
  Json result = run(with_planes(data.at, "color"), data.at).json();
  CHECK(result["planes"]["color"]["voxels"] == 0);
  CHECK(contains(result["frames"][0]["color"]["refused"], "64 x 48 pixels instead of 32 x 24: rgb_camera_info.yaml"));

  const std::string info = camera_info(2);
  write_text(data.at / "rgb_camera_info.yaml",
             info + "camera_T_depth: {translation_m: [0, 0, 0], quaternion_xyzw: [0, 0, 0, 1]}\n");
  MapCommandOptions options = with_planes(data.at, "color");
  options.at = "-0.275,0.025,1.0";
  result = run(options, data.at).json();
  CHECK(result["planes"]["color"]["voxels"] == result["voxels"]["occupied"]);
  CHECK(result["place"]["color"] == Json({220, 10, 10}));
  // The depth camera 0.5 m to the right of the colour camera: what it sees at x is at x + 0.5 for that one.
  write_text(data.at / "rgb_camera_info.yaml",
             info + "camera_T_depth: {translation_m: [0.5, 0, 0], quaternion_xyzw: [0, 0, 0, 1]}\n");
  CHECK(run(options, data.at).json()["place"]["color"] == Json({10, 220, 10}));

  for (const auto& [text, complaint] :
       {std::pair<std::string, std::string>{"", "no such key"},
        {"camera_T_depth: {translation_m: [0, 0], quaternion_xyzw: [0, 0, 0, 1]}\n", "three and four numbers"},
        {"camera_T_depth: {translation_m: [0, 0, 0], quaternion_xyzw: [0, 0, 0, 2]}\n", "length 1"},
        {"camera_T_depth: {translation_m: [25, 0, 0], quaternion_xyzw: [0, 0, 0, 1]}\n", "millimetres"},
        {"camera_T_depth: {translation_m: [.nan, 0, 0], quaternion_xyzw: [0, 0, 0, 1]}\n", "millimetres"},
        {"camera_T_depth: 7\n", "camera_T_depth"}}) {
    write_text(data.at / "rgb_camera_info.yaml", info + text);
    INFO(text);
    CHECK(contains(data.error(), "rgb_camera_info.yaml:"));
    CHECK(contains(data.error(), complaint));
  }
}

TEST_CASE("several sensors make one map", "[app][dataset][planes]") {
  const Recording first, second(6000);
  MapCommandOptions options = with_planes(first.at, "sensor");
  options.datasets = {first.at, second.at};
  options.at = "0.025,0.025,1.175";
  const Json both = run(options, first.at).json();
  CHECK(both["frames"].size() == 4);
  CHECK(both["frames"][2]["sensor"] == 2);
  CHECK(both["place"]["sensor"] == 2);
  CHECK(both["planes"]["sensor"]["voxels"].size() == 2);
  options.datasets = {second.at, first.at};  // the nearer wall last: what lies behind it was seen by the other
  options.at = "0.025,0.025,1.175";
  CHECK(run(options, first.at).json()["place"]["sensor"] == 1);
  options.at = "0.025,0.025,0.9";
  CHECK(run(options, first.at).json()["place"]["sensor"] == 2);
}

TEST_CASE("planes that cannot be are refused", "[app][dataset][planes][hostile]") {
  const Recording data;
  CHECK(run(with_planes(data.at, "colour"), data.at).exit_code == 2);
  MapCommandOptions stored;
  stored.from = data.at / "map.ot";
  stored.planes = "color";
  CHECK(run(stored, data.at).exit_code == 2);
}

TEST_CASE("planes that do not fit are refused with the numbers", "[app][dataset][planes]") {
  Recording data(60000);
  write_text(data.at / "groundtruth.txt", "1.00 0 0 0 0 0 0 1\n2.00 2 2 0 0 0 0 1\n");
  const auto depth = read_mapping_dataset(data.at);
  REQUIRE(depth);
  auto color = read_color_dataset(data.at, *depth);
  REQUIRE(color);
  const SensorRecording recording{*depth, *color};
  DatasetMappingOptions options;
  options.resolution_m = 0.02;
  options.range_max_m = 20;
  options.planes.color = true;
  const auto mapped = map_dataset({&recording, 1}, options, [](const FrameOutcome&) {});
  REQUIRE_FALSE(mapped);
  CHECK(mapped.error().fault == Fault::kMapTooLarge);
  CHECK(contains(std::string(mapped.error().detail()), "planes of 16 bytes each need"));
  CHECK(contains(std::string(mapped.error().detail()), "at most 1024 MiB"));
}

}  // namespace firstlook
