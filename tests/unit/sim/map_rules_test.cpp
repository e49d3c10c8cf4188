/// The map's rules against the simulated sensor: holes, changes, kinds of sensor.
#include <catch2/catch.hpp>
#include <numbers>

#include "algorithms/mapping/distance_field.hpp"
#include "algorithms/mapping/insertion.hpp"
#include "algorithms/mapping/open_rays.hpp"
#include "algorithms/mapping/self_filter.hpp"
#include "algorithms/motion/certificate.hpp"
#include "hal/sim/contacts.hpp"
#include "hal/sim/renderer.hpp"
#include "platform/core/random.hpp"

namespace firstlook::sim {
namespace {

using Eigen::Vector3d;

constexpr double kMaxAge_s = 600;

Solid box(const Vector3d& center_m, const Vector3d& size_m, bool returns = true) {
  Solid solid;
  solid.shape = Box{0.5 * size_m};
  solid.base_T_solid.translation() = center_m;
  solid.surface.returns_depth = returns;
  return solid;
}
Solid pole(const Vector3d& center_m, double radius_m, double height_m, bool returns = true) {
  Solid solid;
  solid.shape = Cylinder{radius_m, 0.5 * height_m};
  solid.base_T_solid.translation() = center_m;
  solid.surface.returns_depth = returns;
  return solid;
}

/// What a test puts there, and nothing else.
Scene nothing_but(const std::vector<Solid>& things) {
  Scene scene;
  scene.mount = default_mount(6);
  scene.solids = {board_panel(scene.boards.front())};
  move_board(scene, Transform<Base, Board>(Eigen::Quaterniond::Identity(), {0, 0, -5}));  // out of sight
  scene.solids.insert(scene.solids.end(), things.begin(), things.end());
  return scene;
}

/// The same above a floor.
Scene hall(std::vector<Solid> things) {
  things.push_back(box({0, 0, -0.9}, {40, 40, 0.1}));
  return nothing_but(things);
}

/// A camera at a place that looks along an azimuth, down by `down_rad`, upright but for `roll_rad`.
Transform<Base, Depth> looking(const Vector3d& from_m, double azimuth_rad, double down_rad, double roll_rad = 0) {
  const Eigen::Matrix3d z_forward =
      (Eigen::Matrix3d() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished();  // x right, y down, z forward of a level camera
  const Eigen::Quaterniond turn = Eigen::AngleAxisd(azimuth_rad, Vector3d::UnitZ()) *
                                  Eigen::AngleAxisd(down_rad, Vector3d::UnitY()) * Eigen::Quaterniond(z_forward) *
                                  Eigen::AngleAxisd(roll_rad, Vector3d::UnitZ());
  return {turn, from_m};
}

/// One sensor that feeds one map.
class Mapper {
 public:
  explicit Mapper(const Scene& scene, std::string_view sensor = "kinect") : preset_(*find_sensor_preset(sensor)) {
    change_to(scene);
    trust(0.75);
  }
  /// Makes a safe zone of this radius.
  void trust(double radius_m) { map_.set_safe_zone({.radius_m = radius_m, .height_m = 1.5, .floor_m = -0.3}); }
  void change_to(Scene scene) {
    scene.mount.depth = preset_.intrinsics;
    scene_ = scene;
    renderer_.emplace(scene, depth_sensor_model(preset_));
  }
  std::vector<std::uint16_t> picture(const Transform<Base, Depth>& pose) {
    std::vector<std::uint16_t> pixels(image().size());
    renderer_->render_depth(pose, {{}, seed, ++frame_}, DepthDetail::kFull, image(pixels.data()));
    return pixels;
  }
  void look(const Transform<Base, Depth>& pose, bool open = true) {
    std::vector<std::uint16_t> pixels = picture(pose);
    now_s += 0.5;
    const DepthImage depth{{pixels.data(), image().width, image().height}, 1000};
    REQUIRE(inserter_.insert(map_, depth, pose, {}, now_s));
    if (!open) return;
    open_rays_.look(depth, {});
    const OpenRaysResult result = open_rays_.clear(map_, pose, {inserter_.missed(), inserter_.hit()}, now_s, kMaxAge_s);
    pixels_open += result.pixels_open;
    voxels_cleared += result.voxels_cleared;
  }
  /// Looks all around from places inside the safe zone, as an arm would.
  void look_around(int frames) {
    Random random(seed);
    for (int i = 0; i < frames; ++i) {
      const Vector3d from_m(random.uniform(-0.18, 0.18), random.uniform(-0.18, 0.18), random.uniform(0.1, 0.6));
      look(looking(from_m, random.uniform(-0.8, 0.8), random.uniform(-0.15, 0.7), random.uniform(-0.3, 0.3)));
    }
  }
  [[nodiscard]] std::size_t known_free_in_matter() const {
    std::size_t wrong = 0;
    for (std::size_t i = 0; i < map_.size(); ++i) {
      const bool free = map_.known_free(i, now_s, kMaxAge_s);
      wrong += free && inside(scene_, geometry_.center_m(geometry_.voxel_at(i))) ? 1 : 0;
    }
    return wrong;
  }
  [[nodiscard]] std::size_t known_free() const {
    std::size_t free = 0;
    for (std::size_t i = 0; i < map_.size(); ++i) free += map_.known_free(i, now_s, kMaxAge_s) ? 1 : 0;
    return free;
  }
  VoxelMap& map() { return map_; }
  [[nodiscard]] const GridGeometry& geometry() const { return geometry_; }

  std::uint64_t seed = 1;
  double now_s = 0;
  std::size_t pixels_open = 0, voxels_cleared = 0;

 private:
  [[nodiscard]] ImageView<std::uint16_t> image(std::uint16_t* data = nullptr) const {
    return {data, preset_.intrinsics.width, preset_.intrinsics.height};
  }
  [[nodiscard]] DepthSensor sensor() const {
    return {preset_.intrinsics, preset_.range_min_m, preset_.range_max_m, preset_.range_trusted_m, preset_.baseline_m};
  }

  SensorPreset preset_;
  Scene scene_;
  std::optional<Renderer> renderer_;
  GridGeometry geometry_ = GridGeometry::covering({-1.5, -1.5, -0.9}, {1.5, 1.5, 1.5}, 0.05);
  VoxelMap map_{geometry_, VoxelMap::Planes::kWithOpenRays};
  Inserter inserter_{geometry_, sensor()};
  OpenRays open_rays_{geometry_, sensor()};
  std::uint64_t frame_ = 0;
};

}  // namespace

TEST_CASE("in an open hall rays without a return clear space that nothing else clears", "[sim][mapping]") {
  Mapper ignored(hall({})), corroborated(hall({}));
  Random random(3);
  for (int i = 0; i < 30; ++i) {
    const auto pose = looking({random.uniform(-0.18, 0.18), random.uniform(-0.18, 0.18), 0.5},
                              random.uniform(-0.8, 0.8), random.uniform(-0.1, 0.3));
    ignored.look(pose, false);
    corroborated.look(pose);
  }
  CHECK(corroborated.voxels_cleared > 1000);
  CHECK(corroborated.known_free() > ignored.known_free() + 500);
  CHECK(corroborated.known_free_in_matter() == 0);
}

TEST_CASE("one viewpoint clears nothing through holes", "[sim][mapping]") {
  Mapper mapper(hall({}));
  for (int i = 0; i < 10; ++i) mapper.look(looking({0, 0, 0.5}, 0, 0.1));
  CHECK(mapper.pixels_open > 10000);
  CHECK(mapper.voxels_cleared == 0);
  mapper.look(looking({0.1, 0, 0.5}, 0, 0.1));
  CHECK(mapper.voxels_cleared > 0);
}

TEST_CASE("holes never clear what is there: near, thin, dark, shaded, dropped", "[sim][mapping][safety]") {
  struct Case {
    const char* name;
    double trusted_m;  ///< radius of the safe zone; nothing stands in it
    std::vector<Solid> things;
  };
  const std::vector<Case> cases = {
      {"a thin pole nearer than the minimum range", 0.3, {pole({0.42, 0.05, 0.1}, 0.01, 1.4)}},
      {"a dark pole nearer than the minimum range", 0.3, {pole({0.40, -0.1, 0.1}, 0.03, 1.4, false)}},
      {"a box nearer than the minimum range", 0.3, {box({0.5, 0.1, 0.4}, {0.2, 0.3, 0.3})}},
      {"a dark cabinet on the floor", 0.75, {box({1.2, 0.2, -0.35}, {0.3, 0.6, 1.0}, false)}},
      {"a dark panel on dark legs",
       0.75,
       {box({1.0, -0.3, 0.1}, {0.04, 0.5, 0.4}, false), pole({1, -0.3, -0.5}, 0.02, 0.8, false)}},
      {"a dark pole", 0.75, {pole({1.1, 0.3, -0.35}, 0.03, 1.0, false)}},
      {"a dark box in the shadow of a panel",
       0.75,
       {box({0.82, -0.25, 0.3}, {0.02, 0.3, 0.5}), box({1.2, 0.0, -0.1}, {0.3, 0.3, 0.9}, false)}},
      {"thin poles before the open", 0.75, {pole({1.0, 0.2, 0.2}, 0.01, 2.2), pole({0.9, -0.3, 0.2}, 0.012, 2.2)}},
  };
  for (const Case& c : cases) {
    std::size_t cleared = 0;
    for (const std::uint64_t seed : {1, 2}) {
      Mapper mapper(hall(c.things));
      mapper.seed = seed;
      mapper.trust(c.trusted_m);
      mapper.look_around(25);
      INFO(c.name << ", seed " << seed);
      CHECK(mapper.known_free_in_matter() == 0);
      cleared += mapper.voxels_cleared;
    }
    INFO(c.name);
    CHECK(cleared > 100);  // the hall around it is cleared
  }
}

TEST_CASE(
    "an obstacle put into the path ends its certificate with the first frame that shows it, and one taken away is "
    "cleared by looking",
    "[sim][mapping][safety]") {
  const ArmModel arm = *find_arm_model("ur5");
  const Body body = body_with_camera(arm, Transform<Flange, Camera>(Pose(Eigen::Translation3d(0, -0.07, 0.06))));
  const JointVector from = default_start(arm);
  JointVector to = from;
  to[0] += 1.2;
  const Clearance need{.voxels_m = 0.07, .surface_m = 0.02};
  Mapper mapper(hall({}));
  mapper.map().set_safe_zone({});
  DistanceField field(mapper.geometry(), 0.6), revoked(mapper.geometry(), 0.6);
  std::vector<std::uint8_t> mask(mapper.map().size());
  const auto is_certified = [&] {
    const VoxelMap& map = mapper.map();
    map.free_mask(mapper.now_s, kMaxAge_s, mask);
    field.update(mask);
    for (std::size_t i = 0; i < mask.size(); ++i) mask[i] = map.zone_revoked(i) ? 0 : 1;
    revoked.update(mask);
    FreeSpace space;
    space.field = &field;
    space.revoked = &revoked;
    return certify(arm, body, space, need, from, to).certified();
  };
  mapper.look(looking({-1.2, 0.3, 0.5}, 0, 0.2), false);
  CHECK(is_certified());

  const Vector3d hand_m = forward(arm, interpolate(from, to, 0.6)).flange().translation();
  mapper.change_to(hall({box(hand_m, {0.12, 0.12, 0.12})}));
  const auto at_hand = [&](double azimuth_rad) {
    return looking(hand_m - 0.9 * Vector3d(std::cos(azimuth_rad), std::sin(azimuth_rad), 0), azimuth_rad, 0);
  };
  int frames = 0;
  do {
    mapper.look(at_hand(0.3), false);
    ++frames;
  } while (is_certified() && frames < 10);
  CHECK(frames == 1);

  for (int i = 0; i < 20; ++i) mapper.look(at_hand(0.3 * i), false);
  CHECK(mapper.map().class_at(hand_m - Vector3d(0.08, 0, 0)) != VoxelClass::kFree);
  mapper.change_to(hall({box({1.4, 0, 0}, {0.05, 2.9, 3}), box({-1.4, 0, 0}, {0.05, 2.9, 3}),
                         box({0, 1.4, 0}, {2.9, 0.05, 3}), box({0, -1.4, 0}, {2.9, 0.05, 3})}));  // something to return
  for (int i = 0; i < 24; ++i) mapper.look(at_hand(0.35 * i), false);
  const GridGeometry& g = mapper.geometry();
  for (const double dx : {-0.05, 0.0, 0.05}) {
    const std::size_t i = g.index(g.voxel(hand_m + Vector3d(dx, 0, 0)));
    CHECK(mapper.map().known_free(i, mapper.now_s, kMaxAge_s));
  }
}

TEST_CASE("the arm before the camera leaves no ghosts, and nothing that it hides is cleared",
          "[sim][mapping][safety]") {
  const ArmModel arm = *find_arm_model("ur5");
  const Pose flange_T_camera(Eigen::Translation3d(0, -0.07, 0.06));
  const Body body = body_with_camera(arm, Transform<Flange, Camera>(flange_T_camera));
  const Capsules true_parts = true_capsules(arm, 6, flange_T_camera);
  Scene room = hall({box({2, 0, 0}, {0.1, 5, 5}), box({-2, 0, 0}, {0.1, 5, 5}), box({0, 2, 0}, {5, 0.1, 5}),
                     box({0, -2, 0}, {5, 0.1, 5}), box({0, 0, 2.2}, {5, 5, 0.1})});
  const Renderer renderer(room);
  const CameraIntrinsics& c = renderer.depth_intrinsics(DepthDetail::kFull);
  const DepthSensor sensor{c, 0.5, 5, 3, 0.075};
  const GridGeometry g = GridGeometry::covering({-1.4, -1.4, -0.7}, {1.4, 1.4, 1.5}, 0.05);
  Inserter inserter(g, sensor);
  std::vector<std::uint16_t> pixels(static_cast<std::size_t>(c.width * c.height));
  std::vector<float> self_m(pixels.size());
  Random random(4);
  int with_arm = 0;
  std::size_t hidden = 0;
  for (int trial = 0; trial < 400 && with_arm < 25; ++trial) {
    JointVector q = default_start(arm);
    for (int joint = 0; joint < 6; ++joint) q[joint] += random.uniform(-2, 2);
    const LinkFrames frames = forward(arm, q);
    const auto base_T_depth = frames.flange() * Transform<Flange, Depth>(flange_T_camera);
    const Capsules solid = place(true_parts, frames), padded = place(body.capsules, frames);
    render_self_depth(std::span(padded.data(), padded.size()), 0.02, base_T_depth, c, self_m);
    const auto on_arm = std::ranges::count_if(self_m, [](float z) { return std::isfinite(z); });
    if (base_T_depth.translation().z() < -0.3 || on_arm < 20000) continue;
    ++with_arm;
    renderer.render_depth(base_T_depth, {solid, 1, static_cast<std::uint64_t>(trial)}, DepthDetail::kFull,
                          {pixels.data(), c.width, c.height});
    VoxelMap map(g);
    REQUIRE(inserter.insert(map, {{pixels.data(), c.width, c.height}, 1000}, base_T_depth, self_m, trial));
    const Vector3d eye_m = base_T_depth.translation();
    for (std::size_t i = 0; i < map.size(); ++i) {
      const Vector3d center_m = g.center_m(g.voxel_at(i));
      REQUIRE(map.voxel_class(i) != VoxelClass::kOccupied);  // every wall is outside the grid
      const bool covered = std::ranges::any_of(solid, [&](const Capsule& part) {
        for (int corner = 0; corner < 8; ++corner) {
          const Vector3d at_m = center_m + 0.026 * Vector3d((corner & 1) != 0 ? 1 : -1, (corner & 2) != 0 ? 1 : -1,
                                                            (corner & 4) != 0 ? 1 : -1);
          if (segment_distance_m(eye_m, eye_m + 0.98 * (at_m - eye_m), part.a, part.b) > 0.98 * part.radius_m)
            return false;
          if ((part.a - eye_m).norm() < 0.25 || (part.b - eye_m).norm() < 0.25) return false;  // the camera's own parts
          if ((at_m - eye_m).norm() < (part.a - eye_m).norm() + 0.3) return false;
        }
        return true;
      });
      if (!covered) continue;
      REQUIRE(map.voxel_class(i) == VoxelClass::kUnknown);
      ++hidden;
    }
  }
  CHECK(with_arm == 25);
  CHECK(hidden > 1000);
}

TEST_CASE("each kind of sensor sees as its figures say", "[sim]") {
  for (const SensorPreset& preset : sensor_presets()) {
    INFO(preset.name);
    for (const double z_m : {1.0, 2.5}) {
      Mapper mapper(nothing_but({box({z_m + 0.05, 0, 0}, {0.1, 20, 20})}), preset.name);
      double sum = 0, squares = 0, count = 0;
      for (const std::uint16_t mm : mapper.picture(looking({0, 0, 0}, 0, 0))) {
        if (mm == 0) continue;
        sum += mm * 1e-3 - z_m, squares += (mm * 1e-3 - z_m) * (mm * 1e-3 - z_m), ++count;
      }
      const double sigma_m = std::hypot(preset.noise_floor_m, preset.noise_at_1m_m * z_m * z_m);
      CHECK(std::abs(sum / count) < 0.2 * sigma_m + 0.0005);
      CHECK(std::sqrt(squares / count) == Approx(sigma_m).epsilon(0.12).margin(0.0003));
    }
    const double far_sigma_m =
        std::hypot(preset.noise_floor_m, preset.noise_at_1m_m * preset.range_max_m * preset.range_max_m);
    for (const double z_m : {0.9 * preset.range_min_m, 1.05 * preset.range_max_m + 4 * far_sigma_m}) {
      Mapper mapper(nothing_but({box({z_m + 0.05, 0, 0}, {0.1, 40, 40})}), preset.name);
      const auto picture = mapper.picture(looking({0, 0, 0}, 0, 0));
      const auto returns = std::ranges::count_if(picture, [](std::uint16_t mm) { return mm != 0; });
      CHECK(static_cast<double>(returns) < 0.01 * static_cast<double>(picture.size()));
    }
  }
}

TEST_CASE("only a sensor with a baseline has a shadow", "[sim]") {
  for (const SensorPreset& preset : sensor_presets()) {
    INFO(preset.name);
    Mapper mapper(nothing_but({box({2.55, 0, 0}, {0.1, 20, 20}), box({1.2, 0, 0}, {0.02, 0.2, 20})}), preset.name);
    const auto picture = mapper.picture(looking({0, 0, 0}, 0, 0));
    const CameraIntrinsics& c = preset.intrinsics;
    const auto row =
        std::span(picture).subspan(static_cast<std::size_t>(c.height / 2 * c.width), static_cast<std::size_t>(c.width));
    const auto lost = std::ranges::count(row, std::uint16_t{0});
    const double expected_px = c.fx * preset.baseline_m * (1 / 1.2 - 1 / 2.5);
    CHECK(static_cast<double>(lost) == Approx(expected_px).margin(8));
  }
}

}  // namespace firstlook::sim
