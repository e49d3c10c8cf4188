#include "hal/sim/ur_controller/tcp_service.hpp"

#include <cstdio>
#include <map>

#include "platform/linux/process.hpp"
#include "platform/linux/tcp.hpp"
#include "platform/linux/wakeup.hpp"

namespace firstlook::sim::ur {
namespace {

constexpr std::size_t kUnreadMax = 2 << 20;
constexpr std::int64_t kPlayAgain_ns = 3'000'000'000;  // longer than a request for a program lasts
constexpr std::int64_t kLateMax_ns = 500'000'000;      // after a longer sleep the cycles in between are left out

class TcpService final : public TcpEvents, public script::Sockets {
 public:
  explicit TcpService(SimulatedUr& robot) : robot_(robot) { robot_.programs().set_sockets(this); }
  ~TcpService() override { robot_.programs().set_sockets(nullptr); }
  TcpService(const TcpService&) = delete;
  TcpService& operator=(const TcpService&) = delete;

  [[nodiscard]] Status listen(const TcpServiceOptions& options, Port port) {
    const int number = static_cast<int>(port) + options.port_offset;
    const Result<TcpId> listener = tcp_.listen(options.host, static_cast<std::uint16_t>(number));
    if (!listener) return std::unexpected(listener.error());
    ports_[*listener] = port;
    return {};
  }

  [[nodiscard]] Status listen(const TcpServiceOptions& options) {
    for (const Port port : kPorts) {
      if (const Status listening = listen(options, port); !listening) return listening;
    }
    if (options.truth) {
      if (const Status listening = listen(options, Port::kTruth); !listening) return listening;
    }
    for (const auto& [listener, port] : ports_) {
      std::fprintf(stderr, "ur-sim: %s on %s:%d\n", std::string(name_of(port)).c_str(), options.host.c_str(),
                   static_cast<int>(tcp_.port_of(listener)));
    }
    return {};
  }

  void run(double play_after_s) {
    std::int64_t due_ns = monotonic_ns() + robot_.cycle().ns;
    if (play_after_s >= 0) play_at_ns_ = due_ns + static_cast<std::int64_t>(play_after_s * 1e9);
    while (!stop_signal_received() && !finished()) {
      tcp_.poll(due_ns, waiting_, *this);
      const std::int64_t now_ns = monotonic_ns();
      if (now_ns - due_ns > kLateMax_ns) due_ns = now_ns;
      for (; due_ns <= now_ns; due_ns += robot_.cycle().ns) robot_.step();
      if (now_ns >= play_at_ns_) press_play(now_ns);
      flush();
    }
  }

  void opened(TcpId connection, TcpId listener) override {
    if (const auto dialled = dialled_.find(connection); dialled != dialled_.end()) {
      dialled->second.state = State::kOpen;
    } else {
      session_ports_[connection] = ports_.at(listener);
      sessions_[connection] = &robot_.open(ports_.at(listener));
    }
  }

  void received(TcpId connection, std::string_view bytes) override {
    if (const auto dialled = dialled_.find(connection); dialled != dialled_.end()) {
      std::string& waiting = dialled->second.received;
      waiting.append(bytes);
      if (waiting.size() > kUnreadMax) tcp_.close(connection), dialled->second.state = State::kClosed;
      return;
    }
    const auto found = sessions_.find(connection);
    if (found != sessions_.end() && !found->second->over()) found->second->receive(bytes);
  }

  void closed(TcpId connection) override {
    if (const auto dialled = dialled_.find(connection); dialled != dialled_.end()) {
      dialled->second.state = State::kClosed;  // what came before can still be read
      return;
    }
    const auto found = sessions_.find(connection);
    if (found == sessions_.end()) return;
    robot_.close(*found->second);
    sessions_.erase(found);
    session_ports_.erase(connection);
  }

  // The connections of scripts.
  Id open(const std::string& host, std::uint16_t port) override {
    const Result<TcpId> connection = tcp_.dial(host, port);
    if (!connection) return 0;
    dialled_[*connection] = {};
    return *connection;
  }
  State state(Id socket) const override {
    const auto found = dialled_.find(socket);
    return found == dialled_.end() ? State::kClosed : found->second.state;
  }
  bool send(Id socket, std::string_view bytes) override {
    const auto found = dialled_.find(socket);
    if (found == dialled_.end() || found->second.state != State::kOpen) return false;
    std::string& unsent = found->second.unsent;
    unsent.append(bytes);
    return tcp_.send(socket, unsent) && unsent.size() <= kUnreadMax;
  }
  std::string& received(Id socket) override { return dialled_[socket].received; }
  void close(Id socket) override {
    tcp_.close(socket);
    dialled_.erase(socket);
  }

 private:
  struct Dialled {
    State state = State::kConnecting;
    std::string received, unsent;
  };

  /// A client that asked for the shutdown has its answer first.
  [[nodiscard]] bool finished() const { return robot_.shutting_down() && waiting_.empty(); }

  void flush() {
    waiting_.clear();
    std::vector<TcpId> done, dropped;
    for (const auto& [connection, session] : sessions_) {
      const bool alive = tcp_.send(connection, session->output());
      const bool all_sent = session->output().empty();
      if (session->output().size() > kUnreadMax) {
        dropped.push_back(connection);
      } else if (!alive || (session->over() && all_sent)) {
        done.push_back(connection);
      } else if (!all_sent) {
        waiting_.push_back(connection);
      }
    }
    for (auto& [connection, dialled] : dialled_) {
      if (dialled.state != State::kOpen || dialled.unsent.empty()) continue;
      static_cast<void>(tcp_.send(connection, dialled.unsent));
      if (!dialled.unsent.empty()) waiting_.push_back(connection);
    }
    for (const TcpId connection : done) {
      tcp_.close(connection);
      closed(connection);
    }
    for (const TcpId connection : dropped) {
      std::fprintf(stderr, "ur-sim: dropped a client of %s that does not read\n",
                   std::string(name_of(session_ports_[connection])).c_str());
      tcp_.abort(connection);
      closed(connection);
    }
  }

  void press_play(std::int64_t now_ns) {
    constexpr std::string_view kProgram = "external_control.urp";
    play_at_ns_ = now_ns + kPlayAgain_ns;
    Programs& programs = robot_.programs();
    if (robot_.controller().playing()) {
      play_at_ns_ = INT64_MAX;
    } else if (programs.loaded_name() == kProgram || programs.load(kProgram)) {
      static_cast<void>(programs.play());
    }
  }

  SimulatedUr& robot_;
  std::int64_t play_at_ns_ = INT64_MAX;
  Tcp tcp_;
  std::map<TcpId, Port> ports_;
  std::map<TcpId, Session*> sessions_;
  std::map<TcpId, Port> session_ports_;
  std::map<TcpId, Dialled> dialled_;  ///< by scripts
  std::vector<TcpId> waiting_;        ///< connections with something to send
};

}  // namespace

Status serve_on_tcp(SimulatedUr& robot, const TcpServiceOptions& options) {
  TcpService service(robot);
  if (Status listening = service.listen(options); !listening) return listening;
  const ControllerIdentity& identity = robot.controller().identity();
  std::fprintf(stderr, "ur-sim: %s, software %s, ready\n", std::string(identity.nominal.name).c_str(),
               identity.version_text().c_str());
  service.run(options.play_after_s);
  return {};
}

}  // namespace firstlook::sim::ur
