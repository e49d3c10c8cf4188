/// The interpreter port, as UR's script manual describes it and as clients use it: one line out, one line back, read by
/// what clients read it by: `(\w+):\W+(\d+)?`.
#include <algorithm>
#include <catch2/catch.hpp>
#include <regex>

#include "tests/support/script_robot.hpp"

namespace firstlook {
using namespace sim::ur;
using namespace test;
using Catch::Matchers::Contains;

namespace {

/// A program in interpreter mode, and a client of it.
struct Interpreted : ScriptRobot {
  Session& port;

  explicit Interpreted(const std::string& program = "interpreter_mode()\n")
      : ScriptRobot("ur5e"), port(robot.open(Port::kInterpreter)) {
    if (!program.empty()) send(program, 0.1);
  }
  /// The line that comes back within `run_s`; empty when none does.
  std::string ask(const std::string& line, double run_s = 0.02) {
    port.output().clear();
    port.receive(line + "\n");
    listen(run_s);
    std::string answer = port.output();
    if (answer.empty()) return answer;
    CHECK(std::count(answer.begin(), answer.end(), '\n') == 1);
    answer.pop_back();
    return answer;
  }
  /// As clients do: the id, or an exception where it was discarded.
  int id(const std::string& line, double run_s = 0.02) {
    const std::string answer = ask(line, run_s);
    std::smatch parts;
    static const std::regex kReply(R"((\w+):\W+(\d+)?)");
    REQUIRE(std::regex_search(answer, parts, kReply, std::regex_constants::match_continuous));
    REQUIRE(parts[1] != "discard");
    REQUIRE(parts[2].matched);
    return std::stoi(parts[2]);
  }
};

std::string joints_off_by(const Vector6& q_rad, double first_rad) {
  Vector6 target_rad = q_rad;
  target_rad[0] += first_rad;
  return script::text_of(script::Value(script::list_of(target_rad)));
}

}  // namespace

TEST_CASE("statements are acknowledged with ids from 1 and run in the program", "[ur][interpreter]") {
  Interpreted robot;
  REQUIRE(robot.state().runtime == RuntimeState::kPlaying);
  CHECK(robot.ask("statelastexecuted") == "state: 0: statelastexecuted");
  CHECK(robot.ask("statelastinterpreted") == "state: 0: statelastinterpreted");
  CHECK(robot.ask("statelastcleared") == "state: 0: statelastcleared");
  CHECK(robot.ask("stateunexecuted") == "state: 0: stateunexecuted");
  CHECK(robot.ask("  set_digital_out(1, True)\r") == "ack: 1: set_digital_out(1, True)");
  CHECK(robot.state().io.output(1));
  CHECK(robot.ask("sleep(1)") == "ack: 2: sleep(1)");
  CHECK(robot.ask("textmsg(\"slept\")") == "ack: 3: textmsg(\"slept\")");
  CHECK(robot.id("statelastexecuted") == 2);
  CHECK(robot.id("statelastinterpreted") == 3);
  CHECK(robot.id("stateunexecuted") == 1);
  CHECK(robot.texts.empty());
  robot.listen(1);
  CHECK(robot.texts == std::vector<std::string>{"slept"});
  CHECK(robot.id("statelastexecuted") == 3);
  CHECK(robot.id("stateunexecuted") == 0);
  CHECK(robot.dashboard("running") == "Program running: true");
  robot.port.output().clear();
  robot.port.receive("\n  \ntextmsg(\"in p");
  CHECK(robot.port.output().empty());
  robot.port.receive("ieces\")\nstatelastexecuted\n");
  CHECK(robot.port.output() == "ack: 4: textmsg(\"in pieces\")\nstate: 3: statelastexecuted\n");
}

TEST_CASE("variables, functions and threads of earlier statements are there in later ones", "[ur][interpreter]") {
  Interpreted robot(
      "def prog():\n  global shared = 1\n  def own(n):\n    return n + 1\n  end\n"
      "  def enters():\n    local kept = 5\n    interpreter_mode()\n    textmsg(\"kept \", kept)\n  end\n"
      "  enters()\n  textmsg(\"shared \", shared)\nend\n");
  CHECK(robot.id("made = own(kept)") == 1);
  CHECK(robot.id("kept = made * 2") == 2);
  CHECK(robot.id("shared = 7") == 3);
  CHECK(robot.id("def twice(n): local m = n * 2 return m + made - made end") == 4);
  CHECK(robot.id("textmsg(\"twice \", twice(made))") == 5);
  // Several statements on a line are one.
  CHECK(robot.id("a = 1 b = [2, 3] if a == 1: b[0] = 20 else: b[0] = 0 end textmsg(b)") == 6);
  CHECK(robot.id("def myFun(): mystring = \"Hello Interpreter\" textmsg(mystring) end") == 7);
  CHECK(robot.id("myFun()") == 8);
  CHECK(robot.id("i = 0 while i < 3: i = i + 1 sync() end textmsg(i)") == 9);
  CHECK(robot.id("thread other(): while True: shared = shared + 1 sync() end end") == 10);
  CHECK(robot.id("t = run other()") == 11);
  robot.listen(0.1);
  CHECK(robot.id("kill t") == 12);
  CHECK(robot.id("local own_one = 4; textmsg(own_one)") == 13);
  CHECK(robot.id("end_interpreter()", 0.1) == 14);
  CHECK(robot.exceptions.empty());
  REQUIRE(robot.texts.size() == 7);
  CHECK(std::vector<std::string>(robot.texts.begin(), robot.texts.begin() + 6) ==
        std::vector<std::string>{"twice 12", "[20, 3]", "Hello Interpreter", "3", "4", "kept 12"});
  REQUIRE_THAT(robot.texts[6], Contains("shared "));
  CHECK(std::stoi(robot.texts[6].substr(7)) > 7);  // the thread counted
  CHECK(robot.state().runtime == RuntimeState::kStopped);
}

TEST_CASE("what does not compile is discarded whole and changes nothing", "[ur][interpreter]") {
  Interpreted robot;
  CHECK(robot.ask("x = ") == "discard: Syntax error: x =");
  CHECK(robot.ask("x = \"open") == "discard: Syntax error: x = \"open");
  CHECK(robot.ask("return 1") == "discard: Syntax error: return 1");
  CHECK(robot.ask("x = 1 2") == "discard: Syntax error: x = 1 2");
  CHECK(robot.ask("first = 1 textmsg(nowhere)") == "discard: Compile error: first = 1 textmsg(nowhere)");
  CHECK(robot.ask("textmsg(first)") == "discard: Compile error: textmsg(first)");
  CHECK(robot.ask("def f(): g() end") == "discard: Compile error: def f(): g() end");
  CHECK(robot.ask("f()") == "discard: Compile error: f()");
  CHECK(robot.ask("global new = 1") == "discard: Compile error: global new = 1");
  CHECK(robot.ask("interpreter_mode()") == "discard: Compile error: interpreter_mode()");
  CHECK(robot.ask("abort textmsg(1)") == "discard: Compile error: abort textmsg(1)");
  CHECK(robot.exceptions.empty());
  CHECK(robot.state().runtime == RuntimeState::kPlaying);
  CHECK(robot.id("textmsg(\"goes on\")") == 1);
  CHECK(robot.texts == std::vector<std::string>{"goes on"});
}

TEST_CASE("a fault in a statement ends the program, and lines are discarded then", "[ur][interpreter]") {
  Interpreted robot;
  CHECK(robot.id("x = [1]") == 1);
  CHECK(robot.id("y = x[4]", 0.2) == 2);
  REQUIRE(robot.exceptions.size() == 1);
  CHECK_THAT(robot.exceptions[0].text, Contains("out of bounds"));
  CHECK(robot.state().runtime == RuntimeState::kStopped);
  CHECK(robot.ask("x = 1") == "discard: Program is in an invalid state: x = 1");
  CHECK(robot.ask("statelastexecuted") == "state: 0: statelastexecuted");
  CHECK(robot.ask("abort") == "ack: 0: abort");
  // The ids of the next program begin anew.
  robot.send("interpreter_mode()\n", 0.1);
  CHECK(robot.id("x = 1") == 1);
}

TEST_CASE("lines sent before interpreter mode wait for it", "[ur][interpreter]") {
  const bool clears = GENERATE(true, false);
  Interpreted robot(std::string("def prog():\n  sleep(0.5)\n  interpreter_mode(clearQueueOnEnter=") +
                    (clears ? "True" : "False") + ")\nend\n");
  REQUIRE(robot.state().runtime == RuntimeState::kPlaying);
  CHECK(robot.ask("textmsg(\"early\")").empty());
  CHECK(robot.id("stateunexecuted") == 1);
  CHECK(robot.id("statelastinterpreted") == 0);
  robot.port.output().clear();
  robot.listen(0.6);
  if (clears) {
    CHECK(robot.port.output() == "discard: Cleaned up before interpretation: textmsg(\"early\")\n");
    CHECK(robot.texts.empty());
  } else {
    CHECK(robot.port.output() == "ack: 1: textmsg(\"early\")\n");
    CHECK(robot.texts == std::vector<std::string>{"early"});
  }
}

TEST_CASE("lines that wait are skipped, and discarded at the program's end", "[ur][interpreter]") {
  Interpreted robot("def prog():\n  sleep(5)\nend\n");
  CHECK(robot.ask("textmsg(1)").empty());
  robot.port.output().clear();
  robot.port.receive("skipbuffer\n");
  CHECK(robot.port.output() == "discard: Cleaned up before interpretation: textmsg(1)\nack: 0: skipbuffer\n");
  CHECK(robot.ask("textmsg(2)").empty());
  robot.dashboard("stop");
  robot.run(0.02);
  CHECK(robot.port.output() == "discard: Program is in an invalid state: textmsg(2)\n");
}

TEST_CASE("skipbuffer forgets what has not begun", "[ur][interpreter]") {
  Interpreted robot;
  CHECK(robot.id("sleep(0.3)") == 1);
  CHECK(robot.id("textmsg(\"skipped\")") == 2);
  CHECK(robot.id("clear_interpreter()") == 3);
  CHECK(robot.id("stateunexecuted") == 2);
  CHECK(robot.ask("skipbuffer") == "ack: 0: skipbuffer");
  CHECK(robot.id("stateunexecuted") == 0);
  CHECK(robot.id("textmsg(\"after\")") == 4);  // at once: the clearing is skipped, too
  CHECK(robot.texts.empty());
  robot.listen(0.5);
  CHECK(robot.texts == std::vector<std::string>{"after"});
  CHECK(robot.id("statelastcleared") == 0);
}

TEST_CASE("clear_interpreter forgets names and ends threads, and holds later lines back", "[ur][interpreter]") {
  Interpreted robot("def prog():\n  global count = 0\n  interpreter_mode()\nend\n");
  CHECK(robot.id("def f(): return 5 end") == 1);
  CHECK(robot.id("x = f()") == 2);
  CHECK(robot.id("thread counter(): while True: count = count + 1 sync() end end t = run counter()") == 3);
  robot.listen(0.1);
  CHECK(robot.id("sleep(0.2)") == 4);
  CHECK(robot.id("clear_interpreter()") == 5);
  CHECK(robot.ask("textmsg(x)").empty());
  CHECK(robot.id("stateunexecuted") == 2);
  CHECK(robot.id("statelastcleared") == 0);
  robot.port.output().clear();
  robot.listen(0.3);
  CHECK(robot.port.output() == "discard: Compile error: textmsg(x)\n");
  CHECK(robot.id("statelastcleared") == 5);
  CHECK(robot.ask("f()") == "discard: Compile error: f()");
  CHECK(robot.id("before = count sleep(0.1) textmsg(before > 10) textmsg(count == before)", 0.3) == 6);
  CHECK(robot.texts == std::vector<std::string>{"True", "True"});
  CHECK(robot.id("if False: clear_interpreter() end") == 7);
  CHECK(robot.id("textmsg(\"taken\")") == 8);
  CHECK(robot.exceptions.empty());
}

TEST_CASE("what was interpreted ends with the mode, or stays in the program", "[ur][interpreter]") {
  const bool clears = GENERATE(true, false);
  Interpreted robot(std::string("def prog():\n  interpreter_mode(clearOnEnd=") + (clears ? "True" : "False") +
                    ")\n  textmsg(\"between\")\n  interpreter_mode()\n  textmsg(\"behind\")\nend\n");
  CHECK(robot.id("def f(): return 5 end") == 1);
  CHECK(robot.id("x = 6") == 2);
  CHECK(robot.id("end_interpreter()", 0.1) == 3);
  CHECK(robot.texts == std::vector<std::string>{"between"});
  CHECK(robot.id("statelastcleared") == (clears ? 3 : 0));
  if (clears) {
    CHECK(robot.ask("textmsg(f() + x)") == "discard: Compile error: textmsg(f() + x)");
  } else {
    CHECK(robot.id("textmsg(f() + x)") == 4);
    CHECK(robot.id("clear_interpreter()") == 5);  // of the second mode alone
    CHECK(robot.id("textmsg(f() + x)") == 6);
    CHECK(robot.texts.back() == "11");
  }
  robot.ask("end_interpreter()", 0.1);
  CHECK(robot.texts.back() == "behind");
  CHECK(robot.state().runtime == RuntimeState::kStopped);
}

TEST_CASE("a thread of the program ends interpreter mode after the statement that runs", "[ur][interpreter]") {
  Interpreted robot(
      "def prog():\n  thread ender():\n    sleep(0.3)\n    end_interpreter()\n  end\n  run ender()\n"
      "  interpreter_mode()\n  textmsg(\"behind\")\nend\n");
  CHECK(robot.id("sleep(0.5)") == 1);
  CHECK(robot.id("textmsg(\"never\")") == 2);
  robot.listen(0.3);
  CHECK(robot.texts.empty());
  robot.listen(0.2);
  CHECK(robot.texts == std::vector<std::string>{"behind"});
}

TEST_CASE("interpreter mode is the main thread's, and not nested", "[ur][interpreter]") {
  Interpreted robot("def prog():\n  thread other():\n    interpreter_mode()\n  end\n  run other()\n  sleep(1)\nend\n");
  REQUIRE(robot.exceptions.size() == 1);
  CHECK_THAT(robot.exceptions[0].text, Contains("main thread"));
  robot.send("sec s():\n  interpreter_mode()\nend\n", 0.1);
  CHECK(robot.exceptions.size() == 2);
  robot.send("def prog():\n  def again():\n    interpreter_mode()\n  end\n  again()\nend\n", 0.1);
  CHECK(robot.id("again()") == 1);
  CHECK(robot.exceptions.size() == 3);
  robot.send("clear_interpreter()\n", 0.1);
  CHECK(robot.exceptions.size() == 4);
  robot.send("end_interpreter()\n", 0.1);  // there is none to end
  CHECK(robot.exceptions.size() == 4);
}

TEST_CASE("abort brakes a movej or movel, and its statement is over when the arm stands", "[ur][interpreter]") {
  Interpreted robot;
  const Vector6 from = robot.state().q_rad;
  const std::string far = joints_off_by(from, 2);
  CHECK(robot.id("movej(" + far + ", a=1, v=0.5)") == 1);
  CHECK(robot.id("textmsg(norm(get_actual_joint_speeds()) < 0.001)", 2) == 2);
  CHECK(robot.state().qd_rad_s[0] == Approx(0.5));
  CHECK(robot.ask("abort") == "ack: 0: abort");
  CHECK(robot.id("statelastexecuted") == 1);
  robot.listen(0.5);
  CHECK(robot.id("statelastexecuted") == 2);
  CHECK(robot.texts == std::vector<std::string>{"True"});
  CHECK(robot.state().q_rad[0] < from[0] + 1.5);
  CHECK(robot.state().runtime == RuntimeState::kPlaying);
  // Nothing else is aborted.
  CHECK(robot.id("movep(pose_add(get_actual_tcp_pose(), p[0, 0, 0.2, 0, 0, 0]), a=1, v=0.05)", 1) == 3);
  CHECK(robot.ask("abort", 0.5) == "ack: 0: abort");
  CHECK(robot.state().tcp_speed[2] == Approx(0.05).margin(1e-3));
  robot.listen(4);
  CHECK(robot.id("speedj([0.2, 0, 0, 0, 0, 0], 1, 2)", 1) == 4);
  CHECK(robot.ask("abort", 0.5) == "ack: 0: abort");
  CHECK(robot.state().qd_rad_s[0] == Approx(0.2));
}

TEST_CASE("abort reaches a motion of the program itself", "[ur][interpreter]") {
  Interpreted robot("");
  robot.send("def prog():\n  movej(" + joints_off_by(robot.state().q_rad, 2) +
                 ", a=1, v=0.5)\n  textmsg(\"over\")\n  sleep(5)\nend\n",
             1);
  CHECK(robot.ask("abort", 0.3) == "ack: 0: abort");
  CHECK(robot.texts == std::vector<std::string>{"over"});
}

TEST_CASE("pause, stop and protective stop act on a program in interpreter mode", "[ur][interpreter]") {
  Interpreted robot("def prog():\n  interpreter_mode()\nend\n");
  CHECK(robot.dashboard("pause") == "Pausing program");
  CHECK(robot.id("textmsg(\"later\")", 0.1) == 1);
  CHECK(robot.texts.empty());
  CHECK(robot.id("statelastexecuted") == 0);
  CHECK(robot.dashboard("play") == "Starting program");
  robot.listen(0.1);
  CHECK(robot.texts == std::vector<std::string>{"later"});
  CHECK(robot.dashboard("stop") == "Stopped");
  CHECK(robot.ask("x = 1") == "discard: Program is in an invalid state: x = 1");
  robot.send("interpreter_mode()\n", 0.1);
  CHECK(robot.id("movej(" + joints_off_by(robot.state().q_rad, 1) + ")", 0.2) == 1);
  robot.robot.controller().protective_stop("a test");
  robot.run(0.5);
  CHECK(robot.state().runtime == RuntimeState::kStopped);
  CHECK(robot.ask("x = 1") == "discard: Program is in an invalid state: x = 1");
}

TEST_CASE("several clients have their own answers, and one may leave", "[ur][interpreter]") {
  Interpreted robot("def prog():\n  sleep(0.2)\n  interpreter_mode(False)\nend\n");
  Session& other = robot.robot.open(Port::kInterpreter);
  robot.port.receive("textmsg(\"a\")\n");
  other.receive("textmsg(\"b\")\n");
  Session& gone = robot.robot.open(Port::kInterpreter);
  gone.receive("textmsg(\"c\")\n");
  robot.robot.close(gone);
  robot.listen(0.3);
  CHECK(robot.port.output() == "ack: 1: textmsg(\"a\")\n");
  CHECK(other.output() == "ack: 2: textmsg(\"b\")\n");
  CHECK(robot.texts == std::vector<std::string>{"a", "b", "c"});
}

TEST_CASE("an interpreter holds so many statements until it is cleared", "[ur][interpreter]") {
  Interpreted robot;
  std::string many;
  for (int i = 0; i < 8500; ++i) many += "x = 1\n";
  robot.port.receive(many);
  robot.run(0.1);
  CHECK_THAT(robot.port.output(), Contains("ack: 8500: x = 1\n") && !Contains("discard"));
  CHECK(robot.ask("x = 2") == "discard: Too many interpreted messages: x = 2");
  CHECK(robot.id("clear_interpreter()") == 8501);
  CHECK(robot.id("x = 2") == 8502);
}

TEST_CASE("statements that an earlier mode left in the program count, too", "[ur][interpreter]") {
  Interpreted robot("def prog():\n  while True:\n    interpreter_mode(True, False)\n  end\nend\n");
  std::string many;
  for (int i = 0; i < 8497; ++i) many += "x = 1\n";
  robot.port.receive(many + "end_interpreter()\n");
  robot.run(0.2);
  CHECK(robot.id("x = 2") == 8499);
  CHECK(robot.id("clear_interpreter()") == 8500);  // of this mode alone
  CHECK(robot.id("x = 2") == 8501);
  CHECK(robot.id("end_interpreter()") == 8502);
  CHECK(robot.ask("x = 3") == "discard: Too many interpreted messages: x = 3");
}

TEST_CASE("thousands of lines that wait leave other clients their turn", "[ur][interpreter]") {
  Interpreted robot("def prog():\n  sleep(1)\n  interpreter_mode(False)\nend\n");
  for (int i = 0; i < 3000; ++i) robot.port.receive("x = 1\n");
  for (int cycle = 0; cycle < 1000 && robot.port.output().empty(); ++cycle) robot.run(0.002);
  const std::string first = robot.port.output();
  CHECK_FALSE(first.empty());
  CHECK(std::count(first.begin(), first.end(), '\n') <= 100);
  robot.run(0.2);
  CHECK_THAT(robot.port.output(), Contains("ack: 3000: x = 1\n"));
}

TEST_CASE("a line for the interpreter without an end does not grow for ever", "[ur][interpreter]") {
  Interpreted robot;
  robot.port.receive(std::string(100'000, 'x'));
  CHECK(robot.port.over());
}

TEST_CASE("a CB3 has no interpreter", "[ur][interpreter]") {
  ScriptRobot cb3("ur5");
  CHECK_FALSE(cb3.robot.serves(Port::kInterpreter));
  cb3.send("interpreter_mode()\n", 0.1);
  REQUIRE(cb3.exceptions.size() == 1);
  CHECK_THAT(cb3.exceptions[0].text, Contains("interpreter"));
  CHECK(ScriptRobot("ur5e").robot.serves(Port::kInterpreter));
}

TEST_CASE("programs may have several statements on a line, on script ports, too", "[ur][script]") {
  ScriptRobot robot;
  robot.send("def f(): x = 1 while x < 3: x = x + 1 if x == 3: break end end textmsg(\"end \", x) return end\n");
  robot.send("textmsg(\"next\")\n");
  CHECK(robot.exceptions.empty());
  CHECK(robot.texts == std::vector<std::string>{"end 3", "next"});
}

TEST_CASE("lines change structs and lists, the program's and their own", "[ur][interpreter]") {
  Interpreted robot(
      "def prog():\n  local mine = struct(list = make_list(1, 5, 9), name = \"m\")\n  interpreter_mode()\n"
      "  textmsg(mine)\nend\n");
  CHECK(robot.ask("mine.list.append(6)") == "ack: 1: mine.list.append(6)");
  CHECK(robot.id("mine.name = \"n\"") == 2);
  CHECK(robot.id("own = struct(a = [[1, 2], [3, 4]])") == 3);
  CHECK(robot.id("own.a[1, 0] = 7") == 4);
  CHECK(robot.id("textmsg(own)") == 5);
  CHECK(robot.ask("neither.a = 1") == "discard: Compile error: neither.a = 1");
  CHECK(robot.id("end_interpreter()", 0.1) == 6);
  CHECK(robot.texts == std::vector<std::string>{"struct(a = [[1, 2], [7, 4]])", "struct(list = [5, 6], name = n)"});
}

}  // namespace firstlook
