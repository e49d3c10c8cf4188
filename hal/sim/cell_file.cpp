#include "hal/sim/cell_file.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <limits>
#include <numbers>
#include <numeric>
#include <set>
#include <sstream>
#include <vector>

#include "algorithms/vision/camera_model.hpp"
#include "algorithms/vision/target_names.hpp"
#include "algorithms/vision/target_set.hpp"
#include "hal/sim/built_in_cells.hpp"
#include "hal/sim/random_cell.hpp"
#include "hal/sim/triangulation.hpp"

namespace firstlook::sim {
namespace {

using Eigen::Vector3d;

constexpr double kWallThickness_m = 0.1;
constexpr double kFar_m = 50;  // no cell is larger
constexpr double kRadians = std::numbers::pi / 180;

/// Leaves the parser of this file; nothing else throws or catches it.
struct CellFailure {
  Error error;
};

std::size_t edits_between(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t above = row[j];
      row[j] = std::min({above + 1, row[j - 1] + 1, diagonal + (a[i - 1] == b[j - 1] ? 0 : 1)});
      diagonal = above;
    }
  }
  return row[b.size()];
}

/// One mapping of the file. Every key must be known; every value is checked where it stands.
class Section {
 public:
  Section(const std::string& file, const YAML::Node& node, const std::string& path,
          std::initializer_list<std::string_view> keys)
      : file_(file), node_(node), path_(path) {
    if (!node_.IsMap()) fail(node_, "{} must be a mapping", path_.empty() ? "the cell" : path_);
    std::set<std::string> met;
    for (const auto& entry : node_) {
      const std::string key = entry.first.as<std::string>();
      if (!met.insert(key).second) fail(entry.first, "{} stands twice", inside(key));
      if (std::ranges::find(keys, key) != keys.end()) continue;
      const std::string_view nearest =
          *std::ranges::min_element(keys, {}, [&](std::string_view known) { return edits_between(key, known); });
      fail(entry.first, "unknown key {}; the nearest is '{}'", inside(key), nearest);
    }
  }

  template <typename... Args>
  [[noreturn]] void fail(const YAML::Node& at, fmt::format_string<Args...> text, Args&&... args) const {
    const YAML::Mark mark = at.Mark();
    throw CellFailure{failure(Fault::kCellInvalid, "{}:{}:{}: {}", file_, mark.line + 1, mark.column + 1,
                              fmt::format(text, std::forward<Args>(args)...))
                          .error()};
  }

  [[nodiscard]] bool has(const char* key) const { return static_cast<bool>(node_[key]); }
  [[nodiscard]] YAML::Node child(const char* key) const {
    if (!has(key)) fail(node_, "{} is missing", inside(key));
    return node_[key];
  }
  [[nodiscard]] std::string inside(std::string_view key) const {
    return path_.empty() ? std::string(key) : path_ + "." + std::string(key);
  }
  [[nodiscard]] const std::string& file() const { return file_; }

  [[nodiscard]] double number(const char* key, double low, double high) const {
    return number_at(child(key), key, low, high);
  }
  [[nodiscard]] double number_or(const char* key, double otherwise, double low, double high) const {
    return has(key) ? number(key, low, high) : otherwise;
  }
  [[nodiscard]] int integer_or(const char* key, int otherwise, int low, int high) const {
    if (!has(key)) return otherwise;
    const double value = number(key, low, high);
    if (value != std::floor(value)) fail(child(key), "{} must be a whole number", inside(key));
    return static_cast<int>(value);
  }
  [[nodiscard]] bool flag_or(const char* key, bool otherwise) const {
    bool value = otherwise;
    if (has(key) && !YAML::convert<bool>::decode(child(key), value)) {
      fail(child(key), "{} must be true or false", inside(key));
    }
    return value;
  }
  [[nodiscard]] std::string text_or(const char* key, const std::string& otherwise) const {
    if (!has(key)) return otherwise;
    if (!child(key).IsScalar()) fail(child(key), "{} must be a word", inside(key));
    return child(key).Scalar();
  }
  [[nodiscard]] std::vector<double> numbers(const char* key, std::size_t count, double low, double high) const {
    const YAML::Node node = child(key);
    if (!node.IsSequence() || node.size() != count) fail(node, "{} must be a list of {} numbers", inside(key), count);
    std::vector<double> values;
    for (const auto& item : node) values.push_back(number_at(item, key, low, high));
    return values;
  }
  [[nodiscard]] Vector3d vector(const char* key, double low = -kFar_m, double high = kFar_m) const {
    const std::vector<double> v = numbers(key, 3, low, high);
    return {v[0], v[1], v[2]};
  }
  [[nodiscard]] Vector3d vector_or(const char* key, const Vector3d& otherwise, double low = -kFar_m,
                                   double high = kFar_m) const {
    return has(key) ? vector(key, low, high) : otherwise;
  }

 private:
  [[nodiscard]] double number_at(const YAML::Node& node, const char* key, double low, double high) const {
    double value = 0;
    if (!node.IsScalar() || !YAML::convert<double>::decode(node, value)) fail(node, "{} must be a number", inside(key));
    if (!(value >= low && value <= high)) fail(node, "{} = {} is not in [{}, {}]", inside(key), value, low, high);
    return value;
  }

  const std::string& file_;
  const YAML::Node node_;
  const std::string path_;
};

constexpr double kSizeMin_m = 1e-4;

/// Roll, pitch, yaw about the fixed axes x, y, z (as URDF has them).
Pose read_pose(const Section& section) {
  Pose pose = Pose::Identity();
  pose.translation() = section.vector_or("position_m", Vector3d::Zero());
  const Vector3d rpy = section.vector_or("rpy_deg", Vector3d::Zero(), -360, 360) * kRadians;
  pose.linear() = (Eigen::AngleAxisd(rpy.z(), Vector3d::UnitZ()) * Eigen::AngleAxisd(rpy.y(), Vector3d::UnitY()) *
                   Eigen::AngleAxisd(rpy.x(), Vector3d::UnitX()))
                      .toRotationMatrix();
  return pose;
}

Shape read_shape(const Section& section, const YAML::Node& node) {
  const bool box = section.has("box"), cylinder = section.has("cylinder");
  if (box == cylinder) section.fail(node, "{} must have either 'box' or 'cylinder'", section.inside("shape"));
  if (box) {
    const Section shape(section.file(), section.child("box"), section.inside("box"), {"size_m"});
    return Box{0.5 * shape.vector("size_m", kSizeMin_m, kFar_m)};
  }
  const Section shape(section.file(), section.child("cylinder"), section.inside("cylinder"), {"radius_m", "height_m"});
  return Cylinder{shape.number("radius_m", kSizeMin_m, kFar_m), 0.5 * shape.number("height_m", kSizeMin_m, kFar_m)};
}

Surface read_surface(const Section& section) {
  Surface surface;
  const Vector3d color = section.vector_or("color", Vector3d(0.6, 0.6, 0.6), 0, 1);
  for (std::size_t i = 0; i < 3; ++i) surface.color[i] = static_cast<float>(color[static_cast<int>(i)]);
  surface.returns_depth = section.flag_or("returns_depth", true);
  return surface;
}

void read_solids(const Section& cell, Scene& scene) {
  if (!cell.has("solids")) return;
  const YAML::Node list = cell.child("solids");
  if (!list.IsSequence()) cell.fail(list, "solids must be a list");
  for (std::size_t i = 0; i < list.size(); ++i) {
    const Section section(cell.file(), list[i], fmt::format("solids[{}]", i),
                          {"name", "box", "cylinder", "position_m", "rpy_deg", "color", "returns_depth"});
    scene.solids.push_back({section.text_or("name", fmt::format("solid {}", i)), read_pose(section),
                            read_shape(section, list[i]), read_surface(section)});
  }
}

void read_regions(const Section& cell, const char* key, std::vector<Region>& regions) {
  if (!cell.has(key)) return;
  const YAML::Node list = cell.child(key);
  if (!list.IsSequence()) cell.fail(list, "{} must be a list", key);
  for (std::size_t i = 0; i < list.size(); ++i) {
    const Section section(cell.file(), list[i], fmt::format("{}[{}]", key, i), {"name", "low_m", "high_m"});
    const Region region{section.text_or("name", fmt::format("{} {}", key, i)), section.vector("low_m"),
                        section.vector("high_m")};
    if (!(region.low_m.array() < region.high_m.array()).all()) section.fail(list[i], "low_m must lie below high_m");
    regions.push_back(region);
  }
}

Solid plain_box(const char* name, const Vector3d& low, const Vector3d& high, const std::array<float, 3>& color) {
  Solid solid;
  solid.name = name;
  solid.shape = Box{0.5 * (high - low)};
  solid.base_T_solid.translation() = 0.5 * (high + low);
  solid.surface.color = color;
  return solid;
}

/// The floor reaches out to the walls, or 8 m where there are none.
void read_room(const Section& cell, Scene& scene) {
  const double floor = cell.number_or("floor_m", -0.85, -kFar_m, -0.1);
  Vector3d low(-8, -8, floor), high(8, 8, floor);
  const double t = kWallThickness_m;
  constexpr std::array<float, 3> kWallColor{0.72F, 0.71F, 0.68F}, kFloorColor{0.45F, 0.44F, 0.42F};
  if (cell.has("walls")) {
    const Section walls(cell.file(), cell.child("walls"), "walls", {"low_m", "high_m", "height_m", "ceiling"});
    const std::vector<double> l = walls.numbers("low_m", 2, -kFar_m, -0.6), h = walls.numbers("high_m", 2, 0.6, kFar_m);
    low = {l[0], l[1], floor};
    high = {h[0], h[1], floor + walls.number_or("height_m", 2.6, 0.1, 20)};
    const auto wall = [&](const char* name, const Vector3d& from, const Vector3d& to) {
      scene.solids.push_back(plain_box(name, from, to, kWallColor));
    };
    wall("wall -x", {low.x() - t, low.y() - t, low.z()}, {low.x(), high.y() + t, high.z()});
    wall("wall +x", {high.x(), low.y() - t, low.z()}, {high.x() + t, high.y() + t, high.z()});
    wall("wall -y", {low.x(), low.y() - t, low.z()}, {high.x(), low.y(), high.z()});
    wall("wall +y", {low.x(), high.y(), low.z()}, {high.x(), high.y() + t, high.z()});
    if (walls.flag_or("ceiling", true)) {
      wall("ceiling", {low.x() - t, low.y() - t, high.z()}, {high.x() + t, high.y() + t, high.z() + t});
    }
  }
  scene.solids.push_back(
      plain_box("floor", {low.x() - t, low.y() - t, floor - t}, {high.x() + t, high.y() + t, floor}, kFloorColor));
}

void read_cart(const Section& cell, Scene& scene) {
  double top = -0.02;
  std::vector<double> low{-0.40, -0.30}, high{0.40, 0.30};
  if (cell.has("cart")) {
    const Section cart(cell.file(), cell.child("cart"), "cart", {"low_m", "high_m", "top_m"});
    top = cart.number_or("top_m", top, -0.5, 0.0);
    if (cart.has("low_m")) low = cart.numbers("low_m", 2, -2, -0.1);
    if (cart.has("high_m")) high = cart.numbers("high_m", 2, 0.1, 2);
  }
  const double floor = cell.number_or("floor_m", -0.85, -kFar_m, -0.1);
  if (top <= floor) cell.fail(cell.child("cart"), "the cart's top lies below the floor");
  scene.solids.push_back(plain_box("cart", {low[0], low[1], floor}, {high[0], high[1], top}, {0.30F, 0.36F, 0.42F}));
  scene.safe_zone.floor_m = top;
  if (cell.has("safe_zone")) {
    const Section zone(cell.file(), cell.child("safe_zone"), "safe_zone", {"radius_m", "height_m"});
    scene.safe_zone.radius_m = zone.number_or("radius_m", scene.safe_zone.radius_m, 0.3, 2);
    scene.safe_zone.height_m = zone.number_or("height_m", scene.safe_zone.height_m, 0.3, 3);
  }
}

/// Upright for who stands in front of it: rows go down; on a board that lies flat, towards the arm.
Pose board_orientation(const Vector3d& faces, const Vector3d& center, double roll_rad) {
  const Vector3d z = -faces.normalized();
  Vector3d down = -Vector3d::UnitZ();
  if (z.cross(down).norm() < 0.1) down = -Vector3d(center.x(), center.y(), 0);
  const Vector3d y = (down - down.dot(z) * z).normalized();
  Pose pose = Pose::Identity();
  pose.linear() << y.cross(z), y, z;
  pose.rotate(Eigen::AngleAxisd(roll_rad, Vector3d::UnitZ()));
  pose.translation() = center;
  return pose;
}

BoardPlacement read_board(const Section& cell, const YAML::Node& node, const std::string& path) {
  const Section board(cell.file(), node, path,
                      {"name", "center_m", "faces", "roll_deg", "type", "inner_columns", "inner_rows", "square_size_m",
                       "mark_size_m", "dictionary", "first_id", "legacy", "white_margin_m", "thickness_m"});
  BoardPlacement placed;
  placed.name = board.text_or("name", placed.name);
  TargetWords words;
  words.type = board.text_or("type", words.type);
  words.columns = board.integer_or("inner_columns", words.columns, 1, 85);
  words.rows = board.integer_or("inner_rows", words.rows, 1, 85);
  words.spacing_m = board.number_or("square_size_m", words.spacing_m, 0.001, 1);
  words.mark_size_m = board.number_or("mark_size_m", 0, 0, 1);
  words.dictionary = board.text_or("dictionary", words.dictionary);
  words.first_id = board.integer_or("first_id", 0, 0, 4095);
  words.legacy = board.flag_or("legacy", false);
  placed.white_margin_m = board.number_or("white_margin_m", placed.white_margin_m, 0, 1);
  placed.thickness_m = board.number_or("thickness_m", placed.thickness_m, 0.001, 0.2);
  const auto spec = target_from_words(words);
  if (!spec) board.fail(node, "{}", spec.error().detail());
  placed.spec = *spec;
  const Vector3d faces = board.vector("faces"), center = board.vector("center_m");
  if (faces.norm() < 1e-6) board.fail(board.child("faces"), "{} must not be zero", board.inside("faces"));
  if (faces.normalized().cross(Vector3d::UnitZ()).norm() < 0.1 && std::hypot(center.x(), center.y()) < 1e-6) {
    board.fail(board.child("center_m"), "a board that lies flat must stand beside the arm");
  }
  Pose pose = board_orientation(faces, center, board.number_or("roll_deg", 0, -360, 360) * kRadians);
  pose.translate(-placed.spec.center());
  placed.base_T_board = Transform<Base, Board>(pose);
  return placed;
}

/// `board`, or the list `boards` of which each has a name and none can be taken for another.
void read_boards(const Section& cell, Scene& scene) {
  scene.boards.clear();
  if (!cell.has("boards")) {
    scene.boards.push_back(read_board(cell, cell.child("board"), "board"));
  } else {
    const YAML::Node list = cell.child("boards");
    if (cell.has("board")) cell.fail(list, "a cell has either 'board' or 'boards'");
    if (!list.IsSequence()) cell.fail(list, "boards must be a list");
    std::vector<NamedTarget> targets;
    for (std::size_t i = 0; i < list.size(); ++i) {
      const std::string path = fmt::format("boards[{}]", i);
      scene.boards.push_back(read_board(cell, list[i], path));
      if (!list[i]["name"]) cell.fail(list[i], "{}.name is missing", path);
      targets.push_back({scene.boards.back().name, scene.boards.back().spec});
    }
    if (const Status distinct = check_distinct(targets); !distinct) cell.fail(list, "{}", distinct.error().detail());
  }
  for (BoardPlacement& placed : scene.boards) {
    placed.solid = scene.solids.size();
    scene.solids.push_back(board_panel(placed));
  }
}

void read_intrinsics(const Section& parent, const char* key, CameraIntrinsics& camera) {
  if (!parent.has(key)) return;
  const Section section(parent.file(), parent.child(key), parent.inside(key),
                        {"width", "height", "fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"});
  camera.width = section.integer_or("width", camera.width, 32, 4096);
  camera.height = section.integer_or("height", camera.height, 32, 4096);
  camera.fx = section.number_or("fx", camera.fx, 10, 1e5);
  camera.fy = section.number_or("fy", camera.fy, 10, 1e5);
  camera.cx = section.number_or("cx", camera.cx, -1e4, 1e4);
  camera.cy = section.number_or("cy", camera.cy, -1e4, 1e4);
  camera.k1 = section.number_or("k1", camera.k1, -2, 2);
  camera.k2 = section.number_or("k2", camera.k2, -2, 2);
  camera.p1 = section.number_or("p1", camera.p1, -1, 1);
  camera.p2 = section.number_or("p2", camera.p2, -1, 1);
  camera.k3 = section.number_or("k3", camera.k3, -2, 2);
}

void read_camera(const Section& cell, Scene& scene, std::uint64_t seed, bool on_last_link) {
  const ArmModel& arm = scene.arm;
  CameraMount& mount = scene.mount;
  mount = default_mount(arm.joints);
  if (cell.has("camera")) {
    const Section camera(cell.file(), cell.child("camera"), "camera",
                         {"link", "position_m", "rpy_deg", "exact", "color", "depth", "depth_position_m"});
    if (!on_last_link) mount.link = camera.integer_or("link", mount.link, 0, arm.joints);
    const Pose given = read_pose(camera);
    if (camera.has("position_m")) mount.link_T_camera.translation() = given.translation();
    if (camera.has("rpy_deg")) mount.link_T_camera.linear() = given.linear();
    read_intrinsics(camera, "color", mount.color);
    read_intrinsics(camera, "depth", mount.depth);
    mount.depth_is_given = camera.has("depth");
    if (mount.depth.k1 != 0 || mount.depth.k2 != 0 || mount.depth.p1 != 0 || mount.depth.p2 != 0 ||
        mount.depth.k3 != 0) {
      camera.fail(camera.child("depth"), "depth images come without distortion");
    }
    mount.camera_T_depth =
        Transform<Camera, Depth>(Eigen::Quaterniond::Identity(),
                                 camera.vector_or("depth_position_m", mount.camera_T_depth.translation(), -1, 1));
    if (camera.flag_or("exact", false)) return;
  }
  mount.link_T_camera = assembled(mount.link_T_camera, seed);
}

void read_light(const Section& cell, Scene& scene) {
  if (!cell.has("light")) return;
  const Section light(cell.file(), cell.child("light"), "light", {"toward", "ambient", "directed", "gradient_per_m"});
  scene.light.toward = light.vector_or("toward", scene.light.toward, -1, 1);
  if (scene.light.toward.norm() < 1e-6) light.fail(light.child("toward"), "light.toward must not be zero");
  scene.light.toward.normalize();
  scene.light.ambient = light.number_or("ambient", scene.light.ambient, 0, 1);
  scene.light.directed = light.number_or("directed", scene.light.directed, 0, 1);
  scene.light.gradient_per_m = light.vector_or("gradient_per_m", scene.light.gradient_per_m, -1, 1);
}

/// An arm's file stands beside the cell's unless its path says otherwise.
std::string beside(const std::string& cell, const std::string& file) {
  return (std::filesystem::path(cell).parent_path() / file).string();
}

/// The arm in place of the cell's own, else the one that it names: built in, or a file.
void read_arm(const Section& cell, Scene& scene, const ArmChoice& choice) {
  std::string file = choice.file;
  if (file.empty() && cell.has("arm")) {
    const std::string name = cell.text_or("arm", "");
    const std::string extension = std::filesystem::path(name).extension();
    if (extension == ".urdf" || extension == ".yaml" || extension == ".yml") {
      file = beside(cell.file(), name);
    } else if (const std::optional<ArmModel> built_in = find_arm_model(name)) {
      scene.arm = *built_in;
    } else {
      cell.fail(cell.child("arm"),
                "unknown arm '{}': ur3, ur5, ur10, ur3e, ur5e, ur10e, two_joint, pr2_like, or a file (.urdf, .yaml)",
                name);
    }
  }
  if (file.empty()) return;
  if (!choice.load) cell.fail(cell.child("arm"), "an arm from a file cannot be read here");
  const Result<ArmModel> arm = choice.load(file);
  if (!arm) throw CellFailure{arm.error()};
  scene.arm = *arm;
  scene.arm_file = file;
}

Scene read_cell(const std::string& name, const YAML::Node& root, std::uint64_t seed, const ArmChoice& choice) {
  const Section cell(name, root, "",
                     {"arm", "start_deg", "floor_m", "walls", "cart", "safe_zone", "board", "boards", "camera", "light",
                      "solids", "regions", "keep_out", "camera_envelope_m", "map"});
  Scene scene;
  scene.name = name;
  read_arm(cell, scene, choice);
  const ArmModel& arm = scene.arm;
  scene.start_rad = default_start(arm);
  if (cell.has("start_deg") && choice.file.empty()) {
    const std::vector<double> degrees = cell.numbers("start_deg", static_cast<std::size_t>(arm.joints), -360, 360);
    for (int i = 0; i < arm.joints; ++i) scene.start_rad[i] = degrees[static_cast<std::size_t>(i)] * kRadians;
  }
  read_room(cell, scene);
  read_cart(cell, scene);
  read_boards(cell, scene);
  read_camera(cell, scene, seed, !choice.file.empty());
  read_light(cell, scene);
  read_solids(cell, scene);
  read_regions(cell, "regions", scene.regions);
  read_regions(cell, "keep_out", scene.keep_out);
  scene.camera_envelope_m = cell.number_or("camera_envelope_m", 0, 0.05, 1);
  if (cell.has("map")) {
    const Section map(cell.file(), cell.child("map"), "map", {"low_m", "high_m"});
    scene.map = Region{"map", map.vector("low_m"), map.vector("high_m")};
    if (!(scene.map->low_m.array() < scene.map->high_m.array()).all())
      map.fail(cell.child("map"), "low_m must lie below high_m");
  }
  return scene;
}

/// Cuts off what lies on the wrong side of z = level (sign +1: keeps above).
std::vector<Vector3d> clipped(const std::vector<Vector3d>& polygon, double level, double sign) {
  std::vector<Vector3d> kept;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector3d &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    const double above_a = sign * (a.z() - level), above_b = sign * (b.z() - level);
    if (above_a >= 0) kept.push_back(a);
    if ((above_a > 0 && above_b < 0) || (above_a < 0 && above_b > 0)) {
      kept.push_back(a + above_a / (above_a - above_b) * (b - a));
    }
  }
  return kept;
}

/// Distance of the z axis from a convex polygon, seen from above.
double axis_distance_m(const std::vector<Vector3d>& polygon) {
  double nearest = std::numeric_limits<double>::infinity(), turn_low = 0, turn_high = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d a = polygon[i].head<2>(), b = polygon[(i + 1) % polygon.size()].head<2>();
    const Eigen::Vector2d d = b - a;
    const double t = d.squaredNorm() > 0 ? std::clamp(-a.dot(d) / d.squaredNorm(), 0.0, 1.0) : 0;
    nearest = std::min(nearest, (a + t * d).norm());
    const double turn = a.x() * b.y() - a.y() * b.x();
    turn_low = std::min(turn_low, turn), turn_high = std::max(turn_high, turn);
  }
  const bool around = polygon.size() > 2 && (turn_low == 0) != (turn_high == 0);  // all edges turn the same way
  return around ? 0 : nearest;
}

bool reaches_into(const SafeZone& zone, const Solid& solid) {
  constexpr double kTouching_m = 1e-6;
  const double low = zone.floor_m + kTouching_m, high = zone.floor_m + zone.height_m - kTouching_m;
  const Vector3d middle(0, 0, 0.5 * (low + high));
  if (distance_m(solid, middle, middle) == 0) return true;
  const Mesh mesh = triangulate(solid.shape);
  return std::ranges::any_of(mesh.triangles, [&](const auto& t) {
    std::vector<Vector3d> polygon;
    for (const std::uint32_t v : t) polygon.push_back(solid.base_T_solid * mesh.vertices_m[v]);
    polygon = clipped(clipped(polygon, low, 1), high, -1);
    return !polygon.empty() && axis_distance_m(polygon) < zone.radius_m - kTouching_m;
  });
}

}  // namespace

Status check_cell(const Scene& scene) {
  for (std::size_t i = 0; i < scene.solids.size(); ++i) {
    if (board_of_solid(scene, i) == nullptr && reaches_into(scene.safe_zone, scene.solids[i])) {
      return failure(Fault::kCellInvalid, "{}: '{}' reaches into the safe zone (radius {} m, height {} m)", scene.name,
                     scene.solids[i].name, scene.safe_zone.radius_m, scene.safe_zone.height_m);
    }
  }
  return {};
}

Result<Scene> parse_cell(std::string_view yaml, const std::string& name, std::uint64_t seed, const ArmChoice& arm) {
  try {
    Scene scene = read_cell(name, YAML::Load(std::string(yaml)), seed, arm);
    if (const Status usable = check_cell(scene); !usable) return std::unexpected(usable.error());
    return scene;
  } catch (const CellFailure& wrong) {
    return std::unexpected(wrong.error);
  } catch (const YAML::Exception& wrong) {
    return failure(Fault::kCellInvalid, "{}:{}:{}: {}", name, wrong.mark.line + 1, wrong.mark.column + 1, wrong.msg);
  }
}

Result<Scene> load_cell(std::string_view name_or_file, std::uint64_t seed, const ArmChoice& arm) {
  constexpr std::string_view kRandom = "random:";
  if (name_or_file.starts_with(kRandom)) {
    const std::string_view digits = name_or_file.substr(kRandom.size());
    std::uint64_t cell_seed = 0;
    const auto [end, code] = std::from_chars(digits.data(), digits.data() + digits.size(), cell_seed);
    if (code != std::errc() || end != digits.data() + digits.size()) {
      return failure(Fault::kCellInvalid, "{}: after 'random:' stands a whole number", name_or_file);
    }
    if (!arm.file.empty()) {
      return failure(Fault::kCellInvalid, "{}: drawn cells are drawn for a ur5; take another cell for {}", name_or_file,
                     arm.file);
    }
    return make_random_cell(cell_seed, seed);
  }
  if (const std::optional<BuiltInCell> cell = find_built_in_cell(name_or_file)) {
    return parse_cell(cell->yaml, std::string(cell->name), seed, arm);
  }
  const std::string path(name_or_file);
  std::ifstream file(path);
  std::stringstream text;
  if (!file || !(text << file.rdbuf())) {
    std::string names;
    for (const BuiltInCell& cell : built_in_cells()) names += std::string(cell.name) + ", ";
    return failure(Fault::kDataMissing, "{}: neither a file that can be read nor a built-in cell ({}random:SEED)", path,
                   names);
  }
  return parse_cell(text.str(), path, seed, arm);
}

}  // namespace firstlook::sim
