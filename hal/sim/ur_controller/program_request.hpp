/// The External Control node of a program on the pendant: asks another computer for the URScript that it then runs.
#pragma once

#include <cstdint>
#include <string>

#include "hal/sim/ur_controller/script/sockets.hpp"

namespace firstlook::sim::ur {

/// Who is asked; port 0: nobody.
struct ExternalControl {
  std::string host;
  std::uint16_t port = 0;
};

/// One question, as the URCap puts it: dials, sends "request_program\n", reads until the other side closes or has sent
/// nothing for half a second.
class ProgramRequest {
 public:
  enum class State : std::uint8_t { kWaiting, kAnswered, kFailed };

  /// `sockets` must outlive the request.
  ProgramRequest(const ExternalControl& from, script::Sockets& sockets);
  ~ProgramRequest();
  ProgramRequest(const ProgramRequest&) = delete;
  ProgramRequest& operator=(const ProgramRequest&) = delete;

  [[nodiscard]] State step(double cycle_s);
  /// What came, as a program: the other side sends what stands inside it.
  [[nodiscard]] std::string program() const { return "def external_control():\n" + text_ + "\nend\n"; }

 private:
  script::Sockets& sockets_;
  script::Sockets::Id socket_;
  bool asked_ = false;
  double silent_s_ = 0;
  std::string text_;
};

}  // namespace firstlook::sim::ur
