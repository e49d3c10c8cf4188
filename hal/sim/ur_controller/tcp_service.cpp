#include "hal/sim/ur_controller/tcp_service.hpp"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <map>

#include "hal/sim/ur_controller/happenings_session.hpp"
#include "hal/sim/ur_controller/lockstep.hpp"
#include "hal/sim/ur_controller/stepped_service.hpp"
#include "hal/sim/ur_controller/truth_session.hpp"
#include "platform/linux/process.hpp"
#include "platform/linux/tcp.hpp"
#include "platform/linux/wakeup.hpp"

namespace firstlook::sim::ur {
namespace {

constexpr std::size_t kUnreadMax = 2 << 20;
constexpr std::int64_t kPlayAgain_ns = 3'000'000'000;  // longer than a request for a program lasts
constexpr std::int64_t kLook_ns = 200'000'000;         // for signals, while nothing comes
constexpr std::int64_t kLateMax_ns = 500'000'000;      // after a longer sleep the cycles in between are left out

class TcpService final : public TcpEvents, public script::Sockets {
 public:
  TcpService(SimulatedUr& robot, const TcpServiceOptions& options) : robot_(robot), console_(options.console) {
    if (options.lockstep) {
      stepped_.emplace(robot, timetable_of(options));
    } else {
      timetable_ = options.timetable;
      std::ranges::stable_sort(timetable_, {}, &TimedHappening::stamp);
      robot_.programs().set_sockets(this);
    }
  }
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
      if (!robot_.has(port)) continue;
      if (const Status listening = listen(options, port); !listening) return listening;
    }
    if (const Status listening = listen(options, Port::kHappenings); !listening) return listening;
    if (options.truth) {
      if (const Status listening = listen(options, Port::kTruth); !listening) return listening;
    }
    for (const auto& [listener, port] : ports_) {
      std::fprintf(stderr, "ur-sim: %s on %s:%d\n", std::string(name_of(port)).c_str(), options.host.c_str(),
                   static_cast<int>(tcp_.port_of(listener)));
    }
    return {};
  }

  /// Its time is that of the client of the private channel.
  void run_in_lockstep() {
    while (!stop_signal_received() && !finished()) {
      tcp_.poll(monotonic_ns() + kLook_ns, waiting_, *this);
      hear_console();
      flush();
    }
  }

  void run(double play_after_s) {
    const std::int64_t begun_ns = monotonic_ns();
    std::int64_t due_ns = begun_ns + robot_.cycle().ns;
    if (play_after_s >= 0) play_at_ns_ = due_ns + static_cast<std::int64_t>(play_after_s * 1e9);
    while (!stop_signal_received() && !finished()) {
      tcp_.poll(due_ns, waiting_, *this);
      const std::int64_t now_ns = monotonic_ns();
      if (now_ns - due_ns > kLateMax_ns) due_ns = now_ns;
      for (; due_ns <= now_ns; due_ns += robot_.cycle().ns) robot_.step();
      if (now_ns >= play_at_ns_) play_again(now_ns);
      for (; next_ < timetable_.size() && timetable_[next_].stamp.ns <= now_ns - begun_ns; ++next_) {
        happen(timetable_[next_].happening, robot_);
      }
      hear_console();
      plug();
      flush();
    }
  }

  void opened(TcpId connection, TcpId listener) override {
    if (const auto dialled = dialled_.find(connection); dialled != dialled_.end()) {
      dialled->second.state = State::kOpen;
    } else if (stepped_ && ports_.at(listener) == Port::kTruth) {
      begin_lockstep(connection);
    } else if (!robot_.serves(ports_.at(listener))) {
      tcp_.abort(connection);  // as a computer that boots: nobody is there
    } else {
      session_ports_[connection] = ports_.at(listener);
      sessions_[connection] = &robot_.open(ports_.at(listener));
    }
  }

  void received(TcpId connection, std::string_view bytes) override {
    if (!reaches(connection)) {
      held_[connection].append(bytes.substr(0, kUnreadMax - std::min(kUnreadMax, held_[connection].size())));
      return;
    }
    if (const auto dialled = dialled_.find(connection); dialled != dialled_.end()) {
      std::string& waiting = dialled->second.received;
      waiting.append(bytes);
      if (waiting.size() > kUnreadMax) tcp_.close(connection), dialled->second.state = State::kClosed;
      return;
    }
    if (connection == stepper_) return take_turns(bytes);
    const auto found = sessions_.find(connection);
    if (found != sessions_.end() && !found->second->over()) found->second->receive(bytes);
  }

  void closed(TcpId connection) override {
    held_.erase(connection);
    if (const auto dialled = dialled_.find(connection); dialled != dialled_.end()) {
      dialled->second.state = State::kClosed;  // what came before can still be read
      return;
    }
    if (connection == stepper_) return end_lockstep();
    const auto found = sessions_.find(connection);
    if (found == sessions_.end()) return;
    robot_.close(*found->second);
    sessions_.erase(found);
    session_ports_.erase(connection);
  }

  // The connections of scripts.
  Id open(const std::string& host, std::uint16_t port) override {
    if (!robot_.cable_in()) return 0;
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
    return (!robot_.cable_in() || tcp_.send(socket, unsent)) && unsent.size() <= kUnreadMax;
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

  /// With what somebody at the pendant does.
  static Timetable timetable_of(const TcpServiceOptions& options) {
    Timetable timetable = options.timetable;
    if (options.play_after_s >= 0) {
      timetable.push_back({Instant{seconds(options.play_after_s).ns}, *read_happening("play")});
    }
    return timetable;
  }

  /// Bytes of this connection get through: its cable is in, or it is one of the simulation's own.
  [[nodiscard]] bool reaches(TcpId connection) const {
    if (robot_.cable_in() || connection == stepper_) return true;
    const auto port = session_ports_.find(connection);
    return port != session_ports_.end() && (port->second == Port::kTruth || port->second == Port::kHappenings);
  }

  /// TCP brings what was sent meanwhile once the cable is in again.
  void plug() {
    if (!robot_.cable_in() || held_.empty()) return;
    const auto held = std::exchange(held_, {});
    for (const auto& [connection, bytes] : held) received(connection, bytes);
  }

  void hear_console() {
    while (console_) {
      pollfd input{STDIN_FILENO, POLLIN, 0};
      if (poll(&input, 1, 0) <= 0) return;
      char buffer[512];
      const ssize_t count = read(STDIN_FILENO, buffer, sizeof buffer);
      console_ = count > 0;  // its end leaves the robot running
      if (console_) typed_.append(buffer, static_cast<std::size_t>(count));
      for (std::size_t end = typed_.find('\n'); end != std::string::npos; end = typed_.find('\n')) {
        std::fprintf(stderr, "ur-sim: %s\n", answer_happening(typed_.substr(0, end), robot_).c_str());
        typed_.erase(0, end + 1);
      }
    }
  }

  void begin_lockstep(TcpId connection) {
    if (stepper_ != 0) return tcp_.close(connection);  // one at a time keeps the time
    stepper_ = connection;
    to_stepper_ = kLockstepGreeting;
    from_stepper_.clear();
  }

  void take_turns(std::string_view bytes) {
    from_stepper_ += bytes;
    while (true) {
      const auto asked = first_turn(from_stepper_);
      if (asked && !*asked) return;
      const std::size_t at = open_turn(to_stepper_);
      if (!asked || !stepped_->turn(**asked, to_stepper_)) {
        std::fprintf(stderr, "ur-sim: hung up on a client in lockstep that does not know its steps\n");
        tcp_.close(stepper_);
        return end_lockstep();
      }
      close_turn(to_stepper_, at);
      from_stepper_.erase(0, 4 + (*asked)->size());
      static_cast<void>(tcp_.send(stepper_, to_stepper_));
    }
  }

  void end_lockstep() {
    stepped_->hang_up();
    stepper_ = 0;
    to_stepper_.clear();
  }

  /// A client that asked for the shutdown has its answer first.
  [[nodiscard]] bool finished() const { return robot_.shutting_down() && waiting_.empty(); }

  void flush() {
    waiting_.clear();
    if (!to_stepper_.empty()) {
      static_cast<void>(tcp_.send(stepper_, to_stepper_));
      if (!to_stepper_.empty()) waiting_.push_back(stepper_);
    }
    std::vector<TcpId> done, dropped;
    for (const auto& [connection, session] : sessions_) {
      if (!reaches(connection) && session->output().size() <= kUnreadMax) continue;
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
      if (dialled.state != State::kOpen || dialled.unsent.empty() || !robot_.cable_in()) continue;
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

  void play_again(std::int64_t now_ns) {
    play_at_ns_ = robot_.controller().playing() ? INT64_MAX : now_ns + kPlayAgain_ns;
    if (play_at_ns_ != INT64_MAX) press_play(robot_);
  }

  SimulatedUr& robot_;
  std::optional<SteppedService> stepped_;  ///< in lockstep
  TcpId stepper_ = 0;                      ///< its client
  std::string from_stepper_, to_stepper_;
  std::int64_t play_at_ns_ = INT64_MAX;
  Timetable timetable_;
  std::size_t next_ = 0;
  bool console_;
  std::string typed_;
  std::map<TcpId, std::string> held_;  ///< what came while the cable was out
  Tcp tcp_;
  std::map<TcpId, Port> ports_;
  std::map<TcpId, Session*> sessions_;
  std::map<TcpId, Port> session_ports_;
  std::map<TcpId, Dialled> dialled_;  ///< by scripts
  std::vector<TcpId> waiting_;        ///< connections with something to send
};

}  // namespace

Status serve_on_tcp(SimulatedUr& robot, const TcpServiceOptions& options) {
  TcpService service(robot, options);
  if (Status listening = service.listen(options); !listening) return listening;
  const ControllerIdentity& identity = robot.controller().identity();
  std::fprintf(stderr, "ur-sim: %s, software %s, ready%s\n", std::string(identity.nominal.name).c_str(),
               identity.version_text().c_str(), options.lockstep ? "; its time waits for `firstlook run`" : "");
  if (options.lockstep) {
    service.run_in_lockstep();
  } else {
    service.run(options.play_after_s);
  }
  return {};
}

}  // namespace firstlook::sim::ur
