#include "platform/linux/notify.hpp"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <catch2/catch.hpp>
#include <cstring>
#include <filesystem>

using namespace firstlook;

namespace {

/// The service manager's end of the socket.
struct Manager {
  Manager() : path(std::filesystem::temp_directory_path() / ("firstlook_notify_" + std::to_string(getpid()))) {
    descriptor = socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
    REQUIRE(bind(descriptor, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
  }
  ~Manager() {
    close(descriptor);
    std::filesystem::remove(path);
  }
  std::string receive() {
    std::array<char, 256> text{};
    const ssize_t got = recv(descriptor, text.data(), text.size(), 0);
    return {text.data(), got > 0 ? static_cast<std::size_t>(got) : 0};
  }
  std::filesystem::path path;
  int descriptor = -1;
};

}  // namespace

TEST_CASE("messages reach the service manager; without one nothing happens") {
  Manager manager;
  const ServiceManager service(manager.path.string());
  CHECK(service.present());
  CHECK(service.send("READY=1"));
  CHECK(manager.receive() == "READY=1");
  const ServiceManager nobody("");
  CHECK_FALSE(nobody.present());
  CHECK_FALSE(nobody.send("READY=1"));
  CHECK_FALSE(ServiceManager("relative/path").present());
  CHECK_FALSE(ServiceManager("/no/such/socket").present());
}

TEST_CASE("the watchdog is fed at most once in its interval") {
  Manager manager;
  const ServiceManager service(manager.path.string());
  ServiceWatchdog watchdog(service, milliseconds(100));
  for (int turn = 0; turn < 25; ++turn) watchdog.feed(Instant{} + milliseconds(8) * turn);
  CHECK(manager.receive() == "WATCHDOG=1");
  CHECK(manager.receive() == "WATCHDOG=1");
  CHECK(manager.receive().empty());
}
