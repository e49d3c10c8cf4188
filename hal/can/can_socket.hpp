/// A raw socket on one CAN interface of Linux (SocketCAN), non-blocking.
#pragma once

#include <linux/can.h>

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "platform/linux/system_calls.hpp"

namespace firstlook::can {

enum class BusTrouble : std::uint8_t {
  kNone,
  kNoCan,        ///< the kernel knows no CAN
  kNoInterface,  ///< there is no interface of this name, or it went away
  kDown,         ///< it is there and switched off
  kRefused,      ///< the system said something else: last_error()
};

/// Not thread-safe. Nothing blocks or allocates.
class CanSocket {
 public:
  /// @param name  of the network interface: "can0"
  /// @param filters  frames to receive, as CAN_RAW_FILTER has them; error frames of the controller come always
  CanSocket(SystemCalls& system, std::string_view name, std::span<const can_filter> filters);
  ~CanSocket() { close(); }
  CanSocket(const CanSocket&) = delete;
  CanSocket& operator=(const CanSocket&) = delete;

  [[nodiscard]] BusTrouble open();
  void close();
  [[nodiscard]] bool is_open() const { return descriptor_ >= 0; }

  /// The next frame that waits. Empty when there is none, or when the interface went down or away: then it is closed
  /// and trouble() says why.
  [[nodiscard]] std::optional<can_frame> receive();
  enum class Sent : std::uint8_t { kYes, kNoRoom, kBroken };
  /// kNoRoom: the queue is full (a bus that nobody acknowledges on fills it), try again later. kBroken: as in
  /// receive().
  [[nodiscard]] Sent send(const can_frame& frame);

  [[nodiscard]] BusTrouble trouble() const { return trouble_; }
  [[nodiscard]] int last_error() const { return error_; }  ///< an errno, positive

 private:
  BusTrouble fail(int error);

  SystemCalls& system_;
  std::string name_;
  std::span<const can_filter> filters_;
  int descriptor_ = -1;
  BusTrouble trouble_ = BusTrouble::kNone;
  int error_ = 0;
};

}  // namespace firstlook::can
