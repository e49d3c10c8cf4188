#include "app/config/arm_file.hpp"
#include "app/config/board_config.hpp"
#include "app/wiring/cell_grading.hpp"
#include "app/wiring/job_site.hpp"
#include "app/wiring/network_arm.hpp"
#include "app/wiring/real_devices.hpp"
#include "hal/sim/ur_controller/simulated_ur.hpp"
#include "hal/sim/ur_controller/truth_reader.hpp"

namespace firstlook {
namespace {

class SimulatedSite final : public JobSite {
 public:
  SimulatedSite(std::unique_ptr<sim::ur::TruthReader> truth, std::unique_ptr<sim::SimulatedCell> cell,
                std::unique_ptr<NetworkArm> arm, std::shared_ptr<hal::Panel> panel)
      : truth_(std::move(truth)), cell_(std::move(cell)), arm_(std::move(arm)), panel_(std::move(panel)) {}
  ~SimulatedSite() override { cell_->grader().watch(nullptr); }

  CartDevices devices() override {
    return {arm_ ? arm_->arm() : cell_->arm(), cell_->color(), cell_->depth(),
            arm_ ? arm_->pendant() : cell_->pendant(), panel_ ? *panel_ : cell_->panel()};
  }
  CellFacts facts() const override {
    const sim::CellDescription& cell = cell_->description();
    return {cell.start_rad, cell.camera_T_depth, {}, arm_ ? arm_->model() : cell.arm};
  }
  bool in_real_time() const override { return arm_ != nullptr || panel_ != nullptr; }
  void begin(const PublishedSpace& space) override {
    known_free_.emplace(space);
    cell_->grader().watch(&*known_free_);
  }
  void finish(const Cart& cart, const Config& config, RunRecord& record, Narrator& narrator) override {
    narrator.line("grading against the simulated cell's truth");
    grade(cell_->grader(), cart, config, record);
    cell_->grader().watch(nullptr);
    if (arm_) record.robot = arm_->record(narrator);
  }

 private:
  std::unique_ptr<sim::ur::TruthReader> truth_;
  std::unique_ptr<sim::SimulatedCell> cell_;
  std::unique_ptr<NetworkArm> arm_;
  std::shared_ptr<hal::Panel> panel_;  ///< a real one in place of the cell's
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
  std::unique_ptr<sim::ur::TruthReader> truth;
  if (config.robot.given()) {
    if (const Status fits = refuse_other_arms(config); !fits) return std::unexpected(fits.error());
    if (config.calibration.touch_test == "yes") {
      return failure(Fault::kUsage, "calibration.touch_test: the simulated person leads the cell's own arm only");
    }
    truth = std::make_unique<sim::ur::TruthReader>();
    const int port = static_cast<int>(sim::ur::Port::kTruth) + config.robot.port_offset;
    if (const Status followed = truth->connect(config.robot.host, static_cast<std::uint16_t>(port)); !followed) {
      return std::unexpected(followed.error());
    }
  }
  const sim::ArmChoice choice = {config.arm.file == "none" ? "" : config.arm.file,
                                 [&](const std::string& path) { return read_arm(path, config.arm, narrator); }};
  auto cell = sim::make_simulated_cell({config.cell, static_cast<std::uint64_t>(config.seed), command.fast_sensor,
                                        command.faults, config.workers, configured_boards(config), config.depth.sensor,
                                        truth.get(), choice});
  if (!cell) return std::unexpected(cell.error());
  describe_cell((*cell)->description(), config);
  auto panel = open_panel(config);
  if (!panel) return std::unexpected(panel.error());
  std::unique_ptr<NetworkArm> arm;
  if (config.robot.given()) {
    auto connected = NetworkArm::connect(config, narrator);
    if (!connected) return std::unexpected(connected.error());
    arm = std::move(*connected);
  }
  return std::make_unique<SimulatedSite>(std::move(truth), std::move(*cell), std::move(arm), std::move(*panel));
}

}  // namespace firstlook
