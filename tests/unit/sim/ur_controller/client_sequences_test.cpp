/// What clients of others do with a controller from the first byte on, as their sources and UR's guides have it:
/// Universal Robots' client library (and with it the ROS drivers), ur_rtde, python-urx, UR's own RTDE client. Written
/// from what they send and expect; none of their code is here.
#include <catch2/catch.hpp>
#include <map>
#include <regex>

#include "tests/support/ur_robot.hpp"
#include "tests/support/ur_wire.hpp"

namespace firstlook {
using namespace sim::ur;
using namespace test;

namespace {

struct RtdeClient {
  explicit RtdeClient(UrRobot& of) : robot(of), session(of.robot.open(Port::kRtde)) {}
  RtdePackage ask(const std::string& bytes) {
    session.receive(bytes);
    auto answers = take_rtde(session.output());
    std::erase_if(answers, [](const RtdePackage& package) { return package.type == 'U'; });
    REQUIRE(answers.size() == 1);
    return answers[0];
  }
  /// The answer's recipe number; all its types must be there.
  int recipe(char kind, const std::string& payload) {
    const RtdePackage answer = ask(rtde(kind, payload));
    CHECK(answer.type == kind);
    INFO(answer.payload.substr(1));
    CHECK(answer.payload.find("NOT_FOUND") == std::string::npos);
    CHECK(answer.payload.find("IN_USE") == std::string::npos);
    return answer.payload[0];
  }
  std::vector<RtdePackage> data(double s) {
    robot.run(s);
    return take_rtde(session.output());
  }
  UrRobot& robot;
  Session& session;
};

std::string numbers(std::initializer_list<std::int64_t> values) {
  std::string bytes;
  for (const std::int64_t value : values) bytes += big_endian(static_cast<std::uint64_t>(value), 4);
  return bytes;
}

/// Other computers that scripts dial: one connection to each port.
class Peers final : public script::Sockets {
 public:
  struct Peer {
    std::string sent, to_robot;
    bool open = true;
  };
  std::map<Id, Peer> by_port;
  Id open(const std::string&, std::uint16_t port) override {
    by_port[port] = {};
    return port;
  }
  [[nodiscard]] State state(Id socket) const override {
    const auto found = by_port.find(socket);
    return found != by_port.end() && found->second.open ? State::kOpen : State::kClosed;
  }
  bool send(Id socket, std::string_view bytes) override {
    by_port[socket].sent += bytes;
    return true;
  }
  [[nodiscard]] std::string& received(Id socket) override { return by_port[socket].to_robot; }
  void close(Id socket) override { by_port[socket].open = false; }
};

/// What the robot tells on the primary interface: texts, and exceptions with "! " before them.
std::vector<std::string> told(Session& primary) {
  std::vector<std::string> lines;
  for (const UrPacket& packet : take_packets(primary.output())) {
    if (packet.type != 20) continue;
    if (packet.content[9] == 0) lines.push_back(packet.content.substr(10));
    if (packet.content[9] == 10) lines.push_back("! " + packet.content.substr(18));
  }
  return lines;
}

}  // namespace

TEST_CASE("UR's client library sets up RTDE: is the robot booted, pause, inputs, start", "[ur][clients]") {
  const std::string model = GENERATE("ur5", "ur10e");
  UrRobot robot(model.c_str());
  RtdeClient client(robot);
  CHECK(client.ask(rtde('V', big_endian(2, 2))).payload == "\1");
  const bool e_series = int_at(client.ask(rtde('v')).payload, 0) >= 5;
  const double hz = e_series ? 500 : 125;
  // The output recipe that the ROS drivers ship.
  const std::string outputs =
      "timestamp,actual_q,actual_qd,speed_scaling,target_speed_fraction,runtime_state,actual_TCP_force,actual_TCP_pose,"
      "actual_digital_input_bits,actual_digital_output_bits,standard_analog_input0,standard_analog_input1,"
      "standard_analog_output0,standard_analog_output1,analog_io_types,tool_mode,tool_analog_input_types,"
      "tool_analog_input0,tool_analog_input1,tool_output_voltage,tool_output_current,tool_temperature,robot_mode,"
      "safety_mode,robot_status_bits,safety_status_bits,actual_current,tcp_offset";
  CHECK(client.recipe('O', big_endian(hz) + outputs) == 1);
  CHECK(client.ask(rtde('S')).payload == "\1");
  const auto first = client.data(0.1);
  REQUIRE(first.size() == static_cast<std::size_t>(std::lround(hz / 10)));
  CHECK(double_at(first.back().payload, 1) > 40);  // younger ones are taken for booting: 1000 packages are waited for
  CHECK(client.ask(rtde('P')).payload == "\1");
  CHECK(client.data(0.1).empty());
  const std::string inputs =
      "speed_slider_mask,speed_slider_fraction,standard_digital_output_mask,standard_digital_output,"
      "configurable_digital_output_mask,configurable_digital_output,tool_digital_output_mask,tool_digital_output,"
      "standard_analog_output_mask,standard_analog_output_type,standard_analog_output_0,standard_analog_output_1";
  CHECK(client.recipe('I', inputs) == 1);
  CHECK(client.ask(rtde('S')).payload == "\1");
  CHECK_FALSE(client.data(0.1).empty());
  // Half speed and the second output, by masks; the rest is left.
  std::string half(1, '\1');
  half += big_endian(1, 4) + big_endian(0.5) + std::string("\2\2\0\0\0\0\0\0", 8) + big_endian(0.0) + big_endian(0.0);
  client.session.receive(rtde('U', half));
  CHECK(client.data(0.1).back().type == 'U');
  CHECK(robot.state().speed_slider == 0.5);
  CHECK(robot.state().io.output(1));
  CHECK_FALSE(robot.state().io.output(0));
}

TEST_CASE("UR's client library finds the documented answers on the dashboard", "[ur][clients]") {
  const std::string model = GENERATE("ur5", "ur5e");
  UrRobot robot(model.c_str(), false, {{"cart.urp", "def cart():\n  while True:\n    sync()\n  end\nend\n", {}}});
  Session& session = robot.robot.open(Port::kDashboard);
  CHECK(session.output().ends_with('\n'));
  session.output().clear();
  const auto answer = [&](const std::string& command) {
    session.receive(command + "\n");
    for (int i = 0; i < 5000 && session.output().empty(); ++i) robot.robot.step();
    std::string line = session.output();
    session.output().clear();
    REQUIRE(line.ends_with('\n'));
    line.pop_back();
    return line;
  };
  // The version stands between the first blank and " (".
  const std::string version = answer("PolyscopeVersion");
  const std::size_t from = version.find(' ') + 1, to = version.find(" (");
  REQUIRE(to != std::string::npos);
  CHECK(std::regex_match(version.substr(from, to - from), std::regex(R"(\d+\.\d+\.\d+\.\d+)")));
  const auto matches = [&](const std::string& command, const std::string& pattern) {
    const std::string line = answer(command);
    INFO(command << ": " << line);
    CHECK(std::regex_match(line, std::regex(pattern)));
  };
  matches("power off", "Powering off");
  matches("power on", "Powering on");
  robot.run(2);
  matches("robotmode", "Robotmode: (IDLE|RUNNING)");
  matches("brake release", "Brake releasing");
  robot.run(2);
  matches("robotmode", "Robotmode: RUNNING");
  matches("load cart.urp", "Loading program: .*cart\\.urp.*");
  matches("get loaded program", "Loaded program: .*cart\\.urp");
  matches("programState", "STOPPED cart\\.urp");
  matches("play", "Starting program");
  robot.run(0.2);
  matches("running", "Program running: true");
  matches("programState", "PLAYING cart\\.urp");
  matches("pause", "Pausing program");
  robot.run(0.2);
  matches("programState", "PAUSED cart\\.urp");
  matches("stop", "Stopped");
  robot.run(0.2);
  matches("running", "Program running: false");
  matches("isProgramSaved", "(true|false).*");
  matches("popup look here", "showing popup");
  matches("close popup", "closing popup");
  matches("close safety popup", "closing safety popup");
  matches("unlock protective stop", "Protective stop releasing");
  matches("addToLog a line", "Added log message");
  matches("safetymode", "Safetymode: NORMAL");
  matches("load installation default.installation", "Loading installation: .*default\\.installation.*");
  matches("get serial number", "20.*");
  matches("get robot model", "UR.*");
  matches("generate flight report system", "(Flight Report generated with id:).*");
  matches("generate flight report ", "(Flight Report generated with id:).*");
  matches("load /ursim/programs/cart.urp", "Loading program: .*cart\\.urp");
  matches("generate support file .", "(Completed successfully:).*");
  matches("saveLog", "Log saved to disk");
  if (model == "ur5e") {
    matches("safetystatus", "Safetystatus: NORMAL");
    matches("set operational mode automatic", "Operational mode automatic is set");
    matches("get operational mode", "(NONE|MANUAL|AUTOMATIC)");
    matches("clear operational mode", "No longer controlling the operational mode\\. .*");
    matches("is in remote control", "(true|false)");
  } else {
    matches("setUserRole locked", "Setting user role: locked");
    matches("getUserRole", "LOCKED");
  }
  matches("restart safety", "Restarting safety");
  matches("robotmode", "Robotmode: POWER_OFF");
  matches("quit", "Disconnected");
  CHECK(session.over());
}

namespace {

// Three connections, commands of eight numbers with the read timeout in front and the mode at the end, a thread that
// serves joints each cycle within a critical section, trajectory points of 21 numbers: the shape of the program that
// UR's client library sends, in words of our own.
constexpr std::string_view kStreamed = R"(def streamed():
  step = get_steptime()
  SCALE = 1000000
  global mode = -1
  global fresh = False
  global goal = get_joint_positions()
  global points = 0
  global timeout = 0.0
  mover = 0
  commands = 0
  def dial(port, name, tries=5, dt=0.2):
    n = 0
    while n < tries:
      if socket_open("10.0.0.9", port, name):
        return True
      end
      sleep(dt)
      n = n + 1
    end
    return False
  end
  thread serve():
    while mode == 1:
      enter_critical
      q = goal
      if not fresh:
        q = goal + (get_target_joint_speeds() * step)
      end
      fresh = False
      servoj(q, t=step, lookahead_time=0.03, gain=2000)
      exit_critical
    end
    stopj(4.0)
  end
  thread follow():
    enter_critical
    result = 0
    while result == 0 and points > 0:
      raw = socket_read_binary_integer(21, "points", 0.5)
      points = points - 1
      if raw[0] > 0:
        to = [raw[1], raw[2], raw[3], raw[4], raw[5], raw[6]] / SCALE
        if raw[21] == 0 or
          raw[21] == 1:
          movej(to, a=raw[14] / SCALE, v=raw[13] / SCALE, t=raw[19] / SCALE, r=raw[20] / SCALE)
        end
      else:
        result = 2
      end
    end
    exit_critical
    stopj(4.0)
    socket_send_int(result, "points")
    textmsg("followed with ", result)
  end
  thread settings():
    while mode > -2:
      raw = socket_read_binary_integer(28, "commands", 0)
      if raw[0] > 0:
        if raw[1] == 1:
          set_payload(raw[2] / SCALE, [raw[3] / SCALE, raw[4] / SCALE, raw[5] / SCALE])
        elif raw[1] == 9:
          set_gravity([raw[2] / SCALE, raw[3] / SCALE, raw[4] / SCALE])
        end
      end
    end
  end
  if not dial(50003, "points") or not dial(50004, "commands") or not dial(50001, "reverse"):
    popup("nobody there", title="streamed", blocking=True, error=True)
    halt
  end
  textmsg("active, step ", step)
  commands = run settings()
  while mode > -2:
    enter_critical
    c = socket_read_binary_integer(8, "reverse", timeout)
    if c[0] > 0:
      timeout = c[1] / 1000.0
      if mode != c[8]:
        if mode == 3:
          kill mover
        end
        mode = c[8]
        join mover
        if mode == 1:
          goal = get_joint_positions()
          mover = run serve()
        end
      end
      if mode == 1:
        goal = [c[2] / SCALE, c[3] / SCALE, c[4] / SCALE, c[5] / SCALE, c[6] / SCALE, c[7] / SCALE]
        fresh = True
      elif mode == 3 and c[2] == 1:
        points = c[3]
        mover = run follow()
      end
    else:
      textmsg(str_cat("timed out after ", str_cat(timeout, " s")))
      mode = -2
      kill mover
      kill commands
      stopj(4.0)
      halt
    end
    exit_critical
  end
  join mover
  kill commands
  stopj(4.0)
  textmsg("ended")
  socket_close("reverse")
  socket_close("points")
  socket_close("commands")
end
)";

struct Streamed {
  explicit Streamed(const char* model) : robot(model), primary(robot.robot.open(Port::kPrimary)) {
    robot.robot.programs().set_sockets(&peers);
    Session& secondary = robot.robot.open(Port::kSecondary);
    secondary.receive(kStreamed);
    robot.run(0.3);
    said = told(primary);
    INFO((said.empty() ? std::string("nothing said") : said.back()));
    REQUIRE(peers.by_port.size() == 3);
    REQUIRE(said.size() == 1);
  }
  ~Streamed() { robot.robot.programs().set_sockets(nullptr); }
  Streamed(const Streamed&) = delete;
  Streamed& operator=(const Streamed&) = delete;
  void command(int timeout_ms, std::int64_t mode, std::initializer_list<double> q = {0, 0, 0, 0, 0, 0}) {
    std::string bytes = numbers({timeout_ms});
    for (const double value : q) bytes += numbers({std::llround(value * 1e6)});
    peers.by_port[50001].to_robot += bytes + numbers({mode});
  }
  void listen(double s) {
    robot.run(s);
    for (std::string& line : told(primary)) said.push_back(line);
  }
  [[nodiscard]] double joint(std::size_t j) { return robot.state().q_rad[j]; }

  Peers peers;
  UrRobot robot;
  Session& primary;
  std::vector<std::string> said;
};

}  // namespace

TEST_CASE("a program like that of UR's client library streams joints, and ends by command or silence",
          "[ur][clients]") {
  const std::string model = GENERATE("ur5", "ur5e");
  Streamed streamed(model.c_str());
  UrRobot& robot = streamed.robot;
  const double from_rad = streamed.joint(0), cycle_s = robot.robot.cycle().seconds();
  streamed.listen(1);  // the first read waits without a limit
  CHECK(robot.state().program_running());
  streamed.command(200, 0);
  robot.run(0.05);
  for (int i = 1; i <= 100; ++i) {
    const auto& q = robot.state().q_rad;
    streamed.command(200, 1, {from_rad + 0.002 * i, q[1], q[2], q[3], q[4], q[5]});
    robot.run(cycle_s);
  }
  CHECK(streamed.joint(0) > from_rad + 0.1);
  SECTION("by command") {
    streamed.command(200, -2);
    streamed.listen(1);
    CHECK(streamed.said.back() == "ended");
    for (const auto& [port, peer] : streamed.peers.by_port) CHECK_FALSE(peer.open);
  }
  SECTION("by silence") {
    streamed.listen(1.5);
    CHECK(streamed.said.back() == "timed out after 0.2 s");
  }
  CHECK_FALSE(robot.state().program_running());
  const double at_rad = streamed.joint(0);
  streamed.listen(0.5);
  CHECK(streamed.joint(0) == at_rad);
}

TEST_CASE("a program like that of UR's client library follows points and takes settings meanwhile", "[ur][clients]") {
  Streamed streamed("ur10e");
  const double to_rad = streamed.joint(0) + 0.3;
  const auto point = [&](double first_rad) {
    std::string bytes;
    for (std::size_t j = 0; j < 6; ++j)
      bytes += numbers({std::llround(1e6 * (j == 0 ? first_rad : streamed.joint(j)))});
    bytes += numbers({0, 0, 0, 0, 0, 0});
    bytes += numbers({1'000'000, 1'400'000, 0, 0, 0, 0});
    return bytes + numbers({0, 0, 0});
  };
  streamed.peers.by_port[50003].to_robot = point(to_rad - 0.1) + point(to_rad);
  streamed.command(0, 3, {1e-6, 2e-6, 0, 0, 0, 0});  // start, two points
  streamed.peers.by_port[50004].to_robot =
      numbers({1, 2'500'000, 0, 0, 50'000}) +
      numbers({0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0});
  streamed.listen(4);
  CHECK(streamed.joint(0) == Approx(to_rad).margin(1e-6));
  CHECK(streamed.peers.by_port[50003].sent == numbers({0}));
  CHECK(streamed.said.back() == "followed with 0");
  CHECK(streamed.robot.state().payload.mass_kg == 2.5);
  CHECK(streamed.robot.state().payload.center_m[2] == 0.05);
}

TEST_CASE("ur_rtde: recipes that share an input, a script that ends in `run program`, commands by registers",
          "[ur][clients]") {
  UrRobot robot("ur5e");
  Session& primary = robot.robot.open(Port::kPrimary);
  RtdeClient client(robot);
  CHECK(client.ask(rtde('V', big_endian(2, 2))).payload == "\1");
  CHECK(int_at(client.ask(rtde('v')).payload, 0) == 5);
  CHECK(client.recipe('O', big_endian(500.0) +
                               "robot_status_bits,safety_status_bits,runtime_state,output_int_register_0,"
                               "output_int_register_1,output_double_register_0,output_double_register_1") == 1);
  const std::string doubles = [] {
    std::string names;
    for (int i = 0; i < 8; ++i) names += fmt::format(",input_double_register_{}", i);
    return names;
  }();
  CHECK(client.recipe('I', "input_int_register_0" + doubles) == 1);
  CHECK(client.recipe('I', "input_int_register_0,input_int_register_1" + doubles) == 2);
  CHECK(client.recipe('I', "input_int_register_0") == 3);
  CHECK(client.ask(rtde('S')).payload == "\1");

  Session& script_port = robot.robot.open(Port::kSecondary);
  script_port.receive(R"(def control():
  global kind = 0
  global task = p[0, 0, 0, 0, 0, 0]
  global selection = [0, 0, 0, 0, 0, 0]
  global speeder = 0
  global speed = [0, 0, 0, 0, 0, 0]
  thread speeds():
    while (True):
      if kind == 0:
        speedl(speed, a=0.5, t=0.002)
      else:
        speedj(speed, a=1.4, t=0.002)
      end
    end
  end
  def ready(val):
    write_output_integer_register(0, val)
  end
  def process():
    cmd = read_input_integer_register(0)
    if cmd == 1:
      q = [0, 0, 0, 0, 0, 0]
      q[0] = read_input_float_register(0)
      q[1] = read_input_float_register(1)
      q[2] = read_input_float_register(2)
      q[3] = read_input_float_register(3)
      q[4] = read_input_float_register(4)
      q[5] = read_input_float_register(5)
      movej(q, a=read_input_float_register(7), v=read_input_float_register(6))
    elif cmd == 6:
      selection[2] = 1
      task[0] = read_input_float_register(0)
      force_mode(task, selection, [0, 0, -5, 0, 0, 0], 2, [0.1, 0.1, 0.1, 0.2, 0.2, 0.2])
      end_force_mode()
    elif cmd == 10:
      qd = [0, 0, 0, 0, 0, 0]
      qd[0] = read_input_float_register(0)
      enter_critical
      kind = 1
      speed = qd
      exit_critical
      if speeder == 0:
        global speeder = run speeds()
      end
    elif cmd == 16:
      enter_critical
      kill speeder
      speeder = 0
      stopj(10)
      exit_critical
    elif cmd == 29:
      w = get_target_waypoint()
      write_output_float_register(0, w[0])
      write_output_float_register(1, w[1])
    elif cmd == 31:
      q = get_inverse_kin(get_actual_tcp_pose(), get_actual_joint_positions(), 1e-10, 1e-10)
      write_output_float_register(0, q[0])
      set_payload(1.0, get_target_payload_cog())
      direction = p[0, 0, 0, 0, 0, 0]
      write_output_integer_register(1, tool_contact(direction))
    end
    return cmd != 255
  end
  force_mode_set_gain_scaling(0.5)
  force_mode_set_damping(0.025)
  keep = True
  busy = False
  ready(1)
  while keep:
    if read_input_integer_register(0) == 0:
      ready(1)
      busy = False
    else:
      ready(0)
      if not busy:
        keep = process()
      end
      busy = True
    end
    sync()
  end
  textmsg("control ended")
end
run program
)");
  const auto field = [&](std::size_t at) {
    const auto data = client.data(0.01);
    REQUIRE_FALSE(data.empty());
    return int_at(data.back().payload, at);
  };
  constexpr std::size_t kReady = 1 + 4 + 4 + 4;
  robot.run(0.1);
  const auto start = told(primary);
  INFO((start.empty() ? std::string() : start.back()));
  CHECK(start.empty());
  REQUIRE(field(kReady) == 1);
  const auto give = [&](int command, std::initializer_list<double> values) {
    std::string payload(1, '\1');
    payload += numbers({command});
    std::size_t count = 0;
    for (const double value : values) payload += big_endian(value), ++count;
    for (; count < 8; ++count) payload += big_endian(0.0);
    client.session.receive(rtde('U', payload));
  };
  const auto finish = [&] {
    client.session.receive(rtde('U', std::string("\3\0\0\0\0", 5)));
    robot.run(0.05);
    CHECK(field(kReady) == 1);
  };
  const auto q = robot.state().q_rad;
  give(1, {q[0] + 0.2, q[1], q[2], q[3], q[4], q[5], 1.05, 1.4});
  robot.run(0.05);
  CHECK(field(kReady) == 0);
  robot.run(2);
  CHECK(robot.state().q_rad[0] == Approx(q[0] + 0.2).margin(1e-9));
  finish();
  give(10, {0.5});
  robot.run(1);
  CHECK(robot.state().qd_rad_s[0] == Approx(0.5).margin(1e-6));
  finish();
  give(16, {});
  robot.run(0.5);
  CHECK(std::abs(robot.state().qd_rad_s[0]) < 1e-9);
  finish();
  for (const int command : {6, 29, 31}) {
    give(command, {});
    robot.run(0.1);
    finish();
  }
  CHECK(robot.state().outputs.doubles[0] == Approx(robot.state().q_rad[0]).margin(1e-6));
  CHECK(robot.state().payload.mass_kg == 1);
  give(255, {});
  robot.run(0.1);
  CHECK(told(primary) == std::vector<std::string>{"control ended"});
  CHECK_FALSE(robot.state().program_running());
}

TEST_CASE("two clients that want the same input: the second is told which, and has it when the first is gone",
          "[ur][clients]") {
  UrRobot robot("ur5");
  RtdeClient first(robot);
  CHECK(first.ask(rtde('V', big_endian(2, 2))).payload == "\1");
  CHECK(first.recipe('I', "input_int_register_0,speed_slider_mask,speed_slider_fraction") == 1);
  RtdeClient second(robot);
  CHECK(second.ask(rtde('V', big_endian(2, 2))).payload == "\1");
  const std::string wanted = "input_double_register_3,speed_slider_mask,no_such_input";
  CHECK(second.ask(rtde('I', wanted)).payload == std::string(1, '\0') + "DOUBLE,IN_USE,NOT_FOUND");
  CHECK(second.recipe('I', "input_double_register_3") == 1);
  robot.robot.close(first.session);
  CHECK(second.recipe('I', "speed_slider_mask,speed_slider_fraction") == 2);
}

TEST_CASE("python-urx: a robot state within half a second, modes where it reads them, one line is a program",
          "[ur][clients]") {
  UrRobot robot("ur5");
  Session& session = robot.robot.open(Port::kSecondary);
  robot.run(0.5);
  // It looks for the first packet of type 16 that is smaller than 2000 bytes, and reads all of its parts.
  const auto newest_mode = [&] {
    std::string mode;
    for (const UrPacket& packet : take_packets(session.output())) {
      if (packet.type != 16) continue;
      CHECK(packet.content.size() + 5 < 2000);
      std::string content = packet.content;
      for (const UrPacket& part : take_packets(content)) {
        if (part.type == 0) mode = part.content;
      }
    }
    REQUIRE(mode.size() >= 24);
    return mode;
  };
  std::string mode = newest_mode();
  CHECK(mode.substr(8, 5) ==
        std::string("\1\1\1\0\0", 5));  // connected, enabled, powered, no e-stop, no protective stop
  CHECK(mode[13] == 0);                 // no program runs
  CHECK(mode[15] == 7);
  session.receive("set_tcp(p[0, 0, 0.1, 0, 0, 0])\n");
  robot.run(0.3);
  CHECK(robot.state().tcp_offset[2] == 0.1);
  const auto q = robot.state().q_rad;
  session.receive(
      fmt::format("movej([{}, {}, {}, {}, {}, {}], a=0.5, v=0.5, r=0)\n", q[0] + 0.3, q[1], q[2], q[3], q[4], q[5]));
  robot.run(0.4);
  CHECK(newest_mode()[13] == 1);
  robot.run(2);
  CHECK(newest_mode()[13] == 0);
  CHECK(robot.state().q_rad[0] == Approx(q[0] + 0.3).margin(1e-9));
  session.receive(
      "def myProg():\n\tset_digital_out(2, True)\n\tspeedl([0, 0, 0.01, 0, 0, 0], 0.5, 0.2)\n\tstopl(0.5)\nend\n");
  robot.run(1.5);
  CHECK(robot.state().io.output(2));
  CHECK(newest_mode()[13] == 0);
  robot.robot.controller().emergency_stop(true);
  robot.run(0.3);
  mode = newest_mode();
  CHECK(mode[11] == 1);
  CHECK(mode[10] == 0);
}

TEST_CASE("clients that come while a controller boots find nobody, then a robot that they can bring up",
          "[ur][clients]") {
  UrRobot robot("ur5e");
  robot.robot.reboot();
  CHECK_FALSE(robot.robot.serves(Port::kRtde));
  robot.run(11);
  REQUIRE(robot.robot.serves(Port::kRtde));
  RtdeClient client(robot);
  CHECK(client.ask(rtde('V', big_endian(2, 2))).payload == "\1");
  CHECK(client.recipe('O', big_endian(500.0) + "timestamp,robot_mode") == 1);
  CHECK(client.ask(rtde('S')).payload == "\1");
  const auto data = client.data(0.1);
  CHECK(double_at(data.back().payload, 1) < 40);
  CHECK(int_at(data.back().payload, 9) == 3);
}

}  // namespace firstlook
