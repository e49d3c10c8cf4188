#include "platform/linux/tcp_stream.hpp"

#include <arpa/inet.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace firstlook {
namespace {

constexpr int kBacklog = 4;

sockaddr_in socket_address(const TcpAddress& address) {
  sockaddr_in result{};
  result.sin_family = AF_INET;
  result.sin_port = htons(address.port);
  result.sin_addr.s_addr = htonl(address.ipv4);
  return result;
}

int open_socket(int kind) { return socket(AF_INET, kind | SOCK_NONBLOCK | SOCK_CLOEXEC, 0); }

void send_at_once(int descriptor) {
  const int on = 1;
  setsockopt(descriptor, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
}

bool not_now() { return errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR; }

}  // namespace

Result<TcpAddress> look_up_tcp(const std::string& host, std::uint16_t port) {
  addrinfo hints{};
  hints.ai_family = AF_INET;
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  const int failed = getaddrinfo(host.c_str(), nullptr, &hints, &found);
  if (failed != 0) return failure(Fault::kDeviceMissing, "{}: {}", host, gai_strerror(failed));
  sockaddr_in address{};
  std::memcpy(&address, found->ai_addr, sizeof address);
  freeaddrinfo(found);
  return TcpAddress{ntohl(address.sin_addr.s_addr), port};
}

std::string address_text(std::uint32_t ipv4) {
  return fmt::format("{}.{}.{}.{}", ipv4 >> 24, ipv4 >> 16 & 255, ipv4 >> 8 & 255, ipv4 & 255);
}

Result<std::uint32_t> own_address_towards(const TcpAddress& peer) {
  // Connecting a datagram socket sends nothing; it only chooses the way.
  const int descriptor = open_socket(SOCK_DGRAM);
  const sockaddr_in address = socket_address(peer);
  sockaddr_in own{};
  socklen_t length = sizeof own;
  const bool found = descriptor >= 0 &&
                     connect(descriptor, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 &&
                     getsockname(descriptor, reinterpret_cast<sockaddr*>(&own), &length) == 0;
  const int error = errno;
  if (descriptor >= 0) ::close(descriptor);
  if (!found) return failure(Fault::kDeviceMissing, "no way to {}: {}", address_text(peer.ipv4), std::strerror(error));
  return ntohl(own.sin_addr.s_addr);
}

void TcpStream::dial(const TcpAddress& peer) {
  close();
  descriptor_ = open_socket(SOCK_STREAM);
  if (descriptor_ < 0) return;
  send_at_once(descriptor_);
  const sockaddr_in address = socket_address(peer);
  state_ = State::kConnecting;
  if (connect(descriptor_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 && errno != EINPROGRESS) {
    close();
  }
}

TcpStream::State TcpStream::state() {
  if (state_ != State::kConnecting) return state_;
  pollfd ready{descriptor_, POLLOUT, 0};
  if (poll(&ready, 1, 0) <= 0) return state_;
  int error = 0;
  socklen_t length = sizeof error;
  getsockopt(descriptor_, SOL_SOCKET, SO_ERROR, &error, &length);
  if (error != 0) {
    close();
  } else {
    state_ = State::kOpen;
  }
  return state_;
}

std::string_view TcpStream::receive(std::span<char> room) {
  if (state() != State::kOpen || room.empty()) return {};
  const ssize_t got = recv(descriptor_, room.data(), room.size(), 0);
  if (got > 0) return {room.data(), static_cast<std::size_t>(got)};
  if (got == 0 || !not_now()) close();
  return {};
}

bool TcpStream::send(std::string_view bytes) {
  if (state() != State::kOpen) return false;
  const ssize_t sent = ::send(descriptor_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
  if (sent == static_cast<ssize_t>(bytes.size())) return true;
  close();
  return false;
}

void TcpStream::wait(Duration longest) {
  if (state_ == State::kClosed) return;
  pollfd ready{descriptor_, POLLIN, 0};
  poll(&ready, 1, static_cast<int>(longest.ns / 1'000'000));
}

void TcpStream::close() {
  if (descriptor_ >= 0) ::close(descriptor_);
  descriptor_ = -1;
  state_ = State::kClosed;
}

Status TcpListener::listen(std::uint16_t port) {
  close();
  descriptor_ = open_socket(SOCK_STREAM);
  const int on = 1;
  if (descriptor_ >= 0) setsockopt(descriptor_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  sockaddr_in address = socket_address({INADDR_ANY, port});
  if (descriptor_ < 0 || bind(descriptor_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      ::listen(descriptor_, kBacklog) != 0) {
    const int error = errno;
    close();
    return failure(Fault::kDeviceMissing, "cannot listen on port {}: {}", port, std::strerror(error));
  }
  socklen_t length = sizeof address;
  getsockname(descriptor_, reinterpret_cast<sockaddr*>(&address), &length);
  port_ = ntohs(address.sin_port);
  return {};
}

TcpStream TcpListener::accept() {
  TcpStream stream;
  if (descriptor_ < 0) return stream;
  stream.descriptor_ = accept4(descriptor_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
  if (stream.descriptor_ < 0) return stream;
  send_at_once(stream.descriptor_);
  stream.state_ = TcpStream::State::kOpen;
  return stream;
}

void TcpListener::close() {
  if (descriptor_ >= 0) ::close(descriptor_);
  descriptor_ = -1;
  port_ = 0;
}

}  // namespace firstlook
