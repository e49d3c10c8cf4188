#include "hal/ur/rtde_codec.hpp"

#include <catch2/catch.hpp>

#include "platform/core/random.hpp"
#include "tests/support/sanitized_builds.hpp"
#include "tests/support/ur_robot.hpp"

namespace firstlook {
using namespace ur;
using Catch::Matchers::Contains;

namespace {

/// The codec on one side, a simulated controller on the other.
struct Link {
  test::UrRobot robot;
  sim::ur::Session& session;
  RtdeReader reader;

  explicit Link(const char* model) : robot(model), session(robot.robot.open(sim::ur::Port::kRtde)) {}
  std::string ask(const std::string& request, RtdeKind kind) {
    session.receive(request);
    return take(kind);
  }
  std::string take(RtdeKind kind) {
    reader.add(session.output());
    session.output().clear();
    const auto package = reader.next();
    REQUIRE(package);
    REQUIRE(*package);
    CHECK((*package)->kind == kind);
    return std::string((*package)->payload);
  }
};

}  // namespace

TEST_CASE("the codec talks to a controller", "[ur]") {
  Link link("ur5e");
  CHECK(*rtde_accepted(link.ask(rtde_protocol_request(2), RtdeKind::kProtocol)));
  CHECK_FALSE(*rtde_accepted(link.ask(rtde_protocol_request(9), RtdeKind::kProtocol)));
  CHECK((*rtde_version(link.ask(rtde_version_request(), RtdeKind::kVersion)))[0] == 5);

  const std::string names = "timestamp,actual_q,robot_mode,joint_mode,safety_status_bits,actual_digital_input_bits";
  const auto recipe = rtde_recipe(link.ask(rtde_outputs_request(500, names), RtdeKind::kOutputs), names);
  REQUIRE(recipe);
  CHECK(recipe->number == 1);
  CHECK(*rtde_accepted(link.ask(rtde_start_request(), RtdeKind::kStart)));
  link.robot.run(0.002);
  const auto values = rtde_values(*recipe, link.take(RtdeKind::kData));
  REQUIRE(values);
  REQUIRE(values->size() == 1 + 6 + 1 + 6 + 1 + 1);
  CHECK((*values)[0] == link.robot.state().timestamp_s);
  CHECK((*values)[3] == link.robot.state().q_rad[2]);
  CHECK((*values)[7] == 7);
  CHECK((*values)[8] == 253);
  CHECK((*values)[14] == 1);
  CHECK(*rtde_accepted(link.ask(rtde_pause_request(), RtdeKind::kPause)));
}

TEST_CASE("names that the controller does not have, or others hold", "[ur]") {
  Link link("ur5");
  static_cast<void>(link.ask(rtde_protocol_request(2), RtdeKind::kProtocol));
  const std::string outputs = "timestamp,nonsense";
  const auto missing = rtde_recipe(link.ask(rtde_outputs_request(125, outputs), RtdeKind::kOutputs), outputs);
  REQUIRE_FALSE(missing);
  CHECK_THAT(std::string(missing.error().detail()), Contains("'nonsense'"));
  const std::string inputs = "input_int_register_24";
  CHECK(rtde_recipe(link.ask(rtde_inputs_request(inputs), RtdeKind::kInputs), inputs));
  sim::ur::Session& other = link.robot.robot.open(sim::ur::Port::kRtde);
  other.receive(rtde_inputs_request(inputs));
  const auto taken = rtde_recipe(std::string_view(other.output()).substr(3), inputs);
  REQUIRE_FALSE(taken);
  CHECK_THAT(std::string(taken.error().detail()), Contains("another client"));
}

TEST_CASE("answers that are cut or wrong are errors", "[ur]") {
  CHECK_FALSE(rtde_accepted(""));
  CHECK_FALSE(rtde_accepted("ab"));
  CHECK_FALSE(rtde_version("123"));
  CHECK_FALSE(rtde_recipe("", "a"));
  CHECK_FALSE(rtde_recipe("\1DOUBLE", "a,b"));
  CHECK_FALSE(rtde_recipe("\1DOUBLE,INT32", "a"));
  CHECK_FALSE(rtde_recipe("\1FLOAT", "a"));
  const RtdeRecipe recipe{2, {RtdeType::kInt32}};
  CHECK_FALSE(rtde_values(recipe, ""));
  CHECK_FALSE(rtde_values(recipe, std::string("\1\0\0\0\1", 5)));
  CHECK_FALSE(rtde_values(recipe, std::string("\2\0\0\0", 4)));
  CHECK((*rtde_values(recipe, "\2\xff\xff\xff\xfe"))[0] == -2);
}

TEST_CASE("a stream is cut anywhere, and one out of step is noticed", "[ur]") {
  const std::string stream = rtde_start_request() + rtde_protocol_request(2) + rtde_pause_request();
  RtdeReader reader;
  std::string kinds;
  for (const char byte : stream) {
    reader.add(std::string_view(&byte, 1));
    const auto package = reader.next();
    REQUIRE(package);
    if (*package) kinds.push_back(static_cast<char>((*package)->kind));
  }
  CHECK(kinds == "SVP");
  RtdeReader broken, unknown;
  broken.add(std::string("\0\2S", 3));
  CHECK_FALSE(broken.next());
  unknown.add(std::string("\0\5Zab", 5));
  CHECK_FALSE(unknown.next());
}

TEST_CASE("the codec bears random bytes", "[ur]") {
  Random random(3);
  for (int trial = 0; trial < test::trials(20'000); ++trial) {
    std::string bytes(static_cast<std::size_t>(random.below(40)), '\0');
    for (char& byte : bytes)
      byte = static_cast<char>(random.below(4) == 0 ? "VvMUOISP,\1\2"[random.below(11)] : random.below(256));
    RtdeReader reader;
    reader.add(bytes);
    for (int i = 0; i < 20; ++i) {
      const auto package = reader.next();
      if (!package || !*package) break;
      const std::string_view payload = (*package)->payload;
      static_cast<void>(rtde_accepted(payload));
      static_cast<void>(rtde_version(payload));
      if (const auto recipe = rtde_recipe(payload, "a,b")) static_cast<void>(rtde_values(*recipe, payload));
    }
  }
  SUCCEED();
}

}  // namespace firstlook
