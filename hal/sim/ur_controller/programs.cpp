#include "hal/sim/ur_controller/programs.hpp"

#include "hal/sim/ur_controller/script/compiler.hpp"

namespace firstlook::sim::ur {
namespace {

constexpr std::string_view kFolder = "/programs/";
constexpr std::size_t kSecondaryMax = 8;  // programs beside the running one, at once

using Kind = ControllerEvent::Kind;

}  // namespace

Programs::Programs(Controller& controller, std::vector<StoredProgram> stored)
    : controller_(controller), stored_(std::move(stored)) {}

void Programs::set_sockets(script::Sockets* sockets) {
  end_program();
  request_.reset();
  pending_.reset();
  secondary_.clear();
  sockets_ = sockets;
}

void Programs::drop_program() {
  program_.reset();
  statements_.step(nullptr);
}

void Programs::forget() {
  drop_program();
  request_.reset();
  pending_.reset();
  secondary_.clear();
  loaded_ = nullptr;
}

void Programs::tell_error(const script::ScriptError& error) {
  controller_.tell({.kind = Kind::kRuntimeException, .code = error.line, .argument = error.column, .text = error.text});
}

void Programs::end_program() {
  if (program_ == nullptr) return;
  if (program_->error()) tell_error(*program_->error());
  controller_.tell({.kind = Kind::kKey, .title = "PROGRAM_XXX_STOPPED", .text = program_->code().name});
  drop_program();
  controller_.set_script_line(0);
  controller_.watchdogs().clear();
}

void Programs::follow_watchdogs() {
  RtdeWatchdogs& watchdogs = controller_.watchdogs();
  const std::uint64_t now = controller_.state().control_step;
  if (program_ == nullptr || !controller_.playing()) return watchdogs.hold(now);
  const auto late = watchdogs.late(now);
  if (!late || *late == RtdeWatchdogs::Action::kIgnore) return;
  controller_.tell(
      {.kind = Kind::kErrorCode, .warning = true, .text = "RTDE watchdog: an input was not renewed in time"});
  if (*late == RtdeWatchdogs::Action::kPause) return controller_.pause();
  controller_.stop();
}

void Programs::begin_pending() {
  program_ = std::move(pending_);
  controller_.play();
  controller_.tell({.kind = Kind::kKey, .title = "PROGRAM_XXX_STARTED", .text = program_->code().name});
}

bool Programs::start_loaded() {
  if (loaded_ == nullptr) return false;
  if (loaded_->external.port == 0) return start(loaded_->script);
  if (sockets_ == nullptr) return false;
  request_ = std::make_unique<ProgramRequest>(loaded_->external, *sockets_);
  return true;
}

void Programs::follow_request() {
  if (request_ == nullptr) return;
  const ProgramRequest::State state = request_->step(controller_.identity().cycle.seconds());
  if (state == ProgramRequest::State::kWaiting) return;
  const std::unique_ptr<ProgramRequest> request = std::move(request_);
  if (state == ProgramRequest::State::kAnswered) {
    start_failed_ = !start(request->program());
  } else {
    start_failed_ = true;
    controller_.tell({.kind = Kind::kPopup,
                      .error = true,
                      .title = "External Control",
                      .text = fmt::format("No program from {}:{}", loaded_->external.host, loaded_->external.port)});
  }
}

void Programs::step() {
  follow_request();
  follow_watchdogs();
  const RuntimeState runtime = controller_.state().runtime;
  if (runtime == RuntimeState::kStopping || runtime == RuntimeState::kStopped) end_program();
  if (pending_ != nullptr && program_ == nullptr && runtime == RuntimeState::kStopped) {
    if (controller_.can_play()) {
      begin_pending();
    } else {
      pending_.reset();
      start_failed_ = true;
    }
  }
  if (program_ != nullptr && controller_.playing()) {
    program_->step();
    if (program_->end()) {
      end_program();
      controller_.stop();
    } else {
      statements_.step(program_.get());
    }
  }
  for (const auto& secondary : secondary_) {
    secondary->step();
    if (secondary->error()) tell_error(*secondary->error());
  }
  std::erase_if(secondary_, [](const auto& secondary) { return secondary->end().has_value(); });
}

bool Programs::start(const std::string& script) {
  auto code = script::compile(script);
  if (!code) {
    tell_error(code.error());
    return false;
  }
  const bool secondary = code->secondary;
  auto machine = std::make_unique<script::Machine>(std::move(*code), controller_, sockets_);
  if (secondary) {
    if (secondary_.size() < kSecondaryMax) secondary_.push_back(std::move(machine));
    return true;
  }
  pending_ = std::move(machine);
  controller_.stop();
  return true;
}

void Programs::submit(const std::string& script) {
  if (start(script) && pending_ != nullptr && !controller_.can_play()) {
    pending_.reset();
    controller_.tell({.kind = Kind::kErrorCode,
                      .warning = true,
                      .text = "The program is not started: the robot is not running, or stopped for safety"});
  }
}

bool Programs::load(std::string_view name) {
  // A simulator of UR's has the folder elsewhere: "/ursim/programs/".
  if (const std::size_t folder = name.find(kFolder); folder != std::string_view::npos) {
    name.remove_prefix(folder + kFolder.size());
  }
  for (const StoredProgram& program : stored_) {
    if (program.name != name) continue;
    static_cast<void>(stop());
    loaded_ = &program;
    return true;
  }
  return false;
}

bool Programs::starting() const {
  return request_ != nullptr || pending_ != nullptr || controller_.state().runtime == RuntimeState::kResuming;
}

bool Programs::play() {
  start_failed_ = false;
  if (!controller_.can_play()) return false;
  switch (controller_.state().runtime) {
    case RuntimeState::kPaused:
    case RuntimeState::kPausing:
      controller_.play();
      return true;
    case RuntimeState::kStopped:
    case RuntimeState::kStopping:
      return start_loaded();
    default:
      return true;  // it plays
  }
}

bool Programs::pause() {
  if (!controller_.state().program_running()) return false;
  controller_.pause();
  return true;
}

bool Programs::stop() {
  const bool running = controller_.state().program_running() || pending_ != nullptr || request_ != nullptr;
  request_.reset();
  pending_.reset();
  controller_.stop();
  return running;
}

std::string Programs::loaded_path() const {
  return loaded_ == nullptr ? std::string() : std::string(kFolder) + loaded_->name;
}

std::string_view Programs::loaded_name() const {
  return loaded_ == nullptr ? std::string_view("<unnamed>") : std::string_view(loaded_->name);
}

}  // namespace firstlook::sim::ur
