#include "hal/sim/renderer.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <thread>

#include "algorithms/view_planning/aim.hpp"
#include "algorithms/vision/camera_model.hpp"
#include "algorithms/vision/checkerboard.hpp"
#include "algorithms/vision/target_detection.hpp"
#include "hal/sim/cell_file.hpp"
#include "hal/sim/random_cell.hpp"
#include "platform/core/random.hpp"

using namespace firstlook;
using namespace firstlook::sim;
using Eigen::Vector3d;

namespace {

Solid box(const Vector3d& center, const Vector3d& size) {
  Solid solid;
  solid.shape = Box{0.5 * size};
  solid.base_T_solid.translation() = center;
  return solid;
}

/// A wall whose front stands at z = distance before a sensor in the origin that looks along z of Base.
Scene wall_scene(double distance_m) {
  Scene scene;
  scene.mount = default_mount(6);
  scene.solids = {board_panel(scene.boards.front()), box({0, 0, distance_m + 0.05}, {20, 20, 0.1})};
  move_board(scene, Transform<Base, Board>(Eigen::Quaterniond::Identity(), {0, 0, -5}));  // out of sight
  return scene;
}

const Transform<Base, Depth> kOrigin;

std::vector<std::uint16_t> depth_of(const Renderer& renderer, const Exposure& exposure = {},
                                    DepthDetail detail = DepthDetail::kFull,
                                    const Transform<Base, Depth>& pose = kOrigin) {
  const CameraIntrinsics& k = renderer.depth_intrinsics(detail);
  std::vector<std::uint16_t> image(static_cast<std::size_t>(k.width) * static_cast<std::size_t>(k.height));
  renderer.render_depth(pose, exposure, detail, {image.data(), k.width, k.height});
  return image;
}

std::uint16_t at(const std::vector<std::uint16_t>& image, int column, int row) {
  return image[static_cast<std::size_t>(row) * 640 + static_cast<std::size_t>(column)];
}

struct Statistics {
  double mean_m = 0, sigma_m = 0, missing = 0;
};
Statistics statistics(const std::vector<std::uint16_t>& image) {
  Statistics s;
  double sum = 0, squares = 0, count = 0;
  for (const std::uint16_t mm : image) {
    if (mm == 0) continue;
    sum += mm * 1e-3, squares += mm * 1e-3 * mm * 1e-3, ++count;
  }
  s.mean_m = sum / count;
  s.sigma_m = std::sqrt(squares / count - s.mean_m * s.mean_m);
  s.missing = 1 - count / static_cast<double>(image.size());
  return s;
}

}  // namespace

TEST_CASE("depth noise grows with the square of the distance as the model says, without bias") {
  for (const double z : {0.7, 1.0, 2.0, 3.5}) {
    const Renderer renderer(wall_scene(z));
    const Statistics s = statistics(depth_of(renderer));
    INFO("wall at " << z);
    CHECK(s.mean_m == Approx(z).margin(0.15 * 0.00285 * z * z + 0.0002));
    CHECK(s.sigma_m == Approx(0.00285 * z * z).epsilon(0.10));
    CHECK(s.missing < 0.01);
    const Statistics coarse = statistics(depth_of(renderer, {}, DepthDetail::kFast));
    CHECK(coarse.sigma_m == Approx(0.00285 * z * z).epsilon(0.10));
  }
}

TEST_CASE("depth comes in steps of an eighth of a pixel of disparity") {
  const Renderer renderer(wall_scene(3.0));
  const double focal_baseline = renderer.depth_intrinsics(DepthDetail::kFull).fx * 0.075;
  for (const std::uint16_t mm : depth_of(renderer)) {
    if (mm == 0) continue;
    const double steps = focal_baseline / (mm * 1e-3) / 0.125;
    REQUIRE(std::abs(steps - std::round(steps)) < 0.03);  // a step is 25 mm here, rounding to 1 mm half of 4 % of it
  }
}

TEST_CASE("nothing returns below the minimum or beyond the maximum range") {
  for (const double z : {0.3, 0.47, 5.6, 9.0}) {
    for (const std::uint16_t mm : depth_of(Renderer(wall_scene(z)))) REQUIRE((mm == 0 || (mm >= 500 && mm <= 5000)));
  }
  CHECK(statistics(depth_of(Renderer(wall_scene(0.45)))).missing == Approx(1.0));
  CHECK(statistics(depth_of(Renderer(wall_scene(6.0)))).missing == Approx(1.0));
}

TEST_CASE("the projector's shadow lies left of a near object, as wide as the baseline makes it") {
  Scene scene = wall_scene(2.0);
  scene.solids.push_back(box({0, 0, 1.05}, {0.2, 0.2, 0.1}));  // front at 1.0
  const std::vector<std::uint16_t> image = depth_of(Renderer(scene));
  const double f = default_mount(6).depth.fx;
  // The object's left edge hides the wall from the projector (x = +b) down to x = -0.1 - (b + 0.1) (2 / 1.1 - 1), say.
  const int edge = static_cast<int>(319.5 - f * 0.1 / 1.0);
  const int shadow = static_cast<int>(f * 0.075 * (1 / 1.0 - 1 / 2.0));
  int dark_left = 0, dark_right = 0;
  for (int column = 0; column < 640; ++column) {
    if (at(image, column, 240) != 0) continue;
    (column < 320 ? dark_left : dark_right) += 1;
  }
  CHECK(dark_left >= shadow - 3);
  CHECK(dark_left <= shadow + 8);
  CHECK(dark_right < 8);
  CHECK(at(image, edge - shadow / 2, 240) == 0);
  CHECK(at(image, edge - shadow - 8, 240) > 1900);
}

TEST_CASE("dark and grazing surfaces return nothing") {
  Scene dark = wall_scene(2.0);
  dark.solids[1].surface.returns_depth = false;
  CHECK(statistics(depth_of(Renderer(dark))).missing == Approx(1.0));
  Scene steep = wall_scene(9.0);
  steep.solids.push_back(
      box({0, 0.06, 1.5}, {2, 0.02, 2}));  // a slab seen nearly along its face: y = 0.05, z = 0.5 .. 2.5
  const std::vector<std::uint16_t> image = depth_of(Renderer(steep));
  int met = 0;
  for (int row = 255; row < 262; ++row) met += at(image, 320, row) != 0;  // cosine 0.03 .. 0.04
  CHECK(met == 0);
}

TEST_CASE("the camera sees its own arm, but not the housing it sits in") {
  const Renderer renderer(wall_scene(3.0));
  Exposure exposure;
  exposure.body.push_back({{-0.4, 0, 1.0}, {0.4, 0, 1.0}, 0.05, 3});
  exposure.body.push_back({{-0.1, 0, 0}, {0.1, 0, 0}, 0.05, 6});  // around the eye
  const std::vector<std::uint16_t> image = depth_of(renderer, exposure);
  CHECK(at(image, 330, 240) == Approx(950).margin(15));
  CHECK(at(image, 330, 100) == Approx(3000).margin(130));
}

TEST_CASE("a depth image depends on seed and frame alone") {
  const Result<Scene> scene = load_cell("cluttered", 1);
  REQUIRE(scene);
  const Renderer renderer(*scene), other(*scene);
  const Transform<Base, Depth> pose(Eigen::Quaterniond(0.6, 0.6, -0.37, 0.37), {0.1, 0, 0.6});
  const Exposure exposure{{}, 7, 3};
  const auto first = depth_of(renderer, exposure, DepthDetail::kFull, pose);
  CHECK(first != depth_of(renderer, {{}, 7, 4}, DepthDetail::kFull, pose));
  CHECK(first != depth_of(renderer, {{}, 8, 3}, DepthDetail::kFull, pose));
  std::vector<std::uint16_t> in_thread;
  std::thread thread([&] { in_thread = depth_of(renderer, exposure, DepthDetail::kFull, pose); });
  const auto beside = depth_of(other, exposure, DepthDetail::kFull, pose);
  thread.join();
  CHECK(first == beside);
  CHECK(first == in_thread);
}

TEST_CASE("pictures are the same whatever the number of threads that share their rows") {
  const Result<Scene> scene = load_cell("workshop", 1);
  REQUIRE(scene);
  const ArmModel arm = scene->arm;
  const std::vector<JointVector> views = board_views(*scene, 60000, 1);
  REQUIRE_FALSE(views.empty());
  const LinkFrames frames = forward(arm, views[0]);
  const Exposure exposure{place(true_body(arm), frames), 5, 9};
  const Transform<Base, Camera> base_T_camera = frames.flange() * scene->mount.flange_T_camera();
  const CameraIntrinsics& color = scene->mount.color;
  std::vector<std::vector<std::uint8_t>> grays;
  std::vector<std::vector<std::uint16_t>> depths;
  WorkerPool one(1), three(3);
  for (WorkerPool* const workers : {static_cast<WorkerPool*>(nullptr), &one, &three}) {
    const Renderer renderer(*scene, {}, workers);
    auto& gray = grays.emplace_back(static_cast<std::size_t>(color.width) * static_cast<std::size_t>(color.height));
    renderer.render_color(base_T_camera, exposure, {gray.data(), color.width, color.height});
    depths.push_back(depth_of(renderer, exposure, DepthDetail::kFull, base_T_camera * scene->mount.camera_T_depth));
  }
  CHECK(grays[1] == grays[0]);
  CHECK(grays[2] == grays[0]);
  CHECK(depths[1] == depths[0]);
  CHECK(depths[2] == depths[0]);
}

TEST_CASE("rendered boards are found, and their corners are where the camera model puts them") {
  const Result<Scene> scene = load_cell("workshop", 2);
  REQUIRE(scene);
  const Renderer renderer(*scene);
  const ArmModel arm = scene->arm;
  const CameraIntrinsics& camera = scene->mount.color;
  std::vector<std::uint8_t> pixels(static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height));
  std::vector<JointVector> views = board_views(*scene, 60000, 3);
  REQUIRE(views.size() >= 12);
  views.resize(12);
  double squares = 0, count = 0;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const LinkFrames frames = forward(arm, views[i]);
    const Transform<Base, Camera> pose = frames.flange() * scene->mount.flange_T_camera();
    renderer.render_color(pose, {place(true_body(arm), frames), 1, i}, {pixels.data(), camera.width, camera.height});
    const Result<CornerSet> corners =
        detect_checkerboard({pixels.data(), camera.width, camera.height}, scene->boards.front().spec);
    INFO("view " << i);
    REQUIRE(corners);
    const Transform<Camera, Board> camera_T_board = pose.inverse() * scene->boards.front().base_T_board;
    for (int k = 0; k < scene->boards.front().spec.corners(); ++k) {
      const auto truth = project(camera, camera_T_board * scene->boards.front().spec.corner(k));
      REQUIRE(truth);
      squares += (corners->corners_px[static_cast<std::size_t>(k)] - *truth).squaredNorm();
      count += 2;
    }
  }
  CHECK(std::sqrt(squares / count) < 0.06);  // 0.027 px measured
}

TEST_CASE("observed corners scatter about the truth by their sigma, and are missing when the board is hidden") {
  const Result<Scene> scene = load_cell("empty", 1);
  REQUIRE(scene);
  const ArmModel arm = scene->arm;
  const std::vector<JointVector> views = board_views(*scene, 60000, 1);
  REQUIRE_FALSE(views.empty());
  const Transform<Base, Camera> pose = forward(arm, views[0]).flange() * scene->mount.flange_T_camera();
  const Renderer renderer(*scene);
  const Transform<Camera, Board> camera_T_board = pose.inverse() * scene->boards.front().base_T_board;
  double sum = 0, squares = 0, count = 0;
  for (std::uint64_t frame = 0; frame < 50; ++frame) {
    const hal::CornerObservation seen = renderer.observe_corners(pose, {{}, 1, frame});
    REQUIRE(seen.corners_px.size() == 54);
    for (int k = 0; k < 54; ++k) {
      const auto truth = project(scene->mount.color, camera_T_board * scene->boards.front().spec.corner(k));
      const double d = seen.corners_px[static_cast<std::size_t>(k)][0] - truth->x();
      sum += d, squares += d * d, ++count;
    }
  }
  CHECK(std::abs(sum / count) < 0.01);
  CHECK(std::sqrt(squares / count) == Approx(0.1).epsilon(0.06));

  const Vector3d center = scene->boards.front().base_T_board * scene->boards.front().spec.center();
  const Vector3d between = 0.5 * (center + pose.translation());
  Scene hidden = *scene;
  hidden.solids.push_back(box(between, {0.03, 0.03, 0.03}));
  CHECK(Renderer(hidden).observe_corners(pose, {}).corners_px.empty());
  Exposure arm_between;
  arm_between.body.push_back({between, between, 0.03, 5});
  CHECK(renderer.observe_corners(pose, arm_between).corners_px.empty());
  const Transform<Base, Camera> from_behind(Eigen::Quaterniond(pose.rotation()),
                                            Vector3d(2 * center - pose.translation()));
  CHECK(renderer.observe_corners(from_behind, {}).corners_px.empty());
}

TEST_CASE("corners are observed where the detector finds them in the picture") {
  const Result<Scene> scene = load_cell("empty", 1);
  REQUIRE(scene);
  const Renderer renderer(*scene);
  const BoardPlacement& board = scene->boards.front();
  const CameraIntrinsics& camera = scene->mount.color;
  const Vector3d center = board.base_T_board * board.spec.center();
  Random random(7, 1);
  std::vector<std::uint8_t> pixels(static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height));
  int both = 0, observed_only = 0, detected_only = 0;
  for (std::uint64_t frame = 0; frame < 120; ++frame) {
    // From near, where parts of the board leave the picture, and tilted.
    const Vector3d front = -board.base_T_board.rotation().col(2);
    const Vector3d direction = direction_within(front, 0.8, random);
    const double distance_m = random.uniform(0.3, 0.8);
    const auto pose = look_at<Camera>(center + 0.05 * random.normal3(), direction, distance_m, random.uniform(0, 6.28));
    const bool observed = !renderer.observe_corners(pose, {{}, 1, frame}).corners_px.empty();
    renderer.render_color(pose, {{}, 1, frame}, {pixels.data(), camera.width, camera.height});
    const bool detected = detect_target({pixels.data(), camera.width, camera.height}, board.spec).has_value();
    both += observed && detected ? 1 : 0;
    observed_only += observed && !detected ? 1 : 0;
    detected_only += !observed && detected ? 1 : 0;
  }
  CAPTURE(both, observed_only, detected_only);
  CHECK(both > 40);
  CHECK(observed_only <= 2);
  CHECK(detected_only * 10 <= both);
}

TEST_CASE("rays and lines of sight end at surfaces") {
  const Renderer renderer(wall_scene(2.0));
  CHECK(renderer.ray_m({0, 0, 0}, {0, 0, 1}) == Approx(2.0).margin(1e-5));
  CHECK(std::isinf(renderer.ray_m({0, 0, 0}, {1, 0, 0})));
  CHECK(renderer.sees({0, 0, 0}, {0.5, 0.5, 2.0}));
  CHECK_FALSE(renderer.sees({0, 0, 0}, {0.5, 0.5, 2.2}));
}

TEST_CASE("an overview shows the arm") {
  const Result<Scene> scene = load_cell("workshop", 1);
  REQUIRE(scene);
  const Renderer renderer(*scene);
  const ArmModel arm = scene->arm;
  const Capsules body = place(true_body(arm), forward(arm, scene->start_rad));
  const Overview with = renderer.render_overview({-1.5, -1.7, 1.6}, {0, 0, 0.2}, body, 160, 120);
  const Overview without = renderer.render_overview({-1.5, -1.7, 1.6}, {0, 0, 0.2}, {}, 160, 120);
  REQUIRE(with.rgb.size() == 160 * 120 * 3);
  std::size_t changed = 0;
  for (std::size_t i = 0; i < with.rgb.size(); ++i) changed += with.rgb[i] != without.rgb[i];
  CHECK(changed > 1000);
  CHECK(changed < with.rgb.size() / 2);
}
