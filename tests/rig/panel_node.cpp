/// A CiA 401 module on a CAN interface of Linux, with somebody who presses its buttons:
///   rig_panel INTERFACE SHEET.eds NODE FIFO STATUS
/// FIFO takes lines: "press start", "release start" (also stop, confirm, enabling), "power off", "power on", "mute",
/// "unmute". STATUS is a file with one line: what the module shows.
#include <fcntl.h>
#include <linux/can.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <sstream>
#include <string>
#include <string_view>

#include "platform/linux/process.hpp"
#include "platform/linux/wakeup.hpp"
#include "tests/support/simulated_io_node.hpp"

namespace firstlook {
namespace {

constexpr int kTurn_ms = 5;
constexpr unsigned kStopBit = 1;  // its contact opens when pressed
constexpr std::array<std::string_view, 4> kInputs{"start", "stop", "confirm", "enabling"};
constexpr std::array<std::string_view, 4> kLamps{"red", "amber", "green", "buzzer"};

/// Bound to the interface; below 0 while there is none that is up.
int open_bus(const char* interface) {
  const int bus = socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW);
  if (bus < 0) return -1;
  ifreq request{};
  std::strncpy(request.ifr_name, interface, IFNAMSIZ - 1);
  sockaddr_can address{};
  address.can_family = AF_CAN;
  if (ioctl(bus, SIOCGIFINDEX, &request) == 0) {
    address.can_ifindex = request.ifr_ifindex;
    if (bind(bus, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) return bus;
  }
  close(bus);
  return -1;
}

void obey(test::SimulatedIoNode& node, unsigned& inputs, const std::string& line) {
  std::istringstream words(line);
  std::string verb, what;
  words >> verb >> what;
  if (verb == "power") node.power(what == "on");
  if (verb == "mute" || verb == "unmute") node.mute = verb == "mute";
  for (unsigned bit = 0; bit < kInputs.size(); ++bit) {
    if (what != kInputs[bit] || (verb != "press" && verb != "release")) continue;
    const bool closed = (verb == "press") != (bit == kStopBit);
    inputs = closed ? inputs | 1U << bit : inputs & ~(1U << bit);
  }
  node.set_inputs(inputs);
}

std::string shown(const test::SimulatedIoNode& node) {
  std::string text = node.operational() ? "operational" : "waits";
  for (unsigned bit = 0; bit < kLamps.size(); ++bit) {
    if ((node.lamps() >> bit & 1U) != 0) text.append(" ").append(kLamps[bit]);
  }
  return text;
}

int serve(const char* interface, const std::string& sheet, unsigned number, const char* fifo, const char* status) {
  if (mkfifo(fifo, 0666) != 0 && errno != EEXIST) {
    std::fprintf(stderr, "rig_panel: cannot make %s: %s\n", fifo, std::strerror(errno));
    return 1;
  }
  const int words = open(fifo, O_RDWR | O_NONBLOCK | O_CLOEXEC);
  if (words < 0) {
    std::fprintf(stderr, "rig_panel: cannot open %s: %s\n", fifo, std::strerror(errno));
    return 1;
  }
  test::SimulatedIoNode node(sheet, number);
  unsigned inputs = 1U << kStopBit;
  node.set_inputs(inputs);
  node.power(true);
  constexpr std::int64_t kReopen_ns = 100'000'000;  // a bus that is down must not keep the computer's only core
  int bus = -1;
  std::int64_t open_at_ns = 0;
  std::string typed, was;
  while (!stop_signal_received()) {
    if (bus < 0 && monotonic_ns() >= open_at_ns) bus = open_bus(interface);
    std::array<pollfd, 2> waits{{{words, POLLIN, 0}, {bus, POLLIN, 0}}};
    (void)poll(waits.data(), waits.size(), kTurn_ms);
    std::array<char, 256> bytes;
    for (ssize_t n = 0; (n = read(words, bytes.data(), bytes.size())) > 0;)
      typed.append(bytes.data(), static_cast<std::size_t>(n));
    for (std::size_t end = 0; (end = typed.find('\n')) != std::string::npos; typed.erase(0, end + 1))
      obey(node, inputs, typed.substr(0, end));
    const Instant now{monotonic_ns()};
    can_frame frame{};
    ssize_t got = 0;
    while (bus >= 0 && (got = read(bus, &frame, sizeof frame)) == sizeof frame) node.receive(frame, now);
    bool broken = bus >= 0 && got < 0 && errno != EAGAIN;
    for (const can_frame& said : node.turn(now)) {
      if (bus >= 0 && write(bus, &said, sizeof said) < 0 && errno != ENOBUFS && errno != EAGAIN) broken = true;
    }
    if (broken) {
      close(bus);
      bus = -1;
      open_at_ns = monotonic_ns() + kReopen_ns;
    }
    if (std::string text = shown(node); text != was) {
      std::ofstream(status) << text << '\n';
      was = std::move(text);
    }
  }
  return 0;
}

}  // namespace
}  // namespace firstlook

int main(int argc, char** argv) {
  if (argc != 6) {
    std::fprintf(stderr, "usage: rig_panel INTERFACE SHEET.eds NODE FIFO STATUS\n");
    return 2;
  }
  std::ifstream file(argv[2]);
  std::stringstream sheet;
  sheet << file.rdbuf();
  if (!file || sheet.str().empty()) {
    std::fprintf(stderr, "rig_panel: cannot read %s\n", argv[2]);
    return 1;
  }
  firstlook::catch_stop_signals();
  return firstlook::serve(argv[1], sheet.str(), static_cast<unsigned>(std::stoul(argv[3])), argv[4], argv[5]);
}
