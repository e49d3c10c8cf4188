/// Several targets solved together: exact without noise, honest with it, in any subsets.
#include <Eigen/LU>
#include <catch2/catch.hpp>
#include <numeric>

#include "algorithms/calibration/board_ambiguity.hpp"
#include "algorithms/calibration/solver_comparison.hpp"
#include "algorithms/calibration/verdict.hpp"
#include "algorithms/vision/board_pose.hpp"
#include "tests/unit/calibration/synthetic_views.hpp"

using namespace firstlook;
using test::Setup;

namespace {

/// A cell with targets; boards[0] is that of the setup.
struct Cell {
  Setup setup;
  std::vector<BoardSpec> boards;
  std::vector<Pose> base_T_board;

  explicit Cell(double noise = 1) {
    setup.corner_sigma_px *= noise;
    setup.arm_sigma.translation_m *= noise;
    setup.arm_sigma.rotation_rad *= noise;
    boards = {setup.board, {7, 6, 0.025}, {6, 5, 0.03}};
    base_T_board.assign(3, setup.base_T_board);
    // Beside the first one, leaning towards it: one picture can show both. The third hangs elsewhere.
    base_T_board[1]
        .translate(Eigen::Vector3d(0.28, 0.02, 0.03))
        .rotate(Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitY()));
    base_T_board[2]
        .translate(Eigen::Vector3d(-0.9, 0.5, -0.3))
        .rotate(Eigen::AngleAxisd(1.1, Eigen::Vector3d::UnitX()));
  }
  [[nodiscard]] Setup of(std::size_t target) const {
    Setup s = setup;
    s.board = boards[target];
    s.base_T_board = base_T_board[target];
    return s;
  }
};

/// What is seen of `targets` from a random place that looks at the first of them.
void observe(const Cell& cell, const std::vector<int>& targets, Random& random, std::vector<CalibrationView>& views) {
  const Setup first = cell.of(static_cast<std::size_t>(targets.front()));
  const Pose base_T_flange = test::flange_for(first, test::random_camera_T_board(first, random));
  const Pose said = perturb(base_T_flange, test::arm_noise(cell.setup.arm_sigma, random));
  const int station = views.empty() ? 0 : views.back().station + 1;
  for (const int k : targets) {
    CalibrationView view = test::observe(cell.of(static_cast<std::size_t>(k)), base_T_flange, random);
    view.base_T_flange = Transform<Base, Flange>(said);
    view.target = k;
    view.station = station;
    views.push_back(view);
  }
}

std::vector<CalibrationView> observe_all(const Cell& cell, const std::vector<std::vector<int>>& stations,
                                         Random& random) {
  std::vector<CalibrationView> views;
  for (const auto& targets : stations) observe(cell, targets, random, views);
  return views;
}

RefinementOptions known_noise(const Setup& s) {
  RefinementOptions options;
  options.corner_sigma_px = std::max(s.corner_sigma_px, 1e-3);
  options.arm_sigma = {std::max(s.arm_sigma.translation_m, 1e-6), std::max(s.arm_sigma.rotation_rad, 1e-6)};
  options.rounds_max = 1;
  options.view_gate = 1e12;
  return options;
}

Transform<Flange, Camera> near(const Pose& truth) {
  Vector6d off;
  off << 0.003, -0.002, 0.004, 0.01, -0.008, 0.012;
  return Transform<Flange, Camera>(perturb(truth, off));
}

double squared_in(const Matrix6d& covariance, const Vector6d& error) {
  return error.dot(covariance.llt().solve(error));
}

Pose mutual_truth(const Cell& cell, int from, int to) {
  return cell.base_T_board[static_cast<std::size_t>(from)].inverse(Eigen::Isometry) *
         cell.base_T_board[static_cast<std::size_t>(to)];
}

std::vector<PosePair> exact_pairs(const Cell& cell, std::span<const CalibrationView> views) {
  std::vector<PosePair> pairs;
  for (const CalibrationView& view : views) {
    const Pose camera_T_board = (view.base_T_flange.pose() * cell.setup.flange_T_camera).inverse(Eigen::Isometry) *
                                cell.base_T_board[static_cast<std::size_t>(view.target)];
    pairs.push_back({view.base_T_flange, Transform<Camera, Board>(camera_T_board), view.target, view.station});
  }
  return pairs;
}

}  // namespace

TEST_CASE("several targets without noise: hand-eye, every board and their mutual poses are exact", "[calibration]") {
  const Cell cell(0);
  Random random(41);
  const auto views = observe_all(cell, {{0, 1}, {1}, {0}, {2}, {0, 1}, {2}, {1, 0}, {2}, {0}}, random);
  const auto solved =
      refine_hand_eye(cell.setup.camera, cell.boards, views, near(cell.setup.flange_T_camera), known_noise(cell.setup));
  REQUIRE(solved);
  CHECK(solved->views_used == 9);
  CHECK(pose_difference(cell.setup.flange_T_camera, solved->flange_T_camera.pose()).norm() < 1e-9);
  REQUIRE(solved->targets.size() == 3);
  for (std::size_t k = 0; k < 3; ++k) {
    CHECK(pose_difference(cell.base_T_board[k], solved->targets[k].base_T_board.pose()).norm() < 1e-9);
  }
  CHECK(solved->targets[0].views == 5);
  CHECK(solved->targets[1].views == 4);
  for (const auto& [from, to] : {std::pair{0, 1}, {1, 2}, {2, 0}}) {
    const auto mutual = mutual_pose(solved->targets, solved->joint_covariance, from, to);
    REQUIRE(mutual);
    CHECK(pose_difference(mutual_truth(cell, from, to), mutual->pose.pose()).norm() < 1e-9);
  }
}

TEST_CASE("every solver takes the motions of several targets together", "[calibration]") {
  const Cell cell(0);
  Random random(42);
  const auto views = observe_all(cell, {{0}, {1}, {0}, {1}, {1}, {0}, {2}, {2}, {0}}, random);
  const auto pairs = exact_pairs(cell, views);
  for (const SolverRow& row : solver_table()) {
    INFO(row.name);
    const auto solved = solve_pose_pairs(pairs, row.solver);
    REQUIRE(solved);
    CHECK(pose_difference(cell.setup.flange_T_camera, solved->flange_T_camera.pose()).norm() < 1e-9);
  }
}

TEST_CASE("targets of two views each are solved together where one alone would not do", "[calibration]") {
  const Cell cell(0);
  Random random(43);
  const auto views = observe_all(cell, {{0}, {1}, {2}, {0}, {1}, {2}}, random);
  const auto pairs = exact_pairs(cell, views);
  CHECK_FALSE(solve_closed_form(pairs_of_target(pairs, 0)));
  const auto result = solve_hand_eye(cell.setup.camera, cell.boards, views);
  REQUIRE(result);
  CHECK(pose_difference(cell.setup.flange_T_camera, result->flange_T_camera.pose()).norm() < 1e-6);
  CHECK(result->views == 6);

  // Each target once: no motion at all, which is said and not solved.
  const auto once = solve_hand_eye(cell.setup.camera, cell.boards, observe_all(cell, {{0}, {1}, {2}}, random));
  REQUIRE_FALSE(once);
  CHECK(once.error().fault == Fault::kDegenerateMotion);
}

TEST_CASE("two targets that are never seen together both tell of the hand-eye", "[calibration]") {
  const Cell cell;
  Random random(44);
  const auto both = observe_all(cell, {{0}, {2}, {0}, {2}, {0}, {2}, {0}, {2}, {0}, {2}, {0}, {2}}, random);
  std::vector<CalibrationView> first;
  std::copy_if(both.begin(), both.end(), std::back_inserter(first), [](const auto& view) { return view.target == 0; });
  const auto start = near(cell.setup.flange_T_camera);
  const auto together = refine_hand_eye(cell.setup.camera, cell.boards, both, start, known_noise(cell.setup));
  const auto alone = refine_hand_eye(cell.setup.camera, cell.boards, first, start, known_noise(cell.setup));
  REQUIRE(together);
  REQUIRE(alone);
  // As many views again: about half of every variance.
  for (int i = 0; i < 6; ++i) CHECK(together->covariance(i, i) < 0.75 * alone->covariance(i, i));
  CHECK(alone->targets[2].views == 0);
  CHECK_FALSE(mutual_pose(alone->targets, alone->joint_covariance, 0, 2));
  const auto mutual = mutual_pose(together->targets, together->joint_covariance, 0, 2);
  REQUIRE(mutual);
  CHECK(squared_in(mutual->covariance, pose_difference(mutual_truth(cell, 0, 2), mutual->pose.pose())) < 22.5);
}

TEST_CASE("a target in one view is solved and tells nothing of the hand-eye", "[calibration]") {
  const Cell cell;
  Random random(45);
  auto views = observe_all(cell, {{0}, {0}, {0}, {0}, {0}, {0}, {2}}, random);
  const auto start = near(cell.setup.flange_T_camera);
  const auto with = refine_hand_eye(cell.setup.camera, cell.boards, views, start, known_noise(cell.setup));
  views.pop_back();
  const auto without = refine_hand_eye(cell.setup.camera, cell.boards, views, start, known_noise(cell.setup));
  REQUIRE(with);
  REQUIRE(without);
  CHECK(with->targets[2].views == 1);
  CHECK(without->targets[2].views == 0);
  CHECK((with->covariance - without->covariance).norm() < 1e-6 * without->covariance.norm());
  CHECK(pose_difference(with->flange_T_camera.pose(), without->flange_T_camera.pose()).norm() < 1e-7);
  CHECK(squared_in(with->targets[2].covariance,
                   pose_difference(cell.base_T_board[2], with->targets[2].base_T_board.pose())) < 22.5);
}

TEST_CASE("views of one station share the arm's deviation, and the covariance is honest for it", "[calibration]") {
  Cell cell;
  cell.setup.arm_sigma = {5e-4, 1e-3};  // an arm that is worse than the pictures: sharing is what tells the mutual pose
  constexpr int kTrials = 300;
  double hand_eye = 0, mutual = 0, third = 0, mutual_sigma_m = 0, apart_sigma_m = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    Random random(static_cast<std::uint64_t>(trial), 46);
    auto views = observe_all(cell, {{0, 1}, {2}, {0, 1}, {1, 0}, {2}, {0}, {1}, {0, 1}, {2}, {0, 1}}, random);
    const auto start = near(cell.setup.flange_T_camera);
    const auto solved = refine_hand_eye(cell.setup.camera, cell.boards, views, start, known_noise(cell.setup));
    REQUIRE(solved);
    REQUIRE(solved->views_used == 10);
    hand_eye +=
        squared_in(solved->covariance, pose_difference(cell.setup.flange_T_camera, solved->flange_T_camera.pose()));
    const auto near_pose = mutual_pose(solved->targets, solved->joint_covariance, 0, 1);
    const auto far_pose = mutual_pose(solved->targets, solved->joint_covariance, 1, 2);
    mutual += squared_in(near_pose->covariance, pose_difference(mutual_truth(cell, 0, 1), near_pose->pose.pose()));
    third += squared_in(far_pose->covariance, pose_difference(mutual_truth(cell, 1, 2), far_pose->pose.pose()));
    if (trial > 0) continue;
    mutual_sigma_m = std::sqrt(near_pose->covariance.topLeftCorner<3, 3>().trace());
    for (CalibrationView& view : views) view.station = -1;
    const auto apart = refine_hand_eye(cell.setup.camera, cell.boards, views, start, known_noise(cell.setup));
    apart_sigma_m =
        std::sqrt(mutual_pose(apart->targets, apart->joint_covariance, 0, 1)->covariance.topLeftCorner<3, 3>().trace());
  }
  // Chi-square with 6 degrees of freedom: mean 6, variance 12.
  const double three_errors = 3 * std::sqrt(12.0 / kTrials);
  CHECK(hand_eye / kTrials == Approx(6).margin(three_errors));
  CHECK(mutual / kTrials == Approx(6).margin(three_errors));
  CHECK(third / kTrials == Approx(6).margin(three_errors));
  CHECK(mutual_sigma_m < 0.7 * apart_sigma_m);
}

TEST_CASE("one station cannot be at two places or show a target twice", "[calibration]") {
  const Cell cell;
  Random random(47);
  auto views = observe_all(cell, {{0, 1}, {0}, {1}, {0, 1}, {0}}, random);
  const auto start = near(cell.setup.flange_T_camera);
  auto moved = views;
  moved[1].base_T_flange = moved[2].base_T_flange;
  const auto two_places = refine_hand_eye(cell.setup.camera, cell.boards, moved, start, known_noise(cell.setup));
  REQUIRE_FALSE(two_places);
  CHECK(two_places.error().fault == Fault::kDataMalformed);
  views[2].target = 7;
  CHECK_FALSE(refine_hand_eye(cell.setup.camera, cell.boards, views, start, known_noise(cell.setup)));
}

TEST_CASE("several targets go the whole way to a verdict, a wrong view left out", "[calibration]") {
  const Cell cell;
  Random random(48);
  std::vector<std::vector<int>> stations;
  for (int i = 0; i < 8; ++i) {
    stations.push_back({0, 1});
    stations.push_back({2});
  }
  auto views = observe_all(cell, stations, random);
  views[4].base_T_flange = views[7].base_T_flange;  // a stale pose: views 3 and 4 are one station
  views[3].base_T_flange = views[7].base_T_flange;
  const auto result = calibrate_hand_eye(cell.setup.camera, cell.boards, views);
  REQUIRE(result);
  for (const std::string& reason : result->reasons) UNSCOPED_INFO(reason);
  CHECK(result->verdict == Verdict::kAccepted);
  CHECK(result->views >= 14);  // of 15 good ones: an oblique view of a small target may be left out, too
  CHECK_FALSE(result->fits[3].used);
  CHECK_FALSE(result->fits[4].used);
  CHECK(result->fits[6].arm_deviation == result->fits[7].arm_deviation);  // one station
  CHECK(squared_in(result->covariance, pose_difference(cell.setup.flange_T_camera, result->flange_T_camera.pose())) <
        22.5);
  CHECK(result->holdout_rms_m > 0);
  CHECK(result->holdout_rms_m < 2e-3);
  CHECK(result->subset_solutions.size() == 100);
  const auto used = used_pairs(cell.setup.camera, cell.boards, views, *result);
  const SolverComparison comparison = compare_solvers(used, *result, {});
  CHECK(comparison.views == static_cast<std::size_t>(result->views));
  CHECK(comparison.views_of_solve == (comparison.views == 15 ? 11 : 10));
  for (const SubsetSolves& s : comparison.solvers) CHECK(s.solved + s.failed == 100);
}

TEST_CASE("each target that looks the same upside down is settled by itself", "[calibration]") {
  Cell cell;
  cell.boards = {{7, 5, 0.03}, {8, 6, 0.025}, {5, 5, 0.03}};
  cell.setup.board = cell.boards[0];
  Random random(49);
  auto views = observe_all(cell, {{0, 1}, {2}, {0}, {1, 0}, {2}, {0, 1}, {1}, {0, 1}, {2}}, random);
  std::vector<bool> turned, met(3);
  std::vector<OpenView> open;
  for (CalibrationView& view : views) {
    const auto target = static_cast<std::size_t>(view.target);
    turned.push_back(met[target] && random.uniform() < 0.5);  // each target's first view stays as it was seen
    met[target] = true;
    if (turned.back()) std::reverse(view.corners_px.begin(), view.corners_px.end());
    const auto pose = estimate_board_pose(cell.setup.camera, cell.boards[target], view.corners_px);
    REQUIRE(pose);
    open.push_back(open_view(cell.boards[target], view, *pose));
  }
  const auto choices = settle_choices(open);  // the third target has too few views to be settled without the others
  const auto known = settle_choices(open, Transform<Flange, Camera>(cell.setup.flange_T_camera));
  for (std::size_t i = 0; i < open.size(); ++i) {
    CHECK(open[i].choices[choices[i]].reversed == turned[i]);
    CHECK(open[i].choices[known[i]].reversed == turned[i]);
  }
}

TEST_CASE("box figures: quartiles between neighbours, whiskers within one and a half boxes", "[calibration]") {
  std::vector<double> sample = {9, 1, 2, 3, 4, 5, 6, 7, 8, 100, -40};
  const BoxFigures box = box_figures(sample);
  CHECK(box.minimum == -40);
  CHECK(box.quartile_low == 2.5);
  CHECK(box.median == 5);
  CHECK(box.quartile_high == 7.5);
  CHECK(box.whisker_low == 1);
  CHECK(box.whisker_high == 9);
  CHECK(box.outliers == std::vector<double>{-40, 100});
  CHECK(box_figures({}).maximum == 0);
}

TEST_CASE("the comparison solves the subsets of the validation with every solver", "[calibration]") {
  const Setup setup;
  Random random(50);
  const auto views = test::observe_views(setup, 12, random);
  const auto result = calibrate_hand_eye(setup.camera, setup.board, views);
  REQUIRE(result);
  REQUIRE(result->subset_solutions.size() == 100);
  const auto pairs = used_pairs(setup.camera, setup.board, views, *result);
  const SolverComparison comparison = compare_solvers(pairs, *result, {});
  REQUIRE(comparison.solvers.size() == solver_table().size() + 1);
  CHECK(comparison.subsets == 100);
  CHECK(comparison.views_of_solve == 9);
  for (const SubsetSolves& s : comparison.solvers) {
    INFO(s.solver);
    CHECK(s.solved + s.failed == 100);
    REQUIRE(s.solved > 50);
    const BoxFigures& x = s.boxes[static_cast<std::size_t>(PoseFigure::kX)];
    CHECK(x.minimum <= x.quartile_low);
    CHECK(x.quartile_low <= x.median);
    CHECK(std::abs(x.median - setup.flange_T_camera.translation().x()) < 0.02);
    const BoxFigures& yaw = s.boxes[static_cast<std::size_t>(PoseFigure::kYaw)];
    CHECK(yaw.maximum - yaw.minimum < 1);  // none has gone around by a turn
  }
  // The spread that the verdict states is that of the same solves.
  double squared = 0;
  for (const auto& solution : result->subset_solutions) {
    squared += (solution.translation() - result->flange_T_camera.translation()).squaredNorm();
  }
  CHECK(result->subset_spread_m == Approx(std::sqrt(squared / 100)));
}
