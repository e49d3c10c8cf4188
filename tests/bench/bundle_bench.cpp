/// The non-linear part of the hand-eye refinement against Ceres on the same problems.
#include <fmt/format.h>

#include <string>

#include "tests/bench/bench.hpp"
#include "tests/oracle/calibration/bundle_scene.hpp"
#include "tests/oracle/calibration/ceres_bundle.hpp"

namespace firstlook::bench {
namespace {

constexpr int kIterationsMax = 60;
constexpr double kStartOff = 0.03;     // 3 cm, 0.03 rad on each axis
constexpr double kSameMinimum = 2e-7;  // m and rad

void compare(const Options& options, Report& report, std::size_t boards, int stations, EstimatedIntrinsics estimated) {
  const test::BundleScene scene(1, boards, stations, kStartOff);
  const IntrinsicsBelief belief = belief_of(estimated, std::nullopt);
  BundleState ours, theirs;
  bool solved = true;
  const auto [ours_s, theirs_s] = medians_taking_turns(
      options.amount(1, 15, 101),
      [&] {
        ours = scene.start;
        solved = solve_bundle(scene.boards, scene.views, scene.noise, belief, kIterationsMax, ours) && solved;
      },
      [&] {
        theirs = scene.start;
        solved =
            test::solve_bundle_with_ceres(scene.boards, scene.views, scene.noise, belief, kIterationsMax, theirs) &&
            solved;
      });
  Row row = timed(fmt::format("bundle/boards{}/stations{}/{}", boards, stations,
                              belief.count > 0 ? "intrinsics_estimated" : "intrinsics_given"),
                  1e3 * ours_s, "ms", "Ceres", 1e3 * theirs_s, Goal::ratio_at_least(1));
  if (!solved) row.void_because = "not solved";
  if (!(pose_difference(ours.flange_T_camera, theirs.flange_T_camera).norm() < kSameMinimum)) {
    row.void_because = "results differ";
  }
  report.add(row);
}

}  // namespace

void bench_bundle(const Options& options, Report& report) {
  for (const auto estimated : {EstimatedIntrinsics::kNone, EstimatedIntrinsics::kWithoutK3}) {
    compare(options, report, 1, 25, estimated);
    compare(options, report, 3, 25, estimated);
    compare(options, report, 1, 100, estimated);
  }
}

}  // namespace firstlook::bench
