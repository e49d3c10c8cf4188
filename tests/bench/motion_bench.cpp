/// Checks, certificates and plans against FCL and OMPL, in the same cells and with the same distances kept.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "algorithms/motion/certificate.hpp"
#include "algorithms/motion/configuration_batch.hpp"
#include "algorithms/motion/planner.hpp"
#include "tests/bench/bench.hpp"
#include "tests/bench/motion_peers.hpp"

namespace firstlook::bench {
namespace {

using Cells = std::vector<std::unique_ptr<MotionCell>>;
using Peers = std::vector<std::unique_ptr<CollisionPeer>>;  // one for each cell; null: not installed

constexpr double kSegment_rad = 0.6;  // leading joint of a random segment

std::optional<double> if_any(const std::vector<double>& seconds, double scale) {
  return seconds.empty() ? std::nullopt : std::optional(scale * median(seconds));
}

/// One configuration: free or not. Times are of whole batches, because one check takes less than a microsecond.
void bench_checks(const Options& options, Report& report, const Cells& cells, const Peers& peers,
                  const std::string& at) {
  const int batch = options.amount(100, 1000, 5000);
  std::vector<double> ours_s, peer_s;
  int contradicted = 0, free_for_peer = 0, refused = 0;
  for (std::size_t c = 0; c < cells.size(); ++c) {
    Random random(c + 1, 31);
    std::vector<JointVector> joints;
    for (int i = 0; i < batch; ++i) joints.push_back(cells[c]->random_joints(random));
    std::vector<std::uint8_t> ours(joints.size()), theirs(joints.size());
    const auto repeats = options.amount(1, 5, 5);
    std::vector<double> batches;
    for (int repeat = 0; repeat < repeats; ++repeat) {
      batches.push_back(seconds_of([&] {
        const MotionCell& cell = *cells[c];
        configurations_are_free(cell.arm, cell.body, cell.space, cell.clearance, joints, kMarginMin_m, ours);
      }));
    }
    ours_s.push_back(median(batches) / batch);
    if (!peers[c]) continue;
    peer_s.push_back(seconds_of([&] {
                       for (std::size_t i = 0; i < joints.size(); ++i) theirs[i] = peers[c]->is_free(joints[i]) ? 1 : 0;
                     }) /
                     batch);
    for (std::size_t i = 0; i < joints.size(); ++i) {
      contradicted += ours[i] != 0 && theirs[i] == 0 ? 1 : 0;
      free_for_peer += theirs[i];
      refused += theirs[i] != 0 && ours[i] == 0 ? 1 : 0;
    }
  }
  Row row = timed("motion/check/" + at, 1e6 * median(ours_s), "us", "FCL octree", if_any(peer_s, 1e6),
                  Goal::ratio_at_least(100));
  if (contradicted > 0) row.void_because = fmt::format("{} not free for FCL", contradicted);
  report.add(row);
  if (free_for_peer == 0) return;
  report.add(measured("motion/timid_checks/" + at, refused, "of them", fmt::format("free for FCL, exact cubes"),
                      free_for_peer, Goal::none()));
}

/// A joint-linear segment: the proof against samples every 0.03 rad.
void bench_certificates(const Options& options, Report& report, const Cells& cells, const Peers& peers,
                        const std::string& at) {
  const int segments = options.amount(20, 200, 2000);
  std::vector<double> ours_s, peer_s;
  int contradicted = 0, free_for_peer = 0, refused = 0;
  for (std::size_t c = 0; c < cells.size(); ++c) {
    const MotionCell& cell = *cells[c];
    Random random(c + 1, 32);
    for (int i = 0; i < segments; ++i) {
      const JointVector from = cell.random_free_joints(random);
      const JointVector way = cell.random_joints(random);
      const JointVector to = from + way * (kSegment_rad / way.max_abs());
      Certificate certificate;
      ours_s.push_back(
          seconds_of([&] { certificate = certify(cell.arm, cell.body, cell.space, cell.clearance, from, to); }));
      if (!peers[c]) continue;
      bool free = true;
      const int steps = static_cast<int>(std::ceil(kSegment_rad / kPeerStep_rad));
      peer_s.push_back(seconds_of([&] {
        for (int k = 0; k <= steps && free; ++k) {
          free = peers[c]->is_free(interpolate(from, to, static_cast<double>(k) / steps));
        }
      }));
      contradicted += certificate.certified() && !free ? 1 : 0;
      free_for_peer += free ? 1 : 0;
      refused += free && !certificate.certified() ? 1 : 0;
    }
  }
  Row row = timed("motion/certify/" + at, 1e6 * median(ours_s), "us", "FCL octree every 0.03 rad", if_any(peer_s, 1e6),
                  Goal::none());
  if (contradicted > 0) row.void_because = fmt::format("{} not free for FCL", contradicted);
  report.add(row);
  if (free_for_peer == 0) return;
  report.add(measured("motion/timid_certificates/" + at, refused, "of them", "free for FCL, exact cubes", free_for_peer,
                      Goal::none()));
}

/// Every place that FCL finds a collision at, along a certified path.
int collisions_along(const CollisionPeer& peer, const Path& path) {
  int collisions = 0;
  for (std::size_t i = 1; i < path.waypoints.size(); ++i) {
    const JointVector &from = path.waypoints[i - 1], &to = path.waypoints[i];
    const int steps = 1 + static_cast<int>((to - from).max_abs() / kPeerStep_rad);
    for (int k = 0; k <= steps; ++k) {
      collisions += peer.is_free(interpolate(from, to, static_cast<double>(k) / steps)) ? 0 : 1;
    }
  }
  return collisions;
}

void bench_plans(const Options& options, Report& report, const Cells& cells, const Peers& peers,
                 const std::string& at) {
  const int problems = options.amount(3, 25, 100);
  const int problems_with_fcl = options.amount(1, 5, 20);
  std::vector<double> ours_s, peer_s, fcl_s;
  int tried = 0, solved = 0, solved_by_peer = 0, collisions = 0;
  Planner planner;
  for (std::size_t c = 0; c < cells.size(); ++c) {
    const MotionCell& cell = *cells[c];
    Random random(c + 1, 33);
    for (int i = 0; i < problems; ++i, ++tried) {
      const JointVector start = cell.random_free_joints(random), goal = cell.random_free_joints(random);
      Result<Path> path = failure(Fault::kNoPath, "not planned");
      ours_s.push_back(
          seconds_of([&] { path = planner.plan(cell.arm, cell.body, cell.space, cell.clearance, start, goal); }));
      solved += path ? 1 : 0;
      if (const auto plan = plan_with_ompl(cell, nullptr, start, goal)) {
        peer_s.push_back(plan->seconds);
        solved_by_peer += plan->solved ? 1 : 0;
      }
      if (!peers[c]) continue;
      if (path) collisions += collisions_along(*peers[c], *path);
      if (i >= problems_with_fcl) continue;
      if (const auto plan = plan_with_ompl(cell, peers[c].get(), start, goal)) fcl_s.push_back(plan->seconds);
    }
  }
  const auto add = [&](Row row) {
    if (collisions > 0) row.void_because = fmt::format("{} collisions on paths", collisions);
    report.add(row);
  };
  const bool has_ompl = !peer_s.empty();
  // Ours shortcut their paths; OMPL's times are without simplification.
  add(timed("motion/plan/" + at, 1e3 * median(ours_s), "ms", "OMPL RRTConnect, our checks", if_any(peer_s, 1e3),
            Goal::ours_at_most(1)));
  add(timed("motion/plan/" + at + "/p99", 1e3 * quantile(ours_s, 0.99), "ms", "OMPL RRTConnect, our checks",
            has_ompl ? std::optional(1e3 * quantile(peer_s, 0.99)) : std::nullopt, Goal::ours_at_most(50)));
  add(timed("motion/plan/" + at + "/fcl", 1e3 * median(ours_s), "ms", "OMPL RRTConnect, FCL", if_any(fcl_s, 1e3),
            Goal::none()));
  add(measured("motion/plan/" + at + "/success", 100.0 * solved / tried, "%", "OMPL RRTConnect, 1 s",
               has_ompl ? std::optional(100.0 * solved_by_peer / tried) : std::nullopt, Goal::ratio_at_least(1)));
}

}  // namespace

void bench_motion(const Options& options, Report& report) {
  for (const auto& [at, resolution_m] : {std::pair{"5cm", 0.05}, std::pair{"2cm", 0.02}}) {
    if (options.smoke && resolution_m < 0.05) continue;
    const Cells cells = motion_cells(options.amount(1, 8, 30), resolution_m);
    Peers peers;
    for (const auto& cell : cells) peers.push_back(make_fcl(*cell));
    bench_checks(options, report, cells, peers, at);
    bench_certificates(options, report, cells, peers, at);
    bench_plans(options, report, cells, peers, at);
  }
}

}  // namespace firstlook::bench
