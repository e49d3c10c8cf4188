/// The calls of the real kernel: their values, and errors as negative numbers.
#include "platform/linux/system_calls.hpp"

#include <fcntl.h>
#include <sys/ioctl.h>

#include <catch2/catch.hpp>
#include <cerrno>
#include <fstream>
#include <string>

#include "tests/support/temporary_folder.hpp"

using namespace firstlook;

TEST_CASE("system calls give what the kernel gives, and errors as -errno", "[linux]") {
  SystemCalls& k = kernel();
  CHECK(k.open("/nowhere/at/all", O_RDONLY) == -ENOENT);
  CHECK(k.close(-1) == -EBADF);
  char byte = 0;
  CHECK(k.read(-1, &byte, 1) == -EBADF);
  CHECK(k.write(-1, &byte, 1) == -EBADF);
  CHECK(k.socket(-1, SOCK_RAW, 0) == -EAFNOSUPPORT);
  CHECK(k.bind(-1, nullptr, 0) == -EBADF);
  CHECK(k.setsockopt(-1, SOL_SOCKET, SO_REUSEADDR, &byte, 1) == -EBADF);
  const test::TemporaryFolder folder("firstlook-calls");
  const std::string path = (folder.path() / "file").string();
  std::ofstream(path) << "hello";
  const int file = k.open(path.c_str(), O_RDWR | O_CLOEXEC);
  REQUIRE(file >= 0);
  int waiting = 0;
  CHECK(k.ioctl(file, FIONREAD, &waiting) == 0);
  CHECK(waiting == 5);
  CHECK(k.ioctl(file, TIOCGWINSZ, &waiting) == -ENOTTY);
  void* mapped = nullptr;
  REQUIRE(k.mmap(5, file, 0, &mapped) == 0);
  CHECK(std::string(static_cast<const char*>(mapped), 5) == "hello");
  CHECK(k.munmap(mapped, 5) == 0);
  CHECK(k.mmap(0, file, 0, &mapped) == -EINVAL);
  pollfd ready{file, POLLIN, 0};
  CHECK(k.poll(&ready, 1, 0) == 1);
  CHECK(k.read(file, &byte, 1) == 1);
  CHECK(byte == 'h');
  CHECK(k.close(file) == 0);
  const std::int64_t before_ns = k.monotonic_ns();
  CHECK(k.monotonic_ns() >= before_ns);
}
