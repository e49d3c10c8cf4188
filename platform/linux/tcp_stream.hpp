/// One TCP connection and one listener, for drivers on the loop: nothing blocks, and nothing is allocated after their
/// addresses are known. Servers with many clients use tcp.hpp.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "platform/core/result.hpp"
#include "platform/core/time.hpp"

namespace firstlook {

/// Where to dial or listen, as numbers: names are looked up once, at boot.
struct TcpAddress {
  std::uint32_t ipv4 = 0;  ///< in the computer's byte order
  std::uint16_t port = 0;
};
/// Looks a name or dotted address up, which may block for seconds. Error: kDeviceMissing with what the system said.
[[nodiscard]] Result<TcpAddress> look_up_tcp(const std::string& host, std::uint16_t port);
/// "192.168.1.10"
[[nodiscard]] std::string address_text(std::uint32_t ipv4);
/// Which of this computer's addresses packets to `peer` leave from. Error: kDeviceMissing when there is no way there.
[[nodiscard]] Result<std::uint32_t> own_address_towards(const TcpAddress& peer);

class TcpStream {
 public:
  enum class State : std::uint8_t { kClosed, kConnecting, kOpen };

  TcpStream() = default;
  ~TcpStream() { close(); }
  TcpStream(TcpStream&& other) noexcept
      : descriptor_(std::exchange(other.descriptor_, -1)), state_(std::exchange(other.state_, State::kClosed)) {}
  TcpStream& operator=(TcpStream&& other) noexcept {
    std::swap(descriptor_, other.descriptor_);
    std::swap(state_, other.state_);
    return *this;
  }
  TcpStream(const TcpStream&) = delete;
  TcpStream& operator=(const TcpStream&) = delete;

  /// Closes what is open and begins to connect; the state tells how it ends.
  void dial(const TcpAddress& peer);
  /// Looks whether dialling has ended. A broken connection is closed.
  [[nodiscard]] State state();
  /// Takes what has come, up to the room given; empty: nothing now, or closed (see state()).
  [[nodiscard]] std::string_view receive(std::span<char> room);
  /// All of it or an end: a peer that does not take these few bytes now is as good as gone. False: closed.
  bool send(std::string_view bytes);
  /// Blocks until something comes or the connection ends, for so long at most.
  void wait(Duration longest);
  void close();

 private:
  friend class TcpListener;
  int descriptor_ = -1;
  State state_ = State::kClosed;
};

class TcpListener {
 public:
  TcpListener() = default;
  ~TcpListener() { close(); }
  TcpListener(const TcpListener&) = delete;
  TcpListener& operator=(const TcpListener&) = delete;

  /// On every address of this computer; port 0: a free one. Error: kDeviceMissing: the port is in use or not allowed.
  [[nodiscard]] Status listen(std::uint16_t port);
  [[nodiscard]] std::uint16_t port() const { return port_; }
  /// The next who has dialled; closed when there is nobody.
  [[nodiscard]] TcpStream accept();
  void close();

 private:
  int descriptor_ = -1;
  std::uint16_t port_ = 0;
};

}  // namespace firstlook
