#include "hal/v4l2/capture.hpp"

#include <fcntl.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>

namespace firstlook::v4l2 {
namespace {

constexpr std::int64_t kNanosecondsPerSecond = 1'000'000'000;
constexpr std::int64_t kNanosecondsPerMicrosecond = 1000;

CaptureTrouble trouble_of(int error) {
  switch (error) {
    case ENOENT:
    case ENODEV:
    case ENXIO:
      return CaptureTrouble::kAbsent;
    case EACCES:
    case EPERM:
      return CaptureTrouble::kForbidden;
    case EBUSY:
      return CaptureTrouble::kBusy;
    default:
      return CaptureTrouble::kFailed;
  }
}

StampKind stamp_kind(std::uint32_t flags) {
  if ((flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) != V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC) return StampKind::kUnknown;
  return (flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) == V4L2_BUF_FLAG_TSTAMP_SRC_SOE ? StampKind::kStartOfExposure
                                                                                 : StampKind::kEndOfFrame;
}

template <std::size_t N>
std::string_view text_of(const unsigned char (&field)[N]) {
  const auto* const begin = reinterpret_cast<const char*>(field);
  return {begin, strnlen(begin, N)};
}

}  // namespace

CaptureTrouble Capture::fail(const char* call, int error) {
  const CaptureTrouble trouble = trouble_of(error);
  gone_ = trouble == CaptureTrouble::kAbsent;
  close();
  failed_call_ = call;
  error_ = error;
  return trouble_ = trouble;
}

CaptureTrouble Capture::open() {
  close();
  granted_ = {};
  gone_ = false;
  descriptor_ = system_.open(options_.device.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  if (descriptor_ < 0) return fail("open", -descriptor_);
  v4l2_capability capability{};
  if (const int failed = system_.ioctl(descriptor_, VIDIOC_QUERYCAP, &capability); failed < 0) {
    // Anything that is no V4L2 device does not know the call.
    if (failed == -ENOTTY || failed == -EINVAL) {
      close();
      return trouble_ = CaptureTrouble::kNoCapture;
    }
    return fail("VIDIOC_QUERYCAP", -failed);
  }
  granted_.driver.set("{}", text_of(capability.driver));
  granted_.card.set("{}", text_of(capability.card));
  const std::uint32_t can =
      (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? capability.device_caps : capability.capabilities;
  if ((can & V4L2_CAP_VIDEO_CAPTURE) == 0 || (can & V4L2_CAP_STREAMING) == 0) {
    close();
    return trouble_ = CaptureTrouble::kNoCapture;
  }
  if (const CaptureTrouble trouble = negotiate(); trouble != CaptureTrouble::kNone) return trouble;
  ask_rate();
  if (const CaptureTrouble trouble = map_buffers(); trouble != CaptureTrouble::kNone) return trouble;
  fix_controls();
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (const int failed = system_.ioctl(descriptor_, VIDIOC_STREAMON, &type); failed < 0) {
    return fail("VIDIOC_STREAMON", -failed);
  }
  error_ = 0;
  failed_call_ = "";
  return trouble_ = CaptureTrouble::kNone;
}

/// S_FMT answers with what the driver makes of the request, and that counts.
CaptureTrouble Capture::negotiate() {
  for (const PixelFormat wanted : options_.formats) {
    v4l2_format format{};
    format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    format.fmt.pix.width = static_cast<std::uint32_t>(options_.width);
    format.fmt.pix.height = static_cast<std::uint32_t>(options_.height);
    format.fmt.pix.pixelformat = fourcc_of(wanted);
    format.fmt.pix.field = V4L2_FIELD_NONE;
    if (const int failed = system_.ioctl(descriptor_, VIDIOC_S_FMT, &format); failed < 0) {
      if (failed == -EINVAL) continue;
      return fail("VIDIOC_S_FMT", -failed);
    }
    const v4l2_pix_format& pix = format.fmt.pix;
    const auto granted = format_of(pix.pixelformat);
    granted_.fourcc = pix.pixelformat;
    granted_.layout.width = static_cast<int>(pix.width);
    granted_.layout.height = static_cast<int>(pix.height);
    if (granted != wanted || granted_.layout.width != options_.width || granted_.layout.height != options_.height ||
        (pix.field != V4L2_FIELD_NONE && pix.field != V4L2_FIELD_ANY)) {
      continue;
    }
    granted_.layout.format = wanted;
    const std::size_t row = pix.width * (wanted == PixelFormat::kYuyv ? 2U : 1U);
    granted_.layout.stride = std::max<std::size_t>(pix.bytesperline, row);
    granted_.layout.full_range = pix.quantization == V4L2_QUANTIZATION_FULL_RANGE;
    granted_.bytes_max = std::max<std::size_t>(pix.sizeimage, granted_.layout.bytes());
    return CaptureTrouble::kNone;
  }
  close();
  return trouble_ = CaptureTrouble::kFormat;
}

/// Drivers without a rate of their own refuse; then we live with what comes.
void Capture::ask_rate() {
  v4l2_streamparm parameters{};
  parameters.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  parameters.parm.capture.timeperframe = {1000, static_cast<std::uint32_t>(std::lround(options_.rate_hz * 1000))};
  if (system_.ioctl(descriptor_, VIDIOC_S_PARM, &parameters) < 0) return;
  const v4l2_fract& period = parameters.parm.capture.timeperframe;
  if (period.numerator != 0) granted_.rate_hz = static_cast<double>(period.denominator) / period.numerator;
}

CaptureTrouble Capture::map_buffers() {
  v4l2_requestbuffers request{};
  request.count = kBuffers;
  request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  request.memory = V4L2_MEMORY_MMAP;
  if (const int failed = system_.ioctl(descriptor_, VIDIOC_REQBUFS, &request); failed < 0) {
    return fail("VIDIOC_REQBUFS", -failed);
  }
  if (request.count < 2) {
    close();
    return trouble_ = CaptureTrouble::kMemory;
  }
  for (std::uint32_t i = 0; i < std::min(request.count, kBuffers); ++i) {
    v4l2_buffer buffer{};
    buffer.index = i;
    buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    buffer.memory = V4L2_MEMORY_MMAP;
    if (const int failed = system_.ioctl(descriptor_, VIDIOC_QUERYBUF, &buffer); failed < 0) {
      return fail("VIDIOC_QUERYBUF", -failed);
    }
    MappedBuffer mapped{nullptr, buffer.length};
    if (const int failed = system_.mmap(buffer.length, descriptor_, buffer.m.offset, &mapped.address); failed < 0) {
      return fail("mmap", -failed);
    }
    mapped_.push_back(mapped);
    if (const int failed = system_.ioctl(descriptor_, VIDIOC_QBUF, &buffer); failed < 0) {
      return fail("VIDIOC_QBUF", -failed);
    }
  }
  return CaptureTrouble::kNone;
}

/// What a camera does not have is noted, not refused: fixed-focus cameras have no focus.
void Capture::fix_controls() {
  const auto note = [&](const char* name, const char* what) {
    const auto before = granted_.notes;
    granted_.notes.set("{}{}{} {}", before.view(), before.empty() ? "" : ", ", name, what);
  };
  for (const ControlSetting& setting : options_.controls) {
    v4l2_control control{setting.id, 0};
    if (system_.ioctl(descriptor_, VIDIOC_G_CTRL, &control) < 0) {
      note(setting.name, "is not there");
      continue;
    }
    saved_.push_back({setting.id, control.value});
    control.value = setting.value;
    if (system_.ioctl(descriptor_, VIDIOC_S_CTRL, &control) < 0) {
      note(setting.name, "was refused");
      continue;
    }
    if (system_.ioctl(descriptor_, VIDIOC_G_CTRL, &control) == 0 && control.value != setting.value) {
      const auto before = granted_.notes;
      granted_.notes.set("{}{}{} is {}", before.view(), before.empty() ? "" : ", ", setting.name, control.value);
    }
  }
}

/// Backwards: a value can be put back only while its automatic is still off.
void Capture::restore_controls() {
  while (!saved_.empty()) {
    v4l2_control control{saved_.back().id, saved_.back().value};
    if (!gone_) (void)system_.ioctl(descriptor_, VIDIOC_S_CTRL, &control);
    saved_.pop_back();
  }
}

void Capture::close() {
  if (descriptor_ < 0) return;
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (!gone_) (void)system_.ioctl(descriptor_, VIDIOC_STREAMOFF, &type);
  restore_controls();
  for (const MappedBuffer& mapped : mapped_) system_.munmap(mapped.address, mapped.size);
  mapped_.clear();
  system_.close(descriptor_);
  descriptor_ = -1;
}

Capture::Taken Capture::take(CapturedBuffer& taken) {
  if (!is_open()) return Taken::kLost;
  v4l2_buffer buffer{};
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  if (const int failed = system_.ioctl(descriptor_, VIDIOC_DQBUF, &buffer); failed < 0) {
    if (failed == -EAGAIN) return Taken::kNothing;
    if (failed == -EIO) return Taken::kInputError;
    fail("VIDIOC_DQBUF", -failed);
    return Taken::kLost;
  }
  if (buffer.index >= mapped_.size()) {
    fail("VIDIOC_DQBUF", ERANGE);
    return Taken::kLost;
  }
  const MappedBuffer& mapped = mapped_[buffer.index];
  taken.bytes = {static_cast<const std::uint8_t*>(mapped.address),
                 std::min<std::size_t>(buffer.bytesused, mapped.size)};
  taken.index = buffer.index;
  taken.sequence = buffer.sequence;
  taken.broken = (buffer.flags & V4L2_BUF_FLAG_ERROR) != 0;
  taken.stamp = stamp_kind(buffer.flags);
  taken.monotonic_ns = static_cast<std::int64_t>(buffer.timestamp.tv_sec) * kNanosecondsPerSecond +
                       static_cast<std::int64_t>(buffer.timestamp.tv_usec) * kNanosecondsPerMicrosecond;
  return Taken::kBuffer;
}

bool Capture::give_back(const CapturedBuffer& given) {
  if (!is_open()) return false;
  v4l2_buffer buffer{};
  buffer.index = given.index;
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  const int failed = system_.ioctl(descriptor_, VIDIOC_QBUF, &buffer);
  if (failed < 0) fail("VIDIOC_QBUF", -failed);
  return failed >= 0;
}

}  // namespace firstlook::v4l2
