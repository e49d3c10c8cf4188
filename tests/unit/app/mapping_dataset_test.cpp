#include "app/dataset/mapping_dataset.hpp"

#include <fmt/format.h>
#include <octomap/octomap.h>
#include <png.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "app/cli/map_command.hpp"
#include "tests/support/printed_map.hpp"

namespace firstlook {
namespace {

namespace fs = std::filesystem;
using test::print_map;
using test::Printed;
using test::read_text;

constexpr int kWidth = 32, kHeight = 24;

void write_text(const fs::path& file, const std::string& text) { std::ofstream(file, std::ios::binary) << text; }

// A PNG of one value, 16-bit grey unless told otherwise.
// The lower half may have another value.
void write_png(const fs::path& file, std::uint16_t value, int bit_depth = 16, int width = kWidth,
               std::optional<std::uint16_t> lower = std::nullopt) {
  std::FILE* out = std::fopen(file.c_str(), "wb");
  REQUIRE(out != nullptr);
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_init_io(png, out);
  png_set_IHDR(png, info, static_cast<png_uint_32>(width), kHeight, bit_depth, PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_write_info(png, info);
  for (int i = 0; i < kHeight; ++i) {
    const std::uint16_t here = i < kHeight / 2 ? value : lower.value_or(value);
    std::vector<png_byte> row;
    for (int column = 0; column < width; ++column) {
      if (bit_depth == 16) row.push_back(static_cast<png_byte>(here >> 8));
      row.push_back(static_cast<png_byte>(here & 0xff));
    }
    png_write_row(png, row.data());
  }
  png_write_end(png, info);
  png_destroy_write_struct(&png, &info);
  std::fclose(out);
}

// Two looks at a wall 1 m ahead, in a folder that vanishes with it.
struct SmallDataset {
  fs::path folder;
  std::string camera_info =
      "image_width: 32\nimage_height: 24\ncamera_name: depth\n"
      "camera_matrix: {rows: 3, cols: 3, data: [30.0, 0, 15.5, 0, 30.0, 11.5, 0, 0, 1]}\n"
      "distortion_model: plumb_bob\n"
      "distortion_coefficients: {rows: 1, cols: 5, data: [0, 0, 0, 0, 0]}\n";
  std::string depth = "# stamp file\n1.00 depth/1.png\n2.00 depth/2.png\n";
  std::string poses = "# stamp tx ty tz qx qy qz qw\n1.00 0 0 0 0 0 0 1\n2.00 0.1 0 0 0 0 0 1\n";

  SmallDataset() {
    std::string name = (fs::temp_directory_path() / "firstlook-mapping-XXXXXX").string();
    REQUIRE(mkdtemp(name.data()) != nullptr);
    folder = name;
    fs::create_directory(folder / "depth");
    write_png(folder / "depth/1.png", 5000);
    write_png(folder / "depth/2.png", 5000);
  }
  SmallDataset(const SmallDataset&) = delete;
  SmallDataset& operator=(const SmallDataset&) = delete;
  ~SmallDataset() {
    std::error_code ignored;
    fs::remove_all(folder, ignored);
  }
  void write() const {
    write_text(folder / "camera_info.yaml", camera_info);
    write_text(folder / "depth.txt", depth);
    write_text(folder / "groundtruth.txt", poses);
  }
  [[nodiscard]] Result<MappingDataset> read() const {
    write();
    return read_mapping_dataset(folder);
  }
  [[nodiscard]] std::string error() const {
    const Result<MappingDataset> dataset = read();
    return dataset ? "read without error" : std::string(dataset.error().detail());
  }
};

// The folder of recorded data, where there is one.
fs::path data_folder() {
  if (const char* folder = std::getenv("FIRSTLOOK_DATA")) return folder;
  return fs::path(FIRSTLOOK_SOURCE_DIR) / "../shared/data";
}

bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

}  // namespace

TEST_CASE("a mapping dataset is read with its poses", "[app][dataset]") {
  SmallDataset data;
  const Result<MappingDataset> dataset = data.read();
  REQUIRE(dataset);
  REQUIRE(dataset->frames.size() == 2);
  CHECK(dataset->units_per_m == 5000);
  CHECK(dataset->intrinsics.fx == 30);
  CHECK(dataset->frames[1].map_T_depth.translation().x() == Approx(0.1));
  data.camera_info += "depth_scale: 1000\n";
  CHECK(data.read()->units_per_m == 1000);
}

TEST_CASE("poses are taken at the frame's stamp", "[app][dataset]") {
  SmallDataset data;
  data.depth =
      "1.0 depth/1.png\n1.05 depth/2.png\n1.21 depth/1.png\n1.5 depth/1.png\n3.01 depth/1.png\n3.1 depth/1.png\n";
  data.poses =
      "1.0 0 0 0 0 0 0 1\n1.1 0.2 0 0 0 0 0.7071 0.7071\n1.2 0.4 0 0 0 0 0 1\n"
      "1.9 9 0 0 0 0 0 1\n3.0 1 0 0 0 0 0 1\n";
  const Result<MappingDataset> dataset = data.read();
  REQUIRE(dataset);
  REQUIRE(dataset->frames.size() == 4);
  CHECK(dataset->frames_without_pose == 2);                                // 1.5 s and 3.1 s
  CHECK(dataset->frames[1].map_T_depth.translation().x() == Approx(0.1));  // half way
  const double turn_rad = Eigen::AngleAxisd(dataset->frames[1].map_T_depth.quaternion()).angle();
  CHECK(turn_rad == Approx(3.14159 / 4).margin(1e-4));
  CHECK(dataset->frames[2].map_T_depth.translation().x() == Approx(0.4));  // 10 ms after 1.2 s, the next too far off
  CHECK(dataset->frames[3].map_T_depth.translation().x() == Approx(1.0));
}

TEST_CASE("poses may come in any order, and each time counts once", "[app][dataset]") {
  SmallDataset data;
  data.depth = "1.05 depth/1.png\n1.15 depth/2.png\n";
  data.poses = "1.2 0.4 0 0 0 0 0 1\n# note\n1.0 0 0 0 0 0 0 1\n1.1 0.2 0 0 0 0 0 1\n1.1 7 0 0 0 0 0 1\n";
  const Result<MappingDataset> dataset = data.read();
  REQUIRE(dataset);
  CHECK(dataset->poses_were_sorted);
  REQUIRE(dataset->frames.size() == 2);
  CHECK(dataset->frames[0].map_T_depth.translation().x() == Approx(0.1));
  CHECK(dataset->frames[1].map_T_depth.translation().x() == Approx(0.3));
  REQUIRE(dataset->refused_poses.size() == 1);
  CHECK(dataset->refused_poses[0].reason == "groundtruth.txt:5: the stamp of line 4 again");
}

TEST_CASE("where the camera was lost no pose is interpolated", "[app][dataset][hostile]") {
  SmallDataset data;
  for (const std::string lost : {"1.1 nan 0 0 0 0 0 1", "1.1 0 0 inf 0 0 0 1", "1.1 0 0 0 0 0 0 0", "1.1 lost"}) {
    data.depth = "1.01 depth/1.png\n1.05 depth/1.png\n1.1 depth/1.png\n1.15 depth/1.png\n1.2 depth/2.png\n";
    data.poses = "1.0 0 0 0 0 0 0 1\n" + lost + "\n1.2 0.4 0 0 0 0 0 1\n";
    const Result<MappingDataset> dataset = data.read();
    INFO(lost);
    REQUIRE(dataset);
    REQUIRE(dataset->frames.size() == 2);  // 1.01 s takes the pose of 1.0 s, 1.2 s its own
    CHECK(dataset->frames[0].map_T_depth.translation().x() == 0);
    CHECK(dataset->frames[1].line == 5);
    CHECK(dataset->frames_without_pose == 3);
    REQUIRE(dataset->refused.size() == 3);
    CHECK(contains(dataset->refused[1].reason, "depth.txt:3: groundtruth.txt:2: "));
    CHECK(dataset->refused_poses.size() == 1);
  }
}

TEST_CASE("frames whose stamps go back are refused, or sorted when asked", "[app][dataset][hostile]") {
  SmallDataset data;
  data.depth = "2.0 depth/2.png\n1.0 depth/1.png\n2.0 depth/1.png\n";
  data.write();
  const MappingDataset recorded = read_mapping_dataset(data.folder).value();
  REQUIRE(recorded.frames.size() == 1);
  REQUIRE(recorded.refused.size() == 2);
  CHECK(contains(recorded.refused[0].reason, "depth.txt:2: time stamps must ascend, and line 1 has 2.000000 s"));
  CHECK(contains(recorded.refused[1].reason, "depth.txt:3: the stamp of line 1 again"));
  const MappingDataset sorted = read_mapping_dataset(data.folder, FrameOrder::kByStamp).value();
  REQUIRE(sorted.frames.size() == 2);
  CHECK(sorted.frames[0].line == 2);
  CHECK(sorted.frames[1].line == 1);
  CHECK(sorted.refused.size() == 1);
}

TEST_CASE("broken lines are left out, counted and named", "[app][dataset][hostile]") {
  SmallDataset data;
  const auto reason = [&] {
    const Result<MappingDataset> dataset = data.read();
    REQUIRE(dataset);
    REQUIRE(dataset->refused.size() + dataset->refused_poses.size() == 1);
    return dataset->refused.empty() ? dataset->refused_poses[0].reason : dataset->refused[0].reason;
  };
  const std::string good = "1.0 depth/1.png\n", good_pose = "1.0 0 0 0 0 0 0 1\n";
  SECTION("of depth.txt") {
    for (const auto& [line, expected] : {std::pair{"nan depth/2.png", "'nan'"},
                                         {"-1 depth/2.png", "negative"},
                                         {"2.0", "1 columns"},
                                         {"2.0 depth/2.png x", "3 columns"},
                                         {"2.0 depth/7.png", "depth/7.png: no such file"},
                                         {"9.0 depth/2.png", "no pose within 0.02 s"}}) {
      data.depth = good + line + "\n";
      CHECK(contains(reason(), std::string("depth.txt:2: ")));
      CHECK(contains(reason(), expected));
    }
  }
  SECTION("of groundtruth.txt") {
    data.depth = good;
    for (const auto& [line, expected] : {std::pair{"2.0 0 nan 0 0 0 0 1", "'nan'"},
                                         {"2.0 0 0 0 0 0 0 inf", "'inf'"},
                                         {"2.0 0 0 0 0 0 0 0", "quaternion of length 0.0000"},
                                         {"2.0 0 0 0 0 0 1", "7 columns"},
                                         {"2.0x 0 0 0 0 0 0 1", "'2.0x'"}}) {
      data.poses = good_pose + line + "\n";
      CHECK(contains(reason(), std::string("groundtruth.txt:2: ")));
      CHECK(contains(reason(), expected));
    }
  }
}

TEST_CASE("data of which nothing is left are refused with the first reason", "[app][dataset][hostile]") {
  SmallDataset data;
  CHECK(contains(std::string(read_mapping_dataset(data.folder / "nowhere").error().detail()), "nowhere"));
  SECTION("frames") {
    data.depth = "# nothing\n\n";
    CHECK(contains(data.error(), "depth.txt: no frames"));
    data.depth = "\n1.0 depth/7.png\n";
    CHECK(contains(data.error(), "depth.txt:2: depth/7.png: no such file"));
  }
  SECTION("poses") {
    data.poses = "1.0 0 0 0 0 0 0 0\n";
    CHECK(contains(data.error(), "groundtruth.txt:1: quaternion of length 0.0000"));
    data.poses = "9.0 0 0 0 0 0 0 1\n";
    CHECK(contains(data.error(), "groundtruth.txt: no pose within"));
    data.poses = "";
    CHECK(contains(data.error(), "groundtruth.txt: no poses"));
  }
  SECTION("depth scale") {
    const std::string camera_info = data.camera_info;
    for (const std::string scale : {"0", "-1000", ".nan", ".inf", "many", "[1, 2]", "5000000"}) {
      data.camera_info = camera_info + "depth_scale: " + scale + "\n";
      CHECK(contains(data.error(), "camera_info.yaml:7"));
    }
  }
  for (const std::string file : {"depth.txt", "groundtruth.txt", "camera_info.yaml"}) {
    SmallDataset incomplete;
    incomplete.write();
    fs::remove(incomplete.folder / file);
    const Result<MappingDataset> dataset = read_mapping_dataset(incomplete.folder);
    REQUIRE_FALSE(dataset);
    CHECK(dataset.error().fault == Fault::kDataMissing);
    CHECK(contains(std::string(dataset.error().detail()), file));
  }
}

TEST_CASE("depth pictures are read whole or not at all", "[app][dataset][hostile]") {
  SmallDataset data;
  const fs::path good = data.folder / "depth/1.png", bad = data.folder / "bad.png";
  const Result<DepthPixels> image = read_depth_png(good);
  REQUIRE(image);
  CHECK(image->width == kWidth);
  CHECK(image->height == kHeight);
  CHECK(image->pixels == std::vector<std::uint16_t>(kWidth * kHeight, 5000));

  CHECK(read_depth_png(data.folder / "none.png").error().fault == Fault::kDataMissing);
  CHECK(read_depth_png(data.folder).error().fault == Fault::kDataMissing);
  const std::string bytes = read_text(good);
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    write_text(bad, bytes.substr(0, size));
    REQUIRE(read_depth_png(bad).error().fault == Fault::kDataMalformed);
  }
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    std::string flipped = bytes;
    flipped[i] = static_cast<char>(flipped[i] ^ 0x41);
    write_text(bad, flipped);
    (void)read_depth_png(bad);  // whatever it says, it says it in a value
  }
  write_png(bad, 50, 8);
  CHECK(contains(std::string(read_depth_png(bad).error().detail()), "not a 16-bit grey picture"));
}

TEST_CASE("map prints counts that add up and writes files that OctoMap reads", "[app][map_command]") {
  SmallDataset data;
  data.write();
  MapCommandOptions options;
  options.datasets = {data.folder};
  options.out = data.folder / "out";
  options.json = true;
  const Printed printed = print_map(options, data.folder);
  REQUIRE(printed.exit_code == 0);
  const nlohmann::json result = nlohmann::json::parse(printed.text);
  CHECK(result["frames"].size() == 2);
  CHECK(result["frames"][0]["pixels"]["used"] == kWidth * kHeight);
  const nlohmann::json voxels = result["voxels"];
  CHECK(result["frames"][1]["voxels"] == voxels);
  const std::size_t known = voxels["free"].get<std::size_t>() + voxels["occupied"].get<std::size_t>();
  CHECK(result["frames"][0]["voxels_discovered"].get<std::size_t>() +
            result["frames"][1]["voxels_discovered"].get<std::size_t>() ==
        known);
  octomap::OcTree tree(0.1);
  REQUIRE(tree.readBinary((options.out / "collision_map.bt").string()));
  CHECK(tree.getResolution() == 0.05);
  const auto* wall = tree.search(0.02, 0.02, 1.02);
  REQUIRE(wall != nullptr);
  CHECK(tree.isNodeOccupied(wall));
  CHECK(read_text(options.out / "map.ply").starts_with("ply\n"));
  CHECK(read_text(options.out / "map.ot").starts_with("# Octomap OcTree file\n"));
  CHECK(print_map(options, data.folder).text == printed.text);  // the same bytes again
}

TEST_CASE("map tells usage from data by its exit code", "[app][map_command][hostile]") {
  SmallDataset data;
  data.write();
  MapCommandOptions options;
  options.datasets = {data.folder};
  const auto exit_code = [&] { return print_map(options, data.folder).exit_code; };
  CHECK(exit_code() == 0);
  for (const double bad : {0.0, -0.05, 1e-9, 7.0, std::nan("")}) {
    options.resolution_m = bad;
    CHECK(exit_code() == 2);
  }
  options.resolution_m = 0.05;
  for (const double bad : {0.0, -1.0, 1e9, std::nan("")}) {
    options.range_max_m = bad;
    CHECK(exit_code() == 2);
  }
  options.range_max_m = 5;
  options.datasets = {data.folder / "none"};
  CHECK(exit_code() == 3);
  options.datasets = {data.folder};
  options.out = data.folder / "depth.txt" / "below-a-file";
  CHECK(exit_code() == 3);
  options.out.clear();
  data.poses = "1.0 0 0 0 0 0 0 1\n2.0 1500 900 700 0 0 0 1\n";
  data.write();
  options.resolution_m = 0.05;
  CHECK(exit_code() == 3);  // a grid from here to there fits no memory
  options.from = data.folder / "map.ot";
  CHECK(exit_code() == 2);  // and a dataset
  options.datasets.clear();
  CHECK(exit_code() == 3);
  options.from.clear();
  CHECK(exit_code() == 2);
}

TEST_CASE("frames that cannot be are refused and counted, the others are mapped", "[app][map_command][hostile]") {
  SmallDataset data;
  for (int i = 3; i <= 9; ++i) {
    write_png(data.folder / fmt::format("depth/{}.png", i), 5000);
    data.depth += fmt::format("{}.00 depth/{}.png\n", i, i);
    data.poses += fmt::format("{}.00 {} 0 0 0 0 0 1\n", i, i == 8 ? 1e7 : 0.02 * i);
  }
  write_png(data.folder / "depth/3.png", 5000, 16, kWidth + 1);
  write_text(data.folder / "depth/4.png", read_text(data.folder / "depth/1.png").substr(0, 60));
  write_png(data.folder / "depth/5.png", 0);
  write_png(data.folder / "depth/6.png", 5);      // 1 mm
  write_png(data.folder / "depth/7.png", 65535);  // saturated
  data.write();
  MapCommandOptions options;
  options.datasets = {data.folder};
  options.out = data.folder / "out";
  options.json = true;
  const Printed printed = print_map(options, data.folder);
  REQUIRE(printed.exit_code == 0);
  const nlohmann::json result = nlohmann::json::parse(printed.text);
  CHECK(result["frames"].size() == 3);
  CHECK(result["frames_refused"] == 6);
  const auto reason = [&](std::size_t i) { return result["refused"][i]["reason"].get<std::string>(); };
  CHECK(contains(reason(0), "depth.txt:4: 3.png: 33 x 24 pixels instead of the 32 x 24"));
  CHECK(contains(reason(1), "depth.txt:5: 4.png:"));
  CHECK(contains(reason(2), "no pixel has a depth"));
  CHECK(contains(reason(3), "median depth would be 0.001 m: depth_scale 5000"));
  CHECK(contains(reason(4), "no pixel has a depth"));
  CHECK(contains(reason(5), "farther away than"));

  // The same map as from the frames that are right, and a row for each line.
  SmallDataset clean;
  write_png(clean.folder / "depth/9.png", 5000);
  clean.depth += "9.00 depth/9.png\n";
  clean.poses += "9.00 0.18 0 0 0 0 0 1\n";
  clean.write();
  options.datasets = {clean.folder};
  options.out = clean.folder / "out";
  REQUIRE(print_map(options, clean.folder).exit_code == 0);
  CHECK(read_text(clean.folder / "out/map.ot") == read_text(data.folder / "out/map.ot"));
  const std::string csv = read_text(data.folder / "out/frames.csv");
  CHECK(csv.starts_with("frame,line,stamp_s,image,unknown,free,occupied,points,refused\n"));
  CHECK(std::count(csv.begin(), csv.end(), '\n') == 10);
  CHECK(contains(csv, "9,10,9.000000,9.png,"));

  write_png(data.folder / "depth/6.png", 5000);
  data.camera_info += "depth_scale: 5\n";  // wrong by 1000: a wall 1 km away would clear everything
  data.write();
  options.datasets = {data.folder};
  CHECK(print_map(options, data.folder).exit_code == 3);
}

TEST_CASE("saturated pixels clear nothing", "[app][map_command][hostile]") {
  SmallDataset data;
  write_png(data.folder / "depth/2.png", 5000, 16, kWidth, 65535);
  data.write();
  MapCommandOptions options;
  options.datasets = {data.folder};
  options.json = true;
  const nlohmann::json result = nlohmann::json::parse(print_map(options, data.folder).text);
  const nlohmann::json pixels = result["frames"][1]["pixels"];
  CHECK(pixels["saturated"] == kWidth * kHeight / 2);
  CHECK(pixels["used"] == kWidth * kHeight / 2);
  CHECK(pixels["without_return"] == kWidth * kHeight / 2);
}

TEST_CASE("a place is told with its class, its frames and its neighbours", "[app][map_command]") {
  SmallDataset data;
  data.write();
  MapCommandOptions options;
  options.datasets = {data.folder};
  options.json = true;
  options.at = "0.02,0.02,1.02";
  const auto place = [&] { return nlohmann::json::parse(print_map(options, data.folder).text)["place"]; };
  nlohmann::json wall = place();
  CHECK(wall["class"] == "occupied");
  CHECK(wall["log_odds"].get<double>() == Approx(2 * 0.8473).margin(1e-3));
  CHECK(wall["seen"]["frames"] == 2);
  CHECK(wall["seen"]["frames_hit"] == 2);
  CHECK(wall["seen"]["last_hit_s"] == 2.0);
  CHECK(wall["nearest_occupied"]["distance_m"].get<double>() < 0.02);
  CHECK(wall["object"] == 1);
  options.at = "0.01,0.01,0.5";
  nlohmann::json air = place();
  CHECK(air["class"] == "free");
  CHECK(air["log_odds"].get<double>() < 0);
  CHECK(air["seen"]["frames_hit"] == 0);
  CHECK(air["seen"]["last_hit_s"].is_null());
  CHECK(air["nearest_occupied"]["distance_m"].get<double>() == Approx(0.525).margin(0.03));
  CHECK(air["object"].is_null());
  options.at = "0,0,-3";
  nlohmann::json outside = place();
  CHECK(outside["class"] == "unknown");
  CHECK(outside["inside_map"] == false);
  CHECK(outside["seen"]["frames"] == 0);
  for (const std::string bad : {"1,2", "1,2,3,4", "a,b,c", "1,2,nan", "1,2,1e99", ","}) {
    options.at = bad;
    CHECK(print_map(options, data.folder).exit_code == 2);
  }
}

TEST_CASE("a stored map is read, asked and changed", "[app][map_command][octomap]") {
  SmallDataset data;
  data.write();
  MapCommandOptions options;
  options.datasets = {data.folder};
  options.out = data.folder / "out";
  options.objects = true;
  REQUIRE(print_map(options, data.folder).exit_code == 0);
  CHECK(fs::file_size(data.folder / "out/objects.png") > 1000);

  MapCommandOptions stored;
  stored.from = data.folder / "out/map.ot";
  stored.json = true;
  stored.objects = true;
  stored.at = "0.02,0.02,1.02";
  nlohmann::json result = nlohmann::json::parse(print_map(stored, data.folder).text);
  CHECK(result["objects"].size() == 1);
  CHECK(result["objects"][0]["shape"] == "plane");
  CHECK(result["place"]["class"] == "occupied");
  CHECK(result["place"]["seen"].is_null());

  stored.moves = {"1,0,0,0.5"};
  stored.out = data.folder / "moved";
  result = nlohmann::json::parse(print_map(stored, data.folder).text);
  CHECK(result["place"]["class"] == "unknown");
  octomap::OcTree tree(0.1);
  REQUIRE(tree.readBinary((stored.out / "collision_map.bt").string()));
  const auto* moved = tree.search(0.02, 0.02, 1.52);
  REQUIRE(moved != nullptr);
  CHECK(tree.isNodeOccupied(moved));
  CHECK(tree.search(0.02, 0.02, 1.02) == nullptr);

  // The moved map against the old one: what was there is not known any more, nothing is gone.
  stored.moves.clear();
  stored.out.clear();
  stored.from = data.folder / "moved/map.ot";
  stored.prior = data.folder / "out/collision_map.bt";
  result = nlohmann::json::parse(print_map(stored, data.folder).text);
  CHECK(result["prior"]["gone"] == 0);
  CHECK(result["prior"]["unseen_occupied"] == result["objects"][0]["voxels"]);
  CHECK(result["prior"]["first_known"] == result["objects"][0]["voxels"]);
  for (const std::string bad : {"7,0,0,1", "0,0,0,1", "1.5,0,0,1", "1,0,0", "1,0,0,nan", "x"}) {
    stored.moves = {bad};
    CHECK(print_map(stored, data.folder).exit_code == 2);
  }
}

TEST_CASE("real Kinect frames give OctoMap's classes voxel for voxel", "[app][map_command][octomap]") {
  const fs::path folder = data_folder() / "kinect_frames";
  if (!fs::exists(folder)) {
    std::printf("skipped: no recorded data at %s\n", folder.c_str());
    return;
  }
  SmallDataset scratch;
  MapCommandOptions options;
  options.datasets = {folder};
  options.out = scratch.folder / "out";
  REQUIRE(print_map(options, scratch.folder).exit_code == 0);
  std::unique_ptr<octomap::AbstractOcTree> read(octomap::AbstractOcTree::read((options.out / "map.ot").string()));
  const auto* ours = dynamic_cast<octomap::OcTree*>(read.get());
  REQUIRE(ours != nullptr);

  octomap::OcTree theirs(0.05);
  const Result<MappingDataset> dataset = read_mapping_dataset(folder);
  REQUIRE(dataset);
  const CameraIntrinsics& c = dataset->intrinsics;
  for (const MappingFrame& frame : dataset->frames) {
    const DepthPixels image = read_depth_png(frame.image).value();
    octomap::Pointcloud cloud;
    for (int v = 0; v < image.height; ++v) {
      for (int u = 0; u < image.width; ++u) {
        const double z_m = image.view(dataset->units_per_m).pixels.at(u, v) / dataset->units_per_m;
        if (z_m == 0) continue;
        const Eigen::Vector3f p =
            (frame.map_T_depth * Eigen::Vector3d((u - c.cx) / c.fx * z_m, (v - c.cy) / c.fy * z_m, z_m)).cast<float>();
        cloud.push_back(p.x(), p.y(), p.z());
      }
    }
    const Eigen::Vector3f origin = frame.map_T_depth.translation().cast<float>();
    theirs.insertPointCloud(cloud, {origin.x(), origin.y(), origin.z()}, 5.0);
  }
  // Opened up to single voxels, both trees must have the same leaves with the same classes.
  theirs.expand();
  std::size_t voxels = 0, differ = 0, near_ties = 0;
  for (auto leaf = theirs.begin_leafs(); leaf != theirs.end_leafs(); ++leaf, ++voxels) {
    const auto* node = ours->search(leaf.getKey());
    if (node != nullptr && ours->isNodeOccupied(node) == theirs.isNodeOccupied(*leaf)) continue;
    const bool tie = node != nullptr && std::abs(leaf->getLogOdds()) < 0.2f;
    ++(tie ? near_ties : differ);
  }
  octomap::OcTree expanded(*ours);
  expanded.expand();
  CHECK(voxels > 200000);
  CHECK(differ == 0);
  CHECK(near_ties < 5);
  CHECK(expanded.getNumLeafNodes() == voxels);
}

}  // namespace firstlook
