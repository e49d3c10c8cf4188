/// The simulated cell: all devices of a cart in a scene, and apart from them the grader, who knows the truth.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "algorithms/mapping/safe_zone.hpp"
#include "algorithms/vision/target_set.hpp"
#include "hal/api/cameras.hpp"
#include "hal/api/operator_devices.hpp"
#include "hal/api/robot_arm.hpp"
#include "hal/sim/cell_file.hpp"
#include "hal/sim/followed_arm.hpp"
#include "hal/sim/grader.hpp"
#include "platform/core/camera_intrinsics.hpp"
#include "platform/core/joint_vector.hpp"
#include "platform/core/result.hpp"
#include "platform/core/transform.hpp"

namespace firstlook::sim {

struct SimulationOptions {
  std::string cell = "workshop";  ///< built-in name, "random:SEED", or a file
  std::uint64_t seed = 1;         ///< of noise, deviations, faults and the true mount
  bool fast_sensor = false;       ///< coarser depth, corners instead of pixels
  std::string faults;             ///< faults.hpp
  int workers = 2;                ///< threads that render and grade; results do not depend on it
  /// What the job looks for: each hangs in place of the cell's board of its name, one without a name in place of the
  /// only one. Empty: the cell's own boards. The colour camera counts them in this order.
  std::vector<NamedTarget> boards{};
  std::string sensor = "kinect";  ///< sensor_presets.hpp
  /// Where the true joints come from when another process moves the arm, and it is not the cell's; null: the cell's own
  /// arm moves. Outlives the cell.
  TrueJointFeed* feed = nullptr;
  ArmChoice arm{};  ///< reads arms from files; may put one in place of the cell's own
};

/// A region of space in base coordinates that nothing may enter, as the configuration has it.
struct KeepOut {
  Eigen::Vector3d low_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d high_m = Eigen::Vector3d::Zero();
};

/// What an integrator would have typed in for this cell: nothing that the job has to find out.
struct CellDescription {
  std::string name;
  ArmModel arm;
  std::string arm_file;    ///< that it was read from; empty: it is built in
  JointVector start_rad;   ///< where the arm stands before the job
  CameraIntrinsics color;  ///< of the factory sheet
  CameraIntrinsics depth;
  double depth_units_per_m = 1000;
  Transform<Camera, Depth> camera_T_depth;                   ///< factory transform
  std::vector<NamedTarget> boards;                           ///< those that the job looks for
  Eigen::Vector3d flange_p_tip_m = Eigen::Vector3d::Zero();  ///< as somebody measured it, 0.5 mm each axis
  double cart_top_m = -0.02;                                 ///< z of the cart's own top
  SafeZone safe_zone;
  std::vector<KeepOut> keep_out;
  double camera_envelope_m = 0;     ///< 0: as the configuration has it
  std::optional<KeepOut> map = {};  ///< box that the map covers; empty: as the configuration has it
};

/// Owns scene, devices and grader. Devices may be used as hal/api says; their references live as long as the cell.
class SimulatedCell {
 public:
  virtual ~SimulatedCell() = default;
  [[nodiscard]] virtual const CellDescription& description() const = 0;
  /// The arm of a cell whose arm is moved elsewhere does nothing, and its pendant has no keys but the person's Confirm.
  [[nodiscard]] virtual hal::RobotArm& arm() = 0;
  [[nodiscard]] virtual hal::ColorCamera& color() = 0;
  [[nodiscard]] virtual hal::DepthCamera& depth() = 0;
  [[nodiscard]] virtual hal::Pendant& pendant() = 0;
  [[nodiscard]] virtual hal::Panel& panel() = 0;
  /// For main and the grading of a finished run only; never for anything that decides.
  [[nodiscard]] virtual Grader& grader() = 0;
};

/// Builds a cell from its options. Errors: kCellInvalid for a cell that cannot be used, kUsage for a fault
/// specification that is not understood, kConfigBadValue for boards that the cell has no place for, kDataMissing for a
/// file that cannot be opened. Faults of an arm that is moved elsewhere are up to who moves it.
[[nodiscard]] Result<std::unique_ptr<SimulatedCell>> make_simulated_cell(const SimulationOptions& options);
/// The same from the scene that `load_cell` gave for `cell`, `seed` and `arm` of the options.
[[nodiscard]] Result<std::unique_ptr<SimulatedCell>> make_simulated_cell(const SimulationOptions& options, Scene scene);

}  // namespace firstlook::sim
