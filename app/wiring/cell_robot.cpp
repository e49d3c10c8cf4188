#include "app/wiring/cell_robot.hpp"

#include "app/wiring/job_site.hpp"
#include "app/wiring/simulated_ur.hpp"
#include "hal/sim/simulated_operator.hpp"
#include "platform/memory/allocation_guard.hpp"

namespace firstlook {
namespace {

constexpr const char* kOwnHost = "127.0.0.1";

/// What happens to a controller in this process: the faults of the cell that its arm has, and what was asked for.
Result<sim::ur::Timetable> timetable_of(const RunCommand& command, const sim::Faults& faults) {
  sim::ur::Timetable timetable = sim::ur::timetable_of(sim::controller_script(faults));
  for (const std::string& words : command.robot_happens) {
    const auto happening = sim::ur::read_timed_happening(words);
    if (!happening) return failure(happening.error().fault, "--robot-at {}", happening.error().detail());
    timetable.push_back(*happening);
  }
  return timetable;
}

bool has_controller(const sim::Scene& scene) {
  return scene.arm_file.empty() && sim::ur::identify_controller(scene.arm.name.view(), 0, "").has_value();
}

/// What only a controller has.
Status refuse_for_own_arm(const RunCommand& command, const Config& config, const sim::Scene& scene) {
  if (!command.robot_happens.empty()) {
    return failure(Fault::kUsage, "--robot-at is for a simulated controller: none moves the arm ({}) of this cell",
                   scene.arm.name.view());
  }
  if (config.robot.calibration_file != "none") {
    return failure(Fault::kConfigBadValue, "robot.calibration_file: no controller moves the arm ({}) of this cell",
                   scene.arm.name.view());
  }
  return {};
}

}  // namespace

Result<std::unique_ptr<CellRobot>> CellRobot::find(const RunCommand& command, const Config& config,
                                                   const sim::Scene& scene) {
  const memory::SimulationScope simulation;
  const std::string& host = config.robot.host;
  if (config.robot.none() || (host == kWhereItCan && !has_controller(scene))) {
    if (const Status fits = refuse_for_own_arm(command, config, scene); !fits) return std::unexpected(fits.error());
    return nullptr;
  }
  if (const Status fits = refuse_other_arms(config); !fits) return std::unexpected(fits.error());
  if (!command.robot_happens.empty() && names_network_robot(config)) {
    return failure(Fault::kUsage, "--robot-at is for --robot {}: `ur-sim` has --at of its own", kInProcess);
  }
  const auto faults = sim::parse_faults(command.faults);
  if (!faults) return std::unexpected(faults.error());
  std::unique_ptr<CellRobot> robot(new CellRobot);
  auto timetable = timetable_of(command, *faults);
  if (!timetable) return std::unexpected(timetable.error());
  const Status found = names_network_robot(config) ? robot->find_on_network(*faults, config)
                                                   : robot->start_in_process(std::move(*timetable), config, scene);
  if (!found) return std::unexpected(found.error());
  return robot;
}

Status CellRobot::start_in_process(sim::ur::Timetable timetable, const Config& config, const sim::Scene& scene) {
  UrSimCommand words;
  words.seed = static_cast<std::uint64_t>(config.seed);
  words.running = true;
  words.external_control = fmt::format("{}:{}", kOwnHost, config.robot.program_port);
  auto controller = make_simulated_ur(words, &scene);
  if (!controller) return std::unexpected(controller.error());
  controller_ = std::move(*controller);
  install(config.robot);
  service_ = std::make_unique<sim::ur::SteppedService>(*controller_, std::move(timetable));
  links_ = std::make_unique<sim::ur::SteppedLinks>(
      [this](std::string_view asked, std::string& told) { return service_->turn(asked, told); });
  return follow_steps();
}

/// A site whose controller is set as it should be.
void CellRobot::install(const Config::Robot& wanted) {
  sim::ur::Controller& controller = controller_->controller();
  if (wanted.payload_kg >= 0)
    controller.set_payload({.mass_kg = wanted.payload_kg, .center_m = {}, .inertia_kg_m2 = {}});
  if (!wanted.tcp_offset) return;
  sim::ur::Vector6 offset{};
  for (int i = 0; i < 6; ++i) offset[static_cast<std::size_t>(i)] = (*wanted.tcp_offset)[i];
  controller.set_tcp_offset(offset);
}

Status CellRobot::follow_steps() {
  auto truth = std::make_unique<sim::ur::SteppedTruth>(*links_);
  if (const Status connected = truth->connect(); !connected) return connected;
  truth_ = std::move(truth);
  return {};
}

Status CellRobot::find_on_network(const sim::Faults& faults, const Config& config) {
  if (sim::acts_on_arm(faults)) {
    return failure(Fault::kUsage, "--faults: what happens to arm, link and operator is up to the robot's simulation");
  }
  const int port = static_cast<int>(sim::ur::Port::kTruth) + config.robot.port_offset;
  auto channel = sim::ur::connect_private_channel(config.robot.host, static_cast<std::uint16_t>(port));
  if (!channel) return std::unexpected(channel.error());
  if (channel->lockstep) {
    lockstep_.emplace(std::move(channel->stream));
    links_ = std::make_unique<sim::ur::SteppedLinks>(
        [this](std::string_view asked, std::string& told) { return lockstep_->turn(asked, told); });
    return follow_steps();
  }
  auto truth = std::make_unique<sim::ur::TcpTruth>();
  if (const Status connected = truth->connect(std::move(channel->stream)); !connected) return connected;
  truth_ = std::move(truth);
  return {};
}

Status CellRobot::connect(const Config& config, Narrator& narrator) {
  const auto keep = [&](Result<std::unique_ptr<NetworkArm>> connected) -> Status {
    if (!connected) return std::unexpected(connected.error());
    arm_ = std::move(*connected);
    return {};
  };
  if (links_ == nullptr) return keep(NetworkArm::connect(config, narrator));
  SteppedClock clock(*links_);
  auto network = std::make_unique<SteppedNetwork>(*links_, static_cast<std::uint16_t>(config.robot.program_port),
                                                  static_cast<std::uint16_t>(config.robot.control_port));
  if (const Status kept = keep(NetworkArm::connect(config, narrator, std::move(network), clock, kOwnHost)); !kept) {
    return kept;
  }
  links_->begin();
  while (truth_->next()) continue;  // where it stood before
  stepped_.emplace(*links_, arm_->arm());
  stepped_pendant_.emplace(*links_, arm_->pendant());
  return {};
}

}  // namespace firstlook
