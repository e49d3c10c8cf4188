/// Every file for ROS, loaded back by readers that know nothing of its writer: yaml-cpp, a small XML reader, MoveIt's
/// steps for scenes, and the rules by which tf2_ros reads its arguments.
#include "app/report/ros_files.hpp"

#include <yaml-cpp/yaml.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <map>
#include <numbers>
#include <regex>
#include <set>
#include <sstream>

#include "algorithms/vision/rotation.hpp"
#include "app/report/yaml_number.hpp"
#include "platform/core/random.hpp"
#include "tests/support/moveit_scene_reader.hpp"
#include "tests/support/xml_reader.hpp"

using namespace firstlook;
using Catch::Matchers::Contains;
using test::Scene;
using test::XmlElement;
using test::XmlReader;

namespace {

constexpr double kSame = 1e-9;

/// The pose that x y z and a quaternion make in a reader that does not normalise, which is what tf2 does.
Pose pose_of(const Eigen::Vector3d& t, const Eigen::Vector4d& xyzw) {
  Pose pose = Pose::Identity();
  pose.linear() = Eigen::Quaterniond(xyzw[3], xyzw[0], xyzw[1], xyzw[2]).toRotationMatrix();
  pose.translation() = t;
  return pose;
}

Eigen::Matrix3d rotation_of(double roll, double pitch, double yaw) {
  return (Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX()))
      .toRotationMatrix();
}

double difference(const Pose& a, const Pose& b) { return (a.matrix() - b.matrix()).cwiseAbs().maxCoeff(); }

/// Random ones, half turns about axes and about anything, hardly any turn, and cameras that look along the tool (where
/// camera_link is at a pitch of 90 degrees) with tilts down to nothing.
std::vector<Transform<Flange, Camera>> transforms() {
  Random random(3, 1);
  std::vector<Transform<Flange, Camera>> all = {Transform<Flange, Camera>()};
  const auto add = [&](const Eigen::Quaterniond& q) { all.emplace_back(q, 0.1 * random.normal3()); };
  for (int i = 0; i < 200; ++i) add(random.rotation());
  for (int i = 0; i < 3; ++i) add(Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::Unit(i))));
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector3d axis = random.normal3().normalized();
    add(Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi, axis)));
    add(Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi + 1e-10 * random.normal(), axis)));
    add(Eigen::Quaterniond(Eigen::AngleAxisd(1e-7, axis)));
  }
  for (double tilt_rad = 1e-2; tilt_rad > 1e-17; tilt_rad /= 10) {
    for (int i = 0; i < 10; ++i) {
      const double turn_rad = random.uniform(-3.2, 3.2);
      add(Eigen::AngleAxisd(turn_rad, Eigen::Vector3d::UnitZ()) *
          Eigen::AngleAxisd(tilt_rad, random.normal3().normalized()));
    }
  }
  return all;
}

std::string text_of(const std::vector<NamedFile>& files, std::string_view name) {
  for (const NamedFile& file : files) {
    if (file.name == name) return file.text;
  }
  FAIL("no file " << name);
  return {};
}

Eigen::Vector3d vector_of(const std::string& words) {
  std::istringstream stream(words);
  Eigen::Vector3d v;
  REQUIRE((stream >> v.x() >> v.y() >> v.z()));
  return v;
}

std::vector<std::string> words_of(const std::string& line) {
  std::istringstream stream(line);
  return {std::istream_iterator<std::string>(stream), {}};
}

/// As easy_handeye's HandeyeCalibration.from_dict.
Pose easy_handeye_pose(const std::string& text) {
  const YAML::Node t = YAML::Load(text)["transformation"];
  const auto n = [&](const char* key) { return t[key].as<double>(); };
  return pose_of({n("x"), n("y"), n("z")}, {n("qx"), n("qy"), n("qz"), n("qw")});
}

/// As set_message_fields fills a geometry_msgs/Transform.
Pose easy_handeye2_pose(const std::string& text) {
  const YAML::Node t = YAML::Load(text)["transform"]["translation"], r = YAML::Load(text)["transform"]["rotation"];
  return pose_of({t["x"].as<double>(), t["y"].as<double>(), t["z"].as<double>()},
                 {r["x"].as<double>(), r["y"].as<double>(), r["z"].as<double>(), r["w"].as<double>()});
}

struct Published {
  Pose pose;
  std::string parent, child;
};

/// ROS 1's static_transform_publisher with nine arguments: x y z qx qy qz qw frame_id child_frame_id.
Published ros1_published(const std::string& text) {
  const XmlElement launch = XmlReader(text).document();
  REQUIRE(launch.name == "launch");
  const XmlElement& node = launch.only("node");
  REQUIRE(node.attributes.at("pkg") == "tf2_ros");
  REQUIRE(node.attributes.at("type") == "static_transform_publisher");
  REQUIRE(node.attributes.contains("name"));
  const std::vector<std::string> argv = words_of(node.attributes.at("args"));
  REQUIRE(argv.size() == 9);
  const auto n = [&](std::size_t i) { return std::atof(argv[i].c_str()); };
  return {pose_of({n(0), n(1), n(2)}, {n(3), n(4), n(5), n(6)}), argv[7], argv[8]};
}

/// The words between quotes of the launch file's `arguments=[...]`, read as ROS 2's static_transform_publisher does.
Published ros2_published(const std::string& text) {
  const std::size_t begin = text.find("arguments=["), end = text.find(']', begin);
  REQUIRE(end != std::string::npos);
  const std::string list = text.substr(begin, end - begin);
  const std::regex word("'([^']*)'");
  std::vector<std::string> argv;
  for (auto it = std::sregex_iterator(list.begin(), list.end(), word); it != std::sregex_iterator(); ++it) {
    argv.push_back((*it)[1]);
  }
  std::map<std::string, std::string> options;
  REQUIRE(argv.size() == 18);
  for (std::size_t i = 0; i < argv.size(); i += 2) REQUIRE(options.emplace(argv[i], argv[i + 1]).second);
  const auto n = [&](const char* key) { return std::stod(options.at(key)); };
  return {pose_of({n("--x"), n("--y"), n("--z")}, {n("--qx"), n("--qy"), n("--qz"), n("--qw")}),
          options.at("--frame-id"), options.at("--child-frame-id")};
}

/// A joint's origin, with xacro's ${-pi/2}.
Pose origin_of(const XmlElement& joint) {
  const XmlElement& origin = joint.only("origin");
  std::string rpy = origin.attributes.at("rpy");
  const std::string quarter = "${-pi/2}";
  for (std::size_t at; (at = rpy.find(quarter)) != std::string::npos;) {
    rpy.replace(at, quarter.size(), fmt::format("{}", -std::numbers::pi / 2));
  }
  const Eigen::Vector3d angles = vector_of(rpy);
  Pose pose = Pose::Identity();
  pose.linear() = rotation_of(angles.x(), angles.y(), angles.z());
  pose.translation() = vector_of(origin.attributes.at("xyz"));
  return pose;
}

}  // namespace

TEST_CASE("every file of a calibration loads back to the same transform", "[ros_files]") {
  for (const Transform<Flange, Camera>& truth : transforms()) {
    INFO(truth.pose().matrix());
    const std::vector<NamedFile> files = ros_calibration_files(truth);
    REQUIRE(files.size() == 5);
    REQUIRE(difference(easy_handeye_pose(text_of(files, "easy_handeye.yaml")), truth.pose()) < kSame);
    REQUIRE(difference(easy_handeye2_pose(text_of(files, "easy_handeye2.calib")), truth.pose()) < kSame);
    for (const Published& published : {ros1_published(text_of(files, "camera_transform.launch")),
                                       ros2_published(text_of(files, "camera_transform.launch.py"))}) {
      REQUIRE(difference(published.pose, truth.pose()) < kSame);
      REQUIRE(published.parent == "tool0");
      REQUIRE(published.child == "camera_color_optical_frame");
    }
    const XmlElement robot = XmlReader(text_of(files, "camera.xacro")).document();
    const auto joints = robot.all("joint");
    REQUIRE(joints.size() == 2);
    REQUIRE(difference(origin_of(*joints[0]) * origin_of(*joints[1]), truth.pose()) < kSame);

    Eigen::Vector3d t, r;
    REQUIRE(std::sscanf(ur_pose_text(truth).c_str(), "p[%lf, %lf, %lf, %lf, %lf, %lf]", &t.x(), &t.y(), &t.z(), &r.x(),
                        &r.y(), &r.z()) == 6);
    REQUIRE((t - truth.translation()).norm() < 1e-6);
    const Eigen::Matrix3d ur = Eigen::AngleAxisd(r.norm(), r.stableNormalized()).toRotationMatrix();
    REQUIRE((ur - truth.rotation()).cwiseAbs().maxCoeff() < 1e-6);
  }
}

TEST_CASE("the xacro is a chain tool0, camera_link, optical frame, by REP 103", "[ros_files]") {
  const XmlElement robot = XmlReader(text_of(ros_calibration_files({}), "camera.xacro")).document();
  CHECK(robot.name == "robot");
  CHECK(robot.attributes.at("xmlns:xacro") == "http://www.ros.org/wiki/xacro");
  const XmlElement& macro = robot.only("xacro:macro");
  CHECK(macro.attributes.at("name") == "firstlook_camera");
  CHECK(macro.attributes.at("params") == "parent:=tool0");
  std::set<std::string> links;
  for (const XmlElement* link : macro.all("link")) links.insert(link->attributes.at("name"));
  CHECK(links == std::set<std::string>{"camera_link", "camera_color_optical_frame"});
  const auto joints = macro.all("joint");
  REQUIRE(joints.size() == 2);
  for (const XmlElement* joint : joints) CHECK(joint->attributes.at("type") == "fixed");
  CHECK(joints[0]->only("parent").attributes.at("link") == "${parent}");
  CHECK(joints[0]->only("child").attributes.at("link") == "camera_link");
  CHECK(joints[1]->only("parent").attributes.at("link") == "camera_link");
  CHECK(joints[1]->only("child").attributes.at("link") == "camera_color_optical_frame");
  // The link looks along x with z up; the optical frame looks along z with y down.
  const Eigen::Matrix3d link_R_optical = origin_of(*joints[1]).linear();
  CHECK((link_R_optical * Eigen::Vector3d::UnitZ()).isApprox(Eigen::Vector3d::UnitX(), 1e-12));
  CHECK((link_R_optical * Eigen::Vector3d::UnitY()).isApprox(-Eigen::Vector3d::UnitZ(), 1e-12));
}

TEST_CASE("each file says at its top what it is and how to load it", "[ros_files]") {
  const std::vector<NamedFile> files = ros_calibration_files({});
  const std::vector<std::pair<std::string, std::string>> commands = {
      {"easy_handeye.yaml", "roslaunch easy_handeye publish.launch eye_on_hand:=true namespace_prefix:=firstlook"},
      {"easy_handeye2.calib", "ros2 launch easy_handeye2 publish.launch.py name:=firstlook"},
      {"camera_transform.launch", "roslaunch ./camera_transform.launch"},
      {"camera_transform.launch.py", "ros2 launch ./camera_transform.launch.py"},
      {"camera.xacro", "<xacro:firstlook_camera parent=\"tool0\"/>"}};
  for (const auto& [name, command] : commands) {
    const std::string text = text_of(files, name);
    INFO(text);
    CHECK(text.find(command) < 700);
    CHECK_THAT(text.substr(0, 700), Contains("written by firstlook"));
  }
  CHECK_THAT(camera_info_yaml({640, 480, 525, 525, 320, 240, 0, 0, 0, 0, 0}),
             Contains("camera_info_url:=file:///path/to/camera_info.yaml"));
}

TEST_CASE("easy_handeye gets only keys that it knows, and finds the file by its name", "[ros_files]") {
  const std::vector<NamedFile> files = ros_calibration_files({});
  // The keywords of easy_handeye's HandeyeCalibrationParameters, which refuses others.
  const std::set<std::string> known = {"eye_on_hand",          "namespace",           "robot_base_frame",
                                       "robot_effector_frame", "tracking_base_frame", "tracking_marker_frame",
                                       "move_group_namespace", "move_group"};
  const YAML::Node first = YAML::Load(files[0].text);
  for (const auto& item : first["parameters"]) CHECK(known.contains(item.first.as<std::string>()));
  CHECK(first["parameters"].size() == known.size());
  CHECK(first["parameters"]["namespace"].as<std::string>() == "/firstlook_eye_on_hand/");
  CHECK(first["transformation"].size() == 7);
  const YAML::Node second = YAML::Load(files[1].text);
  CHECK(second["parameters"]["calibration_type"].as<std::string>() == "eye_in_hand");
  CHECK(second["transform"]["rotation"]["w"].as<double>() == 1);
  for (const YAML::Node& file : {first, second}) {
    CHECK(file["parameters"]["robot_effector_frame"].as<std::string>() == "tool0");
    CHECK(file["parameters"]["tracking_base_frame"].as<std::string>() == "camera_color_optical_frame");
  }
}

TEST_CASE("camera_info.yaml is what camera_calibration_parsers reads", "[ros_files]") {
  const CameraIntrinsics c{640, 480, 537.33, 538.35, 321.61, 252.18, 0.17938, -0.31818, -1e-5, 2e-7, 0};
  const YAML::Node doc = YAML::Load(camera_info_yaml(c));
  const auto matrix = [&](const char* key, int rows, int cols) {
    const YAML::Node node = doc[key];
    REQUIRE(node["rows"].as<int>() == rows);
    REQUIRE(node["cols"].as<int>() == cols);
    REQUIRE(node["data"].size() == static_cast<std::size_t>(rows * cols));
    return node["data"].as<std::vector<double>>();
  };
  CHECK(doc["image_width"].as<int>() == 640);
  CHECK(doc["image_height"].as<int>() == 480);
  CHECK(doc["camera_name"].as<std::string>() == "camera");
  CHECK(doc["distortion_model"].as<std::string>() == "plumb_bob");
  CHECK(matrix("camera_matrix", 3, 3) == std::vector<double>{c.fx, 0, c.cx, 0, c.fy, c.cy, 0, 0, 1});
  CHECK(matrix("distortion_coefficients", 1, 5) == std::vector<double>{c.k1, c.k2, c.p1, c.p2, c.k3});
  CHECK(matrix("rectification_matrix", 3, 3) == std::vector<double>{1, 0, 0, 0, 1, 0, 0, 0, 1});
  CHECK(matrix("projection_matrix", 3, 4) == std::vector<double>{c.fx, 0, c.cx, 0, 0, c.fy, c.cy, 0, 0, 0, 1, 0});
}

TEST_CASE("numbers in YAML are numbers for every reader, and keep their bits", "[ros_files]") {
  // What PyYAML takes for a number.
  const std::regex number("[-+]?[0-9]+|[-+]?[0-9]+\\.[0-9]*([eE][-+][0-9]+)?|[-+]?\\.inf|\\.nan");
  Random random(5, 1);
  for (int i = 0; i < 1000; ++i) {
    const double value = random.normal() * std::pow(10.0, random.uniform(-30, 30));
    const std::string text = yaml_number(value);
    INFO(text);
    REQUIRE(std::regex_match(text, number));
    REQUIRE(std::stod(text) == value);
  }
  CHECK(yaml_number(1e-5) == "1.0e-05");
  CHECK(yaml_number(-2e-7) == "-2.0e-07");
  CHECK(yaml_number(-0.0) == "0");
  CHECK(yaml_number(NAN) == ".nan");
  CHECK(yaml_number(-INFINITY) == "-.inf");
}

TEST_CASE("roll, pitch and yaw make the same rotation wherever they are not unique", "[ros_files]") {
  Random random(7, 1);
  for (const double sign : {-1.0, 1.0}) {
    for (double off_rad = 1e-2; off_rad > 1e-18; off_rad /= 10) {
      const double roll = random.uniform(-3.2, 3.2), yaw = random.uniform(-3.2, 3.2);
      const Eigen::Matrix3d r = rotation_of(roll, sign * (std::numbers::pi / 2 - off_rad), yaw);
      const Eigen::Vector3d rpy = roll_pitch_yaw(r);
      INFO(off_rad);
      CHECK((rotation_of(rpy.x(), rpy.y(), rpy.z()) - r).cwiseAbs().maxCoeff() < 1e-11);
    }
  }
}

TEST_CASE("MoveIt reads the scenes back: the map in base, and turned by half a turn in base_link", "[ros_files]") {
  Random random(9, 1);
  std::vector<AxisBox> boxes;
  for (int i = 0; i < 40; ++i) {
    const Eigen::Vector3d low = random.normal3();
    boxes.push_back({low, low + Eigen::Vector3d(0.05, 0.1, 0.05 * (i + 1))});
  }
  const std::vector<NamedFile> files = ros_scene_files(boxes);
  REQUIRE(files.size() == 2);
  const auto read = [&](const char* name) {
    std::istringstream stream(text_of(files, name));
    Scene scene;
    REQUIRE(test::read_scene(stream, scene));
    REQUIRE(scene.objects.size() == 1);
    CHECK(scene.objects[0].id == "map");
    REQUIRE(scene.objects[0].boxes.size() == boxes.size());
    return scene;
  };
  const Scene base = read("collision_map_base.scene"), link = read("collision_map_base_link.scene");
  CHECK_THAT(base.name, Contains("in base,"));
  CHECK_THAT(link.name, Contains("in base_link,") && Contains("Import"));
  const Eigen::Isometry3d base_link_T_base(Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitZ()));
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const test::SceneBox &in_base = base.objects[0].boxes[i], &in_link = link.objects[0].boxes[i];
    CHECK((in_base.size_m - (boxes[i].high_m - boxes[i].low_m)).norm() < 1e-5);
    CHECK((in_base.pose.translation() - (boxes[i].high_m + boxes[i].low_m) / 2).norm() < 1e-5);
    CHECK(in_base.pose.linear().isIdentity());
    CHECK((in_link.size_m - in_base.size_m).norm() < 1e-9);
    CHECK((in_link.pose.translation() - base_link_T_base * in_base.pose.translation()).norm() < 1e-9);
  }
}
