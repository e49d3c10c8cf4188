/// TCP over poll(2): listeners, accepted and dialled connections, nothing that blocks.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "platform/core/result.hpp"

namespace firstlook {

/// Number of a connection or listener; never used again after its end.
using TcpId = std::uint64_t;

/// What happened in `Tcp::poll`. An implementation may call `send` and `close` of the Tcp that calls it.
class TcpEvents {
 public:
  virtual ~TcpEvents() = default;
  /// Somebody connected to `listener`, or a dialled connection stands (`listener` is 0 then).
  virtual void opened(TcpId connection, TcpId listener) = 0;
  virtual void received(TcpId connection, std::string_view bytes) = 0;
  /// By the other side, by an error, or because dialling failed. Not after our own `close`.
  virtual void closed(TcpId connection) = 0;
};

class Tcp {
 public:
  Tcp() = default;
  ~Tcp();
  Tcp(const Tcp&) = delete;
  Tcp& operator=(const Tcp&) = delete;

  /// `host` is a name or address, port 0 one that is free. Error: kDeviceMissing, with what the system said: the port
  /// is in use, not allowed, or the host is not an address of this computer.
  [[nodiscard]] Result<TcpId> listen(const std::string& host, std::uint16_t port);
  /// The port of a listener.
  [[nodiscard]] std::uint16_t port_of(TcpId listener) const;

  /// Begins to connect; `opened` or `closed` follows. Names are looked up at once, which may take their server's time.
  /// Error: kDeviceMissing when the name is unknown or no socket is left.
  [[nodiscard]] Result<TcpId> dial(const std::string& host, std::uint16_t port);

  /// Sends from the front of `bytes` what the system takes now and removes it. False when the connection is broken or
  /// gone; `closed` follows for a broken one.
  bool send(TcpId connection, std::string& bytes);
  void close(TcpId connection);
  /// The same without sending what the system still holds: for a peer that does not read.
  void abort(TcpId connection);

  /// Waits for something to happen, until `monotonic_ns_until` at most (as monotonic_ns() counts) or a signal, then
  /// tells `events` all of it. `writable` names connections for which room to send counts, too.
  void poll(std::int64_t monotonic_ns_until, const std::vector<TcpId>& writable, TcpEvents& events);

 private:
  enum class Kind : std::uint8_t { kListener, kDialling, kOpen };
  struct Entry {
    int descriptor = -1;
    Kind kind = Kind::kOpen;
  };

  TcpId add(int descriptor, Kind kind);
  void accept_all(TcpId listener, int descriptor, TcpEvents& events);
  void finish_dialling(TcpId connection, TcpEvents& events);
  void read_all(TcpId connection, TcpEvents& events);

  std::map<TcpId, Entry> entries_;
  TcpId next_ = 1;
};

}  // namespace firstlook
