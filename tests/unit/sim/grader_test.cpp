#include <catch2/catch.hpp>
#include <cmath>

#include "hal/sim/truth_grader.hpp"
#include "platform/core/random.hpp"
#include "tests/support/box_world.hpp"

using namespace firstlook;
using namespace firstlook::sim;
using firstlook::test::BoxWorld;

namespace {

using Matrix6d = Eigen::Matrix<double, 6, 6>;

Truth truth_in(const TrueWorld& world) {
  Truth truth;
  truth.arm = *find_arm_model("ur5");
  truth.world = &world;
  truth.link_T_camera = Eigen::Translation3d(0, -0.06, 0.05) * Pose(Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX()));
  truth.depth = {640, 480, 589, 609, 319.5, 239.5};
  truth.start_rad = default_start(truth.arm);
  return truth;
}

ObservableOptions coarse() {
  ObservableOptions options;
  options.clearance = {.voxels_m = 0.12, .surface_m = 0.02};
  options.samples = 200;
  return options;
}

GridGeometry coarse_grid() { return GridGeometry::covering({-1.5, -1.5, -0.3}, {1.5, 1.5, 1.5}, 0.1); }

}  // namespace

TEST_CASE("hand-eye errors and the normalised error of a known perturbation", "[sim][grader]") {
  const BoxWorld world;
  WorkerPool workers(1);
  TruthGrader grader(truth_in(world), workers);
  const Pose truth = grader.true_flange_T_camera().pose();
  const Eigen::Vector3d turn_rad(0.001, -0.002, 0.002), shift_m(0.0003, 0, -0.0004);
  Pose estimate = truth;
  // truth = Exp(turn) estimate in rotation, estimate + shift in translation.
  estimate.linear() = Eigen::AngleAxisd(-turn_rad.norm(), turn_rad.normalized()) * truth.linear();
  estimate.translation() = truth.translation() - shift_m;
  FinalClaims claims;
  claims.flange_T_camera = Transform<Flange, Camera>(estimate);
  claims.covariance.diagonal() << 1e-8, 1e-8, 4e-8, 1e-6, 4e-6, 4e-6;
  const TruthFigures figures = grader.grade(claims);
  REQUIRE(figures.hand_eye_mahalanobis2.has_value());
  CHECK(*figures.hand_eye_error_mm == Approx(0.5));
  CHECK(*figures.hand_eye_error_mrad == Approx(3.0));
  CHECK(*figures.hand_eye_mahalanobis2 == Approx(9 + 0 + 4 + 1 + 1 + 1).epsilon(1e-6));
  CHECK_FALSE(figures.coverage_of_observable.has_value());
}

TEST_CASE("the normalised error of honest estimates has six degrees of freedom", "[sim][grader]") {
  const BoxWorld world;
  WorkerPool workers(1);
  TruthGrader grader(truth_in(world), workers);
  const Pose truth = grader.true_flange_T_camera().pose();
  Random random(4);
  Matrix6d root = Matrix6d::Zero();
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j <= i; ++j) root(i, j) = 2e-4 * random.normal();
    root(i, i) = 3e-4;
  }
  double sum = 0;
  const int n = 3000;
  for (int i = 0; i < n; ++i) {
    Eigen::Matrix<double, 6, 1> unit;
    for (int k = 0; k < 6; ++k) unit[k] = random.normal();
    const Eigen::Matrix<double, 6, 1> d = root * unit;
    Pose estimate = truth;
    estimate.translation() -= d.head<3>();
    estimate.linear() = Eigen::AngleAxisd(-d.tail<3>().norm(), d.tail<3>().normalized()) * truth.linear();
    FinalClaims claims;
    claims.flange_T_camera = Transform<Flange, Camera>(estimate);
    claims.covariance = root * root.transpose();
    sum += *grader.grade(claims).hand_eye_mahalanobis2;
  }
  CHECK(sum / n == Approx(6).margin(0.25));
}

TEST_CASE("a covariance that is not positive has no normalised error", "[sim][grader]") {
  const BoxWorld world;
  WorkerPool workers(1);
  TruthGrader grader(truth_in(world), workers);
  FinalClaims claims;
  claims.flange_T_camera = grader.true_flange_T_camera();
  CHECK_FALSE(grader.grade(claims).hand_eye_mahalanobis2.has_value());
}

TEST_CASE("coverage counts observable voxels that the map knows, false free those that lie in matter",
          "[sim][grader]") {
  BoxWorld world;
  world.add_room({-1.2, -1.2, -0.2}, {1.2, 1.2, 1.4});
  Truth truth = truth_in(world);
  truth.regions.push_back({"left half", {-1.2, -1.2, -0.2}, {0, 1.2, 1.4}});
  truth.regions.push_back({"right half", {0, -1.2, -0.2}, {1.2, 1.2, 1.4}});
  WorkerPool workers(1);
  TruthGrader grader(truth, workers);
  VoxelMap map(coarse_grid());
  FinalClaims claims;
  claims.map = &map;
  claims.now_s = 10;
  claims.observable = coarse();
  const TruthFigures nothing = grader.grade(claims);
  CHECK(*nothing.coverage_of_observable == 0);
  CHECK(*nothing.false_free_voxels == 0);
  REQUIRE(nothing.observable_voxels > 1000);

  // The left half becomes known: free inside the room, occupied in its walls, but for two wall voxels called free.
  const GridGeometry& g = map.geometry();
  int wrong = 0;
  for (std::size_t i = 0; i < map.size(); ++i) {
    const Eigen::Vector3d center = g.center_m(g.voxel_at(i));
    if (center.x() > 0) continue;
    const bool matter = world.inside(center);
    map.set(i, matter && wrong++ >= 2 ? VoxelClass::kOccupied : VoxelClass::kFree, 5);
  }
  const TruthFigures half = grader.grade(claims);
  REQUIRE(half.regions.size() == 2);
  CHECK(half.regions[0].known_fraction == 1);
  CHECK(half.regions[1].known_fraction == 0);
  CHECK(*half.coverage_of_observable == Approx(0.5).margin(0.15));
  CHECK(*half.false_free_voxels == 2);
}

TEST_CASE("false occupied counts voxels away from every surface, inside the reach zone only", "[sim][grader]") {
  BoxWorld world;
  world.add_room({-1.2, -1.2, -0.2}, {1.2, 1.2, 1.4});
  WorkerPool workers(1);
  TruthGrader grader(truth_in(world), workers);
  VoxelMap map(coarse_grid());
  const GridGeometry& g = map.geometry();
  std::vector<std::uint8_t> zone(map.size());
  std::size_t in_zone = 0;
  for (std::size_t i = 0; i < map.size(); ++i) {
    zone[i] = g.center_m(g.voxel_at(i)).x() < 0.5 ? 1 : 0;
    in_zone += zone[i];
  }
  const auto occupy = [&](const Eigen::Vector3d& at_m) { map.set(g.index(g.voxel(at_m)), VoxelClass::kOccupied, 5); };
  const double half_m = g.resolution_m / 2;
  occupy({-0.7, 0.3, 0.8});           // in the middle of the room: wrong
  occupy({0.8, 0.3, 0.8});            // the same out of reach: not asked
  occupy({-1.2 + half_m, 0.3, 0.8});  // before the wall: within the tolerance
  occupy({0, 0, 0.01});               // the arm's own base
  FinalClaims claims;
  claims.map = &map;
  claims.reach_zone = zone;
  claims.observable = coarse();
  CHECK(*grader.grade(claims).false_occupied_fraction == Approx(1.0 / static_cast<double>(in_zone)));
}
