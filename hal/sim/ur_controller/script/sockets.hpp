/// Connections that a script opens to other computers, as the interpreter asks for them: nothing here blocks.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace firstlook::sim::ur::script {

class Sockets {
 public:
  using Id = std::uint64_t;
  enum class State : std::uint8_t { kConnecting, kOpen, kClosed };

  virtual ~Sockets() = default;
  /// Begins to connect. 0 when that is not even possible.
  [[nodiscard]] virtual Id open(const std::string& host, std::uint16_t port) = 0;
  [[nodiscard]] virtual State state(Id socket) const = 0;
  /// False when the connection is closed, or holds more unsent bytes than it should.
  virtual bool send(Id socket, std::string_view bytes) = 0;
  /// What has come and nobody has read: the reader takes from the front. Valid until `close`.
  [[nodiscard]] virtual std::string& received(Id socket) = 0;
  virtual void close(Id socket) = 0;
};

}  // namespace firstlook::sim::ur::script
