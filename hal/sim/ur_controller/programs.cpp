#include "hal/sim/ur_controller/programs.hpp"

namespace firstlook::sim::ur {
namespace {
constexpr std::string_view kFolder = "/programs/";
}

Programs::Programs(Controller& controller, std::vector<StoredProgram> stored)
    : controller_(controller), stored_(std::move(stored)) {}

void Programs::step() {}

bool Programs::load(std::string_view name) {
  if (name.starts_with(kFolder)) name.remove_prefix(kFolder.size());
  for (const StoredProgram& program : stored_) {
    if (program.name != name) continue;
    static_cast<void>(stop());
    loaded_ = &program;
    return true;
  }
  return false;
}

bool Programs::play() {
  if (!controller_.can_play()) return false;
  const RuntimeState runtime = controller_.state().runtime;
  const bool paused = runtime == RuntimeState::kPaused || runtime == RuntimeState::kPausing;
  if (!paused && loaded_ == nullptr) return false;
  controller_.play();
  return true;
}

bool Programs::pause() {
  if (!controller_.state().program_running()) return false;
  controller_.pause();
  return true;
}

bool Programs::stop() {
  if (!controller_.state().program_running()) return false;
  controller_.stop();
  return true;
}

void Programs::submit(const std::string& script) {
  controller_.tell({.kind = ControllerEvent::Kind::kText, .text = "no interpreter: " + script.substr(0, 80)});
}

std::string Programs::loaded_path() const {
  return loaded_ == nullptr ? std::string() : std::string(kFolder) + loaded_->name;
}

std::string_view Programs::loaded_name() const {
  return loaded_ == nullptr ? std::string_view("<unnamed>") : std::string_view(loaded_->name);
}

}  // namespace firstlook::sim::ur
