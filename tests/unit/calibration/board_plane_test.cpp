#include "algorithms/calibration/board_plane.hpp"

#include <Eigen/LU>
#include <catch2/catch.hpp>

#include "tests/unit/calibration/synthetic_depth.hpp"

using namespace firstlook;
using Catch::Matchers::Contains;
using test::DepthSetup;
using test::OwnedDepth;

namespace {

Pose tilted_board(const DepthSetup& s, double distance_m) {
  Pose pose = Pose::Identity();
  pose.linear() = rotation_exp({0.4, -0.3, 0.2});
  pose.translation() = Eigen::Vector3d(0.02, -0.03, distance_m) - pose.linear() * s.color.board.center();
  return pose;
}

Transform<Depth, Board> seen_by_depth(const DepthSetup& s, const Pose& camera_T_board) {
  return Transform<Depth, Board>(s.camera_T_depth.inverse(Eigen::Isometry) * camera_T_board);
}

/// Mahalanobis distance squared of a plane from the truth.
double chi2_of(const DepthSetup& s, const Pose& camera_T_board, const BoardPlane& plane) {
  const Eigen::Vector3d error =
      plane.inverse_depth - expected_plane(s.camera_T_depth, camera_T_board).value().inverse_depth;
  return error.dot(plane.unit_information * error) / (plane.noise * plane.noise);
}

/// Something at `z_m` before all pixels of the board with `fraction` of its columns.
void cover(OwnedDepth& depth, const DepthSetup& s, const Pose& camera_T_board, double fraction, double z_m) {
  const Pose board_T_depth = seen_by_depth(s, camera_T_board).inverse().pose();
  const auto plane = expected_plane(s.camera_T_depth, camera_T_board).value().inverse_depth;
  const double width = s.color.board.corner(s.color.board.corners() - 1).x();
  for (int v = 0; v < s.depth.height; ++v) {
    for (int u = 0; u < s.depth.width; ++u) {
      const Eigen::Vector3d ray((u - s.depth.cx) / s.depth.fx, (v - s.depth.cy) / s.depth.fy, 1);
      if ((board_T_depth * (ray / plane.dot(ray))).x() < fraction * width) {
        depth.at(u, v) = static_cast<std::uint16_t>(std::lround(1000 * z_m));
      }
    }
  }
}

std::string why(const Result<BoardPlane>& plane) {
  REQUIRE_FALSE(plane);
  CHECK(plane.error().fault == Fault::kBoardNotFound);
  return std::string(plane.error().detail());
}

}  // namespace

TEST_CASE("the derivatives of the expected plane are those of finite differences", "[calibration]") {
  Random random(3);
  for (int trial = 0; trial < 20; ++trial) {
    Pose mount = Pose::Identity(), board = Pose::Identity();
    mount.linear() = rotation_exp(0.2 * random.normal3());
    mount.translation() = 0.05 * random.normal3();
    board.linear() = rotation_exp(0.4 * random.normal3());
    board.translation() = Eigen::Vector3d(0, 0, 0.7) + 0.1 * random.normal3();
    const auto plane = expected_plane(mount, board).value();
    constexpr double kStep = 1e-6;
    for (int k = 0; k < 6; ++k) {
      const Vector6d step = kStep * Vector6d::Unit(k);
      const Eigen::Vector3d by_mount = (expected_plane(perturb(mount, step), board)->inverse_depth -
                                        expected_plane(perturb(mount, -step), board)->inverse_depth) /
                                       (2 * kStep);
      const Eigen::Vector3d by_board = (expected_plane(mount, perturb(board, step))->inverse_depth -
                                        expected_plane(mount, perturb(board, -step))->inverse_depth) /
                                       (2 * kStep);
      CHECK((by_mount - plane.by_camera_T_depth.col(k)).norm() < 1e-7);
      CHECK((by_board - plane.by_camera_T_board.col(k)).norm() < 1e-7);
    }
  }
}

TEST_CASE("a board's plane is found as sure as its noise says", "[calibration]") {
  const DepthSetup s;
  Random random(11);
  constexpr int kTrials = 200;
  double chi2 = 0, noise = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const Pose board = tilted_board(s, 0.5 + 0.002 * trial);
    const auto plane = find_board_plane(test::observe_depth(s, board, random).image(), s.depth, s.color.board,
                                        seen_by_depth(s, board));
    REQUIRE(plane);
    chi2 += chi2_of(s, board, *plane) / kTrials;
    noise += plane->noise / kTrials;
    CHECK(plane->share > 0.98);
  }
  CHECK(chi2 == Approx(3).margin(0.6));  // standard deviation of the mean 0.17
  CHECK(noise == Approx(s.noise_at_1m).epsilon(0.03));
}

TEST_CASE("planes of one stop merge into one that is surer", "[calibration]") {
  const DepthSetup s;
  Random random(12);
  const Pose board = tilted_board(s, 0.7);
  std::vector<BoardPlane> planes;
  for (int i = 0; i < 4; ++i) {
    planes.push_back(
        find_board_plane(test::observe_depth(s, board, random).image(), s.depth, s.color.board, seen_by_depth(s, board))
            .value());
  }
  const BoardPlane all = merged(planes);
  CHECK(chi2_of(s, board, all) < 16.3);  // 0.999 of three degrees of freedom
  CHECK(all.pixels > 3.9 * planes[0].pixels);
  CHECK(all.unit_information.trace() > 3.9 * planes[0].unit_information.trace());
}

TEST_CASE("a hand before a third of the board and pixels without return do not move its plane", "[calibration]") {
  const DepthSetup s;
  Random random(13);
  const Pose board = tilted_board(s, 0.7);
  for (const double hand_m : {0.45, 0.67}) {  // far before it, and nearly touching
    OwnedDepth depth = test::observe_depth(s, board, random);
    cover(depth, s, board, 0.3, hand_m);
    for (std::size_t i = 0; i < depth.units.size(); i += 17) depth.units[i] = 0;
    const auto plane = find_board_plane(depth.image(), s.depth, s.color.board, seen_by_depth(s, board));
    REQUIRE(plane);
    CHECK(chi2_of(s, board, *plane) < 16.3);
    CHECK(plane->share < 0.8);
  }
}

TEST_CASE("an expected place that is off by the factory's error still finds the plane", "[calibration]") {
  const DepthSetup s;
  Random random(14);
  const Pose board = tilted_board(s, 0.6);
  const OwnedDepth depth = test::observe_depth(s, board, random);
  for (int k = 0; k < 12; ++k) {
    Vector6d error = Vector6d::Zero();
    error[k % 6] = (k < 6 ? 1 : -1) * (k % 6 < 3 ? 0.015 : 0.030);
    const Pose wrong = perturb(s.camera_T_depth, error);
    const auto plane = find_board_plane(depth.image(), s.depth, s.color.board,
                                        Transform<Depth, Board>(wrong.inverse(Eigen::Isometry) * board));
    REQUIRE(plane);
    CHECK(chi2_of(s, board, *plane) < 16.3);
  }
}

TEST_CASE("a depth image that does not show the board's plane is refused with the reason", "[calibration]") {
  DepthSetup s;
  Random random(15);
  const Pose board = tilted_board(s, 0.7);
  const auto expected = seen_by_depth(s, board);
  const auto refused = [&](OwnedDepth depth, const Transform<Depth, Board>& place) {
    return why(find_board_plane(depth.image(), s.depth, s.color.board, place));
  };
  const OwnedDepth good = test::observe_depth(s, board, random);
  OwnedDepth none = good;
  std::fill(none.units.begin(), none.units.end(), std::uint16_t{0});
  CHECK_THAT(refused(none, expected), Contains("no return"));
  OwnedDepth covered = good;
  cover(covered, s, board, 0.7, 0.4);
  CHECK_THAT(refused(covered, expected), Contains("something is before it"));
  OwnedDepth touching = good;
  cover(touching, s, board, 0.45, 0.69);
  CHECK_THAT(refused(touching, expected), Contains("on one plane"));
  Pose aside = board;
  aside.translation().x() += 1.0;
  CHECK_THAT(refused(good, seen_by_depth(s, aside)), Contains("pixels of the depth image see the board"));
  Pose behind = board;
  behind.translation().z() = -0.7;
  CHECK_THAT(refused(good, seen_by_depth(s, behind)), Contains("in front of the depth camera"));
  Pose nan = board;
  nan.translation().x() = std::nan("");
  CHECK_THAT(refused(good, seen_by_depth(s, nan)), Contains("not finite"));
  s.noise_at_1m = 0.02;
  CHECK_THAT(refused(test::observe_depth(s, board, random), expected), Contains("scatters") || Contains("one plane"));
}
