#include "platform/linux/tcp.hpp"

#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <memory>

#include "platform/linux/wakeup.hpp"

namespace firstlook {
namespace {

constexpr int kBacklog = 16;
constexpr std::int64_t kNanosecondsPerSecond = 1'000'000'000;

struct FreeAddresses {
  void operator()(addrinfo* addresses) const { freeaddrinfo(addresses); }
};
using Addresses = std::unique_ptr<addrinfo, FreeAddresses>;

Result<Addresses> look_up(const std::string& host, std::uint16_t port) {
  addrinfo hints{};
  hints.ai_family = AF_INET;
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  const int failed = getaddrinfo(host.c_str(), std::to_string(port).c_str(), &hints, &found);
  if (failed != 0) return failure(Fault::kDeviceMissing, "{}: {}", host, gai_strerror(failed));
  return Addresses(found);
}

int open_socket() { return socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0); }

void send_at_once(int descriptor) {
  const int on = 1;
  setsockopt(descriptor, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
}

}  // namespace

Tcp::~Tcp() {
  for (const auto& [id, entry] : entries_) ::close(entry.descriptor);
}

TcpId Tcp::add(int descriptor, Kind kind) {
  entries_[next_] = {descriptor, kind};
  return next_++;
}

Result<TcpId> Tcp::listen(const std::string& host, std::uint16_t port) {
  const Result<Addresses> addresses = look_up(host, port);
  if (!addresses) return std::unexpected(addresses.error());
  const int descriptor = open_socket();
  if (descriptor < 0) return failure(Fault::kDeviceMissing, "{}:{}: {}", host, port, std::strerror(errno));
  const int on = 1;
  setsockopt(descriptor, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  const addrinfo& address = **addresses;
  if (bind(descriptor, address.ai_addr, address.ai_addrlen) != 0 || ::listen(descriptor, kBacklog) != 0) {
    const int error = errno;
    ::close(descriptor);
    return failure(Fault::kDeviceMissing, "cannot listen on {}:{}: {}", host, port, std::strerror(error));
  }
  return add(descriptor, Kind::kListener);
}

std::uint16_t Tcp::port_of(TcpId listener) const {
  const auto found = entries_.find(listener);
  if (found == entries_.end()) return 0;
  sockaddr_in address{};
  socklen_t length = sizeof address;
  getsockname(found->second.descriptor, reinterpret_cast<sockaddr*>(&address), &length);
  return ntohs(address.sin_port);
}

Result<TcpId> Tcp::dial(const std::string& host, std::uint16_t port) {
  const Result<Addresses> addresses = look_up(host, port);
  if (!addresses) return std::unexpected(addresses.error());
  const int descriptor = open_socket();
  if (descriptor < 0) return failure(Fault::kDeviceMissing, "{}:{}: {}", host, port, std::strerror(errno));
  send_at_once(descriptor);
  const addrinfo& address = **addresses;
  if (connect(descriptor, address.ai_addr, address.ai_addrlen) != 0 && errno != EINPROGRESS) {
    const int error = errno;
    ::close(descriptor);
    return failure(Fault::kDeviceMissing, "cannot connect to {}:{}: {}", host, port, std::strerror(error));
  }
  return add(descriptor, Kind::kDialling);
}

bool Tcp::send(TcpId connection, std::string& bytes) {
  const auto found = entries_.find(connection);
  if (found == entries_.end() || found->second.kind == Kind::kListener) return false;
  if (found->second.kind == Kind::kDialling || bytes.empty()) return true;
  const ssize_t sent = ::send(found->second.descriptor, bytes.data(), bytes.size(), MSG_NOSIGNAL);
  if (sent < 0) return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR;
  bytes.erase(0, static_cast<std::size_t>(sent));
  return true;
}

void Tcp::close(TcpId connection) {
  const auto found = entries_.find(connection);
  if (found == entries_.end()) return;
  ::close(found->second.descriptor);
  entries_.erase(found);
}

void Tcp::abort(TcpId connection) {
  const auto found = entries_.find(connection);
  if (found == entries_.end()) return;
  const linger at_once{1, 0};
  setsockopt(found->second.descriptor, SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
  close(connection);
}

void Tcp::accept_all(TcpId listener, int descriptor, TcpEvents& events) {
  for (;;) {
    const int accepted = accept4(descriptor, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (accepted < 0) return;
    send_at_once(accepted);
    events.opened(add(accepted, Kind::kOpen), listener);
  }
}

void Tcp::finish_dialling(TcpId connection, TcpEvents& events) {
  Entry& entry = entries_[connection];
  int error = 0;
  socklen_t length = sizeof error;
  getsockopt(entry.descriptor, SOL_SOCKET, SO_ERROR, &error, &length);
  if (error == 0) {
    entry.kind = Kind::kOpen;
    events.opened(connection, 0);
  } else {
    close(connection);
    events.closed(connection);
  }
}

void Tcp::read_all(TcpId connection, TcpEvents& events) {
  constexpr int kReadsMax = 16;  // of one connection in one turn, so that the others have theirs
  std::array<char, 16384> buffer;
  for (int reads = 0; reads < kReadsMax; ++reads) {
    const auto found = entries_.find(connection);
    if (found == entries_.end()) return;  // closed by who was told
    const ssize_t got = recv(found->second.descriptor, buffer.data(), buffer.size(), 0);
    if (got > 0) {
      events.received(connection, {buffer.data(), static_cast<std::size_t>(got)});
      continue;
    }
    if (got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR)) return;
    close(connection);
    events.closed(connection);
    return;
  }
}

void Tcp::poll(std::int64_t monotonic_ns_until, const std::vector<TcpId>& writable, TcpEvents& events) {
  std::vector<TcpId> ids;
  std::vector<pollfd> descriptors;
  for (const auto& [id, entry] : entries_) {
    const bool writes = entry.kind == Kind::kDialling || std::ranges::find(writable, id) != writable.end();
    ids.push_back(id);
    descriptors.push_back({entry.descriptor, static_cast<short>(POLLIN | (writes ? POLLOUT : 0)), 0});
  }
  const std::int64_t left_ns = std::max<std::int64_t>(0, monotonic_ns_until - monotonic_ns());
  const timespec timeout{left_ns / kNanosecondsPerSecond, left_ns % kNanosecondsPerSecond};
  if (ppoll(descriptors.data(), descriptors.size(), &timeout, nullptr) <= 0) return;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const auto found = entries_.find(ids[i]);
    if (descriptors[i].revents == 0 || found == entries_.end()) continue;
    switch (found->second.kind) {
      case Kind::kListener:
        accept_all(ids[i], found->second.descriptor, events);
        break;
      case Kind::kDialling:
        finish_dialling(ids[i], events);
        break;
      case Kind::kOpen:
        if ((descriptors[i].revents & ~POLLOUT) != 0) read_all(ids[i], events);
        break;
    }
  }
}

}  // namespace firstlook
