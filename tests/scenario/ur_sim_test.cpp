/// `firstlook ur-sim` as other programs meet it: over TCP, in a process of its own.
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

namespace firstlook {
using namespace test;
using Catch::Matchers::Contains;

namespace {

constexpr int kLimit_ms = 20'000 * kSlowdown;

int bind_to(int port) {
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
int free_offset() {
  for (int offset = 1000 + getpid() % 500; offset < 30'000; offset += 37) {
    bool free = true;
    for (const int port : {29999, 30001, 30002, 30003, 30004, 30011, 30012, 30013}) {
      const int descriptor = bind_to(port + offset);
      free = free && descriptor >= 0;
      if (descriptor >= 0) close(descriptor);
    }
    if (free) return offset;
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
void wait_for_answer(Connection& dashboard, const std::string& command, const std::string& answer) {
  const auto limit = std::chrono::steady_clock::now() + std::chrono::milliseconds(kLimit_ms);
  std::string last;
  do {
    last = dashboard.ask(command);
    REQUIRE(std::chrono::steady_clock::now() < limit);
  } while (last != answer);
}

}  // namespace

TEST_CASE("ur-sim is brought up, streams and runs a script", "[scenario]") {
  UrSim robot({"--model", "ur5e", "--serial", "20195599999"});
  CHECK_THAT(robot.said, Contains(std::string("RTDE on 127.0.0.1:") + std::to_string(30004 + robot.offset)));
  Connection dashboard(robot, 29999);
  CHECK(dashboard.line() == "Connected: Universal Robots Dashboard Server");
  CHECK(dashboard.ask("get serial number") == "20195599999");
  CHECK(dashboard.ask("brake release") == "Brake releasing");
  wait_for_answer(dashboard, "robotmode", "Robotmode: RUNNING");

  Connection rtde_client(robot, 30004);
  rtde_client.send(rtde('V', big_endian(2, 2)) + rtde('O', big_endian(500.0) + "timestamp,runtime_state") + rtde('S'));
  CHECK(rtde_client.rtde_package().payload == "\1");
  CHECK(rtde_client.rtde_package().payload == "\1DOUBLE,UINT32");
  CHECK(rtde_client.rtde_package().payload == "\1");
  double last_s = 0;
  for (int i = 0; i < 200; ++i) {
    const RtdePackage data = rtde_client.rtde_package();
    REQUIRE(data.type == 'U');
    const double now_s = double_at(data.payload, 1);
    if (i > 0) REQUIRE(now_s - last_s == Approx(0.002));
    last_s = now_s;
  }

  Connection primary(robot, 30001), secondary(robot, 30002);
  secondary.wait_for("URControl");
  primary.wait_for("URControl");
  secondary.send("def job():\n  textmsg(\"over TCP \", 1 + 1)\nend\n");
  primary.wait_for("PROGRAM_XXX_STARTEDjob");
  primary.wait_for("over TCP 2");
  primary.wait_for("PROGRAM_XXX_STOPPEDjob");
  CHECK(robot.end(SIGTERM) == 0);
}

TEST_CASE("a script dials back to the computer that sent it", "[scenario]") {
  UrSim robot({"--running"});
  int port = 45'000 + getpid() % 1000, listener = -1;
  while (listener < 0) listener = bind_to(++port);
  Connection primary(robot, 30001);
  primary.send(std::string("def dial():\n  socket_open(\"127.0.0.1\", ") + std::to_string(port) +
               ")\n  socket_send_line(\"hello\")\n  textmsg(socket_read_line(timeout=0))\nend\n");
  pollfd ready{listener, POLLIN, 0};
  REQUIRE(poll(&ready, 1, kLimit_ms) == 1);
  const int accepted = accept4(listener, nullptr, nullptr, SOCK_CLOEXEC);
  REQUIRE(accepted >= 0);
  std::string got;
  while (got.find('\n') == std::string::npos) {
    char buffer[64];
    const ssize_t count = read(accepted, buffer, sizeof buffer);
    REQUIRE(count > 0);
    got.append(buffer, static_cast<std::size_t>(count));
  }
  CHECK(got == "hello\n");
  REQUIRE(write(accepted, "answer\n", 7) == 7);
  primary.wait_for("answer");
  close(accepted);
  close(listener);
}

TEST_CASE("a client that does not read is dropped, the others go on", "[scenario]") {
  UrSim robot({"--model", "ur5e"});
  Connection dashboard(robot, 29999);
  static_cast<void>(dashboard.line());
  // Some 5 MB/s: they fill the buffers of the system and then those of the program within seconds.
  Connection greedy(robot, 30004);
  std::string names = "actual_q";
  for (int i = 0; i < 200; ++i) names += ",actual_q";
  greedy.send(rtde('V', big_endian(2, 2)) + rtde('O', big_endian(500.0) + names) + rtde('S'));
  CHECK(greedy.rtde_package().type == 'V');
  const auto limit = std::chrono::steady_clock::now() + std::chrono::milliseconds(kLimit_ms);
  pollfd hung_up{greedy.descriptor(), POLLRDHUP, 0};
  while (poll(&hung_up, 1, 100) == 0) {
    REQUIRE(dashboard.ask("running") == "Program running: false");
    REQUIRE(std::chrono::steady_clock::now() < limit);
  }
  CHECK(dashboard.ask("running") == "Program running: false");
}

TEST_CASE("a shutdown over the dashboard ends ur-sim", "[scenario]") {
  UrSim robot({});
  Connection dashboard(robot, 29999);
  static_cast<void>(dashboard.line());
  CHECK(dashboard.ask("shutdown") == "Shutting down");
  CHECK(robot.end(0) == 0);
}

TEST_CASE("ports that cannot be had", "[scenario]") {
  const JobFolder folder;
  const int offset = free_offset();
  const int taken = bind_to(30002 + offset);
  REQUIRE(taken >= 0);
  const ProgramResult in_use = folder.run({"ur-sim", "--port-offset", std::to_string(offset)});
  close(taken);
  CHECK(in_use.exit_code == 4);
  CHECK_THAT(in_use.err, Contains("E5001") && Contains(std::to_string(30002 + offset)) && Contains("in use"));
  const ProgramResult no_host = folder.run({"ur-sim", "--host", "192.0.2.7"});
  CHECK(no_host.exit_code == 4);
  CHECK_THAT(no_host.err, Contains("192.0.2.7"));
  CHECK(folder.run({"ur-sim", "--model", "ur6"}).exit_code == 2);
  CHECK(folder.run({"ur-sim", "--program", "nowhere.script"}).exit_code == 3);
}

}  // namespace firstlook
