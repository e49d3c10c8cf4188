#include "app/wiring/run_check.hpp"

#include <algorithm>
#include <cstdio>
#include <iterator>
#include <optional>

#include "app/check/check_report.hpp"
#include "app/check/device_check.hpp"
#include "app/cli/exit_codes.hpp"
#include "app/config/board_config.hpp"
#include "app/wiring/cell_grading.hpp"
#include "app/wiring/job_site.hpp"
#include "app/wiring/network_arm.hpp"
#include "app/wiring/real_devices.hpp"
#include "app/wiring/usb_check.hpp"
#include "hal/sim/simulated_cell.hpp"
#include "platform/linux/terminal.hpp"

namespace firstlook {

namespace {

/// The robot as arm and pendant among the checks; it must outlive them. Null when it cannot be had: a check says why.
std::unique_ptr<NetworkArm> check_robot(const Config& config, Narrator& narrator, std::vector<DeviceCheck>& checks) {
  auto connected = NetworkArm::connect(config, narrator);
  if (!connected) {
    checks.push_back({std::string(kArmRole), false, absent_device(config.robot.host, connected.error())});
    checks.push_back({std::string(kPendantRole), false, absent_device(config.robot.host, connected.error())});
    return nullptr;
  }
  NetworkArm& arm = **connected;
  checks.push_back({std::string(kArmRole), false, watch_arm(arm.arm(), &arm)});
  checks.push_back({std::string(kPendantRole), false, watch_pendant(arm.pendant(), nullptr)});
  return std::move(*connected);
}

/// The checks of real devices, and the robot that some of them watch.
struct RealChecks {
  std::unique_ptr<NetworkArm> robot;
  std::vector<DeviceCheck> checks;
};

Result<RealChecks> real_checks(const Config& config, Narrator& narrator) {
  RealChecks real;
  auto checks = real_device_checks(config);
  if (!checks) return std::unexpected(checks.error());
  real.checks = std::move(*checks);
  if (names_network_robot(config)) real.robot = check_robot(config, narrator, real.checks);
  return real;
}

}  // namespace

Result<std::vector<CheckedDevice>> ask_real_devices(const Config& config, Narrator& narrator) {
  const auto real = real_checks(config, narrator);
  if (!real) return std::unexpected(real.error());
  RealClock clock;
  return watch_devices(real->checks, clock);
}

int run_check(const CheckCommand& command) {
  auto loaded = load_config(command.sources);
  if (!loaded) return fail(loaded.error());
  Config config = loaded->config;
  Narrator narrator;
  auto real = real_checks(config, narrator);
  if (!real) return fail(real.error());
  std::vector<DeviceCheck>& checks = real->checks;
  const bool simulated = checks.empty();
  std::optional<UsbCheck> usb;
  if (config.camera.device != "none" || config.depth.device != "none") usb.emplace().add_to(checks);
  auto cell = sim::make_simulated_cell({config.cell, static_cast<std::uint64_t>(config.seed), true, "", config.workers,
                                        configured_boards(config), config.depth.sensor});
  if (!cell) return fail(cell.error());
  sim::SimulatedCell& world = **cell;
  if (simulated) describe_cell(world.description(), config);
  const auto stand_in = [&](std::string_view role, std::unique_ptr<WatchedDevice> device) {
    if (std::ranges::find(checks, role, &DeviceCheck::role) != checks.end()) return;
    checks.push_back({std::string(role), true, std::move(device)});
  };
  stand_in(kArmRole, watch_arm(world.arm(), nullptr));
  stand_in(kColorRole, watch_stream(world.color(), nullptr));
  stand_in(kDepthRole, watch_depth(world.depth(), nullptr));
  stand_in(kPendantRole, watch_pendant(world.pendant(), nullptr));
  stand_in(kPanelRole, watch_panel(world.panel(), nullptr));
  constexpr std::string_view kOrder[] = {kArmRole, kColorRole, kDepthRole, kPendantRole, kPanelRole, kUsbRole};
  std::ranges::sort(checks, {}, [&](const DeviceCheck& check) { return std::ranges::find(kOrder, check.role); });
  std::unique_ptr<Clock> clock;
  if (simulated) {
    clock = std::make_unique<VirtualClock>();
  } else {
    clock = std::make_unique<RealClock>();
  }
  narrator.line(simulated ? fmt::format("no device is configured: those of the simulated cell {}", config.cell)
                          : fmt::format("what is not configured is of the simulated cell {}", config.cell));
  CheckResult result{watch_devices(checks, *clock), check_warnings(config, simulated)};
  if (usb) std::ranges::move(usb->warnings(), std::back_inserter(result.warnings));
  std::fputs((command.json ? check_json(result) : check_text(result)).c_str(), stdout);
  return result.all_ready() ? kExitDone : kExitDevice;
}

}  // namespace firstlook
