#include "platform/linux/process.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstring>
#include <ctime>
#include <string_view>

namespace firstlook {
namespace {

std::atomic<bool> g_stop{false};
static_assert(std::atomic<bool>::is_always_lock_free);

extern "C" void on_stop_signal(int) { g_stop.store(true); }

std::string utc_date(const char* format) {
  const std::time_t now = std::time(nullptr);
  std::tm parts{};
  gmtime_r(&now, &parts);
  std::array<char, 32> text{};
  return {text.data(), std::strftime(text.data(), text.size(), format, &parts)};
}

/// proc(5): statm has numbers of pages, separated by blanks; 1 is the resident set, 2 its part that files back.
std::size_t statm_bytes(int column) {
  const int descriptor = ::open("/proc/self/statm", O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return 0;
  std::array<char, 128> buffer{};
  const ssize_t got = ::read(descriptor, buffer.data(), buffer.size());
  ::close(descriptor);
  if (got <= 0) return 0;
  const char* at = buffer.data();
  const char* const end = at + got;
  for (; column > 0; --column) {
    at = std::find(at, end, ' ');
    if (at != end) ++at;
  }
  std::size_t pages = 0;
  std::from_chars(at, end, pages);
  return pages * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
}

}  // namespace

std::size_t resident_bytes() { return statm_bytes(1); }

std::size_t resident_file_bytes() { return statm_bytes(2); }

Status lock_memory() {
  if (mlockall(MCL_CURRENT | MCL_FUTURE) == 0) return {};
  return failure(Fault::kOutOfMemory, "memory cannot be locked: {}", std::strerror(errno));
}

void catch_stop_signals() {
  g_stop = false;
  struct sigaction action{};
  action.sa_handler = on_stop_signal;
  sigemptyset(&action.sa_mask);
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  struct sigaction ignore{};
  ignore.sa_handler = SIG_IGN;
  sigaction(SIGPIPE, &ignore, nullptr);
}

bool stop_signal_received() { return g_stop.load(); }

std::string utc_date_text() { return utc_date("%Y-%m-%dT%H:%M:%SZ"); }
std::string utc_date_for_name() { return utc_date("%Y%m%d-%H%M%S"); }

}  // namespace firstlook
