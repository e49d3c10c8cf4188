/// Whatever clients send, no session crashes, hangs or keeps without bound.
#include <catch2/catch.hpp>

#include "hal/sim/ur_controller/script/compiler.hpp"
#include "platform/core/random.hpp"
#include "tests/support/sanitized_builds.hpp"
#include "tests/support/ur_robot.hpp"
#include "tests/support/ur_wire.hpp"

namespace firstlook {
using namespace sim::ur;
using namespace test;

namespace {

/// Pieces of what real clients send, cut, doubled and with wrong bytes in them.
std::string mutated(const std::vector<std::string>& pieces, Random& random) {
  std::string bytes;
  const int count = 1 + random.below(6);
  for (int i = 0; i < count; ++i) {
    std::string piece = pieces[static_cast<std::size_t>(random.below(static_cast<int>(pieces.size())))];
    if (random.below(3) == 0) piece.resize(static_cast<std::size_t>(random.below(static_cast<int>(piece.size()) + 1)));
    for (int k = random.below(4); k > 0 && !piece.empty(); --k) {
      piece[static_cast<std::size_t>(random.below(static_cast<int>(piece.size())))] =
          static_cast<char>(random.below(256));
    }
    bytes += piece;
  }
  return bytes;
}

const std::vector<std::string> kScripts = {
    "def f():\n  x = [1, 2, 3]\n  while x[0] < 10:\n    x[0] = x[0] + 1\n    sync()\n  end\nend\n",
    "def g(a, b=2):\n  if a == b or a > 3:\n    return p[1,2,3,0,0,0]\n  elif not True:\n    halt\n  else:\n    return "
    "-a\n  end\nend\n",
    "thread t():\n  enter_critical\n  sleep(0.1)\n  exit_critical\nend\n",
    "movej([0,-1,1,-1,1,0], a=1.2, v=0.5, t=0)\n",
    "set_digital_out(1, True)\n",
    "sec s():\n  textmsg(\"a \", get_actual_tcp_pose())\nend\n",
    "t = run t()\n",
    "join t\n",
    "kill t\n",
    "global q = get_inverse_kin(p[0.3,0.2,0.1,0,3.14,0])\n",
    "speedj([0.1,0,0,0,0,0], 1, 0.1)\n",
    "stopj(2)\n",
    "end\n",
    "interpreter_mode(False, False)\n",
    "clear_interpreter()\n",
    "end_interpreter()\n",
    "skipbuffer\n",
    "abort\n",
    "stateunexecuted\n",
};

}  // namespace

TEST_CASE("random bytes on every port", "[ur]") {
  const std::vector<std::string> packages = {rtde('V', big_endian(2, 2)),
                                             rtde('v'),
                                             rtde('S'),
                                             rtde('P'),
                                             rtde('M', "\5hello\2me\1"),
                                             rtde('O', big_endian(125.0) + "timestamp,actual_q,nonsense"),
                                             rtde('O', big_endian(500.0) + "timestamp"),
                                             rtde('I', "input_int_register_24,speed_slider_mask"),
                                             rtde('U', std::string("\1") + big_endian(7, 8))};
  const std::vector<std::string> lines = {"robotmode\n",     "load x\n",  "play\n",
                                          "stop\n",          "popup a\n", "power on\n",
                                          "brake release\n", "\n",        "set operational mode manual\n"};
  Random random(1);
  for (int trial = 0; trial < trials(300); ++trial) {
    UrRobot robot(trial % 2 == 0 ? "ur5" : "ur5e");
    robot.robot.programs().submit("interpreter_mode()\n");
    robot.run(0.02);
    for (const Port port : kPorts) {
      const auto& pieces = port == Port::kRtde ? packages : port == Port::kDashboard ? lines : kScripts;
      Session& session = robot.robot.open(port);
      session.receive(mutated(pieces, random));
    }
    robot.run(0.1);
    CHECK(robot.state().timestamp_s > 60);
    for (const double q : robot.state().q_rad) CHECK(std::abs(q) <= 2 * M_PI + 1e-9);
  }
}

TEST_CASE("mutated scripts are refused or run", "[ur][script]") {
  Random random(2);
  int compiled = 0;
  for (int trial = 0; trial < trials(20'000); ++trial) {
    const std::string script = mutated(kScripts, random);
    const auto code = script::compile(script);
    if (code) {
      ++compiled;
    } else {
      CHECK(code.error().line >= 1);
      CHECK_FALSE(code.error().text.empty());
    }
  }
  CHECK(compiled > 100 / kTrialDivisor);
}

TEST_CASE("mutated statements are refused and leave the program as it was, or are added", "[ur][script]") {
  Random random(3);
  auto code = script::compile("def prog():\n  def f(a):\n    local b = a\n    return b\n  end\n  x = f(1)\nend\n");
  REQUIRE(code);
  int added = 0;
  for (int trial = 0; trial < trials(5'000); ++trial) {
    const script::CodeMark before = script::mark_of(*code);
    const int scope = random.below(2);
    const auto line = script::compile_statements(mutated(kScripts, random), *code, scope);
    if (line) {
      ++added;
      CHECK(static_cast<std::size_t>(line->function) >= before.functions);
      for (std::size_t i = before.functions; i < code->functions.size(); ++i) {
        CHECK_FALSE(code->functions[i].instructions.empty());
      }
      script::take_back(*code, before);
    }
    CHECK(code->functions.size() == before.functions);
    CHECK(code->globals.size() == before.globals);
    CHECK(code->function_numbers == before.function_numbers);
    CHECK(code->global_numbers.size() == before.globals);
  }
  CHECK(added > 100 / kTrialDivisor);
}

}  // namespace firstlook
