#include "platform/linux/system_calls.hpp"

#include <fcntl.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>

#include "platform/linux/wakeup.hpp"

namespace firstlook {
namespace {

/// The call's value, or -errno; again while signals interrupt it.
template <typename Call>
auto made(Call call) {
  auto value = call();
  while (value < 0 && errno == EINTR) value = call();
  return value < 0 ? static_cast<decltype(value)>(-errno) : value;
}

class Kernel final : public SystemCalls {
 public:
  int open(const char* path, int flags) override {
    return made([&] { return ::open(path, flags); });
  }
  int socket(int domain, int type, int protocol) override {
    return made([&] { return ::socket(domain, type, protocol); });
  }
  int bind(int descriptor, const sockaddr* address, socklen_t size) override {
    return made([&] { return ::bind(descriptor, address, size); });
  }
  int setsockopt(int descriptor, int level, int name, const void* value, socklen_t size) override {
    return made([&] { return ::setsockopt(descriptor, level, name, value, size); });
  }
  int ioctl(int descriptor, unsigned long request, void* argument) override {
    return made([&] { return ::ioctl(descriptor, request, argument); });
  }
  int mmap(std::size_t size, int descriptor, std::int64_t offset, void** mapped) override {
    void* const address = ::mmap(nullptr, size, PROT_READ, MAP_SHARED, descriptor, offset);
    if (address == MAP_FAILED) return -errno;
    *mapped = address;
    return 0;
  }
  int munmap(void* mapped, std::size_t size) override {
    return made([&] { return ::munmap(mapped, size); });
  }
  int poll(pollfd* descriptors, std::size_t count, int timeout_ms) override {
    return made([&] { return ::poll(descriptors, count, timeout_ms); });
  }
  std::ptrdiff_t read(int descriptor, void* bytes, std::size_t size) override {
    return made([&] { return ::read(descriptor, bytes, size); });
  }
  std::ptrdiff_t write(int descriptor, const void* bytes, std::size_t size) override {
    return made([&] { return ::write(descriptor, bytes, size); });
  }
  int close(int descriptor) override { return ::close(descriptor) < 0 ? -errno : 0; }
  std::int64_t monotonic_ns() override { return firstlook::monotonic_ns(); }
};

}  // namespace

SystemCalls& kernel() {
  static Kernel real;
  return real;
}

}  // namespace firstlook
