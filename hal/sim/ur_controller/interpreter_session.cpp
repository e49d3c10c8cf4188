#include "hal/sim/ur_controller/interpreter_session.hpp"

#include "hal/sim/ur_controller/script_feed.hpp"

namespace firstlook::sim::ur {
namespace {

constexpr std::size_t kLineMax = 1 << 16;

}  // namespace

void InterpreterSession::receive(std::string_view bytes) {
  received_.append(bytes);
  std::size_t at = 0;
  for (std::size_t end = received_.find('\n'); end != std::string::npos; end = received_.find('\n', at)) {
    const std::string_view line = trimmed(std::string_view(received_).substr(at, end - at));
    if (line.size() > kLineMax) return this->end();
    if (!line.empty()) programs_.interpret(line, answers_);
    at = end + 1;
  }
  received_.erase(0, at);
  if (received_.size() > kLineMax) end();
  on_cycle();
}

void InterpreterSession::on_cycle() {
  output() += *answers_;
  answers_->clear();
}

}  // namespace firstlook::sim::ur
