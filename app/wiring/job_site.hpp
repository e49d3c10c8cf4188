/// Where a job runs: its devices, what is known of them beforehand, and what they add to its record.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "app/check/device_check.hpp"
#include "app/cli/cli.hpp"
#include "app/config/config.hpp"
#include "app/shell/cart.hpp"
#include "platform/linux/terminal.hpp"

namespace firstlook {

class JobSite {
 public:
  virtual ~JobSite() = default;
  [[nodiscard]] virtual CartDevices devices() = 0;
  /// Without a stored calibration.
  [[nodiscard]] virtual CellFacts facts() const = 0;
  /// Whether the devices keep their own time.
  [[nodiscard]] virtual bool in_real_time() const = 0;
  /// Before the job: what it holds for free may be watched.
  virtual void begin(const PublishedSpace& space) = 0;
  /// After it.
  virtual void finish(const Cart& cart, const Config& config, RunRecord& record, Narrator& narrator) = 0;
};

/// A simulated cell. Its arm is moved by the cell itself, or as `robot.host` says by a simulated controller that tells
/// the cell's cameras its true joints: in this process (where it can be: for UR arms), or in another.
/// Fills in `config` what the cell's description says, and `robot.host`.
[[nodiscard]] Result<std::unique_ptr<JobSite>> open_simulated_site(const RunCommand& command, Config& config,
                                                                   Narrator& narrator);

/// The real cart: robot, colour camera and depth camera as the configuration names them, the panel if it names one.
/// Errors: kUsage for options that only a simulated cell has, kConfigBadValue for what does not go together,
/// kDeviceMissing and others of the drivers.
/// @param asked  takes what a panel said that is not ready
[[nodiscard]] Result<std::unique_ptr<JobSite>> open_real_site(const RunCommand& command, Config& config,
                                                              Narrator& narrator, std::vector<CheckedDevice>& asked);

/// Whether `robot.host` names a controller on the network, rather than none or one in this process.
[[nodiscard]] bool names_network_robot(const Config& config);

/// Whether the configuration names cameras: then a job runs on the real cart.
[[nodiscard]] bool names_real_cart(const Config& config);

}  // namespace firstlook
