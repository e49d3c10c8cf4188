#include <numbers>

#include "app/wiring/cell_robot.hpp"
#include "app/wiring/job_site.hpp"
#include "app/wiring/network_arm.hpp"
#include "app/wiring/real_devices.hpp"
#include "platform/linux/process.hpp"

namespace firstlook {
namespace {

/// Where the integrator says that the depth camera sits on the colour camera.
Transform<Camera, Depth> mounted(const Config::Depth& depth) {
  const Eigen::Vector3d rpy = Eigen::Vector3d(depth.mount_rpy_deg.data()) * (std::numbers::pi / 180);
  const Eigen::Quaterniond turn = Eigen::AngleAxisd(rpy.z(), Eigen::Vector3d::UnitZ()) *
                                  Eigen::AngleAxisd(rpy.y(), Eigen::Vector3d::UnitY()) *
                                  Eigen::AngleAxisd(rpy.x(), Eigen::Vector3d::UnitX());
  return {turn, Eigen::Vector3d(depth.mount_m.data())};
}

class RealSite final : public JobSite {
 public:
  RealSite(std::unique_ptr<NetworkArm> arm, RealDevices devices, const Config& config)
      : arm_(std::move(arm)),
        devices_(std::move(devices)),
        telling_(devices_.telling),
        facts_{config.parking_rad.value(), mounted(config.depth), {}, arm_->model()} {
    telling_.push_back({CartDevice::kArm, arm_.get()});
  }

  CartDevices devices() override {
    return {arm_->arm(), *devices_.color, *devices_.depth, arm_->pendant(), *devices_.panel, telling_};
  }
  CellFacts facts() const override { return facts_; }
  bool in_real_time() const override { return true; }
  void begin(const PublishedSpace&) override {}
  void finish(const Cart&, const Config&, RunRecord& record, Narrator& narrator) override {
    record.robot = arm_->record(narrator);
  }

 private:
  std::unique_ptr<NetworkArm> arm_;
  RealDevices devices_;
  TellingDevices telling_;
  CellFacts facts_;
};

/// What cannot be on a real cart, or not without something else.
Status refuse_what_does_not_fit(const RunCommand& command, const Config& config) {
  if (command.cell_given || command.fast_sensor || !command.faults.empty()) {
    return failure(Fault::kUsage,
                   "{}: the configuration names real cameras (camera.device, depth.device), which are of no simulated "
                   "cell: leave out the one or the other",
                   command.cell_given    ? "--cell"
                   : command.fast_sensor ? "--sensor fast"
                                         : "--faults");
  }
  const std::pair<const char*, bool> wanted[] = {{"robot.host", names_network_robot(config)},
                                                 {"camera.device", config.camera.device != "none"},
                                                 {"depth.device", config.depth.device != "none"}};
  for (const auto& [key, given] : wanted) {
    if (!given) {
      return failure(
          Fault::kConfigBadValue,
          "{} names no device: a job takes robot.host, camera.device and depth.device together, or none of them for "
          "a simulated cell (`firstlook check` asks single devices)",
          key);
    }
  }
  if (const Status fits = refuse_other_arms(config); !fits) return fits;
  if (config.start_source == "panel" && config.panel.can_interface == "none") {
    return failure(Fault::kConfigBadValue, "start_source: panel wants a panel: panel.can_interface is none");
  }
  if (config.camera.info == "none" && config.calibration.intrinsics != "estimate") {
    return failure(Fault::kConfigBadValue,
                   "camera.info is none: name the camera_info.yaml of the colour camera, or let a run find its "
                   "intrinsics with calibration.intrinsics: estimate");
  }
  return {};
}

}  // namespace

bool names_network_robot(const Config& config) {
  const std::string& host = config.robot.host;
  return !config.robot.none() && host != CellRobot::kInProcess && host != CellRobot::kWhereItCan;
}

bool names_real_cart(const Config& config) { return config.camera.device != "none" || config.depth.device != "none"; }

Result<std::unique_ptr<JobSite>> open_real_site(const RunCommand& command, Config& config, Narrator& narrator,
                                                std::vector<CheckedDevice>& asked) {
  if (const Status fits = refuse_what_does_not_fit(command, config); !fits) return std::unexpected(fits.error());
  config.cell = "none";
  if (const Status locked = lock_memory(); !locked) {
    narrator.line(fmt::format("warning   memory is not locked, so the loop may be late: {}", locked.error().detail()),
                  Priority::kWarning);
  }
  auto devices = open_real_devices(config, asked);
  if (!devices) return std::unexpected(devices.error());
  auto arm = NetworkArm::connect(config, narrator);
  if (!arm) return std::unexpected(arm.error());
  if (!config.parking_rad) config.parking_rad = default_start((*arm)->model());
  return std::make_unique<RealSite>(std::move(*arm), std::move(*devices), config);
}

}  // namespace firstlook
