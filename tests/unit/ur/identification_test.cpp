#include "hal/ur/identification.hpp"

#include "hal/ur/network_robot.hpp"
#include "platform/core/random.hpp"
#include "tests/support/sanitized_builds.hpp"
#include "tests/support/ur_memory_network.hpp"
#include "tests/support/ur_robot.hpp"
#include "tests/support/ur_wire.hpp"

namespace firstlook {
using namespace ur;
using Catch::Matchers::Contains;

namespace {

struct Site {
  explicit Site(const char* model, std::uint64_t seed = 0, bool running = true)
      : robot(*sim::ur::identify_controller(model, seed, "20195300001"), {{}, running}), network(robot) {}
  Result<RobotIdentity> identify() {
    Identification identification(network);
    for (double t = 0; t < 20; t += 0.005) {
      const Instant now{seconds(t).ns};
      network.advance(now);
      if (const auto found = identification.poll(now)) return *found;
    }
    FAIL("it waits for ever");
    return {};
  }
  sim::ur::SimulatedUr robot;
  test::UrMemoryNetwork network;
};

}  // namespace

TEST_CASE("a controller is identified, with its factory correction", "[ur]") {
  const std::string model = GENERATE("ur3", "ur5", "ur10", "ur3e", "ur5e", "ur10e");
  Site site(model.c_str(), 7);
  const auto found = site.identify();
  REQUIRE(found);
  CHECK(found->arm_name() == model);
  CHECK(found->serial_number() == "20195300001");
  CHECK(found->version.major == (model.ends_with('e') ? 5 : 3));
  CHECK(found->robot_mode == 7);
  CHECK(found->safety_mode == 1);
  const sim::ur::ControllerIdentity& truth = site.robot.controller().identity();
  for (std::size_t j = 0; j < 6; ++j) {
    CHECK(found->kinematics.checksums[j] == truth.kinematics_checksums[j]);
    CHECK(found->kinematics.rows[j].theta_rad == truth.arm.dh[j].theta_offset_rad);
    CHECK(found->kinematics.rows[j].d_m == truth.arm.dh[j].d_m);
    CHECK(found->kinematics.rows[j].a_m == truth.arm.dh[j].a_m);
    CHECK(found->kinematics.rows[j].alpha_rad == truth.arm.dh[j].alpha_rad);
  }
  CHECK(check_robot(*found, {model}));
  CHECK(site.network.links_open() == 0);
}

TEST_CASE("a tool that is set is read", "[ur]") {
  Site site("ur5");
  site.robot.controller().set_tcp_offset({0.01, 0.02, 0.15, 0, 0.1, 0});
  const auto found = site.identify();
  REQUIRE(found);
  CHECK(found->tcp_offset == std::array<double, 6>{0.01, 0.02, 0.15, 0, 0.1, 0});
}

TEST_CASE("another robot than the configured one is refused, by both names", "[ur]") {
  Site site("ur10e");
  const auto found = site.identify();
  REQUIRE(found);
  const Status status = check_robot(*found, {"ur5"});
  REQUIRE_FALSE(status);
  CHECK(status.error().fault == Fault::kConfigBadValue);
  CHECK_THAT(std::string(status.error().detail()), Contains("arm.model is ur5") && Contains("moves a ur10e"));
  RobotIdentity unknown = *found;
  unknown.robot_type = 99;
  unknown.arm = {};
  CHECK_FALSE(check_robot(unknown, {"ur10e"}));
}

TEST_CASE("a stopped controller and one in recovery are refused", "[ur]") {
  Site site("ur5");
  site.robot.controller().protective_stop("a test");
  auto found = site.identify();
  REQUIRE(found);
  const Status stopped = check_robot(*found, {"ur5"});
  REQUIRE_FALSE(stopped);
  CHECK(stopped.error().fault == Fault::kProtectiveStop);
  found->safety_mode = 4;
  const Status recovery = check_robot(*found, {"ur5"});
  REQUIRE_FALSE(recovery);
  CHECK_THAT(std::string(recovery.error().detail()), Contains("recovery") && Contains("joint limits"));
  found->safety_mode = 2;
  CHECK(check_robot(*found, {"ur5"}));
  found->kinematics.rows[3].a_m = std::nan("");
  CHECK_FALSE(check_robot(*found, {"ur5"}));
}

TEST_CASE("a TCP that is not the configured one is refused, with both and what to do", "[ur]") {
  Site site("ur5e");
  site.robot.controller().set_tcp_offset({0, 0, 0.15, 0, 0, 3.1});
  const auto found = site.identify();
  REQUIRE(found);
  const auto check = [&](std::array<double, 6> tcp) { return check_robot(*found, {"ur5e", tcp}); };
  CHECK(check_robot(*found, {"ur5e"}));
  CHECK(check({0, 0, 0.15, 0, 0, 3.1}));
  CHECK(check({0, 0, 0.15005, 0, 0, 3.1 - 2 * M_PI}));  // the same turn, the other way round
  for (const std::array<double, 6> other : {std::array<double, 6>{0, 0, 0.16, 0, 0, 3.1}, {0, 0, 0.15, 0, 0, 0}}) {
    const Status refused = check(other);
    REQUIRE_FALSE(refused);
    CHECK(refused.error().fault == Fault::kConfigBadValue);
    CHECK_THAT(std::string(refused.error().detail()),
               Contains("robot.tcp_offset") && Contains("0.1500") && Contains("Installation"));
  }
}

namespace {

Status connects(Site& site, const NetworkRobotOptions& options) {
  test::UrMemoryNetwork& network = site.network;
  struct NetworkClock final : Clock {
    explicit NetworkClock(test::UrMemoryNetwork& net) : network(net) {}
    [[nodiscard]] Instant now() const override { return at; }
    void sleep_until(Instant until) override { network.advance(at = until); }
    void wake() noexcept override {}
    [[nodiscard]] bool is_virtual() const override { return true; }
    test::UrMemoryNetwork& network;
    Instant at{};
  } clock(network);
  const auto robot = NetworkRobot::connect(network, clock, options, nullptr);
  return robot ? Status{} : std::unexpected(robot.error());
}

}  // namespace

TEST_CASE("a mounting that is not the configured one is refused where the controller tells it", "[ur]") {
  const double tilt_rad = GENERATE(0.0, 0.02, 0.3, M_PI / 2, M_PI);
  Site site("ur5e");
  site.robot.controller().set_gravity({0, 9.82 * std::sin(tilt_rad), 9.82 * std::cos(tilt_rad)});
  NetworkRobotOptions options;
  options.robot.model = "ur5e";
  for (const bool upright : {true, false}) {
    options.upright = upright;
    const Status connected = connects(site, options);
    INFO(tilt_rad << (upright ? " upright" : " tilted"));
    // Which sign a robot sends is not known: one that hangs cannot be told from one that stands.
    const bool plumb = std::abs(std::sin(tilt_rad)) < 0.05;
    CHECK(connected.has_value() == (plumb || !upright));
    if (connected) continue;
    CHECK(connected.error().fault == Fault::kConfigBadValue);
    CHECK_THAT(std::string(connected.error().detail()), Contains("arm.mounting") && Contains("Mounting"));
  }
}

TEST_CASE("a CB3 does not tell its mounting, and is taken as configured", "[ur]") {
  Site site("ur5");
  site.robot.controller().set_gravity({0, 9.82, 0});
  NetworkRobotOptions options;
  CHECK(connects(site, options));
  options.payload_kg = 1;
  CHECK_FALSE(connects(site, options));
}

TEST_CASE("in remote control nobody's Play is a person's: refused where the pendant is to start", "[ur]") {
  Site site("ur5e");
  const bool remote = GENERATE(false, true);
  site.robot.set_remote_control(remote);
  const auto found = site.identify();
  REQUIRE(found);
  CHECK(found->remote_control == remote);
  CHECK(check_robot(*found, {"ur5e"}));
  const Status status = check_robot(*found, {"ur5e", {}, true});
  CHECK(status.has_value() == !remote);
  if (!status) CHECK_THAT(std::string(status.error().detail()), Contains("local control") && Contains("start_source"));
}

TEST_CASE("nobody there is said within the limit", "[ur]") {
  Site site("ur5");
  site.network.plug(false);
  const auto found = site.identify();
  REQUIRE_FALSE(found);
  CHECK(found.error().fault == Fault::kDeviceMissing);
  CHECK_THAT(std::string(found.error().detail()), Contains("30001"));
}

TEST_CASE("packets of the primary interface: cut, oversized, out of step", "[ur]") {
  using test::big_endian;
  CHECK_FALSE(*primary_cut(""));
  CHECK_FALSE(*primary_cut("\0\0\0\6\24"));
  CHECK_FALSE(primary_cut(std::string("\0\0\0\4\24", 5)));
  CHECK_FALSE(primary_cut(std::string("\0\2\0\0\24", 5)));
  const std::string stream = big_endian(std::uint64_t{7}, 4) + "\24ab" + "more";
  const auto packet = primary_cut(stream);
  REQUIRE(packet);
  REQUIRE(*packet);
  CHECK((*packet)->content == "ab");
  CHECK((*packet)->bytes == 7);
  CHECK_FALSE(version_message(**packet));
  // A sub-package that is larger than what holds it.
  CHECK_FALSE(primary_state({kPrimaryState, std::string_view("\0\0\0\77\5abc", 8), 13}));
  // Known ones that are too short say nothing.
  const auto state = primary_state({kPrimaryState, std::string_view("\0\0\0\10\5abc", 8), 13});
  REQUIRE(state);
  CHECK_FALSE(state->kinematics);
}

TEST_CASE("the primary codec bears random bytes", "[ur]") {
  Random random(5);
  for (int trial = 0; trial < test::trials(20'000); ++trial) {
    std::string bytes(static_cast<std::size_t>(random.below(60)), '\0');
    for (char& byte : bytes) byte = static_cast<char>(random.below(3) == 0 ? random.below(256) : random.below(20));
    if (bytes.size() > 5) bytes[0] = bytes[1] = bytes[2] = 0;
    for (std::string_view rest = bytes;;) {
      const auto packet = primary_cut(rest);
      if (!packet || !*packet) break;
      static_cast<void>(version_message(**packet));
      static_cast<void>(primary_state(**packet));
      static_cast<void>(primary_state({kPrimaryState, (*packet)->content, (*packet)->bytes}));
      static_cast<void>(version_message({kPrimaryMessage, (*packet)->content, (*packet)->bytes}));
      rest.remove_prefix((*packet)->bytes);
    }
  }
  SUCCEED();
}

}  // namespace firstlook
