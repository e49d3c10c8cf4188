/// The system calls that drivers make, behind an interface: tests put a simulated kernel in its place.
#pragma once

#include <poll.h>
#include <sys/socket.h>

#include <cstddef>
#include <cstdint>

namespace firstlook {

/// Each call as the manual has it, but for errors: they are returned as -errno instead. Calls that a signal interrupted
/// are made again.
class SystemCalls {
 public:
  virtual ~SystemCalls() = default;
  [[nodiscard]] virtual int open(const char* path, int flags) = 0;
  [[nodiscard]] virtual int socket(int domain, int type, int protocol) = 0;
  [[nodiscard]] virtual int bind(int descriptor, const sockaddr* address, socklen_t size) = 0;
  [[nodiscard]] virtual int setsockopt(int descriptor, int level, int name, const void* value, socklen_t size) = 0;
  [[nodiscard]] virtual int ioctl(int descriptor, unsigned long request, void* argument) = 0;
  /// Shared, to read. `mapped` gets the address when 0 is returned.
  [[nodiscard]] virtual int mmap(std::size_t size, int descriptor, std::int64_t offset, void** mapped) = 0;
  virtual int munmap(void* mapped, std::size_t size) = 0;
  [[nodiscard]] virtual int poll(pollfd* descriptors, std::size_t count, int timeout_ms) = 0;
  [[nodiscard]] virtual std::ptrdiff_t read(int descriptor, void* bytes, std::size_t size) = 0;
  [[nodiscard]] virtual std::ptrdiff_t write(int descriptor, const void* bytes, std::size_t size) = 0;
  virtual int close(int descriptor) = 0;
  /// Nanoseconds of CLOCK_MONOTONIC.
  [[nodiscard]] virtual std::int64_t monotonic_ns() = 0;
};

/// Those of this computer's kernel.
[[nodiscard]] SystemCalls& kernel();

}  // namespace firstlook
