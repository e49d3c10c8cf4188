#include "platform/linux/child_process.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <utility>

namespace firstlook {
namespace {

constexpr std::size_t kBytesPerMaxrss = 1024;  // getrusage(2): kilobytes

/// Closed at the end of its life.
struct Descriptor {
  int value = -1;
  /// Off the three standard streams, which the child will have under these numbers.
  bool lift() {
    if (value > STDERR_FILENO) return true;
    const int lifted = fcntl(value, F_DUPFD_CLOEXEC, STDERR_FILENO + 1);
    close_now();
    value = lifted;
    return lifted >= 0;
  }
  ~Descriptor() { close_now(); }
  void close_now() {
    if (value >= 0) ::close(value);
    value = -1;
  }
};

/// What the child does with itself before it becomes the program: only calls that are allowed after fork
/// (signal-safety(7)). Does not return; the errno of a failure goes into `report`.
[[noreturn]] void become(const char* program, char* const* words, int console, int nothing, int report, pid_t parent) {
  sigset_t stop_signals;
  sigemptyset(&stop_signals);
  sigaddset(&stop_signals, SIGINT);
  sigaddset(&stop_signals, SIGTERM);
  sigprocmask(SIG_BLOCK, &stop_signals, nullptr);
  setpgid(0, 0);
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(127);  // it has ended in between
  dup2(nothing, STDIN_FILENO);
  dup2(console, STDOUT_FILENO);
  dup2(console, STDERR_FILENO);
  execv(program, words);
  const int reason = errno;
  (void)!::write(report, &reason, sizeof reason);
  _exit(127);
}

double seconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

ChildEnd end_of(int status, const rusage& usage) {
  ChildEnd end;
  if (WIFSIGNALED(status))
    end.signal = WTERMSIG(status);
  else
    end.exit_code = WEXITSTATUS(status);
  end.processor_s = seconds(usage.ru_utime) + seconds(usage.ru_stime);
  end.peak_resident_bytes = static_cast<std::size_t>(usage.ru_maxrss) * kBytesPerMaxrss;
  return end;
}

/// glibc 2.36 declares pidfd_open for C alone.
int open_descriptor(pid_t pid) { return static_cast<int>(syscall(SYS_pidfd_open, pid, 0)); }

}  // namespace

Result<ChildProcess> ChildProcess::start(const ChildCommand& command) {
  Descriptor console{::open(command.console.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_APPEND | O_CLOEXEC, 0644)};
  if (console.value < 0) return failure(Fault::kDiskWrite, "{}: {}", command.console, std::strerror(errno));
  Descriptor nothing{::open("/dev/null", O_RDONLY | O_CLOEXEC)};
  std::array<int, 2> ends{-1, -1};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) {
    return failure(Fault::kOutOfMemory, "no pipe to a new process: {}", std::strerror(errno));
  }
  Descriptor reading{ends[0]}, writing{ends[1]};
  if (!console.lift() || !nothing.lift() || !writing.lift()) {
    return failure(Fault::kOutOfMemory, "no descriptor for a new process: {}", std::strerror(errno));
  }
  // Whoever started us may have it ignored, and then nobody would be told how a child ended.
  std::signal(SIGCHLD, SIG_DFL);

  std::string name = "firstlook";
  std::vector<std::string> texts = command.arguments;
  std::vector<char*> words{name.data()};
  for (std::string& text : texts) words.push_back(text.data());
  words.push_back(nullptr);
  const pid_t parent = getpid();
  const pid_t pid = fork();
  if (pid < 0) return failure(Fault::kOutOfMemory, "no new process: {}", std::strerror(errno));
  if (pid == 0) {
    become(command.program.c_str(), words.data(), console.value, nothing.value, writing.value, parent);
  }
  ChildProcess child(pid);
  writing.close_now();
  int reason = 0;
  ssize_t got = 0;
  do got = ::read(reading.value, &reason, sizeof reason);
  while (got < 0 && errno == EINTR);
  if (got > 0)
    return failure(Fault::kDataMissing, "{}: cannot be executed: {}", command.program, std::strerror(reason));
  return child;
}

ChildProcess::ChildProcess(pid_t pid) : pid_(pid), descriptor_(open_descriptor(pid)) {}

ChildProcess::ChildProcess(ChildProcess&& other) noexcept
    : pid_(std::exchange(other.pid_, -1)), descriptor_(std::exchange(other.descriptor_, -1)), end_(other.end_) {}

ChildProcess& ChildProcess::operator=(ChildProcess&& other) noexcept {
  if (this == &other) return *this;
  finish();
  pid_ = std::exchange(other.pid_, -1);
  descriptor_ = std::exchange(other.descriptor_, -1);
  end_ = other.end_;
  return *this;
}

ChildProcess::~ChildProcess() { finish(); }

void ChildProcess::finish() {
  if (pid_ > 0 && !end_) {
    kill();
    int status = 0;
    while (waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
    }
  }
  if (descriptor_ >= 0) ::close(descriptor_);
  pid_ = descriptor_ = -1;
}

std::optional<ChildEnd> ChildProcess::ended() {
  if (end_ || pid_ < 0) return end_;
  int status = 0;
  rusage usage{};
  const pid_t found = wait4(pid_, &status, WNOHANG, &usage);
  if (found == pid_) end_ = end_of(status, usage);
  if (found < 0 && errno == ECHILD) end_ = ChildEnd{.exit_code = kEndNotSeen};
  return end_;
}

void ChildProcess::kill() {
  if (pid_ > 0 && !end_) ::kill(pid_, SIGKILL);
}

void wait_for_child(std::span<const int> descriptors, int limit_ms) {
  std::vector<pollfd> streams;
  for (const int descriptor : descriptors) streams.push_back({descriptor, POLLIN, 0});
  (void)poll(streams.data(), streams.size(), limit_ms);
}

int usable_processors() {
  cpu_set_t allowed;
  CPU_ZERO(&allowed);
  if (sched_getaffinity(0, sizeof allowed, &allowed) == 0) return std::max(1, CPU_COUNT(&allowed));
  return std::max(1, static_cast<int>(sysconf(_SC_NPROCESSORS_ONLN)));
}

std::string signal_name(int signal) {
  const char* const name = sigdescr_np(signal);
  return name != nullptr ? name : "unknown signal";
}

}  // namespace firstlook
