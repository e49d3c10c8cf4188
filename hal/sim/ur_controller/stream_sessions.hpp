/// Clients of the primary, secondary and realtime interfaces: a stream of packets for them, scripts from them.
#pragma once

#include "hal/sim/ur_controller/programs.hpp"
#include "hal/sim/ur_controller/script_feed.hpp"
#include "hal/sim/ur_controller/session.hpp"

namespace firstlook::sim::ur {

/// What the script ports have in common. A read-only port drops what it gets.
class ScriptSession : public Session {
 public:
  /// Both must outlive the session.
  ScriptSession(Controller& controller, Programs& programs, bool read_only)
      : controller_(controller), programs_(programs), read_only_(read_only) {}

  void receive(std::string_view bytes) override;
  void closed() override;

 protected:
  [[nodiscard]] Controller& controller() { return controller_; }

 private:
  void run(const std::string& program);

  Controller& controller_;
  Programs& programs_;
  bool read_only_;
  ScriptFeed feed_;
};

/// 10 Hz robot state after a version message; the primary interface has the events in between.
class StateSession final : public ScriptSession {
 public:
  StateSession(Controller& controller, Programs& programs, bool read_only, bool primary);
  void on_cycle() override;
  void on_event(const std::string& message) {
    if (primary_) output() += message;
  }

 private:
  bool primary_;
};

class RealtimeSession final : public ScriptSession {
 public:
  using ScriptSession::ScriptSession;
  void on_cycle() override;
};

}  // namespace firstlook::sim::ur
