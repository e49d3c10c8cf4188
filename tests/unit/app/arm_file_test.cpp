#include "app/config/arm_file.hpp"

#include <catch2/catch.hpp>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <numbers>

#include "algorithms/kinematics/capsule_fit.hpp"
#include "algorithms/kinematics/inverse_kinematics.hpp"
#include "algorithms/kinematics/self_collision.hpp"
#include "algorithms/motion/body.hpp"
#include "app/config/mesh_points.hpp"
#include "platform/core/random.hpp"

using namespace firstlook;
using Catch::Matchers::Contains;
using Eigen::Vector3d;

namespace {

constexpr double kPi = std::numbers::pi;

std::string joint(const std::string& name, const std::string& parent, const std::string& child,
                  const std::string& origin, const std::string& axis, const std::string& type = "revolute",
                  const std::string& limit = "<limit lower='-6.2' upper='6.2' velocity='3.14' effort='1'/>") {
  return "<joint name='" + name + "' type='" + type + "'><parent link='" + parent + "'/><child link='" + child +
         "'/><origin " + origin + "/><axis xyz='" + axis + "'/>" + limit + "</joint>\n";
}

std::string link(const std::string& name, const std::string& collision) {
  return "<link name='" + name + "'>" + collision + "</link>\n";
}

std::string cylinder(double radius, double length, const std::string& origin) {
  return fmt::format("<collision><origin {}/><geometry><cylinder radius='{}' length='{}'/></geometry></collision>",
                     origin, radius, length);
}

std::string sphere(double radius) {
  return fmt::format("<collision><geometry><sphere radius='{}'/></geometry></collision>", radius);
}

/// A UR5 as a robot description would have it, written from its published lengths: links along axes, offsets that
/// cancel, collision shapes a little inside the built-in arm's true body.
std::string ur5_urdf(const std::string& more = "") {
  return "<?xml version='1.0'?><robot name='my_ur5'>\n" + link("base", cylinder(0.06, 0.06, "xyz='0 0 0.04'")) +
         link("shoulder", cylinder(0.05, 0.1, "xyz='0 0.05 0.039' rpy='1.5707963267948966 0 0'")) +
         link("upper_arm", cylinder(0.05, 0.40, "xyz='-0.2125 -0.006 0' rpy='0 1.5707963267948966 0'")) +
         link("forearm", cylinder(0.04, 0.36, "xyz='-0.19 0 0' rpy='0 1.5707963267948966 0'")) +
         link("wrist_1", sphere(0.04)) + link("wrist_2", sphere(0.04)) +
         link("wrist_3",
              "<collision><origin xyz='0 -0.03 0'/><geometry><box size='0.05 0.04 0.05'/></geometry></collision>") +
         link("tool0", "") + joint("pan", "base", "shoulder", "xyz='0 0 0.05'", "0 0 1") +
         joint("lift", "shoulder", "upper_arm", "xyz='0 -0.13 0.039159'", "0 -1 0") +
         joint("elbow", "upper_arm", "forearm", "xyz='-0.425 0.12 0'", "0 -1 0") +
         joint("w1", "forearm", "wrist_1", "xyz='-0.39225 0.01 0'", "0 -1 0") +
         joint("w2", "wrist_1", "wrist_2", "xyz='0 -0.10915 0.02'", "0 0 -1") +
         joint("w3", "wrist_2", "wrist_3", "xyz='0 0.03 -0.11465'", "0 -1 0") +
         joint("flange", "wrist_3", "tool0", "xyz='0 -0.1123 0' rpy='1.5707963267948966 0 0'", "1 0 0", "fixed", "") +
         more + "</robot>\n";
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  REQUIRE(at != std::string::npos);
  return text.replace(at, from.size(), to);
}

std::string refused_urdf(const std::string& urdf, const ArmFileOptions& options = {}) {
  const auto read = parse_arm_urdf(urdf, "arm.urdf", ".", options);
  REQUIRE_FALSE(read);
  CHECK(std::string(read.error().detail()).find("arm.urdf") != std::string::npos);
  return std::string(read.error().detail());
}

std::string example_yaml() {
  std::ifstream file(std::string(FIRSTLOOK_SOURCE_DIR) + "/app/config/example_arm.yaml");
  return {std::istreambuf_iterator<char>(file), {}};
}

std::string refused_yaml(const std::string& yaml) {
  const auto read = parse_arm_yaml(yaml, "arm.yaml");
  REQUIRE_FALSE(read);
  CHECK(read.error().fault == Fault::kConfigBadValue);
  CHECK_THAT(std::string(read.error().detail()), Contains("arm.yaml"));
  return std::string(read.error().detail());
}

std::string temporary(const std::string& name) {
  const auto folder = std::filesystem::temp_directory_path() / "firstlook_arm_file_test";
  std::filesystem::create_directories(folder);
  return folder / name;
}

void write(const std::string& path, std::string_view bytes) {
  std::ofstream(path, std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
}

std::string binary_stl(const std::vector<Vector3d>& points) {
  std::string bytes(80, ' ');
  const auto put = [&](const auto& value) { bytes.append(reinterpret_cast<const char*>(&value), sizeof value); };
  put(static_cast<std::uint32_t>(points.size() / 3));
  for (std::size_t t = 0; t + 3 <= points.size(); t += 3) {
    for (int i = 0; i < 3; ++i) put(0.0F);
    for (std::size_t v = t; v < t + 3; ++v) {
      for (int i = 0; i < 3; ++i) put(static_cast<float>(points[v][i]));
    }
    put(std::uint16_t{0});
  }
  return bytes;
}

JointVector random_joints(int joints, Random& random) {
  JointVector q = JointVector::zero(joints);
  for (int j = 0; j < joints; ++j) q[j] = random.uniform(-kPi, kPi);
  return q;
}

/// A point of a capsule's surface.
Vector3d surface_point(const Capsule& c, Random& random) {
  const Vector3d direction = random.direction(), axis = c.b - c.a;
  return (direction.dot(axis) > 0 ? c.b : c.a) - random.uniform() * (direction.dot(axis) > 0 ? axis : Vector3d(-axis)) +
         c.radius_m * direction;
}

}  // namespace

TEST_CASE("a URDF of a UR5 has the built-in arm's flange poses and closed form", "[arm_file]") {
  const auto read = parse_arm_urdf(ur5_urdf(), "arm.urdf", ".");
  if (!read) FAIL(read.error().detail());
  const ArmModel& arm = read->arm;
  const ArmModel ours = *find_arm_model("ur5");
  CHECK(arm.name == "my_ur5");
  CHECK(arm.joints == 6);
  CHECK(has_closed_form_inverse(arm));
  CHECK(arm.speed_max_rad_s[3] == 3.14);
  CHECK(arm.lower_rad[1] == -6.2);
  CHECK_THAT(read->summary, Contains("from base to tool0"));
  Random random(1);
  for (int i = 0; i < 500; ++i) {
    const JointVector q = random_joints(6, random);
    const auto apart = forward(arm, q).flange().pose().matrix() - forward(ours, q).flange().pose().matrix();
    REQUIRE(apart.cwiseAbs().maxCoeff() < 1e-12);
  }
}

TEST_CASE("the body of a URDF holds the true geometry that it stands for, with the padding beyond", "[arm_file]") {
  const ArmModel arm = parse_arm_urdf(ur5_urdf(), "arm.urdf", ".")->arm;
  const ArmModel ours = *find_arm_model("ur5");
  Random random(2);
  // Edges of the upper arm's cylinder and corners of wrist 3's box, by the built-in arm's own frames.
  const auto in_body = [&](int link_number, const Vector3d& base_p, const LinkFrames& frames) {
    double outside_m = 1;
    for (const Capsule& c : place(arm.body, frames)) {
      if (c.link == link_number)
        outside_m = std::min(outside_m, segment_distance_m(base_p, base_p, c.a, c.b) - c.radius_m);
    }
    return outside_m <= -kBodyPadding_m + 1e-7;
  };
  for (int i = 0; i < 200; ++i) {
    const JointVector q = random_joints(6, random);
    const LinkFrames frames = forward(arm, q), same = forward(ours, q);
    const Pose& upper = same.base_T_link[2];  // its x along the upper arm, its end at the elbow, its z axis 3
    const double angle = random.uniform(0, 2 * kPi), t = random.uniform() < 0.5 ? -0.2 : 0.2;
    // URDF: link upper_arm at axis 2's joint, -y is z of frame 2, its cylinder about y = -0.006 - 0.13 + 0 of the
    // shoulder.
    const Vector3d edge(0.2125 + t, 0.05 * std::cos(angle), 0.136 + 0.05 * std::sin(angle));
    REQUIRE(in_body(2, upper * edge, frames));
    const Vector3d corner((i & 1) != 0 ? 0.025 : -0.025, (i & 2) != 0 ? 0.025 : -0.025, 0);
    const Pose& flange = same.base_T_link[6];  // wrist_3's -y is its z; the flange is 0.1123 beyond the joint
    REQUIRE(in_body(6, flange * (corner + Vector3d(0, 0, -0.1123 + ((i & 4) != 0 ? 0.05 : 0.01))), frames));
    // The grader's slimmer body lies inside the planner's, capsule by capsule.
    const Capsules real = place(true_body(arm), frames), body = place(arm.body, frames);
    REQUIRE(real.size() == body.size());
    for (std::size_t c = 0; c < real.size(); ++c) {
      const Vector3d p = surface_point(real[c], random);
      REQUIRE(segment_distance_m(p, p, body[c].a, body[c].b) <= body[c].radius_m - kBodyPadding_m + 1e-9);
    }
  }
}

TEST_CASE("the chain of a URDF is the only one, or the one that is named", "[arm_file]") {
  const std::string gripper = link("palm", sphere(0.03)) + link("left", sphere(0.01)) + link("right", sphere(0.01)) +
                              joint("hand", "tool0", "palm", "xyz='0 0 0.02'", "1 0 0", "fixed", "") +
                              joint("finger_l", "palm", "left", "xyz='0 0.03 0.04'", "0 1 0", "prismatic") +
                              joint("finger_r", "palm", "right", "xyz='0 -0.03 0.04'", "0 1 0", "prismatic");
  CHECK_THAT(refused_urdf(ur5_urdf(gripper)), Contains("branches at palm") && Contains("arm.tip_link"));
  const auto read = parse_arm_urdf(ur5_urdf(gripper), "arm.urdf", ".",
                                   {.base_link = {}, .tip_link = "tool0", .links_without_body = {}});
  if (!read) FAIL(read.error().detail());
  CHECK(read->arm.body.size() == 10);  // palm and fingers belong to the last link
  CHECK(read->arm.body.back().link == 6);
  CHECK_THAT(read->summary, Contains("finger_l, finger_r"));
  CHECK_THAT(refused_urdf(ur5_urdf(gripper), {.base_link = {}, .tip_link = "left", .links_without_body = {}}),
             Contains("prismatic"));
  CHECK_THAT(refused_urdf(ur5_urdf(), {.base_link = {}, .tip_link = "tool1", .links_without_body = {}}),
             Contains("no link 'tool1'") && Contains("tool0"));
  CHECK_THAT(refused_urdf(ur5_urdf(), {.base_link = "tool0", .tip_link = "base", .links_without_body = {}}),
             Contains("does not hang on"));
  const auto part = parse_arm_urdf(ur5_urdf(), "arm.urdf", ".",
                                   {.base_link = "shoulder", .tip_link = "wrist_2", .links_without_body = {}});
  REQUIRE(part);
  CHECK(part->arm.joints == 4);
}

TEST_CASE("a URDF that is no arm is refused by what is wrong with it", "[arm_file]") {
  const std::string good = ur5_urdf(), limit = "<limit lower='-6.2' upper='6.2' velocity='3.14' effort='1'/>";
  const auto with_limit = [&](const std::string& other) { return replaced(good, limit, other); };
  CHECK_THAT(refused_urdf(with_limit("")), Contains("no URDF") || Contains("limit"));
  CHECK_THAT(refused_urdf(with_limit("<limit lower='-170' upper='170' velocity='3' effort='1'/>")),
             Contains("joint pan") && Contains("degrees"));
  CHECK_THAT(refused_urdf(with_limit("<limit lower='-3' upper='3' velocity='180' effort='1'/>")), Contains("degrees"));
  CHECK_THAT(refused_urdf(with_limit("<limit lower='3' upper='-3' velocity='3' effort='1'/>")), Contains("no range"));
  CHECK_THAT(refused_urdf(with_limit("<limit lower='nan' upper='3' velocity='3' effort='1'/>")), Contains("arm.urdf"));
  CHECK_THAT(refused_urdf(replaced(good, "xyz='-0.425 0.12 0'", "xyz='-425 120 0'")), Contains("millimetres"));
  CHECK_THAT(refused_urdf(replaced(good, "type='revolute'", "type='prismatic'")),
             Contains("pan is prismatic") && Contains("arm.base_link"));
  CHECK_THAT(refused_urdf(replaced(good, "type='revolute'", "type='planar'")), Contains("neither revolute"));
  CHECK_THAT(refused_urdf(replaced(good, "type='revolute'", "type='rotary'")), Contains("no URDF"));
  CHECK_THAT(refused_urdf(replaced(good, "axis xyz='0 0 1'", "axis xyz='0 0 0'")), Contains("axis"));
  CHECK_THAT(refused_urdf(replaced(good, sphere(0.04), "")), Contains("link 4 has no body"));
  CHECK_THAT(refused_urdf(replaced(good, "radius='0.05'", "radius='-0.05'")), Contains("sizes above 0"));
  CHECK_THAT(refused_urdf(replaced(good, "name='my_ur5'", "name='ur5'")), Contains("built-in"));
  CHECK_THAT(refused_urdf(replaced(good, "name='my_ur5'", "name='my arm'")), Contains("letters"));
  CHECK_THAT(refused_urdf("<robot name='x'/>"), Contains("no URDF"));
  CHECK_THAT(refused_urdf("nothing"), Contains("no URDF"));
  CHECK_THAT(refused_urdf(""), Contains("no URDF"));
  const std::string two_more = link("a", sphere(.02)) + link("b", sphere(.02)) +
                               joint("j7", "tool0", "a", "xyz='0 0 .1'", "0 1 0") +
                               joint("j8", "a", "b", "xyz='0 0 .1'", "1 0 0");
  CHECK_THAT(refused_urdf(ur5_urdf(two_more)), Contains("more than 7"));
  const ArmFileOptions bare{.base_link = {}, .tip_link = {}, .links_without_body = {"wrist_1"}};
  CHECK(parse_arm_urdf(replaced(good, sphere(0.04), ""), "arm.urdf", ".", bare));
}

TEST_CASE("meshes give capsules that hold every vertex, broken ones are refused", "[arm_file]") {
  Random random(3);
  std::vector<Vector3d> points;
  for (int i = 0; i < 300; ++i)
    points.emplace_back(0.3 * random.uniform(), 0.04 * random.uniform(), 0.05 * random.uniform());
  const std::string bytes = binary_stl(points);
  write(temporary("forearm.stl"), bytes);
  const auto read = read_mesh_points(temporary("forearm.stl"));
  REQUIRE(read);
  REQUIRE(read->size() == points.size());
  CHECK((read->at(17) - points[17]).norm() < 1e-7);

  std::string text = "solid part\n", obj = "# part\n";
  for (const Vector3d& p : points) {
    text += fmt::format("  vertex {} {} {}\n", p.x(), p.y(), p.z());
    obj += fmt::format("v {} {} {}\n", p.x(), p.y(), p.z());
  }
  for (const auto& [extension, content] :
       {std::pair{".stl", text + "endsolid\n"}, std::pair{".obj", obj + "f 1 2 3\n"}}) {
    const auto same = parse_mesh_points(content, extension, "mesh");
    REQUIRE(same);
    REQUIRE(same->size() == points.size());
    CHECK((*same)[5] == points[5]);
  }
  CHECK_FALSE(parse_mesh_points(text, ".stl", "mesh"));  // cut
  CHECK_FALSE(parse_mesh_points(bytes.substr(0, bytes.size() - 7), ".stl", "mesh"));
  CHECK_FALSE(parse_mesh_points("", ".stl", "mesh"));
  CHECK_FALSE(parse_mesh_points("v 1 2\n", ".obj", "mesh"));
  CHECK_FALSE(parse_mesh_points("v 1 2 nan\n", ".obj", "mesh"));
  CHECK_FALSE(parse_mesh_points("x", ".dae", "mesh"));
  std::string broken = bytes;
  const float nan = std::nanf("");
  std::memcpy(broken.data() + 84 + 12, &nan, sizeof nan);
  CHECK_FALSE(parse_mesh_points(broken, ".stl", "mesh"));

  const auto with_mesh = [&](const std::string& mesh) {
    return replaced(ur5_urdf(), cylinder(0.04, 0.36, "xyz='-0.19 0 0' rpy='0 1.5707963267948966 0'"),
                    "<collision><geometry><mesh " + mesh + "/></geometry></collision>");
  };
  write(temporary("arm.urdf"), with_mesh("filename='package://any/forearm.stl'"));
  const auto arm = read_arm_file(temporary("arm.urdf"));
  if (!arm) FAIL(arm.error().detail());
  const LinkFrames frames = forward(arm->arm, JointVector::zero(6));
  for (const Capsule& c : place(arm->arm.body, frames)) {
    if (c.link != 3) continue;
    const Vector3d elbow(-0.425, -0.01, 0.089159);  // of the URDF, at joints zero
    for (const Vector3d& p : points) {
      const Vector3d at = elbow + p;
      REQUIRE(segment_distance_m(at, at, c.a, c.b) <= c.radius_m - kBodyPadding_m + 1e-7);
    }
  }
  const std::string folder = std::filesystem::path(temporary("x")).parent_path();
  const auto complaint = [&](const std::string& mesh) {
    const auto no = parse_arm_urdf(with_mesh(mesh), "arm.urdf", folder);
    REQUIRE_FALSE(no);
    return std::string(no.error().detail());
  };
  CHECK_THAT(complaint("filename='forearm.stl' scale='1000 1000 1000'"), Contains("millimetres"));
  CHECK_THAT(complaint("filename='missing.stl'"), Contains("missing.stl"));
  CHECK_THAT(complaint("filename='package://my/missing.stl'"), Contains("not found"));
  CHECK_THAT(complaint("filename='forearm.dae'"), Contains("convert"));
  std::filesystem::remove_all(folder);
}

TEST_CASE("the example table reads, and is the arm that it says", "[arm_file]") {
  const auto read = parse_arm_yaml(example_yaml(), "example_arm.yaml");
  if (!read) FAIL(read.error().detail());
  const ArmModel& arm = read->arm;
  CHECK(arm.name == "example");
  CHECK(arm.joints == 6);
  CHECK(arm.dh[0].alpha_rad == kPi / 2);
  CHECK(arm.upper_rad[0] == Approx(170 * kPi / 180));
  CHECK(arm.speed_max_rad_s[5] == Approx(200 * kPi / 180));
  CHECK(arm.body[0].radius_m == Approx(0.10 + kBodyPadding_m));
  // Stretched upwards at joints zero.
  const Pose flange = forward(arm, JointVector::zero(6)).flange().pose();
  CHECK(flange.translation().isApprox(Vector3d(0, 0, 0.34 + 0.40 + 0.38 + 0.10), 1e-9));
  CHECK(self_margin_m(place(arm.body, forward(arm, default_start(arm))), self_pairs_of_arm(arm, 0.005)) > 0);
  const auto again = parse_arm_yaml(example_yaml(), "example_arm.yaml");
  CHECK(again->arm.start_rad == arm.start_rad);
  CHECK(parse_arm_yaml(replaced(example_yaml(), "\nname: example", "\n"), "some/where/my_robot.yml")->arm.name ==
        "my_robot");
}

TEST_CASE("where an arm starts, a camera fits on its flange whatever side the bracket points to", "[arm_file]") {
  const std::string without_start = replaced(ur5_urdf(), "my_ur5", "my_other");
  for (const auto& read :
       {parse_arm_yaml(example_yaml(), "example_arm.yaml"), parse_arm_urdf(without_start, "my_other.urdf", ".")}) {
    REQUIRE(read);
    const ArmModel& arm = read->arm;
    for (int side = 0; side < 8; ++side) {
      const double angle_rad = side * kPi / 4;
      const Transform<Flange, Camera> flange_T_camera(
          Eigen::Quaterniond::Identity(), Vector3d(0.07 * std::cos(angle_rad), 0.07 * std::sin(angle_rad), 0.06));
      const Body body = body_with_camera(arm, flange_T_camera);
      INFO(arm.name.view() << " side " << side);
      CHECK(self_margin_m(place(body.capsules, forward(arm, default_start(arm))), body.self_pairs) > 0);
    }
  }
}

TEST_CASE("a table that is no arm is refused with the place and the likely mistake", "[arm_file]") {
  const std::string good = example_yaml();
  const auto with = [&](const std::string& from, const std::string& to) {
    return refused_yaml(replaced(good, from, to));
  };
  CHECK_THAT(with("alpha_deg: 90", "alfa_deg: 90"), Contains(":6:") && Contains("did you mean alpha_deg"));
  CHECK_THAT(with("alpha_deg: 90", "alpha_deg: 90, alpha_rad: 1.57"), Contains("in rad and in deg"));
  CHECK_THAT(with("limits_deg: [-170, 170], ", ""), Contains("dh[0].limits_deg (or _rad) is missing"));
  CHECK_THAT(with("limits_deg: [-170, 170]", "limits_rad: [-170, 170]"), Contains("degrees"));
  CHECK_THAT(with("limits_deg: [-170, 170]", "limits_deg: [170, -170]"), Contains("no range"));
  CHECK_THAT(with("limits_deg: [-170, 170]", "limits_deg: 170"), Contains("list of 2 numbers"));
  CHECK_THAT(with("speed_max_deg_s: 100", "speed_max_rad_s: 100"), Contains("degrees"));
  CHECK_THAT(with(", speed_max_deg_s: 100", ""), Contains("speed_max_rad_s is missing"));
  CHECK_THAT(with("a_m: 0.40", "a_m: 400"), Contains("millimetres"));
  CHECK_THAT(with("d_m: 0.34", "d_m: .nan"), Contains("finite"));
  CHECK_THAT(with("radius_m: 0.10", "radius_m: 0"), Contains("radius"));
  CHECK_THAT(with("link: 6", "link: 7"), Contains("0 (the base) to 6"));
  CHECK_THAT(with("link: 6", "link: 5"), Contains("link 6 has no body"));
  CHECK_THAT(with("name: example", "name: ur5"), Contains("built-in"));
  CHECK_THAT(with("name: example", "name: [a]"), Contains("letters"));
  CHECK_THAT(with("acceleration_max_deg_s2: 120", "acceleration_max_deg_s2: 0"), Contains("above 0"));
  CHECK_THAT(with("acceleration_max_deg_s2: 120", "start_deg: [0, 0, 0]"), Contains("list of 6"));
  CHECK_THAT(with("acceleration_max_deg_s2: 120", "start_deg: [0, 0, 0, 0, 111, 0]"), Contains("joint 5"));
  CHECK_THAT(refused_yaml("dh: [{limits_deg: [-1, 1], speed_max_deg_s: 1}]\ncapsules: []\n"), Contains("2 to 7"));
  CHECK_THAT(refused_yaml("name: x\n"), Contains("dh is missing"));
  CHECK_THAT(refused_yaml("a: [1\n"), Contains("arm.yaml:"));
  CHECK_THAT(refused_yaml("words\n"), Contains("mapping"));
  CHECK(parse_arm_yaml(
      replaced(replaced(good, "link: 6", "link: 5"), "# links_without_body: [5]", "links_without_body: [6] #"),
      "arm.yaml"));
  CHECK(read_arm_file("missing.yaml").error().fault == Fault::kDataMissing);
  CHECK_THAT(std::string(read_arm_file("arm.xacro").error().detail()), Contains("xacro arm.xacro > arm.urdf"));
}
