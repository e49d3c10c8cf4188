#include "hal/sim/ur_controller/program_request.hpp"

#include "hal/sim/ur_controller/script_feed.hpp"

namespace firstlook::sim::ur {
namespace {

constexpr double kConnect_s = 2;  // and until the first bytes of an answer
constexpr double kSilent_s = 0.5;

using SocketState = script::Sockets::State;

}  // namespace

ProgramRequest::ProgramRequest(const ExternalControl& from, script::Sockets& sockets)
    : sockets_(sockets), socket_(sockets.open(from.host, from.port)) {}

ProgramRequest::~ProgramRequest() {
  if (socket_ != 0) sockets_.close(socket_);
}

ProgramRequest::State ProgramRequest::step(double cycle_s) {
  if (socket_ == 0) return State::kFailed;
  const SocketState socket = sockets_.state(socket_);
  if (socket == SocketState::kOpen && !asked_) {
    asked_ = true;
    silent_s_ = 0;
    if (!sockets_.send(socket_, "request_program\n")) return State::kFailed;
  }
  std::string& came = sockets_.received(socket_);
  silent_s_ = came.empty() ? silent_s_ + cycle_s : 0;
  text_ += came;
  came.clear();
  if (text_.size() > kScriptBytesMax) return State::kFailed;
  const bool over = socket == SocketState::kClosed || silent_s_ >= (text_.empty() ? kConnect_s : kSilent_s);
  if (!over) return State::kWaiting;
  return text_.empty() ? State::kFailed : State::kAnswered;
}

}  // namespace firstlook::sim::ur
