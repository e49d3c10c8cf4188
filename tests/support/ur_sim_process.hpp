/// `firstlook ur-sim` in a process of its own, and connections to it.
#pragma once

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <poll.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>

#include "tests/support/job_run.hpp"
#include "tests/support/ur_wire.hpp"

extern char** environ;  // POSIX; unistd.h declares it only with extensions

namespace firstlook::test {

inline constexpr int kLimit_ms = 20'000 * kSlowdown;

inline int bind_to(int port) {
  const int descriptor = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const int on = 1;
  setsockopt(descriptor, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  if (bind(descriptor, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 &&
      listen(descriptor, 1) == 0) {
    return descriptor;
  }
  close(descriptor);
  return -1;
}

/// An offset at which all ports of a controller are free now.
inline int free_offset() {
  for (int offset = 1000 + getpid() % 500; offset < 30'000; offset += 37) {
    bool free = true;
    for (const int port : {29999, 30001, 30002, 30003, 30004, 30011, 30012, 30013, 30020, 30098, 30099}) {
      const int descriptor = bind_to(port + offset);
      free = free && descriptor >= 0;
      if (descriptor >= 0) close(descriptor);
    }
    if (free) return offset;
  }
  return 0;
}

/// A port that is free now.
inline int free_port() {
  for (int port = 40'000 + getpid() % 5000; port < 65'000; ++port) {
    const int descriptor = bind_to(port);
    if (descriptor < 0) continue;
    close(descriptor);
    return port;
  }
  return 0;
}

class UrSim {
 public:
  explicit UrSim(std::vector<std::string> words) : offset(free_offset()) {
    words.insert(words.begin(), {FIRSTLOOK_PROGRAM, "ur-sim"});
    words.insert(words.end(), {"--port-offset", std::to_string(offset)});
    std::vector<char*> pointers;
    for (std::string& word : words) pointers.push_back(word.data());
    pointers.push_back(nullptr);
    int ends[2] = {-1, -1};
    REQUIRE(pipe2(ends, O_CLOEXEC) == 0);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, ends[1], STDERR_FILENO);
    REQUIRE(posix_spawn(&pid_, FIRSTLOOK_PROGRAM, &actions, nullptr, pointers.data(), environ) == 0);
    posix_spawn_file_actions_destroy(&actions);
    close(ends[1]);
    errors_ = ends[0];
    wait_for_words("ready");
  }
  ~UrSim() {
    if (pid_ > 0) kill(pid_, SIGKILL), waitpid(pid_, nullptr, 0);
    close(errors_);
  }
  UrSim(const UrSim&) = delete;
  UrSim& operator=(const UrSim&) = delete;

  /// Its exit code after this signal; 0: it is expected to end by itself.
  int end(int signal) {
    if (signal != 0) kill(pid_, signal);
    int status = 0;
    REQUIRE(waitpid(pid_, &status, 0) == pid_);
    pid_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }

  int offset;
  std::string said;

 private:
  void wait_for_words(const std::string& words) {
    while (said.find(words) == std::string::npos) {
      pollfd ready{errors_, POLLIN, 0};
      REQUIRE(poll(&ready, 1, kLimit_ms) == 1);
      char buffer[4096];
      const ssize_t got = read(errors_, buffer, sizeof buffer);
      INFO(said);
      REQUIRE(got > 0);
      said.append(buffer, static_cast<std::size_t>(got));
    }
  }

  pid_t pid_ = -1;
  int errors_ = -1;
};

class Connection {
 public:
  Connection(const UrSim& robot, int port) : descriptor_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port + robot.offset));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    REQUIRE(connect(descriptor_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
  }
  ~Connection() { close(descriptor_); }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  void send(const std::string& bytes) const {
    REQUIRE(::send(descriptor_, bytes.data(), bytes.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(bytes.size()));
  }
  /// Appends what comes next; false at the end of the stream.
  bool receive() {
    pollfd ready{descriptor_, POLLIN, 0};
    REQUIRE(poll(&ready, 1, kLimit_ms) == 1);
    char buffer[65536];
    const ssize_t got = recv(descriptor_, buffer, sizeof buffer, 0);
    if (got > 0) received.append(buffer, static_cast<std::size_t>(got));
    return got > 0;
  }
  std::string line() {
    std::size_t end = 0;
    while ((end = received.find('\n')) == std::string::npos) REQUIRE(receive());
    std::string text = received.substr(0, end);
    received.erase(0, end + 1);
    return text;
  }
  std::string ask(const std::string& command) {
    send(command + "\n");
    return line();
  }
  RtdePackage rtde_package() {
    while (received.size() < 3 || received.size() < unsigned_at(received, 0, 2)) REQUIRE(receive());
    const std::size_t size = unsigned_at(received, 0, 2);
    RtdePackage package{received[2], received.substr(3, size - 3)};
    received.erase(0, size);
    return package;
  }
  /// Waits until these bytes have come.
  void wait_for(const std::string& bytes) {
    while (received.find(bytes) == std::string::npos) REQUIRE(receive());
  }

  [[nodiscard]] int descriptor() const { return descriptor_; }

  std::string received;

 private:
  int descriptor_;
};

/// Asks until the answer is this one.
inline void wait_for_answer(Connection& dashboard, const std::string& command, const std::string& answer) {
  const auto limit = std::chrono::steady_clock::now() + std::chrono::milliseconds(kLimit_ms);
  std::string last;
  do {
    last = dashboard.ask(command);
    REQUIRE(std::chrono::steady_clock::now() < limit);
  } while (last != answer);
}

}  // namespace firstlook::test
