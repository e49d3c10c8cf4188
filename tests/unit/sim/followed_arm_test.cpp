/// The private channel of a simulated robot, and the true body that follows it.
#include "hal/sim/followed_arm.hpp"

#include <catch2/catch.hpp>
#include <thread>

#include "hal/sim/ur_controller/simulated_ur.hpp"
#include "hal/sim/ur_controller/truth_reader.hpp"
#include "hal/sim/ur_controller/truth_session.hpp"

namespace firstlook::sim {
namespace {

/// Sends what it was given to whoever connects, and keeps what comes back.
class Server {
 public:
  Server() { REQUIRE(listener_.listen(0)); }
  ~Server() {
    if (thread_.joinable()) thread_.join();
  }
  [[nodiscard]] std::uint16_t port() const { return listener_.port(); }
  void send(std::string bytes) {
    thread_ = std::thread([this, bytes = std::move(bytes)] {
      for (int i = 0; i < 4000 && stream_.state() != TcpStream::State::kOpen; ++i) {
        stream_ = listener_.accept();
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
      }
      stream_.send(bytes);
    });
  }
  std::string heard() {
    thread_.join();
    std::array<char, 16> room;
    for (int i = 0; i < 4000; ++i) {
      const std::string_view came = stream_.receive(room);
      if (!came.empty()) return std::string(came);
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return {};
  }

 private:
  TcpListener listener_;
  TcpStream stream_;
  std::thread thread_;
};

struct Wall final : BodyWatcher {
  bool body_moved(Instant, const JointVector&, const JointVector& to_rad) override {
    ++calls;
    return to_rad[0] > 0.3;
  }
  void body_led() override {}
  int calls = 0;
};

}  // namespace

TEST_CASE("cameras follow the true joints and kinematics of a robot in another process", "[sim]") {
  ur::SimulatedUrOptions options;
  options.running = true;
  options.start_rad = JointVector{0.1, -1.2, 1.3, -1.4, 1.5, 0.6};
  ur::SimulatedUr robot(*ur::identify_controller("ur5e", 3, ""), options);
  ur::Session& session = robot.open(ur::Port::kTruth);
  JointVector target_rad = *options.start_rad;
  target_rad[0] += 0.4;
  robot.controller().motion().movej(target_rad, 1.0, 1.4, 0);
  for (int i = 0; i < 1000; ++i) robot.step();
  Server server;
  server.send(session.output());
  auto channel = ur::connect_private_channel("127.0.0.1", server.port());
  REQUIRE(channel);
  CHECK_FALSE(channel->lockstep);
  ur::TcpTruth reader;
  REQUIRE(reader.connect(std::move(channel->stream)));

  const ArmModel& truth = robot.controller().identity().arm;
  ArmModel model = *find_arm_model("ur5e");
  CHECK(std::abs(reader.true_dh()[1].a_m - model.dh[1].a_m) > 1e-6);
  model.dh = reader.true_dh();
  Wall wall;
  FollowedArm arm(reader, model, 1, {0, 0}, &wall);
  for (int i = 0; i < 200 && arm.known_until() < Instant{1}; ++i) {
    arm.advance(Instant{seconds(0.01 * i).ns});
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  const Instant end = arm.known_until();
  CHECK((arm.true_joints(end) - target_rad).max_abs() < 1e-6);  // it still swings a little
  CHECK(wall.calls > 200);
  const auto flange = arm.true_flange(target_rad).pose();
  CHECK((flange.matrix() - forward(truth, target_rad).flange().pose().matrix()).norm() < 1e-12);
  CHECK(server.heard() == "T");  // it touched once, and said so once
}

TEST_CASE("a touch that is felt stops the robot protectively", "[sim]") {
  ur::SimulatedUrOptions options;
  options.running = true;
  ur::SimulatedUr robot(*ur::identify_controller("ur5", 0, ""), options);
  ur::Session& session = robot.open(ur::Port::kTruth);
  session.receive("T");
  CHECK(robot.controller().state().safety_mode == ur::SafetyMode::kProtectiveStop);
}

TEST_CASE("a hand leads the robot by the private channel: cut anywhere, and told with the true joints", "[sim]") {
  ur::SimulatedUrOptions options;
  options.running = true;
  ur::SimulatedUr robot(*ur::identify_controller("ur5", 0, ""), options);
  ur::Session& session = robot.open(ur::Port::kTruth);
  const JointVector there = robot.controller().motion().position_rad() * 0.9;
  const auto led = [&] {  // what the newest sample says
    robot.step();
    const std::string& told = session.output();
    return told.at(told.size() - 1) == 1;
  };
  CHECK_FALSE(led());
  const std::string message = ur::lead_message(there, 0.8, 2);
  REQUIRE(message.size() == ur::kLeadBytes);
  session.receive(message.substr(0, 20));
  session.receive(message.substr(20));
  for (int i = 0; i < 400; ++i) CHECK(led());
  CHECK((robot.controller().motion().position_rad() - there).max_abs() < 1e-12);
  robot.controller().motion().movej(there * 0.95, 1.0, 1.4, 0);
  CHECK_FALSE(led());
  session.receive("?");
  CHECK(session.over());
}

namespace {

/// Joints as a test says, and what a hand asked for.
struct Feed final : TrueJointFeed {
  std::array<DhRow, kJointsMax> dh{};
  std::vector<Sample> samples;
  std::vector<JointVector> leads;
  int touches = 0;
  [[nodiscard]] const std::array<DhRow, kJointsMax>& true_dh() const override { return dh; }
  [[nodiscard]] std::optional<Sample> next() override {
    if (samples.empty()) return std::nullopt;
    const Sample sample = samples.front();
    samples.erase(samples.begin());
    return sample;
  }
  void touched() override { ++touches; }
  void lead(const JointVector& to_rad, double, double) override { leads.push_back(to_rad); }
};

}  // namespace

TEST_CASE("what a hand does to a followed arm is not the program's doing, and one that moves is not taken", "[sim]") {
  const ArmModel model = *find_arm_model("ur5");
  Feed feed;
  struct Watcher final : BodyWatcher {
    bool body_moved(Instant, const JointVector&, const JointVector&) override {
      ++moved;
      return true;
    }
    void body_led() override { ++led; }
    int moved = 0, led = 0;
  } watcher;
  FollowedArm arm(feed, model, 1, {}, &watcher);
  const JointVector here = default_start(model);
  JointVector there = here;
  there[0] += 0.5;
  const auto at = [](double s) { return Instant{seconds(s).ns}; };
  CHECK_FALSE(arm.lead(there, 0.8, 2, at(0)));
  feed.samples = {{0.008, here}, {0.016, here * 0.99}};
  CHECK_FALSE(arm.lead(there, 0.8, 2, at(0.016)));
  feed.samples = {{0.024, here}, {0.032, here}};
  const auto takes_s = arm.lead(there, 0.8, 2, at(0.032));
  REQUIRE(takes_s);
  CHECK(*takes_s == Approx(0.5 / 0.8 + 0.8 / 2).margin(1e-6));
  REQUIRE(feed.leads.size() == 1);
  CHECK(feed.leads[0] == there);
  CHECK(watcher.moved == 4);
  CHECK(feed.touches == 1);
  feed.samples = {{0.040, here, true}, {0.048, there, true}, {0.056, there, false}};
  arm.advance(at(0.056));
  CHECK(watcher.led == 2);
  CHECK(watcher.moved == 5);
  CHECK(feed.touches == 2);  // the program's motion is judged afresh
}

TEST_CASE("who is no such channel is refused", "[sim]") {
  Server server;
  server.send(std::string(400, 'x'));
  const auto channel = ur::connect_private_channel("127.0.0.1", server.port());
  REQUIRE_FALSE(channel);
  CHECK(channel.error().fault == Fault::kDeviceMissing);
}

}  // namespace firstlook::sim
