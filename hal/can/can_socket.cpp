#include "hal/can/can_socket.hpp"

#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/ioctl.h>

#include <algorithm>
#include <cerrno>

namespace firstlook::can {
namespace {

BusTrouble trouble_of(int error) {
  switch (error) {
    case EAFNOSUPPORT:
    case EPROTONOSUPPORT:
      return BusTrouble::kNoCan;
    case ENODEV:
    case ENXIO:
      return BusTrouble::kNoInterface;
    case ENETDOWN:
      return BusTrouble::kDown;
    default:
      return BusTrouble::kRefused;
  }
}

}  // namespace

CanSocket::CanSocket(SystemCalls& system, std::string_view name, std::span<const can_filter> filters)
    : system_(system), name_(name), filters_(filters) {}

BusTrouble CanSocket::fail(int error) {
  close();
  error_ = error;
  return trouble_ = trouble_of(error);
}

BusTrouble CanSocket::open() {
  close();
  ifreq request{};
  if (name_.empty() || name_.size() >= sizeof request.ifr_name) return fail(ENODEV);
  descriptor_ = system_.socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW);
  if (descriptor_ < 0) return fail(-descriptor_);
  std::ranges::copy(name_, request.ifr_name);
  if (const int failed = system_.ioctl(descriptor_, SIOCGIFINDEX, &request); failed < 0) return fail(-failed);
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = request.ifr_ifindex;
  if (const int failed = system_.ioctl(descriptor_, SIOCGIFFLAGS, &request); failed < 0) return fail(-failed);
  if ((request.ifr_flags & IFF_UP) == 0) return fail(ENETDOWN);
  const auto filter_bytes = static_cast<socklen_t>(filters_.size_bytes());
  if (const int failed = system_.setsockopt(descriptor_, SOL_CAN_RAW, CAN_RAW_FILTER, filters_.data(), filter_bytes);
      failed < 0) {
    return fail(-failed);
  }
  const can_err_mask_t errors = CAN_ERR_MASK;
  if (const int failed = system_.setsockopt(descriptor_, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &errors, sizeof errors);
      failed < 0) {
    return fail(-failed);
  }
  if (const int failed = system_.bind(descriptor_, reinterpret_cast<const sockaddr*>(&address), sizeof address);
      failed < 0) {
    return fail(-failed);
  }
  error_ = 0;
  return trouble_ = BusTrouble::kNone;
}

void CanSocket::close() {
  if (descriptor_ >= 0) system_.close(descriptor_);
  descriptor_ = -1;
}

std::optional<can_frame> CanSocket::receive() {
  if (!is_open()) return {};
  can_frame frame{};
  const std::ptrdiff_t got = system_.read(descriptor_, &frame, sizeof frame);
  if (got == static_cast<std::ptrdiff_t>(sizeof frame)) return frame;
  if (got >= 0 || got == -EAGAIN || got == -ENOBUFS) return {};
  fail(static_cast<int>(-got));
  return {};
}

CanSocket::Sent CanSocket::send(const can_frame& frame) {
  if (!is_open()) return Sent::kBroken;
  const std::ptrdiff_t sent = system_.write(descriptor_, &frame, sizeof frame);
  if (sent == static_cast<std::ptrdiff_t>(sizeof frame)) return Sent::kYes;
  if (sent >= 0 || sent == -EAGAIN || sent == -ENOBUFS) return Sent::kNoRoom;
  fail(static_cast<int>(-sent));
  return Sent::kBroken;
}

}  // namespace firstlook::can
