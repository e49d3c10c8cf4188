#include "tests/bench/motion_peers.hpp"

#include <cmath>
#include <numbers>

#include "algorithms/motion/certificate.hpp"
#include "tests/bench/bench.hpp"

#ifdef BENCH_HAS_FCL
#include <fcl/geometry/octree/octree.h>
#include <fcl/geometry/shape/capsule.h>
#include <fcl/narrowphase/collision.h>
#include <octomap/octomap.h>
#endif
#ifdef BENCH_HAS_OMPL
#include <ompl/base/DiscreteMotionValidator.h>
#include <ompl/base/MotionValidator.h>
#include <ompl/base/PlannerTerminationCondition.h>
#include <ompl/base/ProblemDefinition.h>
#include <ompl/base/StateValidityChecker.h>
#include <ompl/base/spaces/RealVectorStateSpace.h>
#include <ompl/geometric/planners/rrt/RRTConnect.h>
#include <ompl/util/Console.h>
#include <ompl/util/RandomNumbers.h>
#endif

namespace firstlook::bench {

#ifdef BENCH_HAS_FCL
namespace {

std::shared_ptr<octomap::OcTree> octree_of(const MotionCell& cell) {
  const GridGeometry& g = cell.geometry;
  auto tree = std::make_shared<octomap::OcTree>(g.resolution_m);
  // One layer more than the grid has: outside nothing is free.
  for (int z = -1; z <= g.size.z(); ++z) {
    for (int y = -1; y <= g.size.y(); ++y) {
      for (int x = -1; x <= g.size.x(); ++x) {
        const Eigen::Vector3i v(x, y, z);
        if (g.contains(v) && cell.free[g.index(v)] != 0) continue;
        const Eigen::Vector3i k = v + g.first + Eigen::Vector3i::Constant(32768);
        tree->setNodeValue(
            octomap::OcTreeKey(static_cast<octomap::key_type>(k.x()), static_cast<octomap::key_type>(k.y()),
                               static_cast<octomap::key_type>(k.z())),
            3.5F, true);
      }
    }
  }
  tree->updateInnerOccupancy();
  tree->prune();
  return tree;
}

class FclPeer final : public CollisionPeer {
 public:
  explicit FclPeer(const MotionCell& cell) : cell_(cell), octomap_(octree_of(cell)), tree_(octomap_) {
    const double half_diagonal_m = cell.geometry.resolution_m * std::sqrt(3.0) / 2;
    constexpr double kRounding_m = 1e-6;
    for (std::size_t i = 0; i < cell.body.capsules.size(); ++i) {
      const Capsule& c = cell.body.capsules[i];
      const double length_m = (c.b - c.a).norm();
      const double clear_m = c.radius_m + cell.clearance.voxels_m - half_diagonal_m - kRounding_m;
      shapes_.emplace_back(clear_m, length_m);
      // FCL's capsules lie along z about their middle.
      Pose pose = Pose::Identity();
      if (length_m > 0) {
        pose.linear() = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), c.b - c.a).toRotationMatrix();
      }
      pose.translation() = (c.a + c.b) / 2;
      link_T_shape_.push_back(pose);
    }
    for (const SelfPair& pair : cell.body.self_pairs) {
      const auto length = [&](int i) {
        const Capsule& c = cell.body.capsules[static_cast<std::size_t>(i)];
        return (c.b - c.a).norm();
      };
      const double radius_m = pair.axes_apart_m / 2 - kRounding_m;
      near_.emplace_back(radius_m, length(pair.near));
      far_.emplace_back(radius_m, length(pair.far));
    }
  }

  [[nodiscard]] bool is_free(const JointVector& q_rad) const override {
    const LinkFrames frames = forward(cell_.arm, q_rad);
    std::vector<fcl::Transform3d> placed(shapes_.size());
    for (std::size_t i = 0; i < shapes_.size(); ++i) {
      placed[i] = frames.base_T_link[static_cast<std::size_t>(cell_.body.capsules[i].link)] * link_T_shape_[i];
    }
    for (std::size_t p = 0; p < cell_.body.self_pairs.size(); ++p) {
      const SelfPair& pair = cell_.body.self_pairs[p];
      if (meet(near_[p], placed[static_cast<std::size_t>(pair.near)], far_[p],
               placed[static_cast<std::size_t>(pair.far)])) {
        return false;
      }
    }
    for (std::size_t i = 0; i < shapes_.size(); ++i) {
      if (cell_.body.exempt[i] == 0 && meet(shapes_[i], placed[i], tree_, fcl::Transform3d::Identity())) return false;
    }
    return true;
  }

 private:
  template <typename A, typename B>
  [[nodiscard]] static bool meet(const A& a, const fcl::Transform3d& base_T_a, const B& b,
                                 const fcl::Transform3d& base_T_b) {
    const fcl::CollisionRequestd request;  // the first contact is enough
    fcl::CollisionResultd result;
    return fcl::collide(&a, base_T_a, &b, base_T_b, request, result) > 0;
  }

  const MotionCell& cell_;
  std::shared_ptr<const octomap::OcTree> octomap_;
  fcl::OcTreed tree_;
  std::vector<fcl::Capsuled> shapes_, near_, far_;
  std::vector<Pose> link_T_shape_;
};

}  // namespace

std::unique_ptr<CollisionPeer> make_fcl(const MotionCell& cell) { return std::make_unique<FclPeer>(cell); }
#else
std::unique_ptr<CollisionPeer> make_fcl(const MotionCell&) { return nullptr; }
#endif

#ifdef BENCH_HAS_OMPL
namespace {

namespace ob = ompl::base;
using Space = ob::RealVectorStateSpace;

JointVector joints_of(const ob::State* state, int joints) {
  JointVector q = JointVector::zero(joints);
  for (int j = 0; j < joints; ++j) q[j] = state->as<Space::StateType>()->values[j];
  return q;
}

/// Edges by our certificate.
class CertifiedMotion final : public ob::MotionValidator {
 public:
  CertifiedMotion(const ob::SpaceInformationPtr& information, const MotionCell& cell)
      : ob::MotionValidator(information), cell_(cell) {}
  bool checkMotion(const ob::State* from, const ob::State* to) const override {
    const int n = cell_.arm.joints;
    return certify(cell_.arm, cell_.body, cell_.space, cell_.clearance, joints_of(from, n), joints_of(to, n))
        .certified();
  }
  bool checkMotion(const ob::State* from, const ob::State* to,
                   std::pair<ob::State*, double>& last_valid) const override {
    last_valid.second = 0;
    return checkMotion(from, to);
  }

 private:
  const MotionCell& cell_;
};

}  // namespace

std::optional<PeerPlan> plan_with_ompl(const MotionCell& cell, const CollisionPeer* checker, const JointVector& start,
                                       const JointVector& goal) {
  constexpr double kLimit_s = 1.0;
  ompl::msg::setLogLevel(ompl::msg::LOG_ERROR);
  static const bool kSeeded = [] {
    ompl::RNG::setSeed(1);
    return true;
  }();
  (void)kSeeded;
  const int n = cell.arm.joints;
  auto space = std::make_shared<Space>(static_cast<unsigned>(n));
  ob::RealVectorBounds bounds(static_cast<unsigned>(n));
  bounds.setLow(-std::numbers::pi);
  bounds.setHigh(std::numbers::pi);
  space->setBounds(bounds);
  auto information = std::make_shared<ob::SpaceInformation>(space);
  if (checker != nullptr) {
    information->setStateValidityChecker([&](const ob::State* s) { return checker->is_free(joints_of(s, n)); });
    information->setMotionValidator(std::make_shared<ob::DiscreteMotionValidator>(information));
    information->setStateValidityCheckingResolution(kPeerStep_rad / space->getMaximumExtent());
  } else {
    information->setStateValidityChecker([&](const ob::State* s) { return cell.is_free(joints_of(s, n)); });
    information->setMotionValidator(std::make_shared<CertifiedMotion>(information, cell));
  }
  information->setup();
  auto problem = std::make_shared<ob::ProblemDefinition>(information);
  ob::ScopedState<Space> from(space), to(space);
  for (int j = 0; j < n; ++j) {
    from[static_cast<unsigned>(j)] = start[j];
    to[static_cast<unsigned>(j)] = goal[j];
  }
  problem->setStartAndGoalStates(from, to);
  ompl::geometric::RRTConnect planner(information);
  planner.setProblemDefinition(problem);
  planner.setup();
  PeerPlan plan;
  plan.seconds = seconds_of([&] {
    plan.solved = planner.solve(ob::timedPlannerTerminationCondition(kLimit_s)) == ob::PlannerStatus::EXACT_SOLUTION;
  });
  return plan;
}
#else
std::optional<PeerPlan> plan_with_ompl(const MotionCell&, const CollisionPeer*, const JointVector&,
                                       const JointVector&) {
  return std::nullopt;
}
#endif

}  // namespace firstlook::bench
