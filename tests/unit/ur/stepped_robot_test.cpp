/// The driver on a controller whose time its client keeps: byte streams in turns, in this process and over TCP.
#include <catch2/catch.hpp>
#include <thread>

#include "app/wiring/stepped_network.hpp"
#include "hal/sim/ur_controller/lockstep.hpp"
#include "hal/sim/ur_controller/stepped_service.hpp"
#include "hal/sim/ur_controller/truth_reader.hpp"
#include "hal/ur/network_robot.hpp"

namespace firstlook {
namespace {

using sim::ControllerAction;
using sim::ur::SteppedLinks;

sim::ControllerScript script(std::initializer_list<sim::ControllerEvent> events) {
  sim::ControllerScript all;
  for (const sim::ControllerEvent& event : events) all.push_back(event);
  return all;
}
constexpr sim::ControllerEvent kPlay{Instant{milliseconds(600).ns}, ControllerAction::kPlay};

/// A controller, the turns to it, and a driver.
struct Stepped {
  explicit Stepped(const char* model, const sim::ControllerScript& happens = script({kPlay}))
      : controller(*sim::ur::identify_controller(model, 7, ""),
                   {{{"external_control.urp", "", {"127.0.0.1", 50002}}}, true, {}}),
        service(controller, sim::ur::timetable_of(happens)) {
    REQUIRE(truth.connect());
    SteppedClock clock(links);
    ur::NetworkRobotOptions options;
    options.robot.model = model;
    auto connected = ur::NetworkRobot::connect(network, clock, options, nullptr);
    REQUIRE(connected);
    robot = std::move(*connected);
    links.begin();
    while (truth.next()) continue;
    arm.emplace(links, robot->robot());
  }
  void run_to(double s) {
    while (now < Instant{seconds(s).ns}) {
      now = now + milliseconds(2);
      while (const auto state = arm->poll(now)) last = *state;
      while (const auto key = robot->robot().pendant().poll(now)) keys.push_back(key->action);
      while (const auto sample = truth.next()) true_rad = sample->joints_rad;
    }
  }

  sim::ur::SimulatedUr controller;
  sim::ur::SteppedService service;
  std::vector<std::string> turns;
  SteppedLinks links{[this](std::string_view asked, std::string& told) {
    const Status done = service.turn(asked, told);
    turns.push_back(told);
    return done;
  }};
  sim::ur::SteppedTruth truth{links};
  SteppedNetwork network{links, 50002, 50001};
  std::unique_ptr<ur::NetworkRobot> robot;
  std::optional<SteppedArm> arm;
  Instant now{};
  hal::ArmState last;
  JointVector true_rad;
  std::vector<hal::OperatorAction> keys;
};

}  // namespace

TEST_CASE("identified, played, moved and paused in the time of the client", "[ur]") {
  const std::string model = GENERATE("ur5", "ur10e");
  Stepped stepped(model.c_str(), script({kPlay, {Instant{milliseconds(1500).ns}, ControllerAction::kPause}}));
  CHECK(stepped.robot->identity().arm_name() == model);
  stepped.run_to(1);
  REQUIRE(stepped.keys == std::vector{hal::OperatorAction::kPlay});
  REQUIRE(stepped.last.program_running);
  hal::Segment segment{1, stepped.last.position_rad, 1.0, 1.4};
  segment.target_rad[0] += 2;
  REQUIRE(stepped.arm->move(segment, stepped.now));
  stepped.run_to(1.45);
  CHECK(stepped.last.moving);
  CHECK((stepped.last.position_rad - stepped.true_rad).max_abs() < 0.01);  // reports and truth are of the same time
  CHECK(stepped.last.stamp <= stepped.now);
  CHECK(stepped.now - stepped.last.stamp < milliseconds(8));
  stepped.run_to(3);
  CHECK(stepped.keys.back() == hal::OperatorAction::kPause);
  CHECK_FALSE(stepped.last.moving);
  CHECK(stepped.last.velocity_rad_s.max_abs() < 1e-9);
}

TEST_CASE("the same turns get the same answers", "[ur]") {
  const auto told = [] {
    Stepped stepped("ur5e");
    stepped.run_to(2);
    return stepped.turns;
  };
  CHECK(told() == told());
}

TEST_CASE("a cable that is out carries nothing, but the truth of the simulation", "[ur]") {
  Stepped stepped("ur5", script({kPlay, {Instant{seconds(1).ns}, ControllerAction::kLinkLost}}));
  stepped.run_to(1);
  CHECK(stepped.robot->robot().rtde().streaming());
  const auto heard = stepped.robot->robot().counters().states;
  stepped.true_rad = {};
  stepped.run_to(2);
  CHECK_FALSE(stepped.robot->robot().rtde().streaming());
  CHECK(stepped.robot->robot().counters().states <= heard + 1);
  CHECK(stepped.true_rad.size() == 6);
}

TEST_CASE("what is no turn is refused", "[ur]") {
  Stepped stepped("ur5");
  std::string told;
  for (const std::string& asked : {std::string(), std::string("A"), std::string("Q"), std::string("S\xc8"),
                                   std::string("D\x01\0\x16", 4), std::string("A\xff\xff\xff\xff\xff\xff\xff\xff")}) {
    INFO(asked);
    const Status turn = stepped.service.turn(asked, told);
    REQUIRE_FALSE(turn);
    CHECK(turn.error().fault == Fault::kDataMalformed);
  }
  REQUIRE(stepped.service.turn(std::string("A\0\0\0\0\0\0\0\0", 9), told));
}

TEST_CASE("turns over TCP are cut out of the stream whole", "[ur]") {
  TcpListener listener;
  REQUIRE(listener.listen(0));
  std::thread peer([&] {
    TcpStream stream;
    while (stream.state() != TcpStream::State::kOpen) stream = listener.accept();
    std::string came;
    for (int answered = 0; answered < 2;) {
      stream.wait(milliseconds(1000));
      std::array<char, 7> room;
      came += stream.receive(room);
      const auto asked = sim::ur::first_turn(came);
      if (!asked || !*asked) continue;
      std::string out;
      const std::size_t at = sim::ur::open_turn(out);
      out += "re: " + std::string(**asked);
      sim::ur::close_turn(out, at);
      came.erase(0, 4 + (*asked)->size());
      stream.send(out.substr(0, 5));
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
      stream.send(out.substr(5));
      ++answered;
    }
  });
  TcpStream stream;
  stream.dial({0x7f000001, listener.port()});
  sim::ur::LockstepClient client(std::move(stream));
  std::string told;
  CHECK(client.turn("one", told));
  CHECK(client.turn(std::string(3000, 'x'), told));
  CHECK(told == "re: onere: " + std::string(3000, 'x'));
  peer.join();
  const Status gone = client.turn("three", told);
  REQUIRE_FALSE(gone);
  CHECK(gone.error().fault == Fault::kLinkLost);
  CHECK_FALSE(sim::ur::first_turn(std::string("\x7f\xff\xff\xff", 4)));
}

}  // namespace firstlook
