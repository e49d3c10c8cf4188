/// The panel against a simulated CiA 401 module on a simulated bus, in virtual time.
#include "hal/can/can_panel.hpp"

#include <catch2/catch.hpp>
#include <fstream>
#include <sstream>
#include <string>

#include "hal/can/can_socket.hpp"
#include "platform/core/random.hpp"
#include "tests/support/simulated_can_kernel.hpp"

using namespace firstlook;
using namespace firstlook::can;
using hal::DeviceState;
using hal::OperatorAction;

namespace {

std::string sheet() {
  std::ifstream file(std::string(FIRSTLOOK_SOURCE_DIR) + "/hal/can/firstlook_panel.eds");
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

constexpr unsigned kStart = 1, kStop = 2, kConfirm = 4, kEnabling = 8;
constexpr unsigned kRested = kStop;  // the stop contact opens when pressed
constexpr unsigned kRed = 1, kAmber = 2, kGreen = 4, kBuzzer = 8;

/// Panel, bus and module; time passes in steps of a millisecond, the panel is asked when it is due.
struct Rig {
  explicit Rig(CanPanelOptions panel_options = {}, unsigned number = 10, const std::string& eds = sheet())
      : node(eds, number), options(panel_options), panel(kernel, options) {
    kernel.attach(node);
    node.set_inputs(kRested);
    node.power(true);
    for (; now < Instant{} + milliseconds(100); now = now + milliseconds(1)) kernel.turn(now);  // it was on before us
  }

  void run(double for_s) {
    for (const Instant end = now + seconds(for_s); now < end; now = now + milliseconds(1)) {
      kernel.turn(now);
      if (panel.next_due() > now) continue;
      if (const auto event = panel.poll(now)) events.push_back(*event);
    }
  }
  void press(unsigned inputs, double for_s = 0.2) {
    node.set_inputs(inputs);
    run(for_s);
    node.set_inputs(kRested);
    run(for_s);
  }
  std::vector<OperatorAction> taken() {
    std::vector<OperatorAction> actions;
    for (const auto& event : events) actions.push_back(event.action);
    events.clear();
    return actions;
  }
  [[nodiscard]] std::string detail() const { return std::string(panel.report(now).detail.view()); }
  [[nodiscard]] std::string remedy() const { return std::string(panel.report(now).remedy.view()); }
  [[nodiscard]] DeviceState state() const { return panel.report(now).state; }
  [[nodiscard]] double number(std::string_view name) const {
    for (const auto& n : panel.report(now).numbers) {
      if (n.name == name) return n.value;
    }
    FAIL("no number " << name);
    return 0;
  }

  test::SimulatedCanKernel kernel;
  test::SimulatedIoNode node;
  CanPanelOptions options;
  CanPanel panel;
  Instant now{};
  std::vector<hal::OperatorEvent> events;
};

using Actions = std::vector<OperatorAction>;

}  // namespace

TEST_CASE("the module is reset, identified, configured and started", "[can][panel]") {
  Rig rig;
  CHECK(rig.state() == DeviceState::kStarting);
  rig.run(1);
  CHECK(rig.state() == DeviceState::kReady);
  CHECK(rig.detail() == "CiA 401, vendor 00000000h, product 00000000h");
  CHECK(rig.remedy().empty());
  CHECK(rig.node.operational());
  CHECK(rig.node.resets() == 1);
  CHECK(rig.node.value({0x1017, 0}) == 100);
  CHECK(rig.node.value({0x1016, 1}) == (127U << 16 | 500U));
  CHECK(rig.node.value({0x1800, 1}) == 0x4000018A);
  CHECK(rig.node.value({0x1800, 2}) == 255);
  CHECK(rig.node.value({0x1400, 1}) == 0x4000020A);
  CHECK(rig.node.value({0x6207, 1}) == kRed);
  CHECK(rig.number("losses") == 0);
  CHECK(rig.number("sdo_aborts") == 0);
  CHECK(rig.number("sdo_timeouts") == 0);
  CHECK(rig.taken().empty());
  // What the driver needs is what the electronic data sheet lists.
  const std::string text = sheet();
  for (const auto& [index, sub] : rig.node.touched()) {
    INFO(fmt::format("{:04X}sub{}", index, sub));
    CHECK((text.find(fmt::format("[{:04X}sub{}]", index, sub)) != std::string::npos ||
           text.find(fmt::format("[{:04X}]", index)) != std::string::npos));
  }
}

TEST_CASE("buttons give one event for each press, stamped with its begin", "[can][panel]") {
  Rig rig;
  rig.run(1);
  const Instant begin = rig.now;
  rig.press(kRested | kStart);
  REQUIRE(rig.events.size() == 1);
  CHECK(rig.events[0].action == OperatorAction::kPlay);
  CHECK(rig.events[0].stamp >= begin);
  CHECK(rig.events[0].stamp - begin <= milliseconds(6));  // one turn of the panel
  CHECK(rig.taken() == Actions{OperatorAction::kPlay});
  rig.press(kRested | kConfirm);
  CHECK(rig.taken() == Actions{OperatorAction::kConfirm});
  rig.press(0);
  CHECK(rig.taken() == Actions{OperatorAction::kStop});
  rig.press(kRested | kEnabling);
  CHECK(rig.taken().empty());
  rig.node.set_inputs(kRested | kEnabling);
  rig.run(0.1);
  CHECK(rig.panel.enabling());
}

TEST_CASE("a bouncing contact is one press, a spike is none", "[can][panel]") {
  Rig rig;
  rig.run(1);
  const Instant begin = rig.now;
  for (int i = 0; i < 5; ++i) {  // 6 ms down, 6 ms up
    rig.node.set_inputs(kRested | kStart);
    rig.run(0.006);
    rig.node.set_inputs(kRested);
    rig.run(0.006);
  }
  rig.press(kRested | kStart);
  REQUIRE(rig.events.size() == 1);
  CHECK(rig.events[0].stamp - begin >= milliseconds(54));  // the contact that lasted
  rig.taken();
  rig.node.set_inputs(kRested | kStart);
  rig.run(0.010);
  rig.node.set_inputs(kRested);
  rig.run(0.3);
  CHECK(rig.taken().empty());
}

TEST_CASE("stop counts at once, and beats a start that still bounces", "[can][panel]") {
  Rig rig;
  rig.run(1);
  rig.node.set_inputs(kRested | kStart);
  rig.run(0.012);
  rig.node.set_inputs(kStart);  // start and stop together
  rig.run(0.008);
  CHECK(rig.taken() == Actions{OperatorAction::kStop});
  rig.run(0.5);
  rig.node.set_inputs(kRested);
  rig.run(0.5);
  CHECK(rig.taken().empty());
}

TEST_CASE("a button that is held while the panel comes up counts only after a release", "[can][panel]") {
  Rig rig;
  rig.node.set_inputs(kRested | kStart);
  rig.run(2);
  CHECK(rig.state() == DeviceState::kReady);
  CHECK(rig.taken().empty());
  rig.node.set_inputs(kRested);
  rig.run(0.2);
  CHECK(rig.taken().empty());
  rig.press(kRested | kStart);
  CHECK(rig.taken() == Actions{OperatorAction::kPlay});
}

TEST_CASE("a stop that is pressed, or whose wire broke, counts when the panel comes up", "[can][panel]") {
  Rig rig;
  rig.node.set_inputs(0);
  rig.run(1);
  CHECK(rig.taken() == Actions{OperatorAction::kStop});
  CHECK(rig.number("stop_pressed") == 1);
  CHECK(rig.detail().find("stop button is pressed, or the wire broken") != std::string::npos);
}

TEST_CASE("the light shows what it is told, and the buzzer sounds with red", "[can][panel]") {
  Rig rig;
  rig.panel.light(hal::Light::kGreen);
  rig.run(1);
  CHECK(rig.node.lamps() == kGreen);  // told before the module was there
  rig.panel.light(hal::Light::kAmber);
  rig.run(0.05);
  CHECK(rig.node.lamps() == kAmber);
  rig.panel.light(hal::Light::kRed);
  rig.run(0.05);
  CHECK(rig.node.lamps() == (kRed | kBuzzer));
  rig.run(1);
  CHECK(rig.node.lamps() == kRed);
  rig.panel.light(hal::Light::kOff);
  rig.run(0.05);
  CHECK(rig.node.lamps() == 0);
}

TEST_CASE("the module shows red by itself when it does not hear us", "[can][panel]") {
  Rig rig;
  rig.panel.light(hal::Light::kGreen);
  rig.run(1);
  for (int i = 0; i < 700; ++i) {  // nobody polls the panel
    rig.now = rig.now + milliseconds(1);
    rig.kernel.turn(rig.now);
  }
  CHECK(rig.node.misses_master());
  CHECK(rig.node.lamps() == kRed);
  rig.run(2);  // we are back
  CHECK(rig.state() == DeviceState::kReady);
  CHECK(rig.node.lamps() == kGreen);
}

TEST_CASE("a module that falls silent is lost within half a second, and comes back", "[can][panel]") {
  Rig rig;
  rig.panel.light(hal::Light::kGreen);
  rig.run(1);
  rig.node.power(false);
  rig.run(0.5);
  CHECK(rig.state() == DeviceState::kLost);
  CHECK(rig.detail().find("no heartbeat came any more") != std::string::npos);
  CHECK(rig.remedy().find("power") != std::string::npos);
  CHECK(rig.taken() == Actions{OperatorAction::kLost});  // nobody pressed anything
  CHECK(rig.number("losses") == 1);
  rig.run(20);
  CHECK(rig.state() == DeviceState::kLost);
  CHECK(rig.taken().empty());
  rig.node.set_inputs(kRested | kStart);  // held while it comes back
  rig.node.power(true);
  rig.run(1);
  CHECK(rig.state() == DeviceState::kReady);
  CHECK(rig.node.lamps() == kGreen);
  CHECK(rig.taken().empty());
}

TEST_CASE("a cable that is broken and mended behind a running module", "[can][panel]") {
  Rig rig;
  rig.run(1);
  rig.node.mute = true;
  rig.run(5);
  CHECK(rig.state() == DeviceState::kLost);
  rig.node.mute = false;
  rig.run(4);
  CHECK(rig.state() == DeviceState::kReady);
  CHECK(rig.taken() == Actions{OperatorAction::kLost});
}

TEST_CASE("a module that restarts, or leaves its state, is configured again and its presses are not invented",
          "[can][panel]") {
  Rig rig;
  rig.run(1);
  SECTION("restarts") {
    rig.node.press_reset();
    rig.run(1);
    CHECK(rig.number("node_restarts") == 1);
  }
  SECTION("leaves its state") {
    rig.node.enter_pre_operational();
    rig.run(1);
  }
  CHECK(rig.state() == DeviceState::kReady);
  CHECK(rig.number("losses") == 1);
  CHECK(rig.node.value({0x1017, 0}) == 100);
  CHECK(rig.taken() == Actions{OperatorAction::kLost});
}

TEST_CASE("an interface that goes down or away is told, counted, and used again", "[can][panel]") {
  Rig rig;
  rig.run(1);
  SECTION("down") {
    rig.kernel.go_down();
    rig.run(2.5);
    CHECK(rig.detail() == "the interface went away; the interface can0 is down");
    CHECK(rig.remedy().starts_with("ip link set can0 up type can bitrate"));
    rig.kernel.up = true;
  }
  SECTION("unplugged") {
    rig.kernel.unplug();
    rig.run(2.5);
    CHECK(rig.detail() == "the interface went away; there is no network interface can0");
    rig.kernel.present = true;
  }
  CHECK(rig.number("interface_losses") == 1);
  CHECK(rig.number("losses") == 1);
  CHECK(rig.kernel.open_sockets() == 0);
  CHECK(rig.taken() == Actions{OperatorAction::kLost});
  rig.run(2.5);
  CHECK(rig.state() == DeviceState::kReady);
  CHECK(rig.kernel.open_sockets() == 1);
}

TEST_CASE("a computer without CAN, and one without the interface, say so", "[can][panel]") {
  Rig rig;
  SECTION("no CAN") {
    rig.kernel.has_can = false;
    rig.run(0.1);
    CHECK(rig.detail() == "this kernel has no CAN sockets");
    CHECK(rig.remedy().find("modprobe") != std::string::npos);
  }
  SECTION("no interface") {
    rig.kernel.present = false;
    rig.run(0.1);
    CHECK(rig.detail() == "there is no network interface can0");
    CHECK(rig.remedy().find("panel.can_interface") != std::string::npos);
  }
  CHECK(rig.state() == DeviceState::kMissing);
}

TEST_CASE("bus-off is told, and survived when the controller restarts", "[can][panel]") {
  Rig rig;
  rig.run(1);
  rig.node.mute = true;
  rig.kernel.deliver_error(CAN_ERR_BUSOFF);
  rig.run(3);
  CHECK(rig.state() == DeviceState::kLost);
  CHECK(rig.detail() == "the bus broke down; can0 is off the bus after too many errors");
  CHECK(rig.remedy().find("restart") != std::string::npos);
  CHECK(rig.number("bus_off") == 1);
  rig.node.mute = false;
  SECTION("told") {
    rig.kernel.deliver_error(CAN_ERR_RESTARTED);
    rig.run(1);
  }
  SECTION("untold") { rig.run(4); }
  CHECK(rig.state() == DeviceState::kReady);
  CHECK(rig.taken() == Actions{OperatorAction::kLost});
}

TEST_CASE("a silent bus tells the bit rate from a wrong number", "[can][panel]") {
  SECTION("another bit rate") {
    Rig rig;
    rig.node.mute = true;
    rig.run(0.1);
    rig.kernel.deliver_error(CAN_ERR_CRTL, CAN_ERR_CRTL_TX_PASSIVE);
    rig.run(5);
    CHECK(rig.state() == DeviceState::kMissing);
    CHECK(rig.detail() == "nobody on can0 acknowledges our frames");
    CHECK(rig.remedy().find("same bit rate") != std::string::npos);
    CHECK(rig.number("error_passive") == 1);
  }
  SECTION("a queue that fills up, on a controller that reports no errors") {
    Rig rig;
    rig.kernel.full = true;
    rig.run(5);
    CHECK(rig.detail() == "nobody on can0 acknowledges our frames");
    rig.kernel.full = false;
    rig.run(3);
    CHECK(rig.state() == DeviceState::kReady);
  }
  SECTION("another node's number") {
    Rig rig({}, 11);
    rig.run(5);
    rig.node.power(true);
    rig.run(1);
    CHECK(rig.state() == DeviceState::kMissing);
    CHECK(rig.detail() == "node 10 does not answer; node 11 does");
    CHECK(rig.remedy() == "Set the panel's address switches to 10, or panel.node_id to 11.");
  }
  SECTION("nothing at all") {
    Rig rig;
    rig.node.power(false);
    rig.run(1.5);
    CHECK(rig.state() == DeviceState::kStarting);
    rig.run(5);
    CHECK(rig.state() == DeviceState::kMissing);
    CHECK(rig.detail() == "node 10 does not answer to a reset");
  }
}

TEST_CASE("another device than expected is refused by name", "[can][panel]") {
  CanPanelOptions options;
  options.io.vendor = 0x1234;
  options.io.product = 0x55;
  Rig rig(options);
  rig.node.set({0x1018, 1}, 0x1234);
  rig.node.set({0x1018, 2}, 0x55);
  std::string expected;
  SECTION("a drive") {
    rig.node.set({0x1000, 0}, 0x00020192);
    expected = "its device type is 402 (1000h: 00020192h), not 401 for inputs and outputs";
  }
  SECTION("another vendor") {
    rig.node.set({0x1018, 1}, 0x99);
    expected = "its vendor (1018h:1) is 00000099h, expected 00001234h";
  }
  SECTION("another product") {
    rig.node.set({0x1018, 2}, 0x99);
    expected = "its product code (1018h:2) is 00000099h, expected 00000055h";
  }
  SECTION("no product code") {
    rig.node.remove({0x1018, 2});
    expected = "it refuses object 1018h:2: no such sub-index";
  }
  rig.run(1);
  CHECK(rig.state() == DeviceState::kUnsuitable);
  CHECK(rig.detail() == expected);
  CHECK_FALSE(rig.remedy().empty());
  CHECK_FALSE(rig.node.operational());
  rig.run(30);  // asked again every now and then
  CHECK(rig.state() == DeviceState::kUnsuitable);
}

TEST_CASE("modules that lack what is not needed are used, others are refused", "[can][panel]") {
  Rig rig;
  SECTION("a fixed mapping that is the right one") {
    for (const auto& [index, sub] :
         std::initializer_list<test::SimulatedIoNode::Address>{{0x1A00, 0}, {0x1A00, 1}, {0x1600, 0}, {0x1600, 1}}) {
      rig.node.make_constant({index, sub});
    }
    rig.run(1);
    CHECK(rig.state() == DeviceState::kReady);
    CHECK(rig.number("sdo_aborts") == 6);
    rig.press(kRested | kStart);
    CHECK(rig.taken() == Actions{OperatorAction::kPlay});
  }
  SECTION("a fixed mapping that is another") {
    rig.node.make_constant({0x1A00, 0});
    rig.node.make_constant({0x1A00, 1});
    rig.node.set({0x1A00, 1}, 0x64010110);
    rig.run(1);
    CHECK(rig.state() == DeviceState::kUnsuitable);
    CHECK(rig.detail() == "1A00h:1 maps 64010110h, needed 60000108h, and cannot be changed");
  }
  SECTION("it does not watch our heartbeat") {
    rig.node.remove({0x1016, 1});
    rig.run(1);
    CHECK(rig.state() == DeviceState::kReady);
    CHECK(rig.detail().find("keeps its light when this computer is gone") != std::string::npos);
  }
  SECTION("it has no heartbeat") {
    rig.node.remove({0x1017, 0});
    rig.run(1);
    CHECK(rig.state() == DeviceState::kUnsuitable);
    CHECK(rig.detail() == "it refuses object 1017h:0: no such object");
  }
  SECTION("it answers in segments") {
    rig.node.segmented = {0x1018, 1};
    rig.run(1);
    CHECK(rig.state() == DeviceState::kUnsuitable);
  }
}

TEST_CASE("an answer that is lost is asked for once more, a module that stays silent is named", "[can][panel]") {
  Rig rig;
  SECTION("lost") {
    rig.node.ignored_sdo = 1;
    rig.run(1.5);
    CHECK(rig.state() == DeviceState::kReady);
    CHECK(rig.number("sdo_timeouts") == 1);
  }
  SECTION("silent") {
    rig.node.never_answered = {0x1017, 0};
    rig.run(1.5);
    CHECK(rig.state() == DeviceState::kMissing);
    CHECK(rig.detail() == "it does not answer for object 1017h:0");
  }
}

TEST_CASE("a full queue delays a lamp and loses nothing", "[can][panel]") {
  Rig rig;
  rig.run(1);
  rig.kernel.full = true;
  rig.panel.light(hal::Light::kAmber);
  rig.run(0.1);
  CHECK(rig.node.lamps() != kAmber);
  rig.kernel.full = false;
  rig.run(0.05);
  CHECK(rig.node.lamps() == kAmber);
  CHECK(rig.state() == DeviceState::kReady);
  CHECK(rig.number("sends_put_off") > 0);
}

TEST_CASE("a module with sixteen inputs and outputs", "[can][panel]") {
  std::string eds = sheet();
  const auto add = [&](const char* entry, const char* type, const char* access, const char* value) {
    eds += fmt::format("\n[{}]\nObjectType=0x7\nDataType={}\nAccessType={}\nDefaultValue={}\n", entry, type, access,
                       value);
  };
  add("6000sub2", "0x0005", "ro", "0");
  add("6200sub2", "0x0005", "rww", "0");
  add("6206sub2", "0x0005", "rw", "0xFF");
  add("6207sub2", "0x0005", "rw", "0");
  add("1600sub2", "0x0007", "rw", "0");
  add("1A00sub2", "0x0007", "rw", "0");
  CanPanelOptions options;
  options.io.input_bytes = options.io.output_bytes = 2;
  options.wiring = {9, 1, 15, -1, true, 8, 0, 15, -1};
  Rig rig(options, 10, eds);
  rig.panel.light(hal::Light::kGreen);
  rig.run(1);
  CHECK(rig.state() == DeviceState::kReady);
  CHECK(rig.node.value({0x1A00, 0}) == 2);
  CHECK(rig.node.value({0x1A00, 2}) == 0x60000208);
  CHECK(rig.node.value({0x6207, 2}) == 1);
  CHECK(rig.node.lamps() == 0x8000);
  CHECK(rig.taken().empty());  // both bytes were read before it counted as there
  rig.press(kRested | 0x200);
  rig.press(kRested | 0x8000);
  CHECK(rig.taken() == Actions{OperatorAction::kPlay, OperatorAction::kConfirm});
}

TEST_CASE("other wiring: a stop that closes, lamps elsewhere", "[can][panel]") {
  CanPanelOptions options;
  options.wiring = {5, 6, -1, -1, false, 7, -1, 4, -1};
  Rig rig(options);
  rig.node.set_inputs(0);
  rig.panel.light(hal::Light::kRed);
  rig.run(1);
  CHECK(rig.node.lamps() == 0x80);
  CHECK(rig.node.value({0x6207, 1}) == 0x80);
  rig.node.set_inputs(0x20);
  rig.run(0.1);
  rig.node.set_inputs(0x40);
  rig.run(0.1);
  CHECK(rig.taken() == Actions{OperatorAction::kPlay, OperatorAction::kStop});
  rig.panel.light(hal::Light::kAmber);  // it has no amber lamp
  rig.run(0.1);
  CHECK(rig.node.lamps() == 0);
}

TEST_CASE("whatever frames come, the panel goes on and presses nothing by itself", "[can][panel]") {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    Rig rig;
    rig.run(1);
    Random random(seed);
    for (int i = 0; i < 3000; ++i) {
      can_frame frame{};
      const std::uint32_t functions[] = {0x080, 0x580, 0x700, 0x000, 0x200};
      frame.can_id = functions[random.below(5)] + 10;
      if (random.below(20) == 0) frame.can_id = static_cast<std::uint32_t>(random.bits());
      frame.len = static_cast<std::uint8_t>(random.below(16));
      for (auto& byte : frame.data) byte = static_cast<std::uint8_t>(random.bits());
      if ((frame.can_id & 0x7FF) != 0x18A) rig.kernel.deliver(frame);
      rig.run(0.002);
    }
    for (const OperatorAction action : rig.taken()) CHECK(action == OperatorAction::kLost);
    rig.run(10);
    INFO(seed << ": " << rig.detail());
    CHECK(rig.state() == DeviceState::kReady);
    CHECK(rig.panel.report(rig.now).numbers.size() <= 20);
  }
}

TEST_CASE("the real kernel's virtual CAN carries the same module", "[can][vcan]") {
  SystemCalls& system = kernel();
  static constexpr can_filter kAll[] = {{0, 0}};
  CanSocket bus(system, "vcan0", kAll);
  if (const BusTrouble trouble = bus.open(); trouble != BusTrouble::kNone) {
    WARN("skipped: this computer has no vcan0 that is up (trouble " << static_cast<int>(trouble) << ")");
    return;
  }
  CanPanelOptions options;
  options.io.interface = "vcan0";
  CanPanel panel(system, options);
  test::SimulatedIoNode node(sheet(), 10);
  node.set_inputs(kRested);
  node.power(true);
  const std::int64_t begin_ns = system.monotonic_ns();
  Instant now{};
  while (now < Instant{} + seconds(3) && panel.report(now).state != DeviceState::kReady) {
    now = {system.monotonic_ns() - begin_ns};
    while (const auto frame = bus.receive()) node.receive(*frame, now);
    for (const can_frame& frame : node.turn(now)) CHECK(bus.send(frame) == CanSocket::Sent::kYes);
    (void)panel.poll(now);
  }
  CHECK(panel.report(now).state == DeviceState::kReady);
}
