#include "hal/sim/ur_controller/dashboard_session.hpp"

#include "hal/sim/ur_controller/dashboard_commands.hpp"

namespace firstlook::sim::ur {
namespace {
constexpr std::size_t kLineMax = 4096;
}

DashboardSession::DashboardSession(Controller& controller, Programs& programs, DashboardState& dashboard)
    : controller_(controller), programs_(programs), dashboard_(dashboard) {
  output() = "Connected: Universal Robots Dashboard Server\n";
}

void DashboardSession::receive(std::string_view bytes) {
  received_.append(bytes);
  answer_lines();
  if (received_.size() > kLineMax) disconnect();
}

void DashboardSession::on_cycle() {
  if (pending_ == nullptr) return;
  const std::optional<std::string> reply = pending_(*this);
  if (!reply) return;
  pending_ = nullptr;
  output() += *reply + '\n';
  answer_lines();
}

void DashboardSession::answer_lines() {
  std::size_t at = 0;
  for (std::size_t end = received_.find('\n'); end != std::string::npos && !over() && pending_ == nullptr;
       end = received_.find('\n', at)) {
    answer(std::string_view(received_).substr(at, end - at));
    at = end + 1;
  }
  received_.erase(0, at);
}

void DashboardSession::answer(std::string_view line) {
  while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) line.remove_suffix(1);
  const std::string reply = run_dashboard_command(line, *this);
  if (pending_ == nullptr) output() += reply + '\n';
}

}  // namespace firstlook::sim::ur
