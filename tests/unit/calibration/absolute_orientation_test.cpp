#include "algorithms/calibration/absolute_orientation.hpp"

#include <catch2/catch.hpp>
#include <vector>

#include "algorithms/calibration/calibration_view.hpp"
#include "platform/core/random.hpp"

using namespace firstlook;

namespace {

Pose random_pose(Random& random) {
  Pose pose = Pose::Identity();
  pose.linear() = random.rotation().toRotationMatrix();
  pose.translation() = random.normal3();
  return pose;
}

std::vector<Eigen::Vector3d> random_points(std::size_t count, bool planar, Random& random) {
  std::vector<Eigen::Vector3d> points;
  while (points.size() < count) {
    points.push_back(0.1 * random.normal3());
    if (planar) points.back().z() = 0;
  }
  return points;
}

}  // namespace

TEST_CASE("points without noise give their pose exactly, also with three and in a plane", "[calibration]") {
  Random random(1);
  for (int trial = 0; trial < 200; ++trial) {
    const Pose truth = random_pose(random);
    const auto in_b = random_points(trial % 2 == 0 ? 3 : 12, trial % 3 == 0, random);
    std::vector<Eigen::Vector3d> in_a;
    for (const Eigen::Vector3d& p : in_b) in_a.emplace_back(truth * p);
    CHECK(pose_difference(truth, absolute_orientation(in_a, in_b)).norm() < 1e-11);
    CHECK(scale_between(in_a, in_b) == Approx(1).margin(1e-12));
    for (Eigen::Vector3d& p : in_a) p *= 1.07;
    CHECK(scale_between(in_a, in_b) == Approx(1.07).margin(1e-12));
  }
}

TEST_CASE("no other pose fits noisy points better", "[calibration]") {
  Random random(2);
  const auto misfit = [](const Pose& pose, const auto& in_a, const auto& in_b) {
    double sum = 0;
    for (std::size_t i = 0; i < in_a.size(); ++i) sum += (in_a[i] - pose * in_b[i]).squaredNorm();
    return sum;
  };
  for (int trial = 0; trial < 100; ++trial) {
    const Pose truth = random_pose(random);
    const auto in_b = random_points(6, trial % 2 == 0, random);
    std::vector<Eigen::Vector3d> in_a;
    for (const Eigen::Vector3d& p : in_b) in_a.emplace_back(truth * p + 0.01 * random.normal3());
    const Pose found = absolute_orientation(in_a, in_b);
    const double least = misfit(found, in_a, in_b);
    for (int k = 0; k < 20; ++k) {
      Vector6d step;
      step << 1e-3 * random.normal3(), 1e-2 * random.normal3();
      CHECK(misfit(perturb(found, step), in_a, in_b) > least);
    }
  }
}
