#include "hal/sim/ur_controller/happenings_session.hpp"

#include "hal/sim/ur_controller/happenings.hpp"

namespace firstlook::sim::ur {
namespace {
constexpr std::size_t kLineMax = 4096;
}

std::string answer_happening(std::string_view line, SimulatedUr& robot) {
  while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) line.remove_suffix(1);
  if (line == "help") {
    std::string words = happenings_in_words();
    if (!words.empty()) words.pop_back();
    return words;
  }
  const auto happening = read_happening(line);
  if (!happening) return std::string(happening.error().detail());
  return happen(*happening, robot) ? "done" : "no dialog is open that takes this";
}

HappeningsSession::HappeningsSession(SimulatedUr& robot) : robot_(robot) {
  output() = "firstlook ur-sim: what is to happen to the robot? help tells the words\n";
}

void HappeningsSession::receive(std::string_view bytes) {
  received_.append(bytes);
  for (std::size_t end = received_.find('\n'); end != std::string::npos; end = received_.find('\n')) {
    const std::string line = received_.substr(0, end);
    received_.erase(0, end + 1);
    output() += answer_happening(line, robot_) + '\n';
  }
  if (received_.size() > kLineMax) end();
}

}  // namespace firstlook::sim::ur
