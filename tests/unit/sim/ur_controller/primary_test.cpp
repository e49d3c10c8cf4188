#include <catch2/catch.hpp>
#include <map>

#include "tests/support/ur_robot.hpp"
#include "tests/support/ur_wire.hpp"

namespace firstlook {
using namespace sim::ur;
using namespace test;
using Catch::Matchers::Contains;

namespace {

std::map<int, std::string> sub_packages(const UrPacket& state) {
  std::string content = state.content;
  std::map<int, std::string> found;
  for (const UrPacket& part : take_packets(content)) found[part.type] = part.content;
  CHECK(content.empty());
  return found;
}

/// Messages of type 20 by their kind.
std::vector<std::string> messages(std::vector<UrPacket> packets, int kind) {
  std::vector<std::string> found;
  for (const UrPacket& packet : packets) {
    if (packet.type == 20 && packet.content[9] == kind) found.push_back(packet.content.substr(10));
  }
  return found;
}

}  // namespace

TEST_CASE("every state connection begins with the version", "[ur]") {
  UrRobot robot("ur5e");
  for (const Port port : {Port::kPrimary, Port::kSecondary, Port::kPrimaryReadOnly, Port::kSecondaryReadOnly}) {
    Session& session = robot.robot.open(port);
    const auto packets = take_packets(session.output());
    REQUIRE(packets.size() == 1);
    const auto versions = messages(packets, 3);
    REQUIRE(versions.size() == 1);
    const std::string& v = versions[0];
    CHECK(v.substr(1, static_cast<std::size_t>(v[0])) == "URControl");
    CHECK(v[10] == 5);
    CHECK(v[11] == 12);
    CHECK(int_at(v, 12) == 2);
    CHECK(int_at(v, 16) > 1000);
  }
}

TEST_CASE("robot states come at 10 Hz with the sizes of UR's tables", "[ur]") {
  const auto sizes_of = [](const char* model) {
    UrRobot robot(model);
    Session& session = robot.robot.open(Port::kPrimary);
    session.output().clear();
    robot.run(2);
    const auto packets = take_packets(session.output());
    CHECK(packets.size() == Approx(20).margin(1));
    std::map<int, std::size_t> sizes;
    for (const auto& [type, content] : sub_packages(packets.back())) sizes[type] = content.size() + 5;
    return sizes;
  };
  std::map<int, std::size_t> cb3 = {{0, 47}, {1, 251}, {2, 37}, {3, 74}, {4, 101}, {5, 225}, {6, 445}, {7, 61}, {8, 9}};
  CHECK(sizes_of("ur5") == cb3);
  cb3[3] = 75;
  cb3[11] = 26;
  cb3[12] = 8;
  CHECK(sizes_of("ur5e") == cb3);
}

TEST_CASE("the fields of a robot state", "[ur]") {
  UrRobot robot("ur5");
  robot.robot.controller().set_tcp_offset({0, 0, 0.15, 0, 0, 0});
  robot.robot.controller().io().set_output(1, true);
  robot.robot.controller().set_speed_slider(0.5);
  Session& session = robot.robot.open(Port::kSecondary);
  session.output().clear();
  robot.run(0.2);
  const auto parts = sub_packages(take_packets(session.output()).back());
  const std::string& mode = parts.at(0);
  CHECK(mode.substr(8, 7) == std::string("\1\1\1\0\0\0\0", 7));
  CHECK(mode[15] == 7);
  CHECK(double_at(mode, 17) == 0.5);
  CHECK(double_at(mode, 33) == 1);
  const std::string& joints = parts.at(1);
  CHECK(double_at(joints, 41) == robot.state().q_rad[1]);
  CHECK(double_at(joints, 41 + 8) == robot.state().q_rad[1]);
  CHECK(static_cast<std::uint8_t>(joints[40]) == 253);
  CHECK(float_at(joints, 24 + 4) == 48.0F);
  CHECK(int_at(parts.at(3), 4) == 2);
  const std::string& cartesian = parts.at(4);
  CHECK(double_at(cartesian, 16) == robot.state().tcp_pose[2]);
  CHECK(double_at(cartesian, 64) == 0.15);
  const std::string& kinematics = parts.at(5);
  CHECK(double_at(kinematics, 24 + 48 + 8) == Approx(-0.425));    // a2
  CHECK(double_at(kinematics, 24 + 2 * 48) == Approx(0.089159));  // d1
  CHECK(double_at(kinematics, 24 + 3 * 48) == Approx(M_PI / 2));  // alpha1
  const std::string& configuration = parts.at(6);
  CHECK(double_at(configuration, 0) == Approx(-2 * M_PI));
  CHECK(double_at(configuration, 96) == Approx(M_PI));
  CHECK(double_at(configuration, 232 + 8) == Approx(-0.425));
  CHECK(int_at(configuration, 440 - 8) == 1);  // UR5
}

TEST_CASE("what happens is told on the primary interface alone", "[ur]") {
  UrRobot robot("ur5");
  Session& primary = robot.robot.open(Port::kPrimary);
  Session& secondary = robot.robot.open(Port::kSecondary);
  robot.robot.controller().protective_stop("a test");
  robot.dashboard("addToLog something");
  robot.run(0.05);
  const auto told = take_packets(primary.output());
  REQUIRE(messages(told, 5).size() == 1);
  CHECK(messages(told, 5)[0][8] == 3);
  REQUIRE(messages(told, 6).size() == 1);
  CHECK_THAT(messages(told, 6)[0].substr(20), Contains("a test"));
  REQUIRE(messages(told, 0).size() == 1);
  CHECK(messages(told, 0)[0] == "something");
  CHECK(messages(take_packets(secondary.output()), 0).empty());
}

TEST_CASE("realtime packets come each cycle with the published length", "[ur]") {
  const auto check = [](const char* model, std::size_t size, std::size_t each_second) {
    UrRobot robot(model);
    Session& session = robot.robot.open(Port::kRealtime);
    robot.run(1);
    REQUIRE(session.output().size() == size * each_second);
    CHECK(unsigned_at(session.output(), 0, 4) == size);
    const std::string packet = session.output().substr(size * (each_second - 1));
    CHECK(double_at(packet, 4) == robot.state().timestamp_s);
    CHECK(double_at(packet, 252 + 8) == robot.state().q_rad[1]);  // q actual
    CHECK(double_at(packet, 444) == robot.state().tcp_pose[0]);
    CHECK(double_at(packet, 756) == 7);   // robot mode
    CHECK(double_at(packet, 812) == 1);   // safety mode
    CHECK(double_at(packet, 940) == 1);   // speed scaling
    CHECK(double_at(packet, 1052) == 1);  // program state
    CHECK(double_at(packet, 1060) == robot.state().elbow_position_m[0]);
  };
  check("ur5", 1116, 125);
  check("ur5e", 1220, 500);
}

TEST_CASE("script ports take the commands of clients without a dashboard", "[ur]") {
  UrRobot robot("ur5e", false);
  Session& read_only = robot.robot.open(Port::kPrimaryReadOnly);
  read_only.receive("power on\n");
  CHECK(robot.state().robot_mode == RobotMode::kPowerOff);
  Session& session = robot.robot.open(Port::kPrimary);
  session.receive("power on\n");
  robot.run(2);
  CHECK(robot.state().robot_mode == RobotMode::kIdle);
  session.receive("set robotmode run\n");
  robot.run(2);
  CHECK(robot.state().robot_mode == RobotMode::kRunning);
  robot.robot.controller().protective_stop("test");
  robot.run(6);
  session.receive("set unlock protective stop\n");
  CHECK(robot.state().safety_mode == SafetyMode::kNormal);
  session.receive("set speed 0.25\n");
  CHECK(robot.state().speed_slider == 0.25);
  session.receive("set speed fast\nset real\n");
  CHECK(robot.state().speed_slider == 0.25);
  session.receive("set robotmode freedrive\n");
  robot.run(1);
  CHECK(robot.state().teach_mode);
  CHECK_FALSE(robot.state().program_running());
  session.receive("set robotmode run\n");
  CHECK_FALSE(robot.state().teach_mode);
  session.receive("power off\n");
  CHECK(robot.state().robot_mode == RobotMode::kPowerOff);
}

}  // namespace firstlook
