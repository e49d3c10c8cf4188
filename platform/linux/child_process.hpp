/// A program in a process of its own: started, watched, ended.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "platform/core/result.hpp"

namespace firstlook {

/// This program, also after its file was replaced or removed.
inline constexpr const char* kOwnProgram = "/proc/self/exe";

struct ChildCommand {
  std::string program;                 ///< path of the file
  std::vector<std::string> arguments;  ///< without the program's name
  std::string console;                 ///< file that takes stdout and stderr, made anew; stdin is empty
};

inline constexpr int kEndNotSeen = 126;  ///< exit code of a child that somebody else has waited for

struct ChildEnd {
  int exit_code = 0;
  int signal = 0;                       ///< that ended it; 0: it ended by itself
  double processor_s = 0;               ///< user and system time
  std::size_t peak_resident_bytes = 0;  ///< at least what the parent had when it started it
};

/// A child leaves the parent's process group and has SIGINT and SIGTERM blocked: what a terminal or a scheduler sends
/// to all processes reaches the parent, which decides. It does not outlive the thread that started it.
class ChildProcess {
 public:
  /// Errors: kDiskWrite (the console's file), kOutOfMemory (no process can be made), kDataMissing (the program cannot
  /// be executed).
  [[nodiscard]] static Result<ChildProcess> start(const ChildCommand& command);
  ChildProcess(ChildProcess&& other) noexcept;
  ChildProcess& operator=(ChildProcess&& other) noexcept;
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;
  /// Kills it if it runs, and waits for its end.
  ~ChildProcess();

  /// How it ended; empty while it runs. Never blocks.
  [[nodiscard]] std::optional<ChildEnd> ended();
  /// SIGKILL.
  void kill();
  [[nodiscard]] pid_t pid() const { return pid_; }
  /// Readable when it has ended (pidfd_open(2)); -1 where the kernel has none.
  [[nodiscard]] int descriptor() const { return descriptor_; }

 private:
  explicit ChildProcess(pid_t pid);
  void finish();

  pid_t pid_ = -1;
  int descriptor_ = -1;
  std::optional<ChildEnd> end_;
};

/// Returns when one of the descriptors of children is readable, after `limit_ms`, or after a signal.
void wait_for_child(std::span<const int> descriptors, int limit_ms);

/// Processors that this process may run on: fewer than the machine has, inside of a scheduler's job.
[[nodiscard]] int usable_processors();

/// "Segmentation fault"
[[nodiscard]] std::string signal_name(int signal);

}  // namespace firstlook
