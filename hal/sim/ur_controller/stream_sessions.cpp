#include "hal/sim/ur_controller/stream_sessions.hpp"

#include <charconv>

#include "hal/sim/ur_controller/primary_packets.hpp"
#include "hal/sim/ur_controller/realtime_packet.hpp"

namespace firstlook::sim::ur {
namespace {

constexpr std::uint64_t kStateFrequency_hz = 10;
constexpr std::string_view kSetSpeed = "set speed ";  // and a fraction

std::string_view first_line(std::string_view program) {
  program = program.substr(0, program.find('\n'));
  while (!program.empty() && (program.back() == '\r' || program.back() == ' ')) program.remove_suffix(1);
  while (!program.empty() && program.front() == ' ') program.remove_prefix(1);
  return program;
}

}  // namespace

void ScriptSession::receive(std::string_view bytes) {
  if (read_only_) return;
  feed_.add(bytes);
  while (const std::optional<std::string> program = feed_.take()) run(*program);
  if (feed_.overflown()) end();
}

void ScriptSession::closed() {
  if (read_only_) return;
  while (const std::optional<std::string> program = feed_.take(true)) run(*program);
}

void ScriptSession::run(const std::string& program) {
  const std::string_view command = first_line(program);
  // Besides URScript these ports take a few commands, which clients use where there is no dashboard.
  if (command == "power on") {
    controller_.power_on();
  } else if (command == "power off") {
    controller_.power_off();
  } else if (command == "set robotmode run") {
    controller_.set_teach_mode(false);
    controller_.release_brakes();
  } else if (command == "set robotmode freedrive") {
    controller_.set_teach_mode(true);
  } else if (command.starts_with(kSetSpeed)) {
    double fraction = 0;
    const std::string_view text = command.substr(kSetSpeed.size());
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), fraction);
    if (error == std::errc{} && end == text.data() + text.size()) controller_.set_speed_slider(fraction);
  } else if (command == "set real" || command == "set sim") {
    // The arm is a simulated one in either.
  } else if (command == "set unlock protective stop") {
    static_cast<void>(controller_.unlock_protective_stop());
  } else if (command == "stop program") {
    static_cast<void>(programs_.stop());
  } else if (command == "pause program") {
    static_cast<void>(programs_.pause());
  } else if (command == "resume program") {
    static_cast<void>(programs_.play());
  } else if (command == "run program") {
    // The last line of many script files; their `def` runs by itself.
  } else {
    programs_.submit(program);
  }
}

StateSession::StateSession(Controller& controller, Programs& programs, bool read_only, bool primary)
    : ScriptSession(controller, programs, read_only), primary_(primary) {
  output() = version_message(controller);
}

void StateSession::on_cycle() {
  const auto frequency_hz = static_cast<std::uint64_t>(controller().identity().frequency_hz());
  const std::uint64_t step = controller().state().control_step;
  const bool due = step * kStateFrequency_hz / frequency_hz != (step - 1) * kStateFrequency_hz / frequency_hz;
  if (due) output() += robot_state_message(controller());
}

void RealtimeSession::on_cycle() { append_realtime_packet(controller(), output()); }

}  // namespace firstlook::sim::ur
