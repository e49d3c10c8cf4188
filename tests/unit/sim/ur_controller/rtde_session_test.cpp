#include "hal/sim/ur_controller/rtde_session.hpp"

#include <catch2/catch.hpp>

#include "tests/support/ur_robot.hpp"
#include "tests/support/ur_wire.hpp"

namespace firstlook {
using namespace sim::ur;
using namespace test;

namespace {

struct Client {
  UrRobot& robot;
  Session& session;

  explicit Client(UrRobot& of) : robot(of), session(of.robot.open(Port::kRtde)) {}
  std::vector<RtdePackage> send(const std::string& bytes) {
    session.receive(bytes);
    return take_rtde(session.output());
  }
  RtdePackage ask(const std::string& bytes) {
    const std::vector<RtdePackage> answers = send(bytes);
    REQUIRE(answers.size() == 1);
    return answers[0];
  }
  void protocol_2() { REQUIRE(ask(rtde('V', big_endian(2, 2))).payload == "\1"); }
  std::string outputs(double hz, const std::string& names) { return ask(rtde('O', big_endian(hz) + names)).payload; }
  std::string inputs(const std::string& names) { return ask(rtde('I', names)).payload; }
  void start() { REQUIRE(ask(rtde('S')).payload == "\1"); }
  /// The payloads of the data packages of so many seconds.
  std::vector<std::string> data(double s) {
    robot.run(s);
    std::vector<std::string> payloads;
    for (const RtdePackage& package : take_rtde(session.output())) {
      REQUIRE(package.type == 'U');
      payloads.push_back(package.payload);
    }
    return payloads;
  }
};

std::string with_id(int id, const std::string& types) { return std::string(1, static_cast<char>(id)) + types; }

}  // namespace

TEST_CASE("protocol and version are negotiated", "[ur]") {
  UrRobot cb3("ur5"), e_series("ur5e");
  Client client(cb3), modern(e_series);
  CHECK(client.ask(rtde('V', big_endian(3, 2))).payload == std::string(1, '\0'));
  CHECK(client.ask(rtde('V', "x")).payload == std::string(1, '\0'));
  CHECK(client.ask(rtde('V', big_endian(1, 2))).payload == "\1");
  client.protocol_2();
  const RtdePackage version = client.ask(rtde('v'));
  CHECK(version.type == 'v');
  CHECK(int_at(version.payload, 0) == 3);
  CHECK(int_at(version.payload, 4) == 15);
  CHECK(version.payload.size() == 16);
  CHECK(int_at(modern.ask(rtde('v')).payload, 0) == 5);
}

TEST_CASE("an output recipe is answered with types, and its data have their sizes", "[ur]") {
  UrRobot robot("ur5e");
  Client client(robot);
  client.protocol_2();
  CHECK(client.outputs(500,
                       "timestamp,actual_q,robot_mode,runtime_state,actual_digital_input_bits,joint_mode,"
                       "output_bit_register_64,tool_output_mode,elbow_position") ==
        with_id(1, "DOUBLE,VECTOR6D,INT32,UINT32,UINT64,VECTOR6INT32,BOOL,UINT8,VECTOR3D"));
  client.start();
  const auto data = client.data(0.1);
  REQUIRE(data.size() == 50);
  CHECK(data[0].size() == 1 + 8 + 48 + 4 + 4 + 8 + 24 + 1 + 1 + 24);
  CHECK(data[0][0] == 1);
  CHECK(double_at(data[1], 1) - double_at(data[0], 1) == Approx(0.002));
  CHECK(double_at(data[0], 1 + 8 + 8) == robot.state().q_rad[1]);
  CHECK(int_at(data[0], 57) == 7);
  CHECK(int_at(data[0], 61) == 1);
  CHECK(client.ask(rtde('P')).payload == "\1");
  CHECK(client.data(0.1).empty());
}

TEST_CASE("unknown outputs, and those of later versions, are not found", "[ur]") {
  UrRobot cb3("ur5"), e_series("ur5e");
  Client client(cb3), modern(e_series);
  client.protocol_2();
  modern.protocol_2();
  CHECK(client.outputs(125, "timestamp,nonsense,actual_q") == with_id(0, "DOUBLE,NOT_FOUND,VECTOR6D"));
  CHECK(client.outputs(125, "ft_raw_wrench") == with_id(0, "NOT_FOUND"));
  CHECK(modern.outputs(125, "ft_raw_wrench") == with_id(1, "VECTOR6D"));
  CHECK(client.outputs(125,
                       "output_int_register_48,output_bit_register_63,output_int_register_01,output_int_register_") ==
        with_id(0, "NOT_FOUND,NOT_FOUND,NOT_FOUND,NOT_FOUND"));
  CHECK(client.ask(rtde('S')).payload == std::string(1, '\0'));  // nothing to start
  CHECK(client.data(0.1).empty());
}

TEST_CASE("frequencies divide the control loop's", "[ur]") {
  UrRobot cb3("ur5"), e_series("ur5e");
  const auto packages = [](UrRobot& robot, double hz) {
    Client client(robot);
    client.protocol_2();
    static_cast<void>(client.outputs(hz, "timestamp"));
    client.start();
    return client.data(1).size();
  };
  CHECK(packages(cb3, 125) == 125);
  CHECK(packages(cb3, 500) == 125);
  CHECK(packages(cb3, 0) == 125);
  CHECK(packages(cb3, 10) == Approx(125 / 12).margin(1));
  CHECK(packages(e_series, 500) == 500);
  CHECK(packages(e_series, 125) == 125);
  CHECK(packages(e_series, std::nan("")) == 500);
}

TEST_CASE("a client has one output recipe: the next takes its place", "[ur]") {
  UrRobot robot("ur5e");
  Client client(robot);
  client.protocol_2();
  CHECK(client.outputs(500, "timestamp,actual_q") == with_id(1, "DOUBLE,VECTOR6D"));
  client.start();
  CHECK(client.data(1).size() == 500);
  CHECK(client.outputs(100, "robot_mode,nonsense") == with_id(0, "INT32,NOT_FOUND"));  // nothing changes
  CHECK(client.data(1).back().size() == 57);
  CHECK(client.outputs(100, "robot_mode,safety_mode") == with_id(1, "INT32,INT32"));
  const auto data = client.data(1);
  CHECK(data.size() == 100);
  CHECK(data.back().size() == 9);
}

TEST_CASE("without an output recipe nothing starts", "[ur]") {
  UrRobot robot("ur5e");
  Client client(robot);
  client.protocol_2();
  CHECK(client.inputs("input_int_register_0") == with_id(1, "INT32"));
  CHECK(client.ask(rtde('S')).payload == std::string(1, '\0'));
  CHECK(client.outputs(10, "timestamp") == with_id(1, "DOUBLE"));
  client.start();
}

TEST_CASE("the tool's offset is there from 3.12 and 5.5.1 on", "[ur]") {
  UrRobot robot("ur5");
  Client client(robot);
  client.protocol_2();
  CHECK(client.outputs(125, "tcp_offset") == with_id(1, "VECTOR6D"));
}

TEST_CASE("protocol 1 has neither frequency nor number", "[ur]") {
  UrRobot robot("ur5");
  Client client(robot);
  CHECK(client.ask(rtde('O', "timestamp,robot_mode")).payload == "DOUBLE,INT32");
  CHECK(client.ask(rtde('O', "timestamp,nonsense")).payload == "DOUBLE,NOT_FOUND");
  CHECK(client.ask(rtde('O', "robot_mode,timestamp")).payload == "INT32,DOUBLE");
  client.start();
  const auto data = client.data(1);
  REQUIRE(data.size() == 125);
  CHECK(data[0].size() == 12);
  CHECK(int_at(data[0], 0) == 7);
  const auto text = client.ask(rtde('?'));
  CHECK(text.type == 'M');
  CHECK(text.payload[0] == 1);
}

TEST_CASE("inputs take effect: slider, outputs under their masks, registers", "[ur]") {
  UrRobot robot("ur5e");
  Client client(robot);
  client.protocol_2();
  CHECK(client.inputs("speed_slider_mask,speed_slider_fraction") == with_id(1, "UINT32,DOUBLE"));
  CHECK(client.inputs("standard_digital_output_mask,standard_digital_output,configurable_digital_output_mask,"
                      "configurable_digital_output,tool_digital_output_mask,tool_digital_output") ==
        with_id(2, "UINT8,UINT8,UINT8,UINT8,UINT8,UINT8"));
  CHECK(client.inputs("standard_analog_output_mask,standard_analog_output_type,standard_analog_output_0,"
                      "standard_analog_output_1") == with_id(3, "UINT8,UINT8,DOUBLE,DOUBLE"));
  CHECK(client.inputs("input_bit_registers0_to_31,input_bit_register_64,input_int_register_0,input_int_register_47,"
                      "input_double_register_47") == with_id(4, "UINT32,BOOL,INT32,INT32,DOUBLE"));
  CHECK(client.outputs(1, "timestamp") == with_id(1, "DOUBLE"));
  client.start();
  CHECK(client.send(rtde('U', std::string("\1") + big_endian(1, 4) + big_endian(0.25))).empty());
  CHECK(robot.state().speed_slider == 0.25);
  CHECK(client.send(rtde('U', std::string("\1") + big_endian(0, 4) + big_endian(0.5))).empty());
  CHECK(robot.state().speed_slider == 0.25);
  CHECK(client.send(rtde('U', std::string("\1") + big_endian(1, 4) + big_endian(std::nan("")))).empty());
  CHECK(robot.state().speed_slider == 0.25);

  CHECK(client.send(rtde('U', std::string("\2\x05\x07\x80\xff\x02\x02", 7))).empty());
  CHECK(robot.state().io.digital_outputs == (0x05 | 0x8000 | 0x20000));
  CHECK(client.send(rtde('U', std::string("\2\x01\x00\x00\x00\x00\x00", 7))).empty());
  CHECK(robot.state().io.digital_outputs == (0x04 | 0x8000 | 0x20000));

  CHECK(client.send(rtde('U', std::string("\3\x03\x02", 3) + big_endian(0.5) + big_endian(0.5))).empty());
  CHECK(robot.state().io.analog_outputs[0] == Approx(12));  // 4 to 20 mA
  CHECK(robot.state().io.analog_outputs[1] == Approx(5));   // 0 to 10 V
  CHECK(robot.state().io.analog_types == 0b1000);
  CHECK(client.send(rtde('U', std::string("\3\x01\x01", 3) + big_endian(0.1) + big_endian(0.9))).empty());
  CHECK(robot.state().io.analog_outputs[0] == Approx(1));
  CHECK(robot.state().io.analog_outputs[1] == Approx(5));  // not under the mask

  CHECK(client
            .send(rtde('U', std::string("\4") + big_endian(0x80000001, 4) + std::string("\1") + big_endian(42, 4) +
                                big_endian(static_cast<std::uint32_t>(-7), 4) + big_endian(2.5)))
            .empty());
  CHECK(robot.state().inputs.bits[0] == 0x80000001);
  CHECK(robot.state().inputs.bit(64));
  CHECK(robot.state().inputs.integers[0] == 42);
  CHECK(robot.state().inputs.integers[47] == -7);
  CHECK(robot.state().inputs.doubles[47] == 2.5);

  // Registers leave outputs alone that something else has changed meanwhile.
  robot.robot.controller().io().set_output(0, true);
  CHECK(client.send(rtde('U', std::string("\4") + std::string(21, '\0'))).empty());
  CHECK(robot.state().io.output(0));
}

TEST_CASE("an input belongs to one client until it leaves", "[ur]") {
  UrRobot robot("ur5");
  Client first(robot), second(robot);
  first.protocol_2();
  second.protocol_2();
  CHECK(first.inputs("input_int_register_3,speed_slider_mask") == with_id(1, "INT32,UINT32"));
  CHECK(first.inputs("input_int_register_3") == with_id(2, "INT32"));  // its own
  CHECK(second.inputs("input_int_register_3,input_int_register_4,none") == with_id(0, "IN_USE,INT32,NOT_FOUND"));
  CHECK(second.inputs("input_int_register_4") == with_id(1, "INT32"));
  CHECK(second.send(rtde('U', std::string("\2") + big_endian(1, 4))).at(0).type == 'M');
  robot.robot.close(first.session);
  CHECK(second.inputs("input_int_register_3") == with_id(2, "INT32"));
}

TEST_CASE("data of a wrong size or number change nothing and are answered in words", "[ur]") {
  UrRobot robot("ur5");
  Client client(robot);
  client.protocol_2();
  CHECK(client.inputs("input_int_register_0")[0] == 1);
  for (const std::string& payload :
       {std::string("\1") + big_endian(5, 2), std::string("\1") + big_endian(5, 8),
        std::string("\3") + big_endian(5, 4), std::string(1, '\0') + big_endian(5, 4), std::string()}) {
    const RtdePackage answer = client.ask(rtde('U', payload));
    CHECK(answer.type == 'M');
    CHECK(static_cast<std::size_t>(answer.payload[0]) < answer.payload.size());
    CHECK(robot.state().inputs.integers[0] == 0);
  }
  CHECK(client.ask(rtde('Z', "what")).type == 'M');
  CHECK(client
            .ask(rtde('M',
                      "\xff"
                      "abc"))
            .type == 'M');
  CHECK(client.send(rtde('M', std::string("\5hello\2me\3", 10))).empty());
}

TEST_CASE("a watchdog over an input pauses or stops the program that set it", "[ur]") {
  const auto [action, after] = GENERATE(table<std::string, RuntimeState>({{"\"pause\"", RuntimeState::kPaused},
                                                                          {"\"STOP\"", RuntimeState::kStopped},
                                                                          {"\"ignore\"", RuntimeState::kPlaying}}));
  UrRobot robot("ur5");
  Client client(robot);
  client.protocol_2();
  static_cast<void>(client.outputs(10, "timestamp"));
  CHECK(client.inputs("input_int_register_0,input_int_register_1") == with_id(1, "INT32,INT32"));
  client.start();
  Session& primary = robot.robot.open(Port::kPrimary);
  primary.receive(std::string("def watched():\n  rtde_set_watchdog(\"input_int_register_0\", 10, ") + action +
                  ")\n  while True:\n    sync()\n  end\nend\n");
  for (int i = 0; i < 20; ++i) {
    client.session.receive(rtde('U', std::string("\1\0\0\0\0\0\0\0\0", 9)));
    robot.run(0.09);
    REQUIRE(robot.state().runtime == RuntimeState::kPlaying);
  }
  robot.run(0.2);
  CHECK(robot.state().runtime == after);
  if (after != RuntimeState::kPaused) return;
  // Time in the pause does not count; without a renewal it is paused again.
  robot.run(5);
  CHECK(robot.dashboard("play") == "Starting program");
  robot.run(0.09);
  CHECK(robot.state().runtime == RuntimeState::kPlaying);
  robot.run(0.3);
  CHECK(robot.state().runtime == RuntimeState::kPaused);
}

TEST_CASE("a watchdog ends with its program, and needs an input that there is", "[ur]") {
  UrRobot robot("ur5e");
  Session& primary = robot.robot.open(Port::kPrimary);
  primary.receive("def first():\n  rtde_set_watchdog(\"input_int_register_0\", 10, \"stop\")\nend\n");
  robot.run(0.05);
  primary.receive("def second():\n  while True:\n    sync()\n  end\nend\n");
  robot.run(2);
  CHECK(robot.state().runtime == RuntimeState::kPlaying);
  primary.receive("def third():\n  rtde_set_watchdog(\"no_such_input\", 10)\n  sleep(60)\nend\n");
  robot.run(1);
  CHECK_FALSE(robot.state().program_running());
}

TEST_CASE("packages may be cut anywhere", "[ur]") {
  UrRobot robot("ur5");
  Client client(robot);
  const std::string bytes = rtde('V', big_endian(2, 2)) + rtde('v') + rtde('O', big_endian(125.0) + "timestamp");
  for (const char byte : bytes) client.session.receive(std::string_view(&byte, 1));
  const auto answers = take_rtde(client.session.output());
  REQUIRE(answers.size() == 3);
  CHECK(answers[2].payload == with_id(1, "DOUBLE"));
}

TEST_CASE("a package shorter than its header ends the connection", "[ur]") {
  UrRobot robot("ur5");
  Client client(robot);
  client.session.receive(std::string("\0\2V", 3) + rtde('v'));
  CHECK(client.session.over());
  for (const RtdePackage& answer : take_rtde(client.session.output())) CHECK(answer.type == 'M');
}

TEST_CASE("names that are long, many or empty", "[ur]") {
  UrRobot robot("ur5");
  Client client(robot);
  client.protocol_2();
  CHECK(client.outputs(125, "") == with_id(0, "NOT_FOUND"));
  CHECK(client.outputs(125, "timestamp, actual_q") == with_id(1, "DOUBLE,VECTOR6D"));
  std::string many = "actual_q";
  for (int i = 0; i < 2000; ++i) many += ",actual_q";  // its data would not fit a package
  CHECK(client.outputs(125, many)[0] == 0);
  CHECK(client.ask(rtde('O', "abc")).payload[0] == 0);  // no frequency
  CHECK(client.outputs(125, std::string(60000, 'x')) == with_id(0, "NOT_FOUND"));
}

TEST_CASE("RTDE of a day keeps time and count", "[ur]") {
  UrRobot robot("ur5e");
  Client client(robot);
  client.protocol_2();
  static_cast<void>(client.outputs(500, "timestamp"));
  client.start();
  constexpr int kSeconds = 86400;
  const double begin_s = robot.state().timestamp_s;
  std::uint64_t packages = 0;
  std::size_t most_waiting = 0;
  std::string last;
  for (int s = 0; s < kSeconds; s += 60) {
    for (int i = 0; i < 60 * 500; ++i) {
      robot.robot.step();
      packages += client.session.output().size() / 12;
      most_waiting = std::max(most_waiting, client.session.output().size());
      last.swap(client.session.output());
      client.session.output().clear();
    }
  }
  CHECK(packages == std::uint64_t{500} * kSeconds);
  CHECK(most_waiting == 12);
  CHECK(double_at(last, 4) == Approx(begin_s + kSeconds).margin(1e-6));
}

}  // namespace firstlook
