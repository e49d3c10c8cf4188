#include "app/wiring/real_devices.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "app/dataset/calibration_dataset.hpp"
#include "app/wiring/usb_check.hpp"
#include "hal/can/can_panel.hpp"
#include "hal/freenect/kinect.hpp"
#include "hal/openni/openni_depth.hpp"
#include "hal/v4l2/threaded_camera.hpp"
#include "platform/linux/system_calls.hpp"
#include "platform/loop/clock.hpp"
#include "platform/loop/event.hpp"
#include "platform/memory/budget.hpp"

namespace firstlook {
namespace {

/// A device together with the watch on it.
template <typename Device>
class OwnedDevice final : public WatchedDevice {
 public:
  template <typename Watch>
  OwnedDevice(std::shared_ptr<Device> device, Watch watch) : device_(std::move(device)), watch_(watch(*device_)) {}
  void poll(Instant now) override { watch_->poll(now); }
  [[nodiscard]] Instant next_due() const override { return watch_->next_due(); }
  [[nodiscard]] hal::DeviceReport report(Instant now) const override { return watch_->report(now); }

 private:
  std::shared_ptr<Device> device_;  ///< a Kinect has two cameras
  std::unique_ptr<WatchedDevice> watch_;
};

/// Watches a device that was made, or tells why it was not.
template <typename Device, typename Watch>
DeviceCheck check_of(std::string_view role, std::string_view name, Result<std::unique_ptr<Device>> device,
                     Watch watch) {
  if (!device) return {std::string(role), false, absent_device(name, device.error())};
  return {std::string(role), false, std::make_unique<OwnedDevice<Device>>(std::move(*device), watch)};
}

std::uint8_t bytes_for(std::initializer_list<int> bits) {
  return static_cast<std::uint8_t>(std::max(0, std::max(bits)) / 8 + 1);
}

can::CanPanelOptions panel_options(const Config::Panel& p) {
  can::CanPanelOptions options;
  options.io.interface = p.can_interface;
  options.io.node = static_cast<std::uint8_t>(p.node_id);
  options.io.vendor = static_cast<std::uint32_t>(p.vendor_id);
  options.io.product = static_cast<std::uint32_t>(p.product_code);
  options.io.input_bytes = bytes_for({p.start_input, p.stop_input, p.confirm_input, p.enabling_input});
  options.io.output_bytes = bytes_for({p.red_output, p.amber_output, p.green_output, p.buzzer_output});
  options.wiring = {p.start_input, p.stop_input,   p.confirm_input, p.enabling_input, p.stop_contact == "opens",
                    p.red_output,  p.amber_output, p.green_output,  p.buzzer_output};
  return options;
}

/// The intrinsics of a file, for pictures of this size. "none": those of a lens of 60 degrees, where a calibration that
/// estimates them begins.
Result<CameraIntrinsics> intrinsics_of(const std::string& file, int width, int height) {
  if (file == "none") {
    const double focal_px = width / (2 * std::tan(std::numbers::pi / 6));
    return CameraIntrinsics{width, height, focal_px, focal_px, (width - 1) / 2.0, (height - 1) / 2.0};
  }
  const Result<CameraIntrinsics> read = read_camera_info(file);
  if (read && (read->width != width || read->height != height)) {
    return failure(Fault::kConfigBadValue, "{} is of {} x {} pixels, the camera's pictures are {} x {}", file,
                   read->width, read->height, width, height);
  }
  return read;
}

v4l2::V4l2CameraOptions camera_options(const Config::Camera& c, const CameraIntrinsics& intrinsics) {
  using v4l2::PixelFormat;
  v4l2::V4l2CameraOptions options;
  options.capture.device = c.device;
  options.capture.width = c.width;
  options.capture.height = c.height;
  options.capture.rate_hz = c.rate_hz;
  constexpr std::pair<std::string_view, PixelFormat> kFormats[] = {{"YUYV", PixelFormat::kYuyv},
                                                                   {"NV12", PixelFormat::kNv12},
                                                                   {"GREY", PixelFormat::kGrey},
                                                                   {"MJPG", PixelFormat::kMjpeg}};
  for (const auto& [name, format] : kFormats) {
    if (c.format == "auto" || c.format == name) options.capture.formats.push_back(format);
  }
  options.capture.controls = v4l2::fixed_controls(c.exposure_us, c.gain, c.focus, c.white_balance_k);
  options.exposure = {static_cast<std::int64_t>(c.exposure_us) * 1000};
  options.intrinsics = intrinsics;
  return options;
}

/// The size is that of the camera_info.yaml, if one is named.
Result<openni::OpenNiDepthOptions> depth_options(const Config::Depth& d) {
  openni::OpenNiDepthOptions options;
  if (d.device != "openni") options.sensor.uri = d.device;
  if (!d.device.ends_with(".oni")) options.reset = usb_reset_of(usb::Part::kDepthSensor);
  if (d.info == "none") return options;
  const Result<CameraIntrinsics> read = read_camera_info(d.info);
  if (!read) return std::unexpected(read.error());
  const std::size_t pixels_max = memory::budget_row(memory::Pool::kDepthFrames).bytes_each / sizeof(std::uint16_t);
  if (static_cast<std::size_t>(read->width) * static_cast<std::size_t>(read->height) > pixels_max) {
    return failure(Fault::kConfigBadValue,
                   "depth.info: {} is of {} x {} pixels, memory holds depth pictures of {} pixels (640 x 480). "
                   "Name one for a smaller mode of the camera.",
                   d.info, read->width, read->height, pixels_max);
  }
  options.intrinsics = *read;
  options.sensor.width = read->width;
  options.sensor.height = read->height;
  return options;
}

constexpr std::string_view kKinect = "freenect";

/// "freenect" or "freenect:SERIAL".
bool is_kinect(std::string_view device) { return device == kKinect || device.starts_with("freenect:"); }

/// The Kinect behind one camera or both. Errors: those of a camera_info.yaml; a Kinect that is not there is none.
Result<freenect::KinectOptions> kinect_options(const Config& config) {
  freenect::KinectOptions options;
  options.reset = usb_reset_of(usb::Part::kKinectCamera);
  options.usb.depth = is_kinect(config.depth.device);
  options.usb.color = is_kinect(config.camera.device);
  for (const std::string& name : {config.depth.device, config.camera.device}) {
    if (is_kinect(name) && name.size() > kKinect.size()) options.usb.serial = name.substr(kKinect.size() + 1);
  }
  if (config.depth.info != "none" && options.usb.depth) {
    const auto read = intrinsics_of(config.depth.info, freenect::kWidth, freenect::kHeight);
    if (!read) return std::unexpected(read.error());
    options.depth_intrinsics = *read;
  }
  if (config.camera.info != "none" && options.usb.color) {
    const auto read = intrinsics_of(config.camera.info, freenect::kWidth, freenect::kHeight);
    if (!read) return std::unexpected(read.error());
    options.color_intrinsics = *read;
  }
  return options;
}

Status add_kinect(const Config& config, std::vector<DeviceCheck>& checks) {
  const auto options = kinect_options(config);
  if (!options) return std::unexpected(options.error());
  auto made = freenect::Kinect::make(kernel(), *options);
  const auto add = [&](std::string_view role, auto watch) {
    if (!made) {
      checks.push_back({std::string(role), false, absent_device(kKinect, made.error())});
    } else {
      checks.push_back({std::string(role), false, watch()});
    }
  };
  const std::shared_ptr<freenect::Kinect> kinect = made ? std::move(*made) : nullptr;
  using Owned = OwnedDevice<freenect::Kinect>;
  if (options->usb.color) {
    add(kColorRole, [&] {
      return std::make_unique<Owned>(kinect,
                                     [](freenect::Kinect& k) { return watch_stream(k.color(), &k.color_report()); });
    });
  }
  if (options->usb.depth) {
    add(kDepthRole, [&] {
      return std::make_unique<Owned>(kinect,
                                     [](freenect::Kinect& k) { return watch_depth(k.depth(), &k.depth_report()); });
    });
  }
  return {};
}

Result<std::unique_ptr<v4l2::ThreadedCamera>> make_v4l2(const Config& config, const CameraIntrinsics& intrinsics) {
  return v4l2::ThreadedCamera::make(kernel(), camera_options(config.camera, intrinsics));
}

std::unique_ptr<can::CanPanel> make_panel(const Config& config) {
  return std::make_unique<can::CanPanel>(kernel(), panel_options(config.panel));
}

DeviceCheck panel_check(const Config& config) {
  return check_of<can::CanPanel>(kPanelRole, config.panel.can_interface, make_panel(config),
                                 [](can::CanPanel& panel) { return watch_panel(panel, &panel); });
}

class NoPanel final : public hal::Panel {
 public:
  [[nodiscard]] std::optional<hal::OperatorEvent> poll(Instant) override { return std::nullopt; }
  [[nodiscard]] Instant next_due() const override { return kNever; }
  void light(hal::Light) override {}
};

Status open_kinect(const Config& config, RealDevices& devices) {
  const auto options = kinect_options(config);
  if (!options) return std::unexpected(options.error());
  auto made = freenect::Kinect::make(kernel(), *options);
  if (!made) return std::unexpected(made.error());
  const std::shared_ptr<freenect::Kinect> kinect = std::move(*made);
  if (options->usb.color) {
    devices.color = &kinect->color();
    devices.telling.push_back({CartDevice::kColorCamera, &kinect->color_report()});
  }
  if (options->usb.depth) {
    devices.depth = &kinect->depth();
    devices.telling.push_back({CartDevice::kDepthCamera, &kinect->depth_report()});
  }
  devices.owned.push_back(kinect);
  return {};
}

/// Takes what was made, or its error.
template <typename Device, typename Interface>
Status take(CartDevice which, Result<std::unique_ptr<Device>> made, Interface*& place, RealDevices& devices) {
  if (!made) return std::unexpected(made.error());
  place = made->get();
  devices.telling.push_back({which, made->get()});
  devices.owned.push_back(std::shared_ptr<Device>(std::move(*made)));
  return {};
}

}  // namespace

bool names_real_devices(const Config& config) {
  return config.camera.device != "none" || config.depth.device != "none" || config.panel.can_interface != "none";
}

Result<RealDevices> open_real_devices(const Config& config, std::vector<CheckedDevice>& asked) {
  RealDevices devices;
  if (is_kinect(config.camera.device) || is_kinect(config.depth.device)) {
    if (const Status opened = open_kinect(config, devices); !opened) return std::unexpected(opened.error());
  }
  if (devices.color == nullptr) {
    const auto intrinsics = intrinsics_of(config.camera.info, config.camera.width, config.camera.height);
    if (!intrinsics) return std::unexpected(intrinsics.error());
    const Status opened = take(CartDevice::kColorCamera, make_v4l2(config, *intrinsics), devices.color, devices);
    if (!opened) return std::unexpected(opened.error());
  }
  if (devices.depth == nullptr) {
    const auto options = depth_options(config.depth);
    if (!options) return std::unexpected(options.error());
    const Status opened =
        take(CartDevice::kDepthCamera, openni::OpenNiDepth::make(kernel(), *options), devices.depth, devices);
    if (!opened) return std::unexpected(opened.error());
  }
  auto panel = open_panel(config, asked);
  if (!panel) return std::unexpected(panel.error());
  if (!panel->panel) panel->panel = std::make_shared<NoPanel>();
  devices.panel = panel->panel.get();
  for (const TellingDevice& device : panel->telling) devices.telling.push_back(device);
  devices.owned.push_back(std::move(panel->panel));
  return devices;
}

Result<OpenedPanel> open_panel(const Config& config, std::vector<CheckedDevice>& asked) {
  OpenedPanel opened;
  if (config.panel.can_interface == "none") return opened;
  {
    const DeviceCheck check = panel_check(config);
    RealClock clock;
    const CheckedDevice answered = watch_devices({&check, 1}, clock).front();
    const hal::DeviceReport& report = answered.report;
    if (report.state != hal::DeviceState::kReady) {
      asked.push_back(answered);
      return failure(Fault::kDeviceMissing, "panel {}: {}. {}", report.device.view(), report.detail.view(),
                     report.remedy.view());
    }
  }
  // Another one for the job: the clock of a job begins anew.
  std::shared_ptr<can::CanPanel> panel = make_panel(config);
  opened.telling.push_back({CartDevice::kPanel, panel.get()});
  opened.panel = std::move(panel);
  return opened;
}

Result<std::vector<DeviceCheck>> real_device_checks(const Config& config) {
  std::vector<DeviceCheck> checks;
  if (is_kinect(config.camera.device) || is_kinect(config.depth.device)) {
    if (const Status status = add_kinect(config, checks); !status) return std::unexpected(status.error());
  }
  if (config.camera.device != "none" && !is_kinect(config.camera.device)) {
    const auto intrinsics = intrinsics_of(config.camera.info, config.camera.width, config.camera.height);
    if (!intrinsics) return std::unexpected(intrinsics.error());
    checks.push_back(check_of(kColorRole, config.camera.device, make_v4l2(config, *intrinsics),
                              [](v4l2::ThreadedCamera& camera) { return watch_stream(camera, &camera); }));
  }
  if (config.depth.device != "none" && !is_kinect(config.depth.device)) {
    const auto options = depth_options(config.depth);
    if (!options) return std::unexpected(options.error());
    checks.push_back(check_of(kDepthRole, config.depth.device, openni::OpenNiDepth::make(kernel(), *options),
                              [](openni::OpenNiDepth& camera) { return watch_depth(camera, &camera); }));
  }
  if (config.panel.can_interface != "none") {
    checks.push_back(panel_check(config));
  }
  return checks;
}

}  // namespace firstlook
