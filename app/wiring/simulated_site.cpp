#include "app/config/arm_file.hpp"
#include "app/config/board_config.hpp"
#include "app/wiring/cell_grading.hpp"
#include "app/wiring/cell_robot.hpp"
#include "app/wiring/job_site.hpp"
#include "app/wiring/real_devices.hpp"

namespace firstlook {
namespace {

class SimulatedSite final : public JobSite {
 public:
  SimulatedSite(std::unique_ptr<CellRobot> robot, std::unique_ptr<sim::SimulatedCell> cell, OpenedPanel panel)
      : robot_(std::move(robot)), cell_(std::move(cell)), panel_(std::move(panel.panel)), telling_(panel.telling) {}
  ~SimulatedSite() override { cell_->grader().watch(nullptr); }

  CartDevices devices() override {
    return {robot_ ? robot_->arm() : cell_->arm(),
            cell_->color(),
            cell_->depth(),
            robot_ ? robot_->pendant() : cell_->pendant(),
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
  std::shared_ptr<hal::Panel> panel_;  ///< a real one in place of the cell's
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

}  // namespace

Result<std::unique_ptr<JobSite>> open_simulated_site(const RunCommand& command, Config& config, Narrator& narrator) {
  std::unique_ptr<CellRobot> robot;
  if (!config.robot.given() && !command.robot_happens.empty()) {
    return failure(Fault::kUsage, "--robot-at is for --robot {}", CellRobot::kInProcess);
  }
  if (config.robot.given()) {
    auto found = CellRobot::find(command, config);
    if (!found) return std::unexpected(found.error());
    robot = std::move(*found);
  }
  const sim::ArmChoice choice = {config.arm.file == "none" ? "" : config.arm.file,
                                 [&](const std::string& path) { return read_arm(path, config.arm, narrator); }};
  auto cell = sim::make_simulated_cell({config.cell, static_cast<std::uint64_t>(config.seed), command.fast_sensor,
                                        command.faults, config.workers, configured_boards(config), config.depth.sensor,
                                        robot ? &robot->truth() : nullptr, choice});
  if (!cell) return std::unexpected(cell.error());
  describe_cell((*cell)->description(), config);
  auto panel = open_panel(config);
  if (!panel) return std::unexpected(panel.error());
  if (robot) {
    if (const Status connected = robot->connect(config, narrator); !connected)
      return std::unexpected(connected.error());
  }
  return std::make_unique<SimulatedSite>(std::move(robot), std::move(*cell), std::move(*panel));
}

}  // namespace firstlook
