#include "app/dataset/mapping_dataset.hpp"

#include <octomap/octomap.h>
#include <png.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "app/cli/map_command.hpp"

namespace firstlook {
namespace {

namespace fs = std::filesystem;

constexpr int kWidth = 32, kHeight = 24;

void write_text(const fs::path& file, const std::string& text) { std::ofstream(file, std::ios::binary) << text; }

std::string read_text(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

// A PNG of one value, 16-bit grey unless told otherwise.
void write_png(const fs::path& file, std::uint16_t value, int bit_depth = 16, int width = kWidth) {
  std::FILE* out = std::fopen(file.c_str(), "wb");
  REQUIRE(out != nullptr);
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  png_init_io(png, out);
  png_set_IHDR(png, info, static_cast<png_uint_32>(width), kHeight, bit_depth, PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_write_info(png, info);
  std::vector<png_byte> row;
  for (int column = 0; column < width; ++column) {
    if (bit_depth == 16) row.push_back(static_cast<png_byte>(value >> 8));
    row.push_back(static_cast<png_byte>(value & 0xff));
  }
  for (int i = 0; i < kHeight; ++i) png_write_row(png, row.data());
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

// What a command writes to stdout, and its exit code.
struct Printed {
  int exit_code = 0;
  std::string text;
};

Printed run(const MapCommandOptions& options, const fs::path& scratch) {
  Printed printed;
  std::fflush(stdout);
  const int saved = dup(STDOUT_FILENO);
  REQUIRE(std::freopen((scratch / "stdout").c_str(), "w", stdout) != nullptr);
  printed.exit_code = run_map_command(options);
  std::fflush(stdout);
  dup2(saved, STDOUT_FILENO);
  close(saved);
  printed.text = read_text(scratch / "stdout");
  return printed;
}

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

TEST_CASE("broken mapping data is named by file and line", "[app][dataset][hostile]") {
  SmallDataset data;
  CHECK(contains(std::string(read_mapping_dataset(data.folder / "nowhere").error().detail()), "nowhere"));
  SECTION("stamps of depth.txt") {
    data.depth = "2.0 depth/2.png\n1.0 depth/1.png\n";
    CHECK(contains(data.error(), "depth.txt:2: time stamps must ascend"));
    data.depth = "nan depth/2.png\n";
    CHECK(contains(data.error(), "depth.txt:1: 'nan'"));
    data.depth = "-1 depth/2.png\n";
    CHECK(contains(data.error(), "depth.txt:1: negative"));
    data.depth = "# nothing\n\n";
    CHECK(contains(data.error(), "depth.txt: no frames"));
  }
  SECTION("columns and files of depth.txt") {
    data.depth = "1.0\n";
    CHECK(contains(data.error(), "depth.txt:1: 1 columns"));
    data.depth = "\n1.0 depth/7.png\n";
    CHECK(contains(data.error(), "depth.txt:2: depth/7.png: no such file"));
  }
  SECTION("poses") {
    data.poses = "1.0 0 0 0 0 0 0 1\n2.0 0 nan 0 0 0 0 1\n";
    CHECK(contains(data.error(), "groundtruth.txt:2: 'nan'"));
    data.poses = "1.0 0 0 0 0 0 0 inf\n";
    CHECK(contains(data.error(), "groundtruth.txt:1: 'inf'"));
    data.poses = "1.0 0 0 0 0 0 0 0\n";
    CHECK(contains(data.error(), "groundtruth.txt:1: quaternion of length 0.0000"));
    data.poses = "1.0 0 0 0 0 0 1\n";
    CHECK(contains(data.error(), "groundtruth.txt:1: 7 columns"));
    data.poses = "1.0 0 0 0 0 0 0 1\n0.5 0 0 0 0 0 0 1\n";
    CHECK(contains(data.error(), "groundtruth.txt:2: time stamps must ascend"));
    data.poses = "1.0x 0 0 0 0 0 0 1\n";
    CHECK(contains(data.error(), "'1.0x'"));
    data.poses = "9.0 0 0 0 0 0 0 1\n";
    CHECK(contains(data.error(), "groundtruth.txt: no pose within"));
    data.poses = "";
    CHECK(contains(data.error(), "groundtruth.txt: no poses"));
  }
  SECTION("depth scale") {
    const std::string camera_info = data.camera_info;
    for (const std::string scale : {"0", "-1000", ".nan", ".inf", "many", "[1, 2]"}) {
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
  options.dataset = data.folder;
  options.out = data.folder / "out";
  options.json = true;
  const Printed printed = run(options, data.folder);
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
  CHECK(run(options, data.folder).text == printed.text);  // the same bytes again
}

TEST_CASE("map tells usage from data by its exit code", "[app][map_command][hostile]") {
  SmallDataset data;
  data.write();
  MapCommandOptions options;
  options.dataset = data.folder;
  const auto exit_code = [&] { return run(options, data.folder).exit_code; };
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
  options.dataset = data.folder / "none";
  CHECK(exit_code() == 3);
  options.dataset = data.folder;
  options.out = data.folder / "depth.txt" / "below-a-file";
  CHECK(exit_code() == 3);
  options.out.clear();
  write_png(data.folder / "depth/2.png", 5000, 16, kWidth + 1);
  CHECK(exit_code() == 3);
  write_text(data.folder / "depth/2.png", read_text(data.folder / "depth/1.png").substr(0, 60));
  CHECK(exit_code() == 3);
  write_png(data.folder / "depth/2.png", 5000);
  data.poses = "1.0 0 0 0 0 0 0 1\n2.0 1e6 0 0 0 0 0 1\n";
  data.write();
  CHECK(exit_code() == 3);  // a grid from here to there fits no memory
}

TEST_CASE("real Kinect frames give OctoMap's classes voxel for voxel", "[app][map_command][octomap]") {
  const fs::path folder = data_folder() / "kinect_frames";
  if (!fs::exists(folder)) {
    std::printf("skipped: no recorded data at %s\n", folder.c_str());
    return;
  }
  SmallDataset scratch;
  MapCommandOptions options;
  options.dataset = folder;
  options.out = scratch.folder / "out";
  REQUIRE(run(options, scratch.folder).exit_code == 0);
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
