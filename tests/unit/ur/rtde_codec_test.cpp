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
  std::string received;

  explicit Link(const char* model) : robot(model), session(robot.robot.open(sim::ur::Port::kRtde)) {}
  std::string ask(const RtdeRequest& request, RtdeKind kind) {
    session.receive(request.view());
    return take(kind);
  }
  std::string take(RtdeKind kind) {
    received += session.output();
    session.output().clear();
    const auto package = rtde_cut(received);
    REQUIRE(package);
    REQUIRE(*package);
    CHECK((*package)->kind == kind);
    const std::string payload((*package)->payload);
    received.erase(0, (*package)->bytes);
    return payload;
  }
};

}  // namespace

TEST_CASE("the codec talks to a controller", "[ur]") {
  Link link("ur5e");
  CHECK(*rtde_accepted(link.ask(rtde_protocol_request(2), RtdeKind::kProtocol)));
  CHECK_FALSE(*rtde_accepted(link.ask(rtde_protocol_request(9), RtdeKind::kProtocol)));
  CHECK((*rtde_version(link.ask(rtde_version_request(), RtdeKind::kVersion)))[0] == 5);

  const std::string names = "timestamp,actual_q,robot_mode,joint_mode,safety_status_bits,actual_digital_input_bits";
  const auto recipe = rtde_recipe(2, link.ask(rtde_outputs_request(2, 500, names), RtdeKind::kOutputs), names);
  REQUIRE(recipe);
  CHECK(recipe->number == 1);
  CHECK(*rtde_accepted(link.ask(rtde_start_request(), RtdeKind::kStart)));
  link.robot.run(0.002);
  REQUIRE(recipe->values() == 1 + 6 + 1 + 6 + 1 + 1);
  std::array<double, 16> values{};
  REQUIRE(rtde_values(*recipe, link.take(RtdeKind::kData), values));
  CHECK(values[0] == link.robot.state().timestamp_s);
  CHECK(values[3] == link.robot.state().q_rad[2]);
  CHECK(values[7] == 7);
  CHECK(values[8] == 253);
  CHECK(values[14] == 1);
  CHECK(*rtde_accepted(link.ask(rtde_pause_request(), RtdeKind::kPause)));
}

TEST_CASE("names that the controller does not have, or others hold", "[ur]") {
  Link link("ur5");
  static_cast<void>(link.ask(rtde_protocol_request(2), RtdeKind::kProtocol));
  const std::string outputs = "timestamp,nonsense";
  const auto missing = rtde_recipe(2, link.ask(rtde_outputs_request(2, 125, outputs), RtdeKind::kOutputs), outputs);
  REQUIRE(missing);
  CHECK_FALSE(missing->complete());
  CHECK(missing->types[0] == RtdeType::kDouble);
  CHECK(missing->types[1] == RtdeType::kNotFound);
  const std::string inputs = "input_int_register_24";
  CHECK(rtde_recipe(2, link.ask(rtde_inputs_request(inputs), RtdeKind::kInputs), inputs));
  sim::ur::Session& other = link.robot.robot.open(sim::ur::Port::kRtde);
  other.receive(rtde_inputs_request(inputs).view());
  const auto taken = rtde_recipe(2, std::string_view(other.output()).substr(3), inputs);
  REQUIRE_FALSE(taken);
  CHECK_THAT(std::string(taken.error().detail()), Contains("another client"));
}

TEST_CASE("answers that are cut or wrong are errors", "[ur]") {
  CHECK_FALSE(rtde_accepted(""));
  CHECK_FALSE(rtde_accepted("ab"));
  CHECK_FALSE(rtde_version("123"));
  CHECK_FALSE(rtde_recipe(2, "", "a"));
  CHECK_FALSE(rtde_recipe(2, "\1DOUBLE", "a,b"));
  CHECK_FALSE(rtde_recipe(2, "\1DOUBLE,INT32", "a"));
  CHECK_FALSE(rtde_recipe(2, "\1FLOAT", "a"));
  CHECK(rtde_recipe(1, "DOUBLE", "a"));
  std::string many_types(1, '\1'), many_names;
  for (int i = 0; i < 40; ++i) many_types += "BOOL,", many_names += "a,";
  CHECK_FALSE(rtde_recipe(2, many_types, many_names));
  RtdeRecipe recipe;
  recipe.number = 2;
  recipe.types.push_back(RtdeType::kInt32);
  std::array<double, 1> value{};
  CHECK_FALSE(rtde_values(recipe, "", value));
  CHECK_FALSE(rtde_values(recipe, std::string("\1\0\0\0\1", 5), value));
  CHECK_FALSE(rtde_values(recipe, std::string("\2\0\0\0", 4), value));
  CHECK(rtde_values(recipe, "\2\xff\xff\xff\xfe", value));
  CHECK(value[0] == -2);
  recipe.numbered = false;
  CHECK(rtde_values(recipe, "\xff\xff\xff\xfd", value));
  CHECK(value[0] == -3);
  CHECK(rtde_text(2, "\2hi\4RTDE\1") == "hi");
  CHECK(rtde_text(2, "\377hi") == "hi");
  CHECK(rtde_text(1, "\1hi") == "hi");
}

TEST_CASE("a stream is cut anywhere, and one out of step is noticed", "[ur]") {
  std::string stream;
  for (const RtdeRequest& request : {rtde_start_request(), rtde_protocol_request(2), rtde_pause_request()}) {
    stream += request.view();
  }
  std::string received, kinds;
  for (const char byte : stream) {
    received.push_back(byte);
    const auto package = rtde_cut(received);
    REQUIRE(package);
    if (!*package) continue;
    kinds.push_back(static_cast<char>((*package)->kind));
    received.erase(0, (*package)->bytes);
  }
  CHECK(kinds == "SVP");
  CHECK_FALSE(rtde_cut(std::string("\0\2S", 3)));
  CHECK_FALSE(rtde_cut(std::string("\0\5Zab", 5)));
}

TEST_CASE("the codec bears random bytes", "[ur]") {
  Random random(3);
  for (int trial = 0; trial < test::trials(20'000); ++trial) {
    std::string bytes(static_cast<std::size_t>(random.below(40)), '\0');
    for (char& byte : bytes)
      byte = static_cast<char>(random.below(4) == 0 ? "VvMUOISP,\1\2"[random.below(11)] : random.below(256));
    for (std::string_view rest = bytes;;) {
      const auto package = rtde_cut(rest);
      if (!package || !*package) break;
      const std::string_view payload = (*package)->payload;
      static_cast<void>(rtde_accepted(payload));
      static_cast<void>(rtde_version(payload));
      static_cast<void>(rtde_text(2, payload));
      if (const auto recipe = rtde_recipe(2, payload, "a,b")) {
        std::array<double, 12> values{};
        static_cast<void>(rtde_values(*recipe, payload, values));
      }
      rest.remove_prefix((*package)->bytes);
    }
  }
  SUCCEED();
}

}  // namespace firstlook
