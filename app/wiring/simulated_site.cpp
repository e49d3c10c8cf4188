#include "app/config/arm_file.hpp"
#include "app/config/board_config.hpp"
#include "app/wiring/cell_grading.hpp"
#include "app/wiring/cell_robot.hpp"
#include "app/wiring/job_site.hpp"
#include "app/wiring/persons_pendant.hpp"
#include "app/wiring/real_devices.hpp"
#include "platform/memory/allocation_guard.hpp"

namespace firstlook {
namespace {

class SimulatedSite final : public JobSite {
 public:
  SimulatedSite(std::unique_ptr<CellRobot> robot, std::unique_ptr<sim::SimulatedCell> cell, OpenedPanel panel)
      : robot_(std::move(robot)), cell_(std::move(cell)), panel_(std::move(panel.panel)), telling_(panel.telling) {
    if (robot_) pendant_.emplace(robot_->pendant(), cell_->pendant());
  }
  ~SimulatedSite() override { cell_->grader().watch(nullptr); }

  CartDevices devices() override {
    return {robot_ ? robot_->arm() : cell_->arm(),
            cell_->color(),
            cell_->depth(),
            pendant_ ? static_cast<hal::Pendant&>(*pendant_) : cell_->pendant(),
            panel_ ? *panel_ : cell_->panel(),
            telling_};
  }
  CellFacts facts() const override {
    const sim::CellDescription& cell = cell_->description();
    return {cell.start_rad, cell.camera_T_depth, {}, robot_ ? robot_->model() : cell.arm};
  }
  bool in_real_time() const override { return (robot_ && robot_->in_real_time()) || panel_ != nullptr; }
  void begin(const PublishedSpace& space) override {
    known_free_.emplace(space);
    cell_->grader().watch(&*known_free_);
  }
  void finish(const Cart& cart, const Config& config, RunRecord& record, Narrator& narrator) override {
    narrator.line("grading against the simulated cell's truth");
    grade(cell_->grader(), cart, config, record);
    cell_->grader().watch(nullptr);
    if (robot_) record.robot = robot_->record(narrator);
  }

 private:
  std::unique_ptr<CellRobot> robot_;  ///< moves the arm; null: the cell's own does
  std::unique_ptr<sim::SimulatedCell> cell_;
  std::optional<PersonsPendant> pendant_;  ///< where a robot moves the arm
  std::shared_ptr<hal::Panel> panel_;      ///< a real one in place of the cell's
  TellingDevices telling_;
  std::optional<KnownFree> known_free_;
};

/// The arm of a file, and in words what was taken from it.
Result<ArmModel> read_arm(const std::string& path, const Config::Arm& config, Narrator& narrator) {
  const auto read = read_arm_file(path, arm_file_options(config));
  if (!read) return std::unexpected(read.error());
  narrator.line("arm       " + read->summary);
  return read->arm;
}

Result<sim::Scene> load_scene(const Config& config, const sim::ArmChoice& choice) {
  const memory::SimulationScope simulation;
  return sim::load_cell(config.cell, static_cast<std::uint64_t>(config.seed), choice);
}

}  // namespace

Result<std::unique_ptr<JobSite>> open_simulated_site(const RunCommand& command, Config& config, Narrator& narrator) {
  const sim::ArmChoice choice = {config.arm.file == "none" ? "" : config.arm.file,
                                 [&](const std::string& path) { return read_arm(path, config.arm, narrator); }};
  auto scene = load_scene(config, choice);
  if (!scene) return std::unexpected(scene.error());
  auto found = CellRobot::find(command, config, *scene);
  if (!found) return std::unexpected(found.error());
  std::unique_ptr<CellRobot> robot = std::move(*found);
  if (config.robot.host == CellRobot::kWhereItCan) {
    if (!robot)
      narrator.line(fmt::format("robot     {}: the cell's own arm, no UR controller", scene->arm.name.view()));
    config.robot.host = robot ? CellRobot::kInProcess : "none";
  }
  auto cell = sim::make_simulated_cell(
      {config.cell, static_cast<std::uint64_t>(config.seed), command.fast_sensor, command.faults, config.workers,
       configured_boards(config), config.depth.sensor, robot ? &robot->truth() : nullptr, choice},
      std::move(*scene));
  if (!cell) return std::unexpected(cell.error());
  describe_cell((*cell)->description(), config);
  std::vector<CheckedDevice> asked;
  auto panel = open_panel(config, asked);
  if (!panel) return std::unexpected(panel.error());
  if (robot) {
    if (const Status connected = robot->connect(config, narrator); !connected)
      return std::unexpected(connected.error());
  }
  return std::make_unique<SimulatedSite>(std::move(robot), std::move(*cell), std::move(*panel));
}

}  // namespace firstlook
