#include "app/real_devices.hpp"

#include <algorithm>
#include <utility>

#include "app/dataset/calibration_dataset.hpp"
#include "hal/can/can_panel.hpp"
#include "hal/freenect/kinect.hpp"
#include "hal/openni/openni_depth.hpp"
#include "hal/v4l2/threaded_camera.hpp"
#include "platform/linux/system_calls.hpp"

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

/// The intrinsics of a file, for pictures of this size. "none": a size alone.
Result<CameraIntrinsics> intrinsics_of(const std::string& file, int width, int height) {
  if (file == "none") return CameraIntrinsics{width, height};
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
  if (d.info == "none") return options;
  const Result<CameraIntrinsics> read = read_camera_info(d.info);
  if (!read) return std::unexpected(read.error());
  options.intrinsics = *read;
  options.sensor.width = read->width;
  options.sensor.height = read->height;
  return options;
}

}  // namespace

namespace {

constexpr std::string_view kKinect = "freenect";

/// "freenect" or "freenect:SERIAL".
bool is_kinect(std::string_view device) { return device == kKinect || device.starts_with("freenect:"); }

/// The Kinect behind one camera or both.
Status add_kinect(const Config& config, std::vector<DeviceCheck>& checks) {
  freenect::KinectOptions options;
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
  auto made = freenect::Kinect::make(kernel(), options);
  if (!made) {
    if (options.usb.color) checks.push_back({std::string(kColorRole), false, absent_device(kKinect, made.error())});
    if (options.usb.depth) checks.push_back({std::string(kDepthRole), false, absent_device(kKinect, made.error())});
    return {};
  }
  const std::shared_ptr<freenect::Kinect> kinect = std::move(*made);
  using Owned = OwnedDevice<freenect::Kinect>;
  if (options.usb.color) {
    const auto watch = [](freenect::Kinect& k) { return watch_stream(k.color(), &k.color_report()); };
    checks.push_back({std::string(kColorRole), false, std::make_unique<Owned>(kinect, watch)});
  }
  if (options.usb.depth) {
    const auto watch = [](freenect::Kinect& k) { return watch_stream(k.depth(), &k.depth_report()); };
    checks.push_back({std::string(kDepthRole), false, std::make_unique<Owned>(kinect, watch)});
  }
  return {};
}

}  // namespace

bool names_real_devices(const Config& config) {
  return config.camera.device != "none" || config.depth.device != "none" || config.panel.can_interface != "none";
}

Result<std::vector<DeviceCheck>> real_device_checks(const Config& config) {
  std::vector<DeviceCheck> checks;
  if (is_kinect(config.camera.device) || is_kinect(config.depth.device)) {
    if (const Status status = add_kinect(config, checks); !status) return std::unexpected(status.error());
  }
  if (config.camera.device != "none" && !is_kinect(config.camera.device)) {
    const auto intrinsics = intrinsics_of(config.camera.info, config.camera.width, config.camera.height);
    if (!intrinsics) return std::unexpected(intrinsics.error());
    checks.push_back(check_of(kColorRole, config.camera.device,
                              v4l2::ThreadedCamera::make(kernel(), camera_options(config.camera, *intrinsics)),
                              [](v4l2::ThreadedCamera& camera) { return watch_stream(camera, &camera); }));
  }
  if (config.depth.device != "none" && !is_kinect(config.depth.device)) {
    const auto options = depth_options(config.depth);
    if (!options) return std::unexpected(options.error());
    checks.push_back(check_of(kDepthRole, config.depth.device, openni::OpenNiDepth::make(kernel(), *options),
                              [](openni::OpenNiDepth& camera) { return watch_stream(camera, &camera); }));
  }
  if (config.panel.can_interface != "none") {
    checks.push_back(check_of<can::CanPanel>(kPanelRole, config.panel.can_interface,
                                             std::make_unique<can::CanPanel>(kernel(), panel_options(config.panel)),
                                             [](can::CanPanel& panel) { return watch_panel(panel, &panel); }));
  }
  return checks;
}

}  // namespace firstlook
