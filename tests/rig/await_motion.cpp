/// Whether the robot moves: rig_await_motion SECONDS
/// "moved at UPTIME" with code 0 when a joint has turned by a hundredth of a degree, else "stood" with code 1; 2 when
/// nobody could be asked. One process that reads what the robot sends 125 times a second: a script that asks again and
/// again keeps an emulated computer busier than all that it looks at.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <optional>
#include <string>

#include "platform/linux/wakeup.hpp"

namespace firstlook::rig {
namespace {

constexpr std::uint16_t kRealtimePort = 30003;
constexpr std::size_t kPacketBytes = 1116, kActualJointsAt = 252;  // CB3 from 3.5 on; big-endian doubles
constexpr double kMoved_rad = 2e-4;
using Joints = std::array<double, 6>;

int connected() {
  const int robot = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(kRealtimePort);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const timeval patience{5, 0};
  if (robot < 0 || setsockopt(robot, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience) != 0 ||
      connect(robot, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    return -1;
  }
  return robot;
}

std::optional<Joints> next_joints(int robot) {
  std::array<char, kPacketBytes> packet;
  if (recv(robot, packet.data(), packet.size(), MSG_WAITALL) != static_cast<ssize_t>(packet.size())) return {};
  Joints joints;
  for (std::size_t j = 0; j < joints.size(); ++j) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, packet.data() + kActualJointsAt + 8 * j, sizeof bits);
    joints[j] = std::bit_cast<double>(__builtin_bswap64(bits));
  }
  return joints;
}

int watch(double for_s) {
  const int robot = connected();
  const std::optional<Joints> before = robot < 0 ? std::nullopt : next_joints(robot);
  if (!before) {
    std::puts("nobody tells where it stands");
    return 2;
  }
  const std::int64_t end_ns = monotonic_ns() + static_cast<std::int64_t>(for_s * 1e9);
  while (monotonic_ns() < end_ns) {
    const std::optional<Joints> now = next_joints(robot);
    for (std::size_t j = 0; now && j < now->size(); ++j) {
      if (std::abs((*now)[j] - (*before)[j]) <= kMoved_rad) continue;
      std::string uptime_s;
      std::ifstream("/proc/uptime") >> uptime_s;
      std::printf("moved at %s\n", uptime_s.c_str());
      return 0;
    }
    if (!now) {
      std::puts("nobody tells where it stands any more");
      return 2;
    }
  }
  std::puts("stood");
  return 1;
}

}  // namespace
}  // namespace firstlook::rig

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: rig_await_motion SECONDS\n");
    return 2;
  }
  return firstlook::rig::watch(std::atof(argv[1]));
}
