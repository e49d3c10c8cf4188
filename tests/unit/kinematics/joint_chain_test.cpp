#include "algorithms/kinematics/joint_chain.hpp"

#include <catch2/catch.hpp>
#include <numbers>

#include "algorithms/kinematics/inverse_kinematics.hpp"
#include "algorithms/kinematics/other_arms.hpp"
#include "algorithms/kinematics/self_collision.hpp"
#include "algorithms/kinematics/twist.hpp"
#include "platform/core/random.hpp"

using namespace firstlook;
using Catch::Matchers::Contains;

namespace {

constexpr double kPi = std::numbers::pi;

JointVector random_joints(int joints, Random& random) {
  JointVector q = JointVector::zero(joints);
  for (int j = 0; j < joints; ++j) q[j] = random.uniform(-kPi, kPi);
  return q;
}

Pose random_step(Random& random) {
  Pose pose = Pose(random.rotation());
  pose.translation() = random.uniform(0.02, 0.4) * random.direction();
  return pose;
}

/// Axis 1 is the root's z; all else is as it comes. `bend_rad`: every axis is about as parallel to the one before.
JointChain random_chain(int joints, Random& random, double bend_rad) {
  JointChain chain;
  for (int j = 0; j < joints; ++j) {
    ChainJoint joint{random_step(random), random.direction(), -2, 2, 1};
    if (bend_rad >= 0 || j == 0) {
      joint.before_T_joint.linear() = Eigen::Matrix3d::Identity();
      joint.axis = Eigen::Vector3d(j == 0 ? 0 : bend_rad * random.normal(), j == 0 ? 0 : bend_rad, 1);
    }
    chain.joints.push_back(joint);
    chain.body.push_back({0.1 * random.direction(), 0.1 * random.direction(), 0.05, j + 1});
  }
  chain.body.push_back({{0, 0, 0}, {0, 0, 0.05}, 0.05, 0});
  chain.last_T_tip = random_step(random);
  return chain;
}

/// Frames of the chain, multiplied out from the root: independent of rows.
std::vector<Pose> multiplied(const JointChain& chain, const JointVector& q) {
  std::vector<Pose> frames = {Pose::Identity()};
  for (int j = 0; j < q.size(); ++j) {
    const ChainJoint& joint = chain.joints[static_cast<std::size_t>(j)];
    frames.push_back(frames.back() * joint.before_T_joint * Eigen::AngleAxisd(q[j], joint.axis.normalized()));
  }
  frames.push_back(frames.back() * chain.last_T_tip);
  return frames;
}

/// The UR5 as a robot description would have it: axes along y, offsets along axes that cancel.
JointChain ur5_chain() {
  const Eigen::Vector3d down = -Eigen::Vector3d::UnitZ(), right = -Eigen::Vector3d::UnitY();
  const auto at = [](double x, double y, double z) { return Pose(Eigen::Translation3d(x, y, z)); };
  JointChain chain;
  chain.joints = {{at(0, 0, 0.05), Eigen::Vector3d::UnitZ(), -2 * kPi, 2 * kPi, kPi},
                  {at(0, 0.13, 0.039159), right, -2 * kPi, 2 * kPi, kPi},
                  {at(-0.425, -0.12, 0), right, -kPi, kPi, kPi},
                  {at(-0.39225, -0.01, 0), right, -2 * kPi, 2 * kPi, kPi},
                  {at(0, -0.10915, 0.02), down, -2 * kPi, 2 * kPi, kPi},
                  {at(0, 0.03, -0.11465), right, -2 * kPi, 2 * kPi, kPi}};
  chain.last_T_tip = at(0, -0.1123, 0) * Pose(Eigen::AngleAxisd(kPi / 2, Eigen::Vector3d::UnitX()));
  return chain;
}

}  // namespace

TEST_CASE("a UR5 from a chain has the built-in one's rows and flange poses") {
  const ArmModel ours = *find_arm_model("ur5");
  const ChainedArm made = arm_from_chain(ur5_chain(), "mine");
  CHECK(made.root_T_base.matrix() == Eigen::Matrix4d::Identity());
  CHECK(has_closed_form_inverse(made.arm));
  Random random(1);
  for (std::size_t j = 0; j < 6; ++j) {
    CHECK(made.arm.dh[j].is_standard());
    CHECK(made.arm.dh[j].alpha_rad == ours.dh[j].alpha_rad);
    CHECK(made.arm.dh[j].a_m == Approx(ours.dh[j].a_m).margin(1e-12));
    CHECK(made.arm.dh[j].d_m == Approx(ours.dh[j].d_m).margin(1e-12));
  }
  for (int i = 0; i < 500; ++i) {
    const JointVector q = random_joints(6, random);
    const Eigen::Matrix4d apart =
        forward(made.arm, q).flange().pose().matrix() - forward(ours, q).flange().pose().matrix();
    REQUIRE(apart.cwiseAbs().maxCoeff() < 1e-12);
  }
}

TEST_CASE("rows of any chain give the chain's poses, and its capsules stay where they were") {
  Random random(2);
  for (const double bend_rad : {-1.0, 0.0, 1e-12, 1e-9, 1e-6, 1e-3, 0.05}) {
    for (int joints = 2; joints <= kJointsMax; ++joints) {
      const JointChain chain = random_chain(joints, random, bend_rad);
      const ChainedArm made = arm_from_chain(chain, "random");
      for (int i = 0; i < 20; ++i) {
        const JointVector q = random_joints(joints, random);
        const LinkFrames frames = forward(made.arm, q);
        const std::vector<Pose> wanted = multiplied(chain, q);
        const Pose flange = made.root_T_base * frames.flange().pose();
        INFO(joints << " joints, bend " << bend_rad);
        REQUIRE((flange.matrix() - wanted.back().matrix()).cwiseAbs().maxCoeff() < 2e-12);
        const Capsules placed = place(made.arm.body, frames);
        for (std::size_t c = 0; c < placed.size(); ++c) {
          const Capsule& given = chain.body[c];
          REQUIRE((made.root_T_base * placed[c].a - wanted[static_cast<std::size_t>(given.link)] * given.a).norm() <
                  2e-12);
          REQUIRE(placed[c].radius_m == given.radius_m + kBodyPadding_m);
        }
      }
    }
  }
}

TEST_CASE("bounds of reach stay true and short, for axes that are almost parallel, too") {
  Random random(3);
  for (const double bend_rad : {-1.0, 0.0, 1e-6, 1e-3}) {
    const JointChain chain = random_chain(6, random, bend_rad);
    const ArmModel arm = arm_from_chain(chain, "random").arm;
    double length_m = 0;  // of the chain as a string
    for (const ChainJoint& joint : chain.joints) length_m += joint.before_T_joint.translation().norm();
    for (const Capsule& capsule : arm.body) {
      const LeverArms levers = lever_arms(arm, capsule);
      for (int i = 0; i < 200; ++i) {
        const LinkFrames frames = forward(arm, random_joints(6, random));
        const Eigen::Vector3d a =
            place(Capsules(arm.body), frames)[static_cast<std::size_t>(&capsule - arm.body.begin())].a;
        for (int k = 0; k < capsule.link; ++k) {
          const Pose& axis = frames.base_T_link[static_cast<std::size_t>(k)];
          const double away_m = (axis.inverse(Eigen::Isometry) * a).head<2>().norm();
          REQUIRE(away_m <= levers[static_cast<std::size_t>(k)] + 1e-9);
        }
      }
      for (const double lever_m : levers) CHECK(lever_m <= length_m + 1.0);
    }
  }
}

TEST_CASE("an arm whose first axis is not the root's z gets a Base that stands on it") {
  JointChain chain = ur5_chain();
  chain.joints[0].before_T_joint = Pose(Eigen::Translation3d(0.1, -0.2, 0.3));
  CHECK(arm_from_chain(chain, "moved").root_T_base.translation().isApprox(Eigen::Vector3d(0.1, -0.2, 0)));
  CHECK(arm_from_chain(chain, "moved").root_T_base.linear().isIdentity(0));

  chain.joints[0].axis = -Eigen::Vector3d::UnitZ();
  const ChainedArm hanging = arm_from_chain(chain, "reversed");
  CHECK(hanging.root_T_base.linear().isIdentity(0));
  CHECK(hanging.arm.base_T_first.linear().col(2) == -Eigen::Vector3d::UnitZ());

  chain.joints[0].axis = Eigen::Vector3d(1, 0, 0);
  const ChainedArm wall = arm_from_chain(chain, "wall");
  CHECK(wall.root_T_base.linear().col(2).isApprox(Eigen::Vector3d::UnitX()));
  Random random(4);
  for (const ChainedArm& made : {hanging, wall}) {
    JointChain same = chain;
    same.joints[0].axis =
        made.arm.name == "wall" ? Eigen::Vector3d::UnitX() : Eigen::Vector3d(-Eigen::Vector3d::UnitZ());
    for (int i = 0; i < 50; ++i) {
      const JointVector q = random_joints(6, random);
      const Pose flange = made.root_T_base * forward(made.arm, q).flange().pose();
      REQUIRE((flange.matrix() - multiplied(same, q).back().matrix()).cwiseAbs().maxCoeff() < 2e-12);
    }
  }
}

TEST_CASE("pairs that can meet are found, and a start that stands free") {
  for (const std::string_view name : {"two_joint", "pr2_like"}) {
    ArmModel arm = *find_arm_model(name);
    CHECK(arm.own_pairs);
    INFO(name);
    for (const CapsulePair& pair : arm.pairs) CHECK(arm.body[pair.far].link - arm.body[pair.near].link >= 2);
    const SelfPairs pairs = self_pairs_of_arm(arm, 0.005);
    CHECK(self_margin_m(place(arm.body, forward(arm, default_start(arm))), pairs) > 0.01);
    arm.start_rad = JointVector();
    REQUIRE(complete_arm(arm));
    CHECK(self_margin_m(place(arm.body, forward(arm, default_start(arm))), pairs) > 0);
  }
  // The hand of the one with a torso can reach it.
  const ArmModel arm = *find_arm_model("pr2_like");
  const SelfPairs pairs = self_pairs_of_arm(arm, 0.005);
  Random random(5);
  int meet = 0;
  for (int i = 0; i < 2000; ++i) {
    JointVector q = JointVector::zero(7);
    for (int j = 0; j < 7; ++j) {
      q[j] = random.uniform(arm.lower_rad[static_cast<std::size_t>(j)], arm.upper_rad[static_cast<std::size_t>(j)]);
    }
    meet += self_margin_m(place(arm.body, forward(arm, q)), pairs) < 0 ? 1 : 0;
  }
  CHECK(meet > 50);
  CHECK(meet < 1500);
}

TEST_CASE("numbers that no arm has are refused, with the likely mistake") {
  const ArmModel good = *find_arm_model("pr2_like");
  REQUIRE(check_arm(good, {}, 0));
  const auto refused = [&](auto spoil) {
    ArmModel arm = good;
    spoil(arm);
    const Status status = check_arm(arm, {}, 0);
    REQUIRE_FALSE(status);
    CHECK(status.error().fault == Fault::kConfigBadValue);
    return std::string(status.error().detail());
  };
  CHECK_THAT(refused([](ArmModel& a) { a.upper_rad[2] = 170; }), Contains("joint 3") && Contains("degrees"));
  CHECK_THAT(refused([](ArmModel& a) { a.speed_max_rad_s[1] = 180; }), Contains("joint 2") && Contains("degrees"));
  CHECK_THAT(refused([](ArmModel& a) { a.speed_max_rad_s[1] = 0; }), Contains("speed"));
  CHECK_THAT(refused([](ArmModel& a) { a.dh[3].a_m = 425; }), Contains("joint 4") && Contains("millimetres"));
  CHECK_THAT(refused([](ArmModel& a) { a.dh[3].a_m = std::nan(""); }), Contains("finite"));
  CHECK_THAT(refused([](ArmModel& a) { std::swap(a.lower_rad[0], a.upper_rad[0]); }), Contains("no range"));
  CHECK_THAT(refused([](ArmModel& a) { a.body[5].radius_m = kBodyPadding_m; }), Contains("radius"));
  CHECK_THAT(refused([](ArmModel& a) { a.body[5].b.x() = 300; }), Contains("millimetres"));
  CHECK_THAT(refused([](ArmModel& a) { a.body.pop_back(); }), Contains("link 7 has no body"));
  ArmModel bare = good;
  bare.body.pop_back();
  CHECK(check_arm(bare, {}, 1U << 7));
  const std::string names[] = {"joint pan", "joint lift"};
  ArmModel named = good;
  named.upper_rad[1] = 90;
  CHECK_THAT(std::string(check_arm(named, names, 0).error().detail()), Contains("joint lift"));
}
