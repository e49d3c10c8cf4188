/// What a job tells those who look at it from outside while it runs: the service manager, and programs that read
/// $RUNTIME_DIRECTORY/status.json. Outside of a service it tells nobody.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "hal/api/device_report.hpp"
#include "platform/core/fault_table.hpp"
#include "platform/core/time.hpp"
#include "platform/linux/notify.hpp"
#include "platform/linux/status_file.hpp"

namespace firstlook {

struct MissingDevice {
  std::string_view role;  ///< "colour camera"
  const hal::DeviceReport* report = nullptr;
};

/// After construction nothing here allocates or blocks.
class ServiceStatus {
 public:
  /// Reads what systemd sets: NOTIFY_SOCKET, WATCHDOG_USEC with WATCHDOG_PID, RUNTIME_DIRECTORY.
  /// @param cell_or_robot  what the job works on, for the file
  explicit ServiceStatus(std::string_view works_on);

  /// The first time that the job is ready the service manager learns that the service has started.
  void state(std::string_view name, bool ready);
  void text(std::string_view line);
  void fault(Fault fault);
  /// The devices that are not there, all of them.
  void missing(std::span<const MissingDevice> devices);
  /// The loop has ended and feeds no watchdog; the manager allows this long for what is left to do.
  void ending(Duration allowed);

  /// Whether anybody is told.
  [[nodiscard]] bool heard() const { return manager_.present() || file_.present(); }
  /// Whether the file of a start before was left.
  [[nodiscard]] bool told_before() const { return file_.there(); }
  /// The file stays when the process ends, for those who look while the service is started again.
  void leave_file() { file_.leave(); }

  /// To be fed by the loop; null when nobody asked for it.
  [[nodiscard]] Watchdog* watchdog() { return watchdog_ ? &*watchdog_ : nullptr; }

 private:
  void publish();

  ServiceManager manager_;
  std::optional<ServiceWatchdog> watchdog_;
  StatusFile file_;
  std::string works_on_;
  std::string started_;
  std::array<char, 32> state_{};
  std::array<char, 160> text_{};
  std::array<char, 4096> missing_{};  ///< the elements of a JSON array
  int fault_ = 0;
  bool told_ready_ = false;
};

}  // namespace firstlook
