#include <catch2/catch.hpp>

#include "hal/sim/ur_controller/script/compiler.hpp"
#include "tests/support/script_robot.hpp"

namespace firstlook {
using namespace sim::ur;
using namespace test;
using Catch::Matchers::Contains;
using Catch::Matchers::StartsWith;

TEST_CASE("control flow, functions and scopes", "[ur][script]") {
  ScriptRobot robot;
  robot.send(R"(def prog():
  global total = 0
  kept = 5
  def add(n, twice):
    local kept = n
    if twice:
      kept = kept * 2
    elif n > 100:
      return -1
    else:
      total = total + 1
    end
    total = total + kept
    return total
  end
  i = 0
  while True:
    i = i + 1
    if i == 2:
      continue
    end
    if i > 4: # a comment
      break
    end
    add(i, i == 3)
  end
  list = [1, 2, 3]
  list[1] = 20
  copy = list
  copy[0] = 9
  textmsg("total ", total)
  textmsg("kept ", kept)
  textmsg("list ", list)
  textmsg("far ", add(101, False))
end
)");
  CHECK(robot.exceptions.empty());
  CHECK(robot.texts == std::vector<std::string>{"total 13", "kept 5", "list [1, 20, 3]", "far -1"});
  CHECK(robot.keys == std::vector<std::string>{"PROGRAM_XXX_STARTEDprog", "PROGRAM_XXX_STOPPEDprog"});
  CHECK(robot.state().runtime == RuntimeState::kStopped);
}

TEST_CASE("what scripts of known clients rely on", "[ur][script]") {
  ScriptRobot robot;
  robot.send(R"(def prog():
  global mode = 0
  def greet(name, times=2, mark="!"):
    return str_cat(str_cat(name, times), mark)
  end
  def declares():
    global mode
    mode = 7
  end
  textmsg(greet("a"))
  textmsg(greet("b", mark="?"))
  textmsg(greet("c", 3))
  declares()
  thread_move = 0
  join thread_move
  kill thread_move
  if mode == 8 or
    mode == 7:
    textmsg("continued")
  end
  if 1.0 and thread_move != 1:
    textmsg("number")
  end
  def scale(p, factor):
    p[0] = p[0] * factor
    return p
  end
  textmsg(scale(p[1, 2, 3, 0, 0, 0], 2))
  global served = 0
  thread server():
    while True:
      enter_critical
      q = get_joint_positions()
      servoj(q, t=get_steptime(), lookahead_time=0.03, gain=2000)
      served = served + 1
      exit_critical
    end
  end
  thread_move = run server()
  i = 0
  while i < 20:
    enter_critical
    i = i + 1
    sync()
    exit_critical
  end
  textmsg(served > 10)
  kill thread_move
  stopj(4.0)
  speedj([0, 0, 0, 0, 0, 0], 0, get_steptime())
  movec(pose_add(get_actual_tcp_pose(), p[0, 0.01, 0.01, 0, 0, 0]), pose_add(get_actual_tcp_pose(), p[0, 0.02, 0, 0, 0, 0]))
  textmsg("end")
end
)",
             2);
  for (const auto& exception : robot.exceptions) CHECK(exception.text.empty());
  CHECK(robot.texts ==
        std::vector<std::string>{"a2!", "b2?", "c3!", "continued", "number", "p[2, 2, 3, 0, 0, 0]", "True", "end"});
}

TEST_CASE("threads run beside each other and end with the program", "[ur][script]") {
  ScriptRobot robot;
  robot.send(R"(def prog():
  global count = 0
  thread counter():
    while True:
      count = count + 1
      sync()
    end
  end
  thread short():
    sleep(0.1)
    textmsg("short")
  end
  t = run counter()
  s = run short()
  join s
  textmsg("joined")
  kill t
  last = count
  sleep(0.1)
  textmsg(last == count)
  textmsg(last > 10)
  u = run counter()
end
)",
             1);
  CHECK(robot.exceptions.empty());
  CHECK(robot.texts == std::vector<std::string>{"short", "joined", "True", "True"});
  CHECK(robot.state().runtime == RuntimeState::kStopped);
}

TEST_CASE("what does not compile is told with its place, and the running program goes on", "[ur][script]") {
  ScriptRobot robot;
  robot.send("def runs():\n  while True:\n    sync()\n  end\nend\n");
  REQUIRE(robot.state().runtime == RuntimeState::kPlaying);
  robot.send("def bad():\n  x = 1\n  y = foo(x)\nend\n");
  REQUIRE(robot.exceptions.size() == 1);
  CHECK(robot.exceptions[0].text == "compile_error_name_not_found:foo:");
  CHECK(robot.exceptions[0].line == 3);
  CHECK(robot.exceptions[0].column == 7);
  robot.send("def bad():\n  movej([0.5, -1], a=0.25, v=1.0):\nend\n");
  REQUIRE(robot.exceptions.size() == 2);
  CHECK(robot.exceptions[1].text == "syntax_error_on_line:2:  movej([0.5, -1], a=0.25, v=1.0)::");
  CHECK(robot.state().runtime == RuntimeState::kPlaying);
  for (const char* bad : {"def f():\n  return x\nend\n", "x = \"open\n", "movej()\n", "movej([0], q=1)\n", "break\n",
                          "def f(:\nend\n", "sleep(1, 2)\n", "x = p[1,2]\n", "x = (1\n", "1 +\n", "x = $\n",
                          "textmsg(1, s3=2)\n", "def f():\n  if True:\n    x = 1\n    end\n  end\n  end\nend\n"}) {
    INFO(bad);
    CHECK_FALSE(script::compile(bad));
  }
}

TEST_CASE("a fault while it runs ends the program and is told with its place", "[ur][script]") {
  ScriptRobot robot;
  robot.send("def prog():\n  x = [1]\n  sync()\n  y = x[3]\nend\n");
  REQUIRE(robot.exceptions.size() == 1);
  CHECK(robot.exceptions[0].line == 4);
  CHECK(robot.state().runtime == RuntimeState::kStopped);
  CHECK(robot.keys.back() == "PROGRAM_XXX_STOPPEDprog");
}

TEST_CASE("a script moves the arm and a new one replaces it", "[ur][script]") {
  ScriptRobot robot("ur5");
  const Vector6 from = robot.state().q_rad;
  robot.send(std::string("movej(") + script::text_of(script::Value(script::list_of(from))) + ", a=1, v=0.5)\n", 0.2);
  CHECK(robot.exceptions.empty());
  robot.send(
      "def go():\n  q = get_actual_joint_positions()\n  q[0] = q[0] + 1\n  movej(q, a=1, v=0.5)\n"
      "  textmsg(\"there\")\nend\n",
      1.5);
  CHECK(robot.state().qd_rad_s[0] == Approx(0.5));
  CHECK(robot.state().script_line == 4);
  CHECK(robot.texts.empty());
  robot.send(std::string("def back():\n  movej(p[") + fmt::format("{}", fmt::join(robot.state().tcp_pose, ",")) +
                 "], t=2)\nend\n",
             5);
  CHECK(robot.exceptions.empty());
  CHECK(robot.texts.empty());
  CHECK(robot.keys == std::vector<std::string>{"PROGRAM_XXX_STARTEDunnamed", "PROGRAM_XXX_STOPPEDunnamed",
                                               "PROGRAM_XXX_STARTEDgo", "PROGRAM_XXX_STOPPEDgo",
                                               "PROGRAM_XXX_STARTEDback", "PROGRAM_XXX_STOPPEDback"});
  CHECK(robot.state().q_rad[0] > from[0] + 0.4);
  CHECK(robot.state().q_rad[0] < from[0] + 0.9);
  CHECK(robot.state().runtime == RuntimeState::kStopped);
}

TEST_CASE("movel, servoj, speedj and stopj from a script", "[ur][script]") {
  ScriptRobot robot;
  const Vector6 pose = robot.state().tcp_pose;
  robot.send(R"(def prog():
  set_tcp(p[0, 0, 0.1, 0, 0, 0])
  movel(pose_add(get_actual_tcp_pose(), p[0, 0, 0.05, 0, 0, 0]), v=0.2)
  textmsg("moved")
  q = get_actual_joint_positions()
  i = 0
  while i < 250:
    q[5] = q[5] + 0.001
    servoj(q, lookahead_time=0.03)
    i = i + 1
  end
  stopj(2)
  textmsg("served")
  speedj([0, 0, 0, 0, 0, 0.3], 1, 0.5)
  textmsg("speed ", get_actual_joint_speeds()[5])
  stopj(1)
  textmsg(is_steady())
end
)",
             6);
  CHECK(robot.exceptions.empty());
  CHECK(robot.texts == std::vector<std::string>{"moved", "served", "speed 0.3", "True"});
  CHECK(robot.state().tcp_pose[2] != pose[2]);
}

TEST_CASE("paths of a script blend, bend and end where they should", "[ur][script]") {
  // Up, aside and back: two lines, an arc, a line that would blend with what does not come.
  const auto program = [](const char* radius) {
    return std::string(
               "def prog():\n  set_tcp(p[0.02, 0, 0.1, 0, 0, 0])\n  sleep(0.1)\n  a = get_actual_tcp_pose()\n"
               "  movel(pose_add(a, p[0, 0, 0.05, 0, 0, 0]), v=0.2, r=") +
           radius + ")\n  movep(pose_add(a, p[0, 0.05, 0.05, 0, 0, 0]), 1.2, 0.2, " + radius +
           ")\n  textmsg(\"aside\")\n  movec(pose_add(a, p[0.025, 0.025, 0.05, 0, 0, 0]), pose_add(a, p[0, 0, 0.05, 0, "
           "0, "
           "0]), v=0.2)\n  textmsg(\"back\")\n  movel(a, r=0.04)\nend\n";
  };
  double took_s[2] = {};
  for (const bool blends : {false, true}) {
    ScriptRobot robot;
    const JointVector start_rad = robot.robot.controller().motion().position_rad();
    robot.send(program(blends ? "0.02" : "0"), 0.05);
    const Vector6 from = robot.state().tcp_pose;
    double aside_most_m = 0, bulge_m = 0;
    while (robot.state().runtime != RuntimeState::kStopped && took_s[blends ? 1 : 0] < 20) {
      robot.listen(0.01);
      took_s[blends ? 1 : 0] += 0.01;
      aside_most_m = std::max(aside_most_m, robot.state().tcp_pose[1] - from[1]);
      bulge_m = std::max(bulge_m, robot.state().tcp_pose[0] - from[0]);
    }
    CHECK(robot.exceptions.empty());
    CHECK(robot.texts == std::vector<std::string>{"aside", "back"});
    if (!blends) CHECK(aside_most_m == Approx(0.05).margin(1e-6));
    if (blends) CHECK(aside_most_m < 0.05);
    CHECK(bulge_m > 0.02);
    CHECK((robot.robot.controller().motion().position_rad() - start_rad).max_abs() < 1e-6);
  }
  CHECK(took_s[1] < took_s[0] - 0.1);
}

TEST_CASE("one thread moves the arm at a time", "[ur][script]") {
  ScriptRobot robot;
  robot.send(R"(def prog():
  thread other():
    speedj([0, 0, 0, 0, 0, 0.2], 1, 5)
  end
  run other()
  sync()
  sync()
  stopj(1)
end
)");
  REQUIRE(robot.exceptions.size() == 1);
  CHECK(robot.exceptions[0].text == "Another thread is already controlling the robot");
  robot.run(1);
  CHECK(robot.robot.controller().motion().standing());
}

TEST_CASE("freedrive from a script: hands lead the arm, the program goes on, its end holds the arm", "[ur][script]") {
  const auto [begin, end] = GENERATE(table<std::string, std::string>(
      {{"freedrive_mode()", "end_freedrive_mode()"},
       {"teach_mode()", "end_teach_mode()"},
       {"freedrive_mode(freeAxes=[1, 0, 0, 0, 0, 0], feature=\"tool\")", "end_freedrive_mode()"}}));
  ScriptRobot robot("ur5");
  Controller& controller = robot.robot.controller();
  robot.send("def teach():\n  speedj([0.2, 0, 0, 0, 0, 0], 1, 0.5)\n  " + begin +
             "\n  textmsg(\"free\")\n  sleep(4)\n  textmsg(get_actual_joint_positions()[0])\n  sleep(1)\n  " + end +
             "\n  textmsg(\"held\")\n  sleep(1)\n  movej(get_actual_joint_positions())\n  textmsg(\"moved\")\nend\n");
  robot.listen(1);
  CHECK(robot.texts == std::vector<std::string>{"free"});
  CHECK(robot.state().teach_mode);
  CHECK(robot.state().control_mode() == 1);
  CHECK(robot.state().robot_mode == RobotMode::kRunning);
  CHECK(robot.state().runtime == RuntimeState::kPlaying);
  JointVector there = controller.motion().position_rad();
  there[0] -= 0.5;
  REQUIRE(controller.lead(there, 0.8, 2));
  robot.listen(0.1);
  CHECK(controller.motion().in_hand());
  CHECK(robot_status_bits(robot.state()) == 0b0011U);  // no button is pressed
  robot.listen(3);
  CHECK(robot.state().q_rad[0] == Approx(there[0]).margin(1e-9));
  CHECK(robot.texts.size() == 2);
  // A hand that is still leading when it ends is held where it is, not where it wanted to go.
  JointVector far = there;
  far[0] += 2;
  REQUIRE(controller.lead(far, 0.5, 2));
  robot.listen(1.2);
  REQUIRE(robot.texts.size() >= 3);
  CHECK(robot.texts[2] == "held");
  CHECK_FALSE(robot.state().teach_mode);
  CHECK(robot.state().control_mode() == 0);
  CHECK(controller.motion().standing());
  CHECK(robot.state().q_rad[0] < far[0] - 1);
  robot.listen(2);
  CHECK(robot.texts.back() == "moved");
  CHECK(robot.exceptions.empty());
}

TEST_CASE("in freedrive no path is followed, and what stops the program ends it", "[ur][script]") {
  ScriptRobot robot;
  robot.send("def f():\n  freedrive_mode()\n  stopj(2)\n  movej([0, -1, 1, 0, 0, 0])\nend\n");
  REQUIRE(robot.exceptions.size() == 1);
  CHECK(robot.exceptions[0].text == "The robot is in freedrive: it cannot follow a path");
  CHECK(robot.exceptions[0].line == 4);
  CHECK_FALSE(robot.state().teach_mode);
  const std::string waits = "def f():\n  freedrive_mode()\n  sleep(60)\nend\n";
  robot.send(waits);
  CHECK(robot.state().teach_mode);
  CHECK(robot.dashboard("stop") == "Stopped");
  CHECK_FALSE(robot.state().teach_mode);
  robot.send(waits);
  robot.send("def g():\n  end_freedrive_mode()\nend\n");
  CHECK_FALSE(robot.state().teach_mode);
  robot.send(waits);
  robot.robot.controller().protective_stop("a test");
  CHECK_FALSE(robot.state().teach_mode);
  robot.send("freedrive_mode()\n");
  CHECK_FALSE(robot.state().teach_mode);
}

TEST_CASE("what this robot has not does nothing, and a program with it runs", "[ur][script]") {
  ScriptRobot robot;
  robot.send(R"(def p():
  track_conveyor_linear(p[1, 0, 0, 0, 0, 0], 500.0)
  textmsg(encoder_get_tick_count(0))
  stop_conveyor_tracking(15)
  path_offset_enable()
  path_offset_set([0, 0, 0.01, 0, 0, 0], 3)
  path_offset_disable()
  set_tool_communication(True, 115200, 1, 2, 1.0, 3.5)
  set_standard_digital_input_action(0, "freedrive")
  set_runstate_standard_digital_output_to_value(1, 3)
  set_runstate_outputs([])
  set_analog_inputrange(2, 0)
  set_input_actions_to_default()
  force_mode(p[0, 0, 0, 0, 0, 0], [0, 0, 1, 0, 0, 0], [0, 0, 5, 0, 0, 0], 2, [0.1, 0.1, 0.1, 0.2, 0.2, 0.2])
  end_force_mode()
  textmsg("done")
end
)");
  CHECK(robot.exceptions.empty());
  CHECK(robot.texts == std::vector<std::string>{"0", "done"});
}

TEST_CASE("programs of the pendant have labels, which the primary interface tells", "[ur][script]") {
  ScriptRobot robot;
  robot.primary.receive(
      "def p():\n  $ 1 \"Robot Program\"\n  if True:\n    $ 2 \"Set\" \"breakAfter\"\n    textmsg(\"set\")\n  "
      "end\nend\n");
  robot.run(0.5);
  std::vector<std::string> labels;
  for (const UrPacket& packet : take_packets(robot.primary.output())) {
    if (packet.type != 20 || packet.content[9] != 1) continue;
    const std::string content = packet.content.substr(10);
    labels.push_back(std::to_string(int_at(content, 0)) + content.substr(4));
  }
  CHECK(labels == std::vector<std::string>{"1Robot Program", "2Set"});
  robot.send("def p():\n  $ \"Robot Program\"\nend\n");
  REQUIRE(robot.exceptions.size() == 1);
  CHECK_THAT(robot.exceptions[0].text, StartsWith("syntax_error_on_line:2:"));
}

TEST_CASE("signals by their old names", "[ur][script]") {
  ScriptRobot robot("ur5");
  robot.send("digital_out[2]=True\n");
  CHECK(robot.state().io.output(2));
  robot.send(
      "def f():\n  digital_out[2] = not digital_out[2]\n  digital_out[1 + 2] = True\n  textmsg(digital_in[0])\nend\n");
  CHECK_FALSE(robot.state().io.output(2));
  CHECK(robot.state().io.output(3));
  CHECK(robot.texts == std::vector<std::string>{"False"});
  robot.texts.clear();
  robot.send("def f():\n  digital_out = [1, 2]\n  digital_out[0] = 7\n  textmsg(digital_out)\nend\n");
  CHECK(robot.texts == std::vector<std::string>{"[7, 2]"});
  CHECK(robot.exceptions.empty());
}

TEST_CASE("inputs, outputs and registers from a script", "[ur][script]") {
  ScriptRobot robot;
  robot.robot.controller().set_digital_input(3, true);
  robot.robot.controller().inputs().integers[24] = -5;
  robot.robot.controller().inputs().set_bit(70, true);
  robot.send(R"(def prog():
  set_standard_digital_out(1, True)
  set_configurable_digital_out(2, True)
  set_digital_out(8, True)
  set_standard_analog_out(0, 0.5)
  write_output_integer_register(3, read_input_integer_register(24) * 2)
  write_output_float_register(4, 1.25)
  write_output_boolean_register(65, read_input_boolean_register(70))
  textmsg(get_standard_digital_in(3))
  textmsg(get_digital_out(1))
  set_payload(1.5, [0, 0, 0.02])
end
)");
  CHECK(robot.exceptions.empty());
  CHECK(robot.texts == std::vector<std::string>{"True", "True"});
  CHECK(robot.state().io.digital_outputs == ((1U << 1) | (1U << 10) | (1U << 16)));
  CHECK(robot.state().io.analog_outputs[0] == Approx(12));
  CHECK(robot.state().outputs.integers[3] == -10);
  CHECK(robot.state().outputs.doubles[4] == 1.25);
  CHECK(robot.state().outputs.bit(65));
  CHECK(robot.state().payload.mass_kg == 1.5);
  robot.send("set_standard_digital_out(9, True)\n");
  CHECK(robot.exceptions.size() == 1);
}

TEST_CASE("a secondary program runs beside the program, and does not move", "[ur][script]") {
  ScriptRobot robot;
  robot.send("def runs():\n  while True:\n    sync()\n  end\nend\n");
  robot.send("sec s():\n  set_digital_out(2, True)\nend\n");
  CHECK(robot.state().io.output(2));
  CHECK(robot.state().runtime == RuntimeState::kPlaying);
  robot.send("sec s():\n  movej([0,0,0,0,0,0])\nend\n");
  CHECK(robot.exceptions.size() == 1);
  CHECK(robot.state().runtime == RuntimeState::kPlaying);
}

TEST_CASE("pause holds a program where it is", "[ur][script]") {
  ScriptRobot robot;
  robot.send("def prog():\n  sleep(1)\n  textmsg(\"done\")\nend\n", 0.5);
  CHECK(robot.dashboard("pause") == "Pausing program");
  robot.listen(5);
  CHECK(robot.texts.empty());
  CHECK(robot.dashboard("play") == "Starting program");
  robot.listen(0.4);
  CHECK(robot.texts.empty());
  robot.listen(0.2);
  CHECK(robot.texts == std::vector<std::string>{"done"});
}

TEST_CASE("a program may be without end, but not without bounds", "[ur][script]") {
  ScriptRobot robot;
  const auto fails_with = [&](const std::string& script, const std::string& text) {
    robot.exceptions.clear();
    robot.send(script, 4);
    INFO(script);
    REQUIRE(robot.exceptions.size() == 1);
    CHECK_THAT(robot.exceptions[0].text, Contains(text));
    CHECK(robot.state().runtime == RuntimeState::kStopped);
  };
  fails_with("def f():\n  while True:\n  end\nend\n", "too much behind");
  fails_with("def f():\n  def g():\n    g()\n  end\n  g()\nend\n", "Stack overflow");
  fails_with("def f():\n  x = [1]\n  while True:\n    x = [x, x]\n  end\nend\n", "Out of memory");
  fails_with("def f():\n  x = \"ab\"\n  while True:\n    x = str_cat(x, x)\n  end\nend\n", "Out of memory");
  fails_with("def f():\n  thread t():\n    sleep(9)\n  end\n  while True:\n    run t()\n  end\nend\n",
             "Too many threads");
  std::string deep = "x = ";
  for (int i = 0; i < 100'000; ++i) deep += "(";
  CHECK_FALSE(script::compile(deep + "1\n"));
  deep = "x = ";
  for (int i = 0; i < 100'000; ++i) deep += "not ";
  CHECK_FALSE(script::compile(deep + "True\n"));
  std::string many = "def f():\n";
  for (int i = 0; i < 1000; ++i) many += std::string("  def g") + std::to_string(i) + "():\n";
  CHECK_FALSE(script::compile(many));
}

TEST_CASE("the shortest sleep takes a cycle", "[ur][script]") {
  ScriptRobot robot("ur5");
  robot.send("def f():\n  i = 0\n  while i < 1000:\n    sleep(0.001)\n    i = i + 1\n  end\n  textmsg(i)\nend\n", 7.9);
  CHECK(robot.texts.empty());
  robot.listen(0.2);
  CHECK(robot.texts == std::vector<std::string>{"1000"});
  CHECK(robot.exceptions.empty());
}

TEST_CASE("scripts need a robot that runs", "[ur][script]") {
  UrRobot robot("ur5e", false);
  Session& primary = robot.robot.open(Port::kPrimary);
  primary.receive("def f():\n  set_digital_out(0, True)\nend\n");
  robot.run(0.2);
  CHECK(robot.state().runtime == RuntimeState::kStopped);
  CHECK_FALSE(robot.state().io.output(0));
}

namespace {

/// The other end of a script's connections, in memory.
class FakePeer final : public script::Sockets {
 public:
  bool reachable = true;
  std::string sent, to_robot;
  int closed = 0;
  std::string host;

  Id open(const std::string& to, std::uint16_t) override {
    host = to;
    return 1;
  }
  State state(Id) const override { return reachable ? State::kOpen : State::kClosed; }
  bool send(Id, std::string_view bytes) override {
    sent += bytes;
    return true;
  }
  std::string& received(Id) override { return to_robot; }
  void close(Id) override { ++closed; }
};

}  // namespace

TEST_CASE("sockets that were closed leave room for others", "[ur][script]") {
  FakePeer peer;
  ScriptRobot robot;
  robot.robot.programs().set_sockets(&peer);
  const auto open_so_many = [&](const std::string& then) {
    robot.send(
        "def prog():\n  i = 0\n  while i < 17:\n    name = str_cat(\"s\", i)\n    socket_open(\"10.0.0.2\", 1, "
        "name)\n" +
            then + "    i = i + 1\n  end\n  textmsg(\"done\")\nend\n",
        0.5);
  };
  open_so_many("    socket_close(name)\n");
  CHECK(robot.texts == std::vector<std::string>{"done"});
  CHECK(robot.exceptions.empty());
  open_so_many("");
  REQUIRE(robot.exceptions.size() == 1);
  CHECK_THAT(robot.exceptions.front().text, Contains("Too many sockets"));
  robot.robot.programs().set_sockets(nullptr);
}

TEST_CASE("flags outlive the program that set them", "[ur][script]") {
  ScriptRobot robot;
  robot.send("def one():\n  set_flag(31, True)\n  set_flag(3, get_flag(31))\n  set_flag(31, False)\nend\n", 0.1);
  robot.send("def two():\n  textmsg(get_flag(3), get_flag(31))\nend\n", 0.1);
  CHECK(robot.exceptions.empty());
  CHECK(robot.texts == std::vector<std::string>{"TrueFalse"});
}

TEST_CASE("a script talks to another computer", "[ur][script]") {
  FakePeer peer;
  ScriptRobot robot;
  robot.robot.programs().set_sockets(&peer);
  peer.to_robot = std::string("\0\0\0\7\xff\xff\xff\xfe", 8);
  robot.send(R"(def prog():
  textmsg(socket_open("192.168.1.2", 50002, "pc"))
  socket_send_string("request_program", "pc")
  socket_send_byte(10, "pc")
  socket_send_int(258, "pc")
  textmsg(socket_read_binary_integer(2, "pc"))
  textmsg(socket_read_line("pc", 0.2))
  textmsg(socket_read_ascii_float(2, "pc", 0))
  textmsg(socket_read_binary_integer(1, "pc", 0.1))
  textmsg(socket_read_byte_list(2, "pc", 0.1))
  textmsg(socket_read_ascii_float(2, "pc", 0.1))
  socket_close("pc")
  textmsg(socket_send_line("x", "pc"))
end
)",
             0.1);
  CHECK(robot.exceptions.empty());
  CHECK(peer.host == "192.168.1.2");
  CHECK(peer.sent == std::string("request_program\n\0\0\1\2", 20));
  peer.to_robot = "a line\r\n (1.5,";
  robot.listen(0.1);
  peer.to_robot += " -2)";
  robot.listen(0.5);
  CHECK(robot.texts == std::vector<std::string>{"True", "[2, 7, -2]", "a line", "[2, 1.5, -2]", "[0, -1]",
                                                "[0, -1, -1]", "[0, nan, nan]", "False"});
  CHECK(peer.closed >= 1);
  peer.reachable = false;
  robot.texts.clear();
  robot.send("textmsg(socket_open(\"10.0.0.1\", 1))\n", 3);
  CHECK(robot.texts == std::vector<std::string>{"False"});
  robot.robot.programs().set_sockets(nullptr);
}

TEST_CASE("External Control asks another computer for its program at Play", "[ur][script]") {
  FakePeer peer;
  UrRobot with_program("ur5e", true, {{"external_control.urp", "", {"10.0.0.2", 50002}}});
  with_program.robot.programs().set_sockets(&peer);
  CHECK_THAT(with_program.dashboard("load external_control.urp"), StartsWith("Loading program"));
  Session& pendant = with_program.robot.open(Port::kDashboard);
  pendant.output().clear();
  pendant.receive("play\n");
  with_program.run(0.1);
  CHECK(pendant.output().empty());
  CHECK(peer.host == "10.0.0.2");
  CHECK(peer.sent == "request_program\n");
  CHECK(with_program.state().runtime == RuntimeState::kStopped);
  peer.to_robot = "set_digital_out(3, True)\nwhile True:\n";
  with_program.run(0.3);
  peer.to_robot = "  sync()\nend\n";
  with_program.run(0.3);
  CHECK(with_program.state().runtime == RuntimeState::kStopped);  // more could come
  with_program.run(0.4);
  CHECK(with_program.state().runtime == RuntimeState::kPlaying);
  CHECK(pendant.output() == "Starting program\n");
  CHECK(with_program.state().io.output(3));
  CHECK(with_program.dashboard("stop") == "Stopped");

  // Nobody answers: nothing starts.
  CHECK(with_program.dashboard("play") == "Failed to execute: play");
  CHECK(with_program.state().runtime == RuntimeState::kStopped);
  CHECK(with_program.dashboard("stop") == "Failed to execute: stop");
  with_program.robot.programs().set_sockets(nullptr);
}

}  // namespace firstlook
