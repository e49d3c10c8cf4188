#include <catch2/catch.hpp>

#include "algorithms/vision/camera_model.hpp"
#include "algorithms/vision/target_detection.hpp"
#include "algorithms/vision/target_names.hpp"
#include "hal/sim/cell_file.hpp"
#include "hal/sim/renderer.hpp"

using namespace firstlook;
using namespace firstlook::sim;

namespace {

constexpr const char* kTypes[] = {
    "type: circles, inner_columns: 7, inner_rows: 5, square_size_m: 0.035",
    "type: asymmetric_circles, inner_columns: 4, inner_rows: 9, square_size_m: 0.025",
    "type: charuco, inner_columns: 7, inner_rows: 5, square_size_m: 0.035",
    "type: aruco, inner_columns: 4, inner_rows: 3, square_size_m: 0.07",
    "type: apriltag, inner_columns: 4, inner_rows: 3, square_size_m: 0.07, first_id: 9",
    "type: artoolkitplus, inner_columns: 3, inner_rows: 2, square_size_m: 0.09",
    "type: marker, square_size_m: 0.12, first_id: 3",
    "type: artoolkit, square_size_m: 0.12",
};

Result<Scene> cell_with(const std::string& board, const std::string& more = {}) {
  return parse_cell("walls: {low_m: [-2, -2], high_m: [2, 2]}\nboard: {center_m: [0.9, 0, 0.3], faces: [-1, 0, 0], " +
                        board + "}\n" + more,
                    "cell.yaml", 1);
}

/// Half a metre before the board's middle, a little to the side, looking at it.
Transform<Base, Camera> looking_at(const Scene& scene) {
  const Eigen::Vector3d center = scene.boards.front().base_T_board * scene.boards.front().spec.center();
  const Eigen::Vector3d eye = center + Eigen::Vector3d(-0.5, 0.12, 0.08), z = (center - eye).normalized();
  const Eigen::Vector3d y = (-Eigen::Vector3d::UnitZ() + z.z() * z).normalized();
  Pose pose = Pose::Identity();
  pose.linear() << y.cross(z), y, z;
  pose.translation() = eye;
  return Transform<Base, Camera>(pose);
}

/// Detection in the rendered picture, and its error against the camera model.
struct Seen {
  Result<CornerSet> corners;
  double rms_px = 0;
};
Seen look(const Scene& scene) {
  const Renderer renderer(scene);
  const CameraIntrinsics& camera = scene.mount.color;
  std::vector<std::uint8_t> pixels(static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height));
  const auto pose = looking_at(scene);
  renderer.render_color(pose, {{}, 1, 1}, {pixels.data(), camera.width, camera.height});
  const BoardSpec& board = scene.boards.front().spec;
  Seen seen{detect_target({pixels.data(), camera.width, camera.height}, board)};
  if (!seen.corners) return seen;
  const auto camera_T_board = pose.inverse() * scene.boards.front().base_T_board;
  const double n = static_cast<double>(seen.corners->corners_px.size());
  double turned = 0;
  for (std::size_t i = 0; i < seen.corners->corners_px.size(); ++i) {
    const int id = point_of(seen.corners->ids, i);
    const auto at = [&](int k) { return *project(camera, camera_T_board * board.corner(k)); };
    seen.rms_px += (seen.corners->corners_px[i] - at(id)).squaredNorm() / (2 * n);
    turned += (seen.corners->corners_px[i] - at(board.corners() - 1 - id)).squaredNorm() / (2 * n);
  }
  seen.rms_px = std::sqrt(board.is_orientation_unique() ? seen.rms_px : std::min(seen.rms_px, turned));
  return seen;
}

}  // namespace

TEST_CASE("every target stands in a cell, is rendered, and found where it is") {
  for (const char* const type : kTypes) {
    const auto scene = cell_with(type);
    CAPTURE(type);
    REQUIRE(scene);
    const Seen seen = look(*scene);
    REQUIRE(seen.corners);
    CHECK(seen.corners->ids.empty());
    CHECK(seen.rms_px < 0.06);
    // --sensor fast: the same points, projected.
    const auto projected = Renderer(*scene).observe_corners(looking_at(*scene), {{}, 1, 1});
    CHECK(projected.corners_px.size() == static_cast<std::size_t>(scene->boards.front().spec.corners()));
  }
}

TEST_CASE("a board of somebody's own hangs where the cell's was") {
  auto scene = cell_with("roll_deg: 90");
  REQUIRE(scene);
  const BoardPlacement before = scene->boards.front();
  exchange_board(*scene, target_from_words({"apriltag", 4, 3, 0.07}).value());
  CHECK((scene->boards.front().base_T_board * scene->boards.front().spec.center() -
         before.base_T_board * before.spec.center())
            .norm() < 1e-12);
  CHECK((scene->boards.front().base_T_board.rotation() - before.base_T_board.rotation()).norm() < 1e-12);
  const Seen seen = look(*scene);
  REQUIRE(seen.corners);
  CHECK(seen.rms_px < 0.06);
}

TEST_CASE("a thing in front of a board of markers hides a part, and only that") {
  const std::string rod = "solids:\n  - {box: {size_m: [0.02, 0.5, 0.07]}, position_m: [0.8, 0, 0.25]}\n";
  for (const char* const type : {kTypes[2], kTypes[4]}) {
    const auto scene = cell_with(type, rod);
    CAPTURE(type);
    REQUIRE(scene);
    const Seen seen = look(*scene);
    REQUIRE(seen.corners);
    CHECK_FALSE(seen.corners->ids.empty());
    CHECK(seen.corners->ids.size() >= static_cast<std::size_t>(scene->boards.front().spec.corners() / 3));
    CHECK(seen.rms_px < 0.12);
  }
  const auto circles = cell_with(kTypes[0], rod);
  CHECK_FALSE(look(*circles).corners);
}

TEST_CASE("a board that cannot be is refused with its place") {
  const auto wrong = cell_with("type: aruco, inner_columns: 9, inner_rows: 9, square_size_m: 0.02, dictionary: 4x4_50");
  REQUIRE_FALSE(wrong);
  CHECK(wrong.error().detail().find("ends with 49") != std::string::npos);
  CHECK_FALSE(cell_with("type: chess"));
}

TEST_CASE("two boards in one picture are drawn each with its own pattern, where they are") {
  const auto scene = parse_cell(
      "walls: {low_m: [-2, -2], high_m: [2, 2]}\n"
      "boards:\n"
      "  - {name: left, center_m: [0.9, 0.17, 0.3], faces: [-1, 0, 0], inner_columns: 7, inner_rows: 4, "
      "square_size_m: 0.03}\n"
      "  - {name: right, center_m: [0.9, -0.17, 0.3], faces: [-1, 0.2, 0], type: apriltag, inner_columns: 4, "
      "inner_rows: 3, square_size_m: 0.06}\n",
      "cell.yaml", 1);
  REQUIRE(scene);
  Pose eye = Pose::Identity();  // looks along x
  eye.linear() << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  eye.translation() = Eigen::Vector3d(0.2, 0, 0.3);
  const Transform<Base, Camera> base_T_camera(eye);
  const Renderer renderer(*scene);
  const CameraIntrinsics& camera = scene->mount.color;
  std::vector<std::uint8_t> pixels(static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height));
  renderer.render_color(base_T_camera, {{}, 1, 1}, {pixels.data(), camera.width, camera.height});
  for (std::size_t k = 0; k < 2; ++k) {
    const BoardPlacement& board = scene->boards[k];
    const auto seen = detect_target({pixels.data(), camera.width, camera.height}, board.spec);
    REQUIRE(seen);
    const auto exact = renderer.observe_corners(base_T_camera, {{}, 1, 1}, k, 0);
    REQUIRE(exact.corners_px.size() == static_cast<std::size_t>(board.spec.corners()));
    double squared = 0;
    for (std::size_t i = 0; i < seen->corners_px.size(); ++i) {
      const auto& at = exact.corners_px[static_cast<std::size_t>(point_of(seen->ids, i))];
      squared += (seen->corners_px[i] - Eigen::Vector2d(at[0], at[1])).squaredNorm();
    }
    CHECK(std::sqrt(squared / static_cast<double>(seen->corners_px.size())) < 0.15);
  }
}
