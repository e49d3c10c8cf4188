#include "tests/support/run_program.hpp"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <csignal>
#include <string_view>

#include "platform/core/ensure.hpp"

extern char** environ;  // POSIX; unistd.h declares it only with extensions

namespace firstlook::test {
namespace {

struct Pipe {
  std::array<int, 2> ends{-1, -1};
  Pipe() { ENSURE(9101, pipe2(ends.data(), O_CLOEXEC) == 0); }
  ~Pipe() {
    close_end(0);
    close_end(1);
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;
  void close_end(std::size_t i) {
    if (ends[i] >= 0) close(ends[i]);
    ends[i] = -1;
  }
};

/// Limits are inherited: set while the child is started.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(std::optional<std::uint64_t> bytes) {
    getrlimit(RLIMIT_FSIZE, &before_);
    if (!bytes) return;
    const rlimit limit{*bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
    handler_ = std::signal(SIGXFSZ, SIG_IGN);  // so that write() fails instead
  }
  ~FileSizeLimit() {
    setrlimit(RLIMIT_FSIZE, &before_);
    if (handler_ != SIG_ERR) std::signal(SIGXFSZ, handler_);
  }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;

 private:
  rlimit before_{};
  void (*handler_)(int) = SIG_ERR;
};

std::vector<char*> pointers_to(std::vector<std::string>& texts) {
  std::vector<char*> pointers;
  for (std::string& text : texts) pointers.push_back(text.data());
  pointers.push_back(nullptr);
  return pointers;
}

pid_t start(const std::string& program, const std::vector<std::string>& arguments, const ProgramOptions& options,
            Pipe& out, Pipe& err) {
  std::vector<std::string> words{program};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<std::string> environment;
  for (char** entry = environ; *entry != nullptr; ++entry) {
    if (!std::string_view(*entry).starts_with("FIRSTLOOK_")) environment.emplace_back(*entry);
  }
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  if (options.stdout_to.empty()) {
    posix_spawn_file_actions_adddup2(&actions, out.ends[1], STDOUT_FILENO);
  } else {
    posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, options.stdout_to.c_str(), O_WRONLY | O_CREAT, 0644);
  }
  posix_spawn_file_actions_adddup2(&actions, err.ends[1], STDERR_FILENO);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addchdir_np(&actions, options.folder.c_str());
  const FileSizeLimit limit(options.file_bytes_max);
  pid_t pid = -1;
  const int failed =
      posix_spawn(&pid, program.c_str(), &actions, nullptr, pointers_to(words).data(), pointers_to(environment).data());
  posix_spawn_file_actions_destroy(&actions);
  ENSURE(9102, failed == 0);
  return pid;
}

/// Appends what has come; false at the end of the stream.
bool take(int descriptor, std::string& text) {
  std::array<char, 65536> buffer;
  const ssize_t got = read(descriptor, buffer.data(), buffer.size());
  if (got > 0) text.append(buffer.data(), static_cast<std::size_t>(got));
  return got > 0;
}

}  // namespace

ProgramResult run_program(const std::string& program, const std::vector<std::string>& arguments,
                          const ProgramOptions& options) {
  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + std::chrono::duration<double>(options.limit_s);
  Pipe out, err;
  const pid_t pid = start(program, arguments, options, out, err);
  out.close_end(1);
  err.close_end(1);

  ProgramResult result;
  bool signalled = options.signal_at.empty();
  while (out.ends[0] >= 0 || err.ends[0] >= 0) {
    std::array<pollfd, 2> streams{{{out.ends[0], POLLIN, 0}, {err.ends[0], POLLIN, 0}}};
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - Clock::now()).count();
    if (left <= 0 || poll(streams.data(), streams.size(), static_cast<int>(left)) == 0) {
      result.timed_out = true;
      kill(pid, SIGKILL);
      break;
    }
    if (streams[0].revents != 0 && !take(out.ends[0], result.out)) out.close_end(0);
    if (streams[1].revents != 0 && !take(err.ends[0], result.err)) err.close_end(0);
    if (!signalled && result.err.find(options.signal_at) != std::string::npos) {
      signalled = true;
      kill(pid, options.signal);
    }
  }
  int status = 0;
  ENSURE(9103, waitpid(pid, &status, 0) == pid);
  result.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return result;
}

}  // namespace firstlook::test
