/// Messages to the service manager (sd_notify(3): datagrams to NOTIFY_SOCKET), without its library.
#pragma once

#include <string>
#include <string_view>

#include "platform/loop/watchdog.hpp"

namespace firstlook {

/// The socket of the service manager, if there is one. Opened at construction; sending never blocks or allocates.
class ServiceManager {
 public:
  /// Uses NOTIFY_SOCKET of the environment.
  ServiceManager();
  explicit ServiceManager(const std::string& socket_path);
  ~ServiceManager();
  ServiceManager(const ServiceManager&) = delete;
  ServiceManager& operator=(const ServiceManager&) = delete;

  /// Sends e.g. "READY=1" or "STATUS=sweep". False when there is no service manager or it does not listen.
  bool send(std::string_view state) const;
  [[nodiscard]] bool present() const { return socket_ >= 0; }

 private:
  int socket_ = -1;
};

/// Sends "WATCHDOG=1" at most every `interval`.
class ServiceWatchdog final : public Watchdog {
 public:
  ServiceWatchdog(const ServiceManager& manager, Duration interval) : manager_(manager), interval_(interval) {}
  void feed(Instant now) override;

 private:
  const ServiceManager& manager_;
  Duration interval_;
  Instant last_{};
  bool fed_ = false;
};

}  // namespace firstlook
