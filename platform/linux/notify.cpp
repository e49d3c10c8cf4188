#include "platform/linux/notify.hpp"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <cstdlib>

namespace firstlook {
namespace {
std::string path_from_environment() {
  const char* const path = std::getenv("NOTIFY_SOCKET");
  return path == nullptr ? "" : path;
}
}  // namespace

ServiceManager::ServiceManager() : ServiceManager(path_from_environment()) {}

ServiceManager::ServiceManager(const std::string& socket_path) {
  sockaddr_un address{};
  if (socket_path.size() < 2 || socket_path.size() >= sizeof address.sun_path) return;
  if (socket_path[0] != '/' && socket_path[0] != '@') return;
  address.sun_family = AF_UNIX;
  std::ranges::copy(socket_path, address.sun_path);
  if (socket_path[0] == '@') address.sun_path[0] = '\0';  // the abstract name space
  const auto length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + socket_path.size());
  socket_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (socket_ >= 0 && ::connect(socket_, reinterpret_cast<const sockaddr*>(&address), length) != 0) {
    ::close(socket_);
    socket_ = -1;
  }
}

ServiceManager::~ServiceManager() {
  if (socket_ >= 0) ::close(socket_);
}

bool ServiceManager::send(std::string_view state) const {
  if (socket_ < 0) return false;
  return ::send(socket_, state.data(), state.size(), MSG_NOSIGNAL | MSG_DONTWAIT) == static_cast<ssize_t>(state.size());
}

void ServiceWatchdog::feed(Instant now) {
  if (fed_ && now - last_ < interval_) return;
  fed_ = true;
  last_ = now;
  (void)manager_.send("WATCHDOG=1");
}

}  // namespace firstlook
