#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>

#include "algorithms/calibration/hand_eye_closed_form.hpp"
#include "tests/unit/calibration/synthetic_views.hpp"

using namespace firstlook;

namespace {

constexpr double kExact_m = 1e-12;  // 1e-9 mm
constexpr double kExact_rad = 1e-9;

Pose pose_of(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation) {
  Pose pose = Pose::Identity();
  pose.linear() = rotation;
  pose.translation() = translation;
  return pose;
}

Pose random_pose(Random& random) { return pose_of(random.rotation().toRotationMatrix(), 0.5 * random.normal3()); }

PosePair exact_pair(const Pose& flange, const Pose& flange_T_camera, const Pose& base_T_board) {
  const Pose board = (flange * flange_T_camera).inverse(Eigen::Isometry) * base_T_board;
  return {Transform<Base, Flange>(flange), Transform<Camera, Board>(board)};
}

std::vector<PosePair> exact_pairs(const std::vector<Pose>& flanges, const Pose& flange_T_camera,
                                  const Pose& base_T_board) {
  std::vector<PosePair> pairs;
  for (const Pose& flange : flanges) pairs.push_back(exact_pair(flange, flange_T_camera, base_T_board));
  return pairs;
}

std::vector<Pose> random_flanges(int count, Random& random) {
  std::vector<Pose> flanges;
  for (int i = 0; i < count; ++i) flanges.push_back(random_pose(random));
  return flanges;
}

/// Flange poses within `angle` of one pose and 0.2 m of it.
std::vector<Pose> near_flanges(int count, double angle_rad, Random& random) {
  const Pose home = random_pose(random);
  std::vector<Pose> flanges;
  for (int i = 0; i < count; ++i) {
    flanges.push_back(home * pose_of(rotation_exp(angle_rad * random.direction()), 0.2 * random.direction()));
  }
  return flanges;
}

struct Worst {
  double m = 0, rad = 0;
  void add(const Pose& truth, const Pose& estimate) {
    const Vector6d error = pose_difference(truth, estimate);
    m = std::max(m, error.head<3>().norm());
    rad = std::max(rad, error.tail<3>().norm());
  }
};

int poses_for(const SolverRow& row, int count) { return std::max(count, row.poses_min); }

bool same_bits(const Pose& a, const Pose& b) { return std::memcmp(a.data(), b.data(), 16 * sizeof(double)) == 0; }

}  // namespace

TEST_CASE("every solver is exact without noise for any poses and any hand-eye transform", "[calibration][solvers]") {
  for (const SolverRow& row : solver_table()) {
    CAPTURE(row.name);
    Random random(11);
    Worst hand_eye, board;
    for (int trial = 0; trial < 200; ++trial) {
      const Pose truth = random_pose(random), base_T_board = random_pose(random);
      const int count = poses_for(row, 4 + trial % 22) + (row.board_rotation ? 0 : 3);
      const auto solved = solve_pose_pairs(exact_pairs(random_flanges(count, random), truth, base_T_board), row.solver);
      REQUIRE(solved);
      hand_eye.add(truth, solved->flange_T_camera.pose());
      REQUIRE(solved->base_T_board.has_value() == (row.equation == SolverEquation::kAxYb));
      if (solved->base_T_board) board.add(base_T_board, solved->base_T_board->pose());
    }
    CHECK(hand_eye.m < kExact_m);
    CHECK(hand_eye.rad < kExact_rad);
    CHECK(board.m < kExact_m);
    CHECK(board.rad < kExact_rad);
  }
}

TEST_CASE("hand-eye rotations of 0 and 180 degrees, exactly and nearly", "[calibration][solvers]") {
  for (const SolverRow& row : solver_table()) {
    CAPTURE(row.name);
    Random random(12);
    Worst worst;
    for (const double off : {0.0, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3}) {
      for (const double angle : {off, std::numbers::pi - off}) {
        for (int axis = 0; axis < 5; ++axis) {
          const Eigen::Vector3d direction =
              axis < 3 ? Eigen::Vector3d(Eigen::Vector3d::Unit(axis))
                       : (axis == 3 ? Eigen::Vector3d(1, 1, 0).normalized() : random.direction());
          const Pose truth = pose_of(rotation_exp(angle * direction), {.1, .2, .3});
          const auto pairs = exact_pairs(random_flanges(8, random), truth, random_pose(random));
          const auto solved = solve_pose_pairs(pairs, row.solver);
          REQUIRE(solved);
          worst.add(truth, solved->flange_T_camera.pose());
        }
      }
    }
    CHECK(worst.m < kExact_m);
    CHECK(worst.rad < kExact_rad);
  }
}

TEST_CASE("flange motions of 180 degrees, exactly and nearly, beside others", "[calibration][solvers]") {
  for (const SolverRow& row : solver_table()) {
    CAPTURE(row.name);
    Random random(13);
    Worst worst;
    for (const double off : {0.0, 1e-15, 1e-9, 1e-6, 1e-3, 0.1}) {
      for (int trial = 0; trial < 10; ++trial) {
        const Pose home = random_pose(random), truth = random_pose(random), board = random_pose(random);
        std::vector<Pose> flanges = {home};
        for (int i = 0; i < 5; ++i) {
          flanges.push_back(
              home * pose_of(rotation_exp((std::numbers::pi - off) * random.direction()), 0.3 * random.normal3()));
        }
        flanges.push_back(home * pose_of(rotation_exp({0.5, 0.1, 0}), {.1, .2, .1}));
        flanges.push_back(home * pose_of(rotation_exp({-0.1, 0.5, 0.2}), {-.1, .2, .3}));
        const auto solved = solve_pose_pairs(exact_pairs(flanges, truth, board), row.solver);
        REQUIRE(solved);
        worst.add(truth, solved->flange_T_camera.pose());
      }
    }
    CHECK(worst.m < kExact_m);
    CHECK(worst.rad < kExact_rad);
  }
}

TEST_CASE("quaternion and matrix solvers need no more than half turns and one clear pair", "[calibration][solvers]") {
  // Poses 1 and 2 differ by 90 degrees about z; the third is a half turn away from the first about an axis oblique to
  // z.
  Random random(14);
  for (const SolverRow& row : solver_table()) {
    if (row.poses_min > 3) continue;
    CAPTURE(row.name);
    const Pose truth = random_pose(random);
    const std::vector<Pose> flanges = {
        pose_of(Eigen::Matrix3d::Identity(), {.1, .2, .3}), pose_of(rotation_exp({0, 0, 1.5}), {.3, .1, .2}),
        pose_of(rotation_exp(std::numbers::pi * Eigen::Vector3d(1, 0, 1).normalized()), {.2, -.1, .4})};
    const auto solved = solve_pose_pairs(exact_pairs(flanges, truth, random_pose(random)), row.solver);
    REQUIRE(solved);
    Worst worst;
    worst.add(truth, solved->flange_T_camera.pose());
    CHECK(worst.m < kExact_m);
    CHECK(worst.rad < kExact_rad);
  }
}

TEST_CASE("small motions cost precision in proportion", "[calibration][solvers]") {
  // Rounding of the poses (2e-16) over the angle: at 2 degrees ten times that at 20.
  for (const SolverRow& row : solver_table()) {
    CAPTURE(row.name);
    for (const double angle : {20 * test::kDegree, 2 * test::kDegree}) {
      Random random(15);
      Worst worst;
      for (int trial = 0; trial < 50; ++trial) {
        const Pose truth = random_pose(random);
        const auto solved =
            solve_pose_pairs(exact_pairs(near_flanges(12, angle, random), truth, random_pose(random)), row.solver);
        REQUIRE(solved);
        worst.add(truth, solved->flange_T_camera.pose());
      }
      CHECK(worst.m < (angle > 0.1 ? 0.1 : 1.0) * kExact_m);
      CHECK(worst.rad < 1e-3 * kExact_rad);
    }
  }
}

TEST_CASE("three views and 250 views", "[calibration][solvers]") {
  for (const SolverRow& row : solver_table()) {
    CAPTURE(row.name);
    Random random(16);
    for (const int count : {3, 250}) {
      Worst worst;
      for (int trial = 0; trial < (count == 3 ? 50 : 1); ++trial) {
        const Pose truth = random_pose(random), board = random_pose(random);
        const auto solved =
            solve_pose_pairs(exact_pairs(random_flanges(poses_for(row, count), random), truth, board), row.solver);
        REQUIRE(solved);
        worst.add(truth, solved->flange_T_camera.pose());
      }
      CHECK(worst.m < kExact_m);
      CHECK(worst.rad < kExact_rad);
    }
  }
}

TEST_CASE("the same views in any order give the same bits", "[calibration][solvers]") {
  for (const SolverRow& row : solver_table()) {
    CAPTURE(row.name);
    Random random(17);
    test::Setup setup;
    setup.arm_sigma = {1e-3, 2e-3};
    auto pairs = test::observe_pairs(setup, 12, random);
    const auto first = solve_pose_pairs(pairs, row.solver);
    REQUIRE(first);
    for (int trial = 0; trial < 5; ++trial) {
      for (std::size_t i = pairs.size() - 1; i > 0; --i) {
        std::swap(pairs[i], pairs[static_cast<std::size_t>(random.below(static_cast<int>(i) + 1))]);
      }
      const auto other = solve_pose_pairs(pairs, row.solver);
      REQUIRE(other);
      CHECK(same_bits(other->flange_T_camera.pose(), first->flange_T_camera.pose()));
    }
  }
}

namespace {

std::vector<PosePair> one_axis_pairs(const test::Setup& setup, double noise_rad, Random& random) {
  std::vector<Pose> flanges;
  for (int i = 0; i < 10; ++i) {
    const Eigen::Vector3d turn = Eigen::Vector3d(0, 0, 0.2 * i) + noise_rad * random.normal3();
    flanges.push_back(pose_of(rotation_exp(turn), random.normal3()));
  }
  return exact_pairs(flanges, setup.flange_T_camera, setup.base_T_board);
}

Fault fault_of(std::span<const PosePair> pairs, const SolverRow& row) {
  const auto solved = solve_pose_pairs(pairs, row.solver);
  REQUIRE_FALSE(solved);
  return solved.error().fault;
}

bool mentions(std::span<const PosePair> pairs, const SolverRow& row, std::string_view words) {
  return solve_pose_pairs(pairs, row.solver).error().detail().find(words) != std::string_view::npos;
}

}  // namespace

TEST_CASE("every solver names motions that cannot tell", "[calibration][solvers]") {
  const test::Setup setup;
  for (const SolverRow& row : solver_table()) {
    CAPTURE(row.name);
    Random random(18);
    for (const double noise_rad : {0.0, 1e-3}) {
      const auto pairs = one_axis_pairs(setup, noise_rad, random);
      CHECK(fault_of(pairs, row) == Fault::kDegenerateMotion);
      CHECK(mentions(pairs, row, "about one axis only: largest rotation 103"));
    }
    std::vector<Pose> shifts;
    for (int i = 0; i < 10; ++i) shifts.push_back(pose_of(rotation_exp({1, 2, 0.5}), random.normal3()));
    const auto shifted = exact_pairs(shifts, setup.flange_T_camera, setup.base_T_board);
    CHECK(fault_of(shifted, row) == Fault::kDegenerateMotion);
    CHECK(mentions(shifted, row, "about no axis only: largest rotation 0.0 deg"));
    const std::vector<PosePair> repeated(12, shifted[3]);
    CHECK(fault_of(repeated, row) == Fault::kDegenerateMotion);
    const auto good = exact_pairs(random_flanges(8, random), random_pose(random), random_pose(random));
    std::vector<PosePair> two_poses(12, good[0]);
    for (std::size_t i = 0; i < 6; ++i) two_poses[i] = good[1];
    CHECK(fault_of(two_poses, row) == Fault::kDegenerateMotion);
    const auto least = static_cast<std::size_t>(row.poses_min);
    for (std::size_t count = 0; count < least; ++count) {
      CHECK(fault_of(std::span(good).first(count), row) == Fault::kTooFewViews);
    }
    CHECK(mentions(std::span(good).first(2), row, fmt::format("2 views, {} are the least", least)));
  }
}

TEST_CASE("half turns alone leave four answers and are refused", "[calibration][solvers]") {
  Random random(19);
  std::vector<Pose> flanges = {pose_of(Eigen::Matrix3d::Identity(), random.normal3())};
  for (int axis = 0; axis < 3; ++axis) {
    flanges.push_back(pose_of(rotation_exp(std::numbers::pi * Eigen::Vector3d::Unit(axis)), random.normal3()));
  }
  flanges.push_back(flanges[1]);
  const auto pairs = exact_pairs(flanges, random_pose(random), random_pose(random));
  for (const SolverRow& row : solver_table()) {
    CAPTURE(row.name);
    CHECK(fault_of(pairs, row) == Fault::kDegenerateMotion);
  }
}

TEST_CASE("a board that does not turn in the picture is named", "[calibration][solvers]") {
  // The arm moves, the camera does not: it is not on the arm.
  Random random(20);
  std::vector<PosePair> pairs;
  const Pose board = random_pose(random);
  for (int i = 0; i < 10; ++i) {
    pairs.push_back({Transform<Base, Flange>(random_pose(random)), Transform<Camera, Board>(board)});
  }
  for (const SolverRow& row : solver_table()) {
    CAPTURE(row.name);
    CHECK(fault_of(pairs, row) == Fault::kDegenerateMotion);
    if (row.board_rotation) CHECK(mentions(pairs, row, "board as seen"));
  }
}

TEST_CASE("poses that are no poses are refused by every solver", "[calibration][solvers]") {
  Random random(21);
  const auto good = exact_pairs(random_flanges(8, random), random_pose(random), random_pose(random));
  const auto broken = [&](auto change) {
    auto pairs = good;
    Pose flange = pairs[2].base_T_flange.pose(), board = pairs[2].camera_T_board.pose();
    change(flange, board);
    pairs[2] = {Transform<Base, Flange>(flange), Transform<Camera, Board>(board)};
    return pairs;
  };
  const double nan = std::nan("");
  for (const SolverRow& row : solver_table()) {
    CAPTURE(row.name);
    CHECK(fault_of(broken([&](Pose& f, Pose&) { f.translation().x() = nan; }), row) == Fault::kSolveFailed);
    CHECK(fault_of(broken([&](Pose& f, Pose&) { f.linear()(1, 2) = nan; }), row) == Fault::kSolveFailed);
    CHECK(fault_of(broken([&](Pose&, Pose& b) { b.translation().y() = 1 / 0.0; }), row) == Fault::kSolveFailed);
    CHECK(fault_of(broken([&](Pose& f, Pose&) { f.translation().z() = 1e300; }), row) == Fault::kSolveFailed);
    CHECK(fault_of(broken([&](Pose& f, Pose&) { f.linear() *= 1.01; }), row) == Fault::kSolveFailed);
    CHECK(fault_of(broken([&](Pose&, Pose& b) { b.linear().col(0) *= -1; }), row) == Fault::kSolveFailed);
    const auto no_rotation = broken([&](Pose&, Pose& b) { b.linear().setConstant(nan); });
    CHECK(solve_pose_pairs(no_rotation, row.solver).has_value() == !row.board_rotation);
    if (row.board_rotation) CHECK(mentions(no_rotation, row, "view 3"));
  }
}

TEST_CASE("QR15 needs no rotation of the board, and gives its own only when some views carry it",
          "[calibration][solvers]") {
  Random random(22);
  const Pose truth = random_pose(random), base_T_board = random_pose(random);
  auto pairs = exact_pairs(random_flanges(10, random), truth, base_T_board);
  const auto forget = [&](std::size_t i) {
    Pose board = pairs[i].camera_T_board.pose();
    board.linear().setConstant(std::nan(""));
    pairs[i].camera_T_board = Transform<Camera, Board>(board);
  };
  for (std::size_t i = 0; i < 9; ++i) forget(i);
  const auto partial = solve_pose_pairs(pairs, Solver::kQr15);
  REQUIRE(partial);
  Worst worst;
  worst.add(truth, partial->flange_T_camera.pose());
  worst.add(base_T_board, partial->base_T_board->pose());
  CHECK(worst.m < kExact_m);
  CHECK(worst.rad < kExact_rad);
  forget(9);
  const auto missing = solve_pose_pairs(pairs, Solver::kQr15);
  REQUIRE(missing);
  CHECK_FALSE(missing->base_T_board);
  worst.add(truth, missing->flange_T_camera.pose());
  CHECK(worst.m < kExact_m);
  // The board always in the middle of the picture: its positions lie on a line.
  std::vector<PosePair> centred;
  const test::Setup setup;
  for (int i = 0; i < 20; ++i) {
    Pose board = test::random_camera_T_board(setup, random);
    board.translation() = Eigen::Vector3d(0, 0, 0.5 + 0.02 * i);
    centred.push_back({Transform<Base, Flange>(test::flange_for(setup, board)), Transform<Camera, Board>(board)});
  }
  CHECK(solve_pose_pairs(centred, Solver::kQr15).error().fault == Fault::kDegenerateMotion);
}

TEST_CASE("a wrist that turns about one point: refused by the solvers that cannot take it, exact by the others",
          "[calibration][solvers]") {
  Random random(23);
  for (const double noise_m : {0.0, 2e-4}) {
    const Pose truth = random_pose(random), board = random_pose(random);
    std::vector<Pose> flanges;
    const Eigen::Vector3d tool(0, 0, 0.1);  // from the wrist's point, which is base's (0.3, 0.2, 0.9)
    for (int i = 0; i < 20; ++i) {
      const Eigen::Matrix3d turn =
          rotation_exp({0, 0, random.uniform(-2, 2)}) * rotation_exp({0, random.uniform(-1, 1), 0});
      flanges.push_back(pose_of(turn, Eigen::Vector3d(.3, .2, .9) + turn * tool + noise_m * random.normal3()));
    }
    const auto pairs = exact_pairs(flanges, truth, board);
    for (const SolverRow& row : solver_table()) {
      CAPTURE(row.name, noise_m);
      const bool takes = row.cannot_take.find("one point") == std::string_view::npos;
      const auto solved = solve_pose_pairs(pairs, row.solver);
      REQUIRE(solved.has_value() == takes);
      if (takes) {
        Worst worst;
        worst.add(truth, solved->flange_T_camera.pose());
        CHECK(worst.m < kExact_m);
      } else {
        CHECK(solved.error().fault == Fault::kDegenerateMotion);
        CHECK(mentions(pairs, row, "turns about one point"));
      }
    }
  }
}

TEST_CASE("linear solvers report the matrix before it was made a rotation", "[calibration][solvers]") {
  Random random(24);
  test::Setup setup;
  setup.arm_sigma = {1e-3, 5e-3};
  const auto pairs = test::observe_pairs(setup, 15, random);
  for (const Solver solver :
       {Solver::kLiBetsis, Solver::kAndreff, Solver::kLi, Solver::kQr24, Solver::kQr24Preconditioned, Solver::kQr15}) {
    CAPTURE(solver_name(solver));
    const auto solved = solve_pose_pairs(pairs, solver);
    REQUIRE(solved);
    REQUIRE(solved->raw_flange_T_camera);
    const Eigen::Matrix3d raw = solved->raw_flange_T_camera->leftCols<3>();
    CHECK((raw.transpose() * raw - Eigen::Matrix3d::Identity()).norm() > 1e-4);
    CHECK((raw - solved->flange_T_camera.rotation()).norm() < 0.2);
    const Eigen::Matrix3d r = solved->flange_T_camera.rotation();
    CHECK((r.transpose() * r - Eigen::Matrix3d::Identity()).norm() < 1e-14);
  }
  CHECK_FALSE(solve_pose_pairs(pairs, Solver::kShah)->raw_flange_T_camera);
}

TEST_CASE("nonlinear forms end in a minimum of their own cost", "[calibration][solvers]") {
  // Frobenius norm of AX - XB over all pairs: no step of 10 um or 10 urad from the solution lowers it.
  Random random(25);
  test::Setup setup;
  setup.arm_sigma = {1e-3, 5e-3};
  const auto pairs = test::observe_pairs(setup, 12, random);
  const auto cost = [&](const Pose& x) {
    double sum = 0;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      for (std::size_t j = 0; j < pairs.size(); ++j) {
        const Pose a = pairs[i].base_T_flange.pose().inverse() * pairs[j].base_T_flange.pose();
        const Pose b = pairs[i].camera_T_board.pose() * pairs[j].camera_T_board.pose().inverse();
        sum += ((a * x).matrix() - (x * b).matrix()).squaredNorm();
      }
    }
    return sum;
  };
  const auto solved = solve_pose_pairs(pairs, Solver::kLiBetsisNonlinear);
  REQUIRE(solved);
  const double least = cost(solved->flange_T_camera.pose());
  for (int axis = 0; axis < 12; ++axis) {
    Vector6d step = Vector6d::Zero();
    step(axis / 2) = axis % 2 == 0 ? 1e-5 : -1e-5;
    CHECK(cost(perturb(solved->flange_T_camera.pose(), step)) > least);
  }
  CHECK(cost(solve_pose_pairs(pairs, Solver::kParkMartin)->flange_T_camera.pose()) > least);
}

TEST_CASE("the table of solvers", "[calibration][solvers]") {
  CHECK(solver_table().size() == 20);
  for (const SolverRow& row : solver_table()) {
    CHECK(find_solver(row.name) == row.solver);
    CHECK(solver_name(row.solver) == row.name);
    CHECK(&solver_row(row.solver) == &row);
    CHECK(std::count(solver_names().begin(), solver_names().end(), row.name) == 1);
  }
  std::ifstream readme(FIRSTLOOK_SOURCE_DIR "/algorithms/calibration/solvers/README.md");
  const std::string text{std::istreambuf_iterator<char>(readme), {}};
  if (text.find(solver_table_markdown()) == std::string::npos) {
    FAIL("solvers/README.md must contain:\n" << solver_table_markdown());
  }
}

TEST_CASE("views that contradict each other give a rigid transform or an error", "[calibration][solvers]") {
  Random random(26);
  int answers = 0;
  for (int trial = 0; trial < 60; ++trial) {
    std::vector<PosePair> pairs;
    const Pose truth = random_pose(random), board = random_pose(random);
    for (int i = 0; i < 5 + trial % 10; ++i) {
      const Pose flange = random_pose(random);
      PosePair pair = exact_pair(flange, truth, board);
      if (trial % 3 == 0) pair.camera_T_board = Transform<Camera, Board>(random_pose(random));
      if (trial % 3 == 1) pair.camera_T_board = Transform<Camera, Board>(pair.camera_T_board.pose().inverse());
      if (trial % 3 == 2) pair.base_T_flange = Transform<Base, Flange>(flange.inverse());
      pairs.push_back(pair);
    }
    for (const SolverRow& row : solver_table()) {
      CAPTURE(row.name, trial);
      const auto solved = solve_pose_pairs(pairs, row.solver);
      if (!solved) {
        CHECK((solved.error().fault == Fault::kDegenerateMotion || solved.error().fault == Fault::kSolveFailed));
        continue;
      }
      ++answers;
      const Eigen::Matrix3d r = solved->flange_T_camera.rotation();
      CHECK((r.transpose() * r - Eigen::Matrix3d::Identity()).norm() < 1e-12);
      CHECK(r.determinant() > 0);
      CHECK(solved->flange_T_camera.translation().norm() < 1e3);
    }
  }
  CHECK(answers > 0);
}

TEST_CASE("no hand-eye rotation makes a solver lose its footing", "[calibration][solvers]") {
  // Motions of 2 degrees about x and y only: a hand-eye rotation of 180 degrees about an axis in that plane, or about
  // z, is where half angle tangents and differences of axes are singular.
  const double noise_rad = 1e-6;
  for (const SolverRow& row : solver_table()) {
    if (!row.board_rotation) continue;
    CAPTURE(row.name);
    for (const Eigen::Vector3d& vector :
         {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(std::numbers::pi, 0, 0), Eigen::Vector3d(0, 0, std::numbers::pi),
          Eigen::Vector3d(0.7, 0, 0), Eigen::Vector3d(1.2, 1.2, 0)}) {
      CAPTURE(vector.transpose());
      Random random(27);
      const Pose truth = pose_of(rotation_exp(vector), {.1, .2, .3});
      std::vector<PosePair> pairs;
      for (int i = 0; i < 20; ++i) {
        const double angle = random.uniform(0, 2 * std::numbers::pi);
        const Eigen::Vector3d turn = 2 * test::kDegree * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0);
        const Pose flange = pose_of(rotation_exp(turn), 0.3 * random.normal3());
        const PosePair exact = exact_pair(flange, truth, pose_of(rotation_exp({1, 2, 0.3}), {.5, .2, 0}));
        Vector6d noise = Vector6d::Zero();
        noise.tail<3>() = noise_rad * random.normal3();
        pairs.push_back({Transform<Base, Flange>(perturb(flange, noise)), exact.camera_T_board});
      }
      const auto solved = solve_pose_pairs(pairs, row.solver);
      REQUIRE(solved);
      CHECK(pose_difference(truth, solved->flange_T_camera.pose()).tail<3>().norm() < 5e-5);
    }
  }
}
