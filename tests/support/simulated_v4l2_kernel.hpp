/// The kernel as a V4L2 driver meets it: one camera behind a path, in virtual time, and what real drivers do.
#pragma once

#include <linux/videodev2.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <deque>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "platform/core/time.hpp"
#include "platform/linux/system_calls.hpp"
#include "platform/linux/wakeup.hpp"

namespace firstlook::test {

class SimulatedV4l2Kernel final : public SystemCalls {
 public:
  // What the camera is.
  std::string path = "/dev/v4l/by-id/usb-test-index0";
  std::string card = "Test camera";
  std::uint32_t capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
  std::vector<std::uint32_t> formats{V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_MJPEG};
  /// What S_FMT makes of a size.
  std::function<void(v4l2_pix_format&)> grant = [](v4l2_pix_format&) {};
  Duration period = milliseconds(40);
  Duration transfer = milliseconds(20);  ///< from the time stamp to the buffer
  std::uint32_t stamp_flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
  std::int64_t stamp_shift_ns = 0;
  std::uint32_t first_sequence = 0;
  std::uint32_t buffers_granted = 4;
  std::map<std::uint32_t, std::int32_t> controls;  ///< those that it has
  std::map<std::uint32_t, std::int32_t> limits;    ///< values above are cut
  /// The bytes of frame number n.
  std::function<std::vector<std::uint8_t>(std::uint32_t)> picture;

  // What goes wrong.
  bool present = true, stalled = false;
  bool keeps_last = false;         ///< whoever begins to stream gets a frame of before at once, as v4l2loopback does
  std::set<std::uint32_t> lost;    ///< frames that the driver never fills a buffer with, by number
  std::set<std::uint32_t> broken;  ///< frames flagged as errors
  std::set<std::uint32_t> cut;     ///< frames of half the bytes
  int input_errors = 0;            ///< so many DQBUF give EIO
  std::map<unsigned long, int> refuse;  ///< an errno for each request
  int open_error = 0;
  // With an own thread above it: the computer's time in place of set_now(), and an opening that takes its time.
  bool real_time = false;
  Duration open_takes{};

  void set_now(Instant now) { now_ = now; }
  void unplug() {
    present = false;
    streaming_ = false;
  }
  [[nodiscard]] std::int64_t offset_ns() const { return kBoot_ns; }
  [[nodiscard]] bool is_open() const { return open_; }
  [[nodiscard]] std::size_t mapped() const { return mapped_; }
  [[nodiscard]] int opens() const { return opens_; }
  [[nodiscard]] bool streaming() const { return streaming_; }

  int open(const char* asked, int) override {
    if (!present || path != asked) return -ENOENT;
    if (open_error != 0) return -open_error;
    if (open_takes.ns > 0) std::this_thread::sleep_for(std::chrono::nanoseconds(open_takes.ns));
    open_ = true;
    gone_ = false;
    ++opens_;
    return 5;
  }
  int close(int) override {
    open_ = streaming_ = false;
    queued_.clear();
    return 0;
  }
  int socket(int, int, int) override { return -EAFNOSUPPORT; }
  int bind(int, const sockaddr*, socklen_t) override { return -ENOTSOCK; }
  int setsockopt(int, int, int, const void*, socklen_t) override { return -ENOTSOCK; }
  int poll(pollfd*, std::size_t, int) override { return 0; }
  std::ptrdiff_t read(int, void*, std::size_t) override { return -EINVAL; }
  std::ptrdiff_t write(int, const void*, std::size_t) override { return -EINVAL; }
  std::int64_t monotonic_ns() override { return real_time ? firstlook::monotonic_ns() : kBoot_ns + now_.ns; }
  int mmap(std::size_t size, int, std::int64_t offset, void** mapped) override {
    auto& buffer = memory_.at(static_cast<std::size_t>(offset / kPage));
    if (size != buffer.size()) return -EINVAL;
    *mapped = buffer.data();
    ++mapped_;
    return 0;
  }
  int munmap(void*, std::size_t) override {
    --mapped_;
    return 0;
  }

  int ioctl(int, unsigned long request, void* argument) override {
    if (!open_) return -EBADF;
    if (real_time) now_ = {firstlook::monotonic_ns() - kBoot_ns};
    if (!present) return -ENODEV;
    if (const auto refused = refuse.find(request); refused != refuse.end()) return -refused->second;
    switch (request) {
      case VIDIOC_QUERYCAP: {
        auto& c = *static_cast<v4l2_capability*>(argument);
        std::strncpy(reinterpret_cast<char*>(c.driver), "test", sizeof c.driver);
        std::strncpy(reinterpret_cast<char*>(c.card), card.c_str(), sizeof c.card - 1);
        c.device_caps = capabilities;
        c.capabilities = capabilities | V4L2_CAP_DEVICE_CAPS | V4L2_CAP_META_CAPTURE;
        return 0;
      }
      case VIDIOC_S_FMT: {
        auto& pix = static_cast<v4l2_format*>(argument)->fmt.pix;
        if (std::ranges::find(formats, pix.pixelformat) == formats.end()) pix.pixelformat = formats.front();
        pix.bytesperline = pix.pixelformat == V4L2_PIX_FMT_YUYV ? 2 * pix.width : pix.width;
        pix.field = V4L2_FIELD_NONE;
        grant(pix);
        pix.sizeimage = std::max(pix.sizeimage, pix.bytesperline * pix.height * 3 / 2);
        format_ = pix;
        return 0;
      }
      case VIDIOC_S_PARM: {
        auto& p = static_cast<v4l2_streamparm*>(argument)->parm.capture.timeperframe;
        p = {static_cast<std::uint32_t>(period.ns / 1000), 1000000};
        return 0;
      }
      case VIDIOC_REQBUFS: {
        auto& r = *static_cast<v4l2_requestbuffers*>(argument);
        r.count = std::min(r.count, buffers_granted);
        memory_.assign(r.count, std::vector<std::uint8_t>(format_.sizeimage));
        return 0;
      }
      case VIDIOC_QUERYBUF: {
        auto& b = *static_cast<v4l2_buffer*>(argument);
        b.length = format_.sizeimage;
        b.m.offset = static_cast<std::uint32_t>(b.index * kPage);
        return 0;
      }
      case VIDIOC_QBUF:
        queued_.push_back(static_cast<v4l2_buffer*>(argument)->index);
        return 0;
      case VIDIOC_STREAMON:
        streaming_ = true;
        next_ = 0;
        begin_ = now_;
        filled_.clear();
        if (keeps_last) fill(next_++);
        return 0;
      case VIDIOC_STREAMOFF:
        streaming_ = false;
        return 0;
      case VIDIOC_G_CTRL:
      case VIDIOC_S_CTRL:
        return control(request == VIDIOC_S_CTRL, *static_cast<v4l2_control*>(argument));
      case VIDIOC_DQBUF:
        return dequeue(*static_cast<v4l2_buffer*>(argument));
      default:
        return -ENOTTY;
    }
  }

 private:
  struct Filled {
    std::uint32_t index, number, bytes;
  };
  static constexpr std::int64_t kBoot_ns = 123'456'789'000;
  static constexpr std::int64_t kPage = 1 << 24;

  int control(bool set, v4l2_control& c) {
    const auto found = controls.find(c.id);
    if (found == controls.end()) return -EINVAL;
    if (!set) {
      c.value = found->second;
      return 0;
    }
    // A value cannot be written while its automatic is on.
    const bool automatic =
        controls.contains(V4L2_CID_EXPOSURE_AUTO) && controls[V4L2_CID_EXPOSURE_AUTO] != V4L2_EXPOSURE_MANUAL;
    if (c.id == V4L2_CID_EXPOSURE_ABSOLUTE && automatic) return -EACCES;
    if (c.id == V4L2_CID_FOCUS_ABSOLUTE && controls.contains(V4L2_CID_FOCUS_AUTO) && controls[V4L2_CID_FOCUS_AUTO] != 0)
      return -EACCES;
    found->second = limits.contains(c.id) ? std::min(c.value, limits[c.id]) : c.value;
    return 0;
  }
  [[nodiscard]] Instant stamp(std::uint32_t number) const { return begin_ + period * (number + 1) - transfer; }

  /// Fills buffers with what has arrived by now; what finds no buffer is lost, as in the kernel.
  void advance() {
    while (streaming_ && !stalled && stamp(next_) + transfer <= now_) {
      const std::uint32_t number = next_++;
      if (!lost.contains(number) && !queued_.empty()) fill(number);
    }
  }
  void fill(std::uint32_t number) {
    const std::uint32_t index = queued_.front();
    queued_.pop_front();
    std::vector<std::uint8_t> bytes = picture(number);
    if (cut.contains(number)) bytes.resize(bytes.size() / 2);
    std::ranges::copy(bytes, memory_.at(index).begin());
    filled_.push_back({index, number, static_cast<std::uint32_t>(bytes.size())});
  }
  int dequeue(v4l2_buffer& b) {
    if (!streaming_) return -EINVAL;
    if (input_errors > 0) {
      --input_errors;
      return -EIO;
    }
    advance();
    if (filled_.empty()) return -EAGAIN;
    const Filled f = filled_.front();
    filled_.pop_front();
    const std::int64_t ns = kBoot_ns + stamp(f.number).ns + stamp_shift_ns;
    b.index = f.index;
    b.bytesused = f.bytes;
    b.sequence = first_sequence + f.number;
    b.flags = stamp_flags | (broken.contains(f.number) ? V4L2_BUF_FLAG_ERROR : 0U);
    b.timestamp.tv_sec = ns / 1'000'000'000;
    b.timestamp.tv_usec = ns % 1'000'000'000 / 1000;
    return 0;
  }

  Instant now_{}, begin_{};
  bool open_ = false, streaming_ = false, gone_ = false;
  int opens_ = 0;
  std::size_t mapped_ = 0;
  v4l2_pix_format format_{};
  std::vector<std::vector<std::uint8_t>> memory_;
  std::deque<std::uint32_t> queued_;
  std::deque<Filled> filled_;
  std::uint32_t next_ = 0;
};

}  // namespace firstlook::test
