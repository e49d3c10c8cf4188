/// The cameras of a simulated cell on the guest's devices, following the arm that `firstlook ur-sim --cell` moves:
///   rig_cameras CELL SEED VIDEO_DEVICE     feeds a v4l2loopback device, and depth through DepthWindow
///   rig_cameras CELL SEED --describe       the lines of a firstlook.yaml and of camera_info files, for the rig
#include <fcntl.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "hal/sim/simulated_cell.hpp"
#include "hal/sim/ur_controller/simulated_ur.hpp"
#include "hal/sim/ur_controller/truth_reader.hpp"
#include "platform/linux/process.hpp"
#include "platform/linux/wakeup.hpp"
#include "platform/loop/clock.hpp"
#include "tests/rig/depth_window.hpp"

namespace firstlook::rig {
namespace {

constexpr int kRate_hz = 10;
constexpr const char* kDepthHangsPath = "/run/rig/depth-hangs";  // while it is there, depth repeats one picture

int complain(const char* what, const char* why) {
  std::fprintf(stderr, "rig_cameras: %s: %s\n", what, why);
  return 1;
}

int complain(const char* what, const Error& error) { return complain(what, std::string(error.detail()).c_str()); }

/// The device takes YUYV frames by write(2). Below 0 when it refuses.
int open_video(const char* path, int width, int height) {
  const int device = open(path, O_RDWR | O_CLOEXEC);
  if (device < 0) return -1;
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
  format.fmt.pix.width = static_cast<std::uint32_t>(width);
  format.fmt.pix.height = static_cast<std::uint32_t>(height);
  format.fmt.pix.pixelformat = V4L2_PIX_FMT_YUYV;
  format.fmt.pix.field = V4L2_FIELD_NONE;
  format.fmt.pix.bytesperline = static_cast<std::uint32_t>(2 * width);
  format.fmt.pix.sizeimage = static_cast<std::uint32_t>(2 * width * height);
  if (ioctl(device, VIDIOC_S_FMT, &format) == 0) return device;
  const int refused = errno;
  close(device);
  errno = refused;
  return -1;
}

DepthWindow* make_window() {
  const int file = open(kDepthWindowPath, O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (file < 0 || ftruncate(file, sizeof(DepthWindow)) != 0) return nullptr;
  void* const bytes = mmap(nullptr, sizeof(DepthWindow), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  close(file);
  return bytes == MAP_FAILED ? nullptr : static_cast<DepthWindow*>(bytes);
}

float field_of_view_rad(int pixels, double focal_px) {
  return static_cast<float>(2 * std::atan(pixels / (2 * focal_px)));
}

/// The feed of true joints, with an eye on whether the arm moves, and whether the robot is there at all.
class WatchedFeed final : public sim::TrueJointFeed {
 public:
  explicit WatchedFeed(sim::TrueJointFeed& feed) : feed_(feed) {}
  [[nodiscard]] const std::array<DhRow, kJointsMax>& true_dh() const override { return feed_.true_dh(); }
  [[nodiscard]] std::optional<Sample> next() override {
    const auto sample = feed_.next();
    if (sample) {
      heard_ns_ = monotonic_ns();
      for (int j = 0; j < sample->joints_rad.size(); ++j) {
        if (std::abs(sample->joints_rad[j] - stood_rad_[j]) <= kStands_rad) continue;
        stood_rad_ = sample->joints_rad;
        moved_ns_ = monotonic_ns();
      }
    }
    return sample;
  }
  void touched() override { feed_.touched(); }
  void lead(const JointVector& to_rad, double speed_rad_s, double acceleration_rad_s2) override {
    feed_.lead(to_rad, speed_rad_s, acceleration_rad_s2);
  }
  [[nodiscard]] std::int64_t moved_ns() const { return moved_ns_; }
  [[nodiscard]] bool gone() const { return monotonic_ns() - heard_ns_ > kGone_ns; }

 private:
  // After a motion an arm swings by up to 1.2 mrad about its rest: it stands, for all that.
  static constexpr double kStands_rad = 3e-3;
  static constexpr std::int64_t kGone_ns = 1'000'000'000;
  sim::TrueJointFeed& feed_;
  JointVector stood_rad_ = JointVector::zero(kJointsMax);
  std::int64_t moved_ns_ = monotonic_ns(), heard_ns_ = moved_ns_;
};

/// A cell whose arm is the robot's.
struct Followed {
  sim::ur::TcpTruth truth;
  std::optional<WatchedFeed> arm;
  std::unique_ptr<sim::SimulatedCell> cell;
};

Result<std::unique_ptr<Followed>> follow(sim::SimulationOptions options) {
  auto channel = sim::ur::connect_private_channel("127.0.0.1", static_cast<std::uint16_t>(sim::ur::Port::kTruth));
  if (!channel) return std::unexpected(channel.error());
  auto followed = std::make_unique<Followed>();
  if (const Status there = followed->truth.connect(std::move(channel->stream)); !there)
    return std::unexpected(there.error());
  options.feed = &followed->arm.emplace(followed->truth);
  auto cell = sim::make_simulated_cell(options);
  if (!cell) return std::unexpected(cell.error());
  followed->cell = std::move(*cell);
  return followed;
}

/// What to show. Rendering is what an emulated computer is slowest at: it is done once for each place where the arm
/// stands, when it has swung out. While it moves the last picture is shown again, which is wrong then (the rig's
/// configuration uses no pictures of a moving camera), and none in between: one of before would be taken for one of
/// now.
enum class Shown : std::uint8_t { kLast, kNone, kNew };
class Freshness {
 public:
  [[nodiscard]] Shown next(std::int64_t moved_ns) {
    constexpr std::int64_t kStands_ns = 60'000'000, kSwings_ns = 250'000'000;
    if (rendered_ns_ > moved_ns) return Shown::kLast;
    const std::int64_t stood_ns = monotonic_ns() - moved_ns;
    if (stood_ns < kStands_ns && rendered_ns_ != 0) return Shown::kLast;
    if (stood_ns < kSwings_ns) return Shown::kNone;
    rendered_ns_ = monotonic_ns();
    return Shown::kNew;
  }

 private:
  std::int64_t rendered_ns_ = 0;
};

/// Feeds the devices, at most kRate_hz times a second each.
class Feeder {
 public:
  Feeder(const CameraIntrinsics& color, const CameraIntrinsics& depth, int video, DepthWindow& window)
      : color_(color),
        depth_of_(depth),
        video_(video),
        window_(window),
        gray_(pixels_of(color)),
        depth_(pixels_of(depth)),
        yuyv_(2 * gray_.size(), 128) {
    window.horizontal_fov_rad = field_of_view_rad(depth.width, depth.fx);
    window.vertical_fov_rad = field_of_view_rad(depth.height, depth.fy);
  }

  /// What the cell shows now; its clock began at `clock_start_ns`.
  Status turn(Followed& followed, Instant now, std::int64_t clock_start_ns) {
    sim::SimulatedCell& cell = *followed.cell;
    if (const auto frame = cell.color().poll(now)) {
      const Shown shown = color_fresh_.next(followed.arm->moved_ns());
      if (shown == Shown::kNew) {
        if (const Status read = cell.color().read(*frame, {gray_.data(), color_.width, color_.height}); !read)
          return read;
        for (std::size_t i = 0; i < gray_.size(); ++i) yuyv_[2 * i] = gray_[i];
      }
      if (shown != Shown::kNone) {
        if (const Status given = give_color(); !given) return given;
      }
    }
    if (const auto frame = cell.depth().poll(now)) {
      const Shown shown = depth_fresh_.next(followed.arm->moved_ns());
      if (shown == Shown::kNew) {
        if (const Status read = cell.depth().read(*frame, {depth_.data(), depth_of_.width, depth_of_.height}); !read)
          return read;
      }
      if (shown != Shown::kNone) give_depth(frame->stamp.ns + clock_start_ns);
    }
    return {};
  }
  /// The robot is away, and its arm stands: cameras go on.
  Status again() {
    give_depth(monotonic_ns());
    return give_color();
  }

 private:
  static std::size_t pixels_of(const CameraIntrinsics& k) {
    return static_cast<std::size_t>(k.width) * static_cast<std::size_t>(k.height);
  }

  Status give_color() {
    if (write(video_, yuyv_.data(), yuyv_.size()) < 0) return failure(Fault::kDiskWrite, "{}", std::strerror(errno));
    return {};
  }

  void give_depth(std::int64_t stamp_ns) {
    window_.turn.fetch_add(1, std::memory_order_acq_rel);
    std::memcpy(window_.depth_mm, depth_.data(), sizeof window_.depth_mm);
    ++window_.frame;
    if (access(kDepthHangsPath, F_OK) != 0) change_one_pixel();
    window_.stamp_us = static_cast<std::uint64_t>(stamp_ns / 1000);
    window_.turn.fetch_add(1, std::memory_order_release);
  }

  /// No sensor gives the same picture twice, and firstlook stops at one that does.
  void change_one_pixel() {
    for (std::size_t i = 0; i < depth_.size(); ++i) {
      std::uint16_t& pixel = window_.depth_mm[(window_.frame + i) % depth_.size()];
      if (pixel == 0) continue;                                           // it stays without a return
      pixel = static_cast<std::uint16_t>(pixel + 1 + window_.frame % 7);  // of several frames it may be the same pixel
      return;
    }
  }

  CameraIntrinsics color_, depth_of_;
  Freshness color_fresh_, depth_fresh_;
  int video_;
  DepthWindow& window_;
  std::vector<std::uint8_t> gray_;
  std::vector<std::uint16_t> depth_;
  std::vector<std::uint8_t> yuyv_;
};

/// Until the robot goes, or somebody ends this.
Status feed_from(Followed& followed, Feeder& feeder) {
  const std::int64_t clock_start_ns = monotonic_ns();
  RealClock clock;
  while (!stop_signal_received() && !followed.arm->gone()) {
    if (const Status fed = feeder.turn(followed, clock.now(), clock_start_ns); !fed) return fed;
    clock.sleep_until(clock.now() + milliseconds(1000 / kRate_hz));
  }
  return {};
}

/// Until a robot is there again; null when somebody ended this.
Result<std::unique_ptr<Followed>> await_robot(const sim::SimulationOptions& options, Feeder& feeder) {
  RealClock clock;
  while (!stop_signal_received()) {
    if (auto followed = follow(options)) return followed;
    if (const Status fed = feeder.again(); !fed) return std::unexpected(fed.error());
    clock.sleep_until(clock.now() + milliseconds(1000 / kRate_hz));
  }
  return nullptr;
}

int feed(const sim::SimulationOptions& options, const char* device) {
  auto followed = follow(options);
  if (!followed) return complain("the simulated robot", followed.error());
  const CameraIntrinsics color = (*followed)->cell->color().intrinsics();
  const int video = open_video(device, color.width, color.height);
  if (video < 0) {
    const std::string why = std::strerror(errno);
    return complain(device, ("cannot be fed with YUYV pictures (" + why + "); is it a v4l2loopback device?").c_str());
  }
  DepthWindow* const window = make_window();
  if (window == nullptr) return complain(kDepthWindowPath, std::strerror(errno));
  Feeder feeder(color, (*followed)->cell->depth().intrinsics(), video, *window);
  catch_stop_signals();
  while (followed && *followed) {
    if (const Status fed = feed_from(**followed, feeder); !fed) return complain("a frame", fed.error());
    followed->reset();
    followed = await_robot(options, feeder);
  }
  return followed ? 0 : complain("a frame", followed.error());
}

void print_info(const char* name, const CameraIntrinsics& k) {
  std::printf("=== %s\n", name);
  std::printf("image_width: %d\nimage_height: %d\ncamera_name: rig\n", k.width, k.height);
  std::printf("camera_matrix:\n  rows: 3\n  cols: 3\n  data: [%.9g, 0, %.9g, 0, %.9g, %.9g, 0, 0, 1]\n", k.fx, k.cx,
              k.fy, k.cy);
  std::printf(
      "distortion_model: plumb_bob\ndistortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [%.9g, %.9g, %.9g, "
      "%.9g, %.9g]\n",
      k.k1, k.k2, k.p1, k.p2, k.k3);
}

/// What an integrator would have typed in for this cell.
int describe(const sim::SimulationOptions& options) {
  const auto cell = sim::make_simulated_cell(options);
  if (!cell) return complain("the cell", cell.error());
  const sim::CellDescription& d = (*cell)->description();
  print_info("color_info.yaml", d.color);
  print_info("depth_info.yaml", d.depth);
  std::printf("=== cell.yaml\ncart:\n  top_m: %.9g\n", d.cart_top_m);
  std::printf("safe_zone:\n  radius_m: %.9g\n  height_m: %.9g\n", d.safe_zone.radius_m, d.safe_zone.height_m);
  const Eigen::Vector3d p = d.camera_T_depth.translation();
  std::printf("mount_m: [%.9g, %.9g, %.9g]\n", p.x(), p.y(), p.z());
  std::printf("start_rad: [");
  for (int j = 0; j < d.start_rad.count; ++j)
    std::printf("%s%.9g", j == 0 ? "" : ", ", d.start_rad.values[static_cast<std::size_t>(j)]);
  std::printf("]\n");
  return 0;
}

}  // namespace
}  // namespace firstlook::rig

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fprintf(stderr, "usage: rig_cameras CELL SEED VIDEO_DEVICE|--describe\n");
    return 2;
  }
  firstlook::sim::SimulationOptions options;
  options.cell = argv[1];
  options.seed = std::stoull(argv[2]);
  if (std::string_view(argv[3]) == "--describe") return firstlook::rig::describe(options);
  return firstlook::rig::feed(options, argv[3]);
}
