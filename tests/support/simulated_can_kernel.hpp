/// The kernel as a CAN driver meets it: one interface, raw sockets with filters, nodes on the bus, and what goes wrong.
#pragma once

#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/ioctl.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <deque>
#include <map>
#include <string>
#include <vector>

#include "platform/core/time.hpp"
#include "platform/linux/system_calls.hpp"
#include "tests/support/simulated_io_node.hpp"

namespace firstlook::test {

class SimulatedCanKernel final : public SystemCalls {
 public:
  explicit SimulatedCanKernel(std::string name = "can0") : name_(std::move(name)) {}

  // What somebody does to it.
  bool has_can = true, present = true, up = true;
  bool full = false;  ///< the queue of the interface takes nothing more
  void attach(SimulatedIoNode& node) { nodes_.push_back(&node); }
  void go_down() {
    up = false;
    for (auto& [id, s] : sockets_) s.error = ENETDOWN;
  }
  void unplug() {
    present = false;
    for (auto& [id, s] : sockets_) s.error = ENODEV;
  }
  /// A frame from the bus, or one of the controller's errors.
  void deliver(const can_frame& frame) {
    for (auto& [id, s] : sockets_) {
      if (s.bound && s.wants(frame)) s.queue.push_back(frame);
    }
  }
  void deliver_error(std::uint32_t kind, std::uint8_t controller = 0) {
    can_frame frame{};
    frame.can_id = CAN_ERR_FLAG | kind;
    frame.len = CAN_ERR_DLC;
    frame.data[1] = controller;
    deliver(frame);
  }
  /// Lets the nodes act at `now`.
  void turn(Instant now) {
    now_ = now;
    for (SimulatedIoNode* node : nodes_) {
      for (const can_frame& frame : node->turn(now)) {
        if (present && up) deliver(frame);
      }
    }
  }

  [[nodiscard]] const std::vector<can_frame>& sent() const { return sent_; }
  [[nodiscard]] std::size_t open_sockets() const { return sockets_.size(); }

  int open(const char*, int) override { return -ENOENT; }
  int socket(int domain, int, int protocol) override {
    if (!has_can) return -EAFNOSUPPORT;
    if (domain != PF_CAN || protocol != CAN_RAW) return -EPROTONOSUPPORT;
    sockets_[next_] = {};
    return next_++;
  }
  int bind(int descriptor, const sockaddr* address, socklen_t size) override {
    sockaddr_can can{};
    if (size != sizeof can) return -EINVAL;
    std::memcpy(&can, address, sizeof can);
    if (!present || can.can_ifindex != kIndex) return -ENODEV;
    sockets_.at(descriptor).bound = true;
    return 0;
  }
  int setsockopt(int descriptor, int level, int option, const void* value, socklen_t size) override {
    Socket& s = sockets_.at(descriptor);
    if (level != SOL_CAN_RAW) return -ENOPROTOOPT;
    if (option == CAN_RAW_FILTER) {
      s.filters.resize(size / sizeof(can_filter));
      std::memcpy(s.filters.data(), value, size);
    } else if (option == CAN_RAW_ERR_FILTER) {
      std::memcpy(&s.errors, value, sizeof s.errors);
    } else {
      return -ENOPROTOOPT;
    }
    return 0;
  }
  int ioctl(int, unsigned long request, void* argument) override {
    auto* const interface = static_cast<ifreq*>(argument);
    if (!present || name_ != interface->ifr_name) return -ENODEV;
    if (request == SIOCGIFINDEX) {
      interface->ifr_ifindex = kIndex;
    } else if (request == SIOCGIFFLAGS) {
      interface->ifr_flags = up ? IFF_UP : 0;
    } else {
      return -EINVAL;
    }
    return 0;
  }
  int mmap(std::size_t, int, std::int64_t, void**) override { return -ENODEV; }
  int munmap(void*, std::size_t) override { return -EINVAL; }
  int poll(pollfd*, std::size_t, int) override { return 0; }
  std::ptrdiff_t read(int descriptor, void* bytes, std::size_t size) override {
    Socket& s = sockets_.at(descriptor);
    if (s.error != 0) return -std::exchange(s.error, 0);
    if (s.queue.empty()) return -EAGAIN;
    std::memcpy(bytes, &s.queue.front(), std::min(size, sizeof(can_frame)));
    s.queue.pop_front();
    return sizeof(can_frame);
  }
  std::ptrdiff_t write(int, const void* bytes, std::size_t size) override {
    if (!present) return -ENXIO;
    if (!up) return -ENETDOWN;
    if (full) return -ENOBUFS;
    if (size != sizeof(can_frame)) return -EINVAL;
    can_frame frame{};
    std::memcpy(&frame, bytes, size);
    sent_.push_back(frame);
    for (SimulatedIoNode* node : nodes_) node->receive(frame, now_);
    return static_cast<std::ptrdiff_t>(size);
  }
  int close(int descriptor) override {
    sockets_.erase(descriptor);
    return 0;
  }
  std::int64_t monotonic_ns() override { return now_.ns; }

 private:
  struct Socket {
    std::vector<can_filter> filters;
    can_err_mask_t errors = 0;
    bool bound = false;
    int error = 0;
    std::deque<can_frame> queue;
    [[nodiscard]] bool wants(const can_frame& frame) const {
      if ((frame.can_id & CAN_ERR_FLAG) != 0) return (frame.can_id & errors & CAN_ERR_MASK) != 0;
      return std::ranges::any_of(
          filters, [&](const can_filter& f) { return (frame.can_id & f.can_mask) == (f.can_id & f.can_mask); });
    }
  };
  static constexpr int kIndex = 7;
  std::string name_;
  std::map<int, Socket> sockets_;
  int next_ = 3;
  Instant now_{};
  std::vector<SimulatedIoNode*> nodes_;
  std::vector<can_frame> sent_;
};

}  // namespace firstlook::test
