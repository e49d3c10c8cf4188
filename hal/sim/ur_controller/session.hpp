/// One connection to one of a controller's ports: bytes in, bytes out. No sockets, no time but the control cycle.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace firstlook::sim::ur {

class Session {
 public:
  Session() = default;
  virtual ~Session() = default;
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  /// Bytes of the client, cut anywhere.
  virtual void receive(std::string_view bytes) = 0;
  /// After each control cycle: what is due goes to `output()`.
  virtual void on_cycle() {}
  /// The client is gone: what it held is free again.
  virtual void closed() {}

  /// The controller is gone: nothing of what waited is sent any more.
  void cut_off() {
    output_.clear();
    over_ = true;
  }

  /// To be sent; whoever sends takes it from the front.
  [[nodiscard]] std::string& output() { return output_; }
  /// Of the simulation, which a reboot of the controller does not end.
  [[nodiscard]] virtual bool is_private() const { return false; }
  /// The session is over once its output is sent.
  [[nodiscard]] bool over() const { return over_; }

 protected:
  void end() { over_ = true; }

 private:
  std::string output_;
  bool over_ = false;
};

}  // namespace firstlook::sim::ur
