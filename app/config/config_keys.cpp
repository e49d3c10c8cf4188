#include "app/config/config_keys.hpp"

#include <fmt/format.h>

#include "algorithms/calibration/solvers/solver_table.hpp"
#include "algorithms/mapping/map_planes.hpp"
#include "algorithms/mapping/sensor_presets.hpp"
#include "algorithms/vision/detector_presets.hpp"
#include "algorithms/vision/target_names.hpp"
#include "app/config/board_config.hpp"
#include "app/config/device_keys.hpp"
#include "app/machine/job_types.hpp"
#include "platform/loop/worker_pool.hpp"
#include "platform/memory/budget.hpp"

namespace firstlook {
namespace {

constexpr std::string_view kStartSources[] = {"pendant", "panel"};
constexpr std::string_view kArmModels[] = {"ur3", "ur5", "ur10", "ur3e", "ur5e", "ur10e", "two_joint", "pr2_like"};
constexpr std::string_view kMountings[] = {"upright", "tilted"};
constexpr std::string_view kViews[] = {"firstlook", "thesis2014"};
constexpr std::string_view kHoles[] = {"ignore", "clear_when_corroborated"};

constexpr std::size_t kColorPixelsMax = memory::budget_row(memory::Pool::kColorFrames).bytes_each;

/// Every seed that a double of result.json's readers can hold exactly.
constexpr double kSeedMax = 9007199254740992.0;

using Keys = std::vector<ConfigKey>;

void add_job_keys(Keys& keys, Config& c) {
  keys.push_back({"cell", &c.cell, 0, 0, {}, "simulated cell: a built-in name, random:SEED, or a YAML file"});
  keys.push_back({"seed", &c.seed, 0, kSeedMax, {}, "of every random number: one seed, one result"});
  keys.push_back({"workers",
                  &c.workers,
                  1,
                  WorkerPool::kWorkersMax,
                  {},
                  "threads for heavy work; the result is the same for any number"});
  keys.push_back({"start_source", &c.start_source, 0, 0, kStartSources,
                  "what starts a job: Play on the pendant, or the panel's button within 60 s of Play"});
}

void add_arm_keys(Keys& keys, Config& c) {
  keys.push_back({"arm.model", &c.arm.model, 0, 0, kArmModels, "arm on the cart"});
  keys.push_back({"arm.file", &c.arm.file, 0, 0, {}, "URDF or YAML of an arm that is not built in; none: arm.model"});
  keys.push_back({"arm.base_link", &c.arm.base_link, 0, 0, {}, "where a URDF's arm begins; auto: its root"});
  keys.push_back({"arm.tip_link", &c.arm.tip_link, 0, 0, {}, "the flange in a URDF; auto: the end of its only chain"});
  keys.push_back({"arm.links_without_body",
                  &c.arm.links_without_body,
                  0,
                  0,
                  {},
                  "links of arm.file that have no body of their own, with commas between; none"});
  keys.push_back(
      {"arm.mounting", &c.arm.mounting, 0, 0, kMountings, "tilted: axis 1 does not stand upright (wall, ceiling)"});
  keys.push_back({"arm.speed_max_m_s", &c.arm.speed_max_m_s, 0.01, 1.0, {}, "limit for every point of the body"});
  keys.push_back({"arm.speed_max_rad_s", &c.arm.speed_max_rad_s, 0.01, 3.14, {}, "limit for every joint"});
  keys.push_back({"arm.acceleration_rad_s2", &c.arm.acceleration_rad_s2, 0.05, 10, {}, "of every joint"});
  keys.push_back({"parking_rad",
                  &c.parking_rad,
                  -6.2832,
                  6.2832,
                  {},
                  "joints where a job ends, inside the safe zone; null: the arm's own default"});
}

void add_robot_keys(Keys& keys, Config& c) {
  keys.push_back({"robot.host",
                  &c.robot.host,
                  0,
                  0,
                  {},
                  "name or address of a Universal Robots controller, CB3 or e-Series; simulated: one in this process, "
                  "whose protocols are spoken; auto: that where the simulated cell's arm is a UR, else the cell's own "
                  "arm; none: always that"});
  keys.push_back({"robot.own_address",
                  &c.robot.own_address,
                  0,
                  0,
                  {},
                  "this computer's address as the controller sees it; auto: that of the network towards it"});
  keys.push_back({"robot.program_port",
                  &c.robot.program_port,
                  1,
                  65535,
                  {},
                  "here the External Control URCap asks for the program: the port that its installation page names"});
  keys.push_back({"robot.control_port", &c.robot.control_port, 1, 65535, {}, "here that program asks for commands"});
  keys.push_back({"robot.port_offset",
                  &c.robot.port_offset,
                  -29000,
                  35000,
                  {},
                  "added to the controller's ports: simulated ones"});
  keys.push_back({"robot.payload_kg",
                  &c.robot.payload_kg,
                  -1,
                  100,
                  {},
                  "that must be set in the controller, else the job is refused; -1: whatever is set there"});
  keys.push_back(
      {"robot.tcp_offset",
       &c.robot.tcp_offset,
       -6.2832,
       6.2832,
       {},
       "TCP that must be set in the controller, else the job is refused: [x, y, z, rx, ry, rz] as the pendant "
       "shows it, in m and rad; null: whatever is set there (firstlook moves joints and uses none)"});
  keys.push_back(
      {"robot.calibration_file",
       &c.robot.calibration_file,
       0,
       0,
       {},
       "YAML that calibration_correction (ROS: ur_calibration) wrote for this robot: its factory correction, "
       "refused where the controller tells another; none: what the controller tells"});
}

void add_space_keys(Keys& keys, Config& c) {
  keys.push_back({"safe_zone.radius_m",
                  &c.safe_zone.radius_m,
                  0.1,
                  2.0,
                  {},
                  "cylinder about axis 1 that you vouch for: nobody and nothing may be in it"});
  keys.push_back({"safe_zone.height_m", &c.safe_zone.height_m, 0.1, 3.0, {}, "of that cylinder above the cart's top"});
  keys.push_back({"cart.top_m", &c.cart.top_m, -1.0, 0.0, {}, "z of the cart's own top in the arm's base frame"});
  keys.push_back({"base_allowance.radius_m",
                  &c.base_allowance.radius_m,
                  0.05,
                  0.6,
                  {},
                  "cylinder about axis 1 in which the arm's own base may touch unknown space"});
  keys.push_back({"base_allowance.height_m", &c.base_allowance.height_m, 0.0, 0.8, {}, "of that cylinder above base"});
  keys.push_back({"keep_out",
                  &c.keep_out,
                  -10,
                  10,
                  {},
                  "boxes in base that nothing may enter: [{low_m: [x, y, z], high_m: [x, y, z]}, ...], at most 16"});
  keys.push_back({"camera_envelope_radius_m",
                  &c.camera_envelope_radius_m,
                  0.02,
                  1.0,
                  {},
                  "sphere at the flange that holds camera and gripper until the calibration is accepted"});
}

constexpr std::array<std::string_view, 2> kYesNo = {"no", "yes"};

constexpr std::array<std::string_view, 2> kCalibrationViews = {"designed", "fixed48"};

constexpr std::array<std::string_view, 2> kIntrinsics = {"given", "estimate"};

void add_calibration_keys(Keys& keys, Config& c) {
  Config::Calibration& k = c.calibration;
  for (const ConfigKey& key : board_keys(c.board)) keys.push_back(key);
  keys.push_back(
      {"boards",
       &c.boards,
       0,
       kTargetsMax,
       {},
       "several in place of 'board', spread over the cell and solved together: [{name: NAME, and the keys of "
       "'board'}, ...]"});
  keys.push_back({"calibration.solver", &k.solver, 0, 0, solver_names(), "what starts the joint refinement"});
  keys.push_back({"calibration.intrinsics", &k.intrinsics, 0, 0, kIntrinsics,
                  "of the colour camera. given: as the camera states them; estimate: solved for with the rest"});
  keys.push_back({"calibration.depth", &k.depth, 0, 0, kIntrinsics,
                  "where the depth camera sits on the colour camera. given: as stated, taken as exact; estimate: found "
                  "from the board's plane in depth images of the calibration views"});
  keys.push_back({"calibration.depth_sigma_mm",
                  &k.depth_sigma_mm,
                  0.01,
                  20,
                  {},
                  "standard deviation of where it is stated to be, each axis; counts where the board tells nothing"});
  keys.push_back({"calibration.depth_sigma_mrad", &k.depth_sigma_mrad, 0.01, 50, {}, "the same of its rotation"});
  keys.push_back({"calibration.time_offset", &k.time_offset, 0, 0, kIntrinsics,
                  "of the cameras' stamps. given: they are the arm's time; estimate: found from frames on the way "
                  "between calibration views, up to 0.2 s"});
  keys.push_back(
      {"calibration.views", &k.views, 0, 0, kCalibrationViews,
       "designed: each for what it adds; fixed48: a list that moves the board over the picture, to compare"});
  keys.push_back({"calibration.views_min", &k.views_min, 3, 60, {}, "views of the board to take at least"});
  keys.push_back({"calibration.views_max", &k.views_max, 3, 60, {}, "and at most"});
  keys.push_back({"calibration.holdout_views", &k.holdout_views, 0, 20, {}, "views kept out of the solve, to test it"});
  keys.push_back({"calibration.target_sigma_mm",
                  &k.target_sigma_mm,
                  0.01,
                  10,
                  {},
                  "predicted standard deviation at which views suffice"});
  keys.push_back({"calibration.target_sigma_mrad", &k.target_sigma_mrad, 0.01, 20, {}, "the same of the rotation"});
  keys.push_back({"calibration.settle_time_s",
                  &k.settle_time_s,
                  0.0,
                  5.0,
                  {},
                  "wait after a motion before looking; a board's picture that still moves is waited for"});
  keys.push_back({"calibration.frames_per_view", &k.frames_per_view, 1, 8, {}, "frames averaged for one view"});
  keys.push_back({"calibration.corner_sigma_px",
                  &k.corner_sigma_px,
                  0.005,
                  5,
                  {},
                  "expected noise of a detected corner: predicts what a view will bring"});
  keys.push_back({"calibration.robot_sigma_mm",
                  &k.robot_sigma_mm,
                  0.001,
                  10,
                  {},
                  "expected position noise of the arm for each axis"});
  keys.push_back({"calibration.robot_sigma_mrad", &k.robot_sigma_mrad, 0.001, 20, {}, "the same of its orientation"});
  keys.push_back({"calibration.sigma_max_mm",
                  &k.sigma_max_mm,
                  0.01,
                  50,
                  {},
                  "limit of the verdict: standard deviation of the translation, worst axis"});
  keys.push_back({"calibration.sigma_max_mrad", &k.sigma_max_mrad, 0.01, 100, {}, "the same of the rotation"});
  keys.push_back({"calibration.holdout_rms_max_px",
                  &k.holdout_rms_max_px,
                  0.01,
                  50,
                  {},
                  "limit of the verdict: error in views kept out of the solve"});
  keys.push_back({"calibration.subset_spread_max_mm",
                  &k.subset_spread_max_mm,
                  0.01,
                  50,
                  {},
                  "limit of the verdict: spread of solves on random subsets of the views"});
  keys.push_back({"calibration.gripper_tolerance_m",
                  &k.gripper_tolerance_m,
                  0.0001,
                  0.2,
                  {},
                  "what the gripper forgives; gives the usable distance"});
  keys.push_back({"calibration.usable_distance_min_m",
                  &k.usable_distance_min_m,
                  0,
                  10,
                  {},
                  "limit of the verdict: distance at which that tolerance must still hold"});
  keys.push_back(
      {"calibration.touch_test", &k.touch_test, 0, 0, kYesNo,
       "yes: before a calibration counts, a person leads the arm's tip by hand onto corners of the board (of "
       "several the first)"});
  keys.push_back({"calibration.touch_corners",
                  &k.touch_corners,
                  3,
                  static_cast<double>(kTouchPointsMax),
                  {},
                  "how many; the pendant names them"});
  keys.push_back({"calibration.touch_tip", &k.touch_tip, 0, 0, kIntrinsics,
                  "where the tip is on the flange. given: as touch_tip_m says; estimate: found from the touches, for "
                  "which the arm is tilted to different sides between them"});
  keys.push_back({"calibration.touch_tip_m", &k.touch_tip_m, -2, 2, {}, "the tip's offset in the flange, when given"});
  keys.push_back(
      {"calibration.touch_tip_sigma_mm", &k.touch_tip_sigma_mm, 0, 100, {}, "standard deviation of that, each axis"});
  keys.push_back({"calibration.touch_error_max_mm",
                  &k.touch_error_max_mm,
                  0.01,
                  100,
                  {},
                  "limit of the verdict: how far touches may put the camera from where the calibration does"});
  keys.push_back(
      {"calibration.touch_error_max_mrad", &k.touch_error_max_mrad, 0.01, 200, {}, "the same of its rotation"});
  keys.push_back({"calibration.stored",
                  &k.stored,
                  0,
                  0,
                  {},
                  "hand_eye.yaml of an earlier run, for --only map and --only verify; none: there is none"});
  keys.push_back(
      {"calibration.verify_views", &k.verify_views, 3, 8, {}, "views to test a stored calibration on at least"});
}

void add_depth_keys(Keys& keys, Config& c) {
  static const auto kSensors = sensor_preset_names();
  keys.push_back({"depth.sensor", &c.depth.sensor, 0, 0, kSensors,
                  "whose figures the other keys of this section are unless they are set; the simulated cell has it"});
  keys.push_back({"depth.range_min_m", &c.depth.range_min_m, 0.05, 5, {}, "nearest return that is used"});
  keys.push_back({"depth.range_max_m", &c.depth.range_max_m, 0.2, 20, {}, "farthest return that is used"});
  keys.push_back({"depth.range_trusted_m",
                  &c.depth.range_trusted_m,
                  0.2,
                  20,
                  {},
                  "returns beyond it clear the space up to it and mark nothing"});
  keys.push_back(
      {"depth.noise_floor_m", &c.depth.noise_floor_m, 0, 0.1, {}, "standard deviation of a return at any distance"});
  keys.push_back({"depth.noise_at_1m_m",
                  &c.depth.noise_at_1m_m,
                  0.0001,
                  0.1,
                  {},
                  "its part that grows with the square of the distance, at 1 m"});
  keys.push_back({"depth.baseline_m",
                  &c.depth.baseline_m,
                  0,
                  0.5,
                  {},
                  "from the camera to the projector or second camera, to its right: what that does not see has no "
                  "returns; 0: none"});
  keys.push_back({"depth.crop_m", &c.depth.crop_m, 0, 20, {}, "farther returns neither clear nor mark; 0: all do"});
  keys.push_back({"depth.filter_voxel_m",
                  &c.depth.filter_voxel_m,
                  0,
                  0.2,
                  {},
                  "of the returns that end in one cube of this side one is used; 0: all are"});
  keys.push_back({"depth.plane_fit_px",
                  &c.depth.plane_fit_px,
                  0,
                  31,
                  {},
                  "side of a window (odd); where its returns lie on a plane within the noise, that plane is mapped; 0: "
                  "off"});
  keys.push_back(
      {"depth.device",
       &c.depth.device,
       0,
       0,
       {},
       "depth camera. openni: the first one that OpenNI finds, or its URI, or a recording FILE.oni; freenect, or "
       "freenect:SERIAL: a Kinect v1; none: the simulated cell's"});
  keys.push_back({"depth.info",
                  &c.depth.info,
                  0,
                  0,
                  {},
                  "camera_info.yaml with its intrinsics and the size of its pictures, 640 x 480 pixels at most in all; "
                  "none: that size, by the field of view that the device states"});
  keys.push_back({"depth.mount_m",
                  &c.depth.mount_m,
                  -1,
                  1,
                  {},
                  "where a real depth camera sits in the frame of the colour camera (x right, y down, z ahead)"});
  keys.push_back({"depth.mount_rpy_deg",
                  &c.depth.mount_rpy_deg,
                  -180,
                  180,
                  {},
                  "how it is turned there: about x, then y, then z of the colour camera"});
}

void add_map_keys(Keys& keys, Config& c) {
  keys.push_back({"map.resolution_m", &c.map.resolution_m, 0.01, 0.2, {}, "side of a voxel"});
  keys.push_back({"map.low_m", &c.map.low_m, -10, 10, {}, "corner of the map in base"});
  keys.push_back({"map.high_m", &c.map.high_m, -10, 10, {}, "opposite corner"});
  keys.push_back({"map.free_max_age_s",
                  &c.map.free_max_age_s,
                  1,
                  86400,
                  {},
                  "free space not seen for so long counts as unknown for motion"});
  keys.push_back({"map.occupied_max_age_s",
                  &c.map.occupied_max_age_s,
                  0,
                  86400,
                  {},
                  "occupied voxels not seen for so long become unknown, never free; 0: they stay"});
  keys.push_back({"map.pose_sigma_max_m",
                  &c.map.pose_sigma_max_m,
                  0.0001,
                  0.1,
                  {},
                  "frames of a moving camera are used while the standard deviation of what they show 1.5 m ahead, for "
                  "how well their time is known, is no larger; counts in the clearance"});
  keys.push_back({"map.holes", &c.map.holes, 0, 0, kHoles,
                  "what a pixel without a return says. ignore: nothing; clear_when_corroborated: free space, where two "
                  "poses agree, the near part is known free and no return is near it"});
  keys.push_back({"map.ground_height_m", &c.map.ground_height_m, -5, 5, {}, "of a level floor in base"});
  keys.push_back(
      {"map.ground_tolerance_m",
       &c.map.ground_tolerance_m,
       0,
       0.5,
       {},
       "returns this near to the floor clear the way there and mark nothing, and nothing moves below its top; "
       "0: the floor is mapped as all else"});
  keys.push_back({"map.fine_resolution_m",
                  &c.map.fine_resolution_m,
                  0,
                  0.1,
                  {},
                  "side of a voxel of a second, finer map of a part of the cell, fine_map.bt; 0: none"});
  keys.push_back({"map.fine_low_m", &c.map.fine_low_m, -10, 10, {}, "corner of that part in base"});
  keys.push_back({"map.fine_high_m", &c.map.fine_high_m, -10, 10, {}, "opposite corner"});
  keys.push_back({"map.planes",
                  &c.map.planes,
                  0,
                  0,
                  {},
                  "what is kept for each voxel besides, with commas between: color (mean of the points that hit it, of "
                  "looks at rest; 16 bytes), label (its object; 4), sensor (that saw it last; 1); none: nothing"});
  keys.push_back({"map.prior",
                  &c.map.prior,
                  0,
                  0,
                  {},
                  "earlier map of the cell, .bt or .ot: hints where to look first, and nothing is known by it; none: "
                  "there is none"});
  keys.push_back({"explore.views", &c.explore.views, 0, 0, kViews,
                  "how views are chosen; thesis2014: as the thesis of 2014 did, a baseline to measure against"});
  keys.push_back({"explore.views_max", &c.explore.views_max, 1, 500, {}, "views to take at most"});
  keys.push_back({"explore.candidates", &c.explore.candidates, 10, 20000, {}, "configurations scored for each view"});
  keys.push_back({"explore.certificate_samples",
                  &c.explore.certificate_samples,
                  100,
                  100000,
                  {},
                  "configurations that must see nothing new before exploring ends"});
  keys.push_back({"explore.cluster_voxels_min",
                  &c.explore.cluster_voxels_min,
                  1,
                  10000,
                  {},
                  "smaller unknown clusters are left alone"});
  keys.push_back(
      {"explore.frames_while_moving_hz", &c.explore.frames_while_moving_hz, 0, 30, {}, "depth frames used on the way"});
}

void add_margin_keys(Keys& keys, Config& c) {
  keys.push_back({"clearance.tracking_sigma_m",
                  &c.clearance.tracking_sigma_m,
                  0,
                  0.05,
                  {},
                  "standard deviation of the arm's position at a frame's time stamp"});
  keys.push_back({"clearance.sag_m", &c.clearance.sag_m, 0, 0.1, {}, "sag under payload"});
  keys.push_back({"clearance.reaction_time_s", &c.clearance.reaction_time_s, 0, 1, {}, "from finding out to braking"});
  keys.push_back({"clearance.deceleration_m_s2",
                  &c.clearance.deceleration_m_s2,
                  0.1,
                  50,
                  {},
                  "of the outermost point of the body while it brakes"});
  keys.push_back({"memory.budget_mib", &c.memory.budget_mib, 32, 65536, {}, "for everything but the simulated cell"});
}

}  // namespace

std::vector<ConfigKey> board_keys(Config::Board& board) {
  Keys keys;
  keys.push_back({"board.type", &board.type, 0, 0, target_type_names(),
                  "kind of calibration board; one that is set here hangs in the simulated cell, too"});
  keys.push_back({"board.inner_columns",
                  &board.inner_columns,
                  1,
                  30,
                  {},
                  "inner corners, circles or markers along a row; odd x even corners avoid a half-turn ambiguity"});
  keys.push_back(
      {"board.inner_rows", &board.inner_rows, 1, 30, {}, "the same along a column; boards of one marker ignore both"});
  keys.push_back({"board.square_size_m",
                  &board.square_size_m,
                  0.002,
                  1.0,
                  {},
                  "distance of neighbours, side of one square or single marker: measure the print"});
  keys.push_back({"board.mark_size_m",
                  &board.mark_size_m,
                  0,
                  1.0,
                  {},
                  "side of a marker's black square, or diameter of a circle; 0: usual for the type"});
  keys.push_back({"board.dictionary", &board.dictionary, 0, 0, dictionary_names(),
                  "family of the markers; auto: usual for the type"});
  keys.push_back({"board.first_id", &board.first_id, 0, 4095, {}, "number of the first marker"});
  keys.push_back({"board.legacy", &board.legacy, 0, 0, kYesNo,
                  "ChArUco as OpenCV drew it before 4.6: with an even number of rows of squares the first is white"});
  keys.push_back({"board.detector", &board.detector, 0, 0, detector_preset_names(),
                  "settings of the checkerboard's detection; thesis2014...: those of table D-8"});
  return keys;
}

std::vector<ConfigKey> config_keys(Config& config) {
  Keys keys;
  add_job_keys(keys, config);
  add_arm_keys(keys, config);
  add_robot_keys(keys, config);
  add_space_keys(keys, config);
  add_calibration_keys(keys, config);
  for (const ConfigKey& key : camera_keys(config.camera)) keys.push_back(key);
  add_depth_keys(keys, config);
  add_map_keys(keys, config);
  add_margin_keys(keys, config);
  for (const ConfigKey& key : panel_keys(config.panel)) keys.push_back(key);
  return keys;
}

void set_sensor(const SensorPreset& preset, Config::Depth& depth) {
  depth = {std::string(preset.name), preset.range_min_m,   preset.range_max_m, preset.range_trusted_m,
           preset.noise_floor_m,     preset.noise_at_1m_m, preset.baseline_m};
}

namespace {

std::string broken_fine_map_rule(const Config::Map& m) {
  if (m.fine_resolution_m == 0) return {};
  if (m.fine_resolution_m < 0.005 || m.fine_resolution_m >= m.resolution_m) {
    return "map.fine_resolution_m must be 0, or at least 0.005 and below map.resolution_m";
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (m.fine_high_m[axis] - m.fine_low_m[axis] < m.fine_resolution_m) {
      return "map.fine_low_m must lie below map.fine_high_m by at least one fine voxel on each axis";
    }
    if (m.fine_low_m[axis] < m.low_m[axis] || m.fine_high_m[axis] > m.high_m[axis]) {
      return "map.fine_low_m and map.fine_high_m must lie inside map.low_m and map.high_m";
    }
  }
  return {};
}

}  // namespace

std::string broken_rule(const Config& c) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (c.map.high_m[axis] - c.map.low_m[axis] < c.map.resolution_m) {
      return "map.low_m must lie below map.high_m by at least one voxel on each axis";
    }
    for (const Config::KeepOut& box : c.keep_out) {
      if (box.low_m[axis] > box.high_m[axis]) return "keep_out: low_m must not exceed high_m on any axis";
    }
  }
  if (std::string rule = broken_fine_map_rule(c.map); !rule.empty()) return rule;
  if (std::string rule = broken_panel_rule(c.panel); !rule.empty()) return rule;
  if (static_cast<std::size_t>(c.camera.width) * static_cast<std::size_t>(c.camera.height) > kColorPixelsMax) {
    return fmt::format("camera.width times camera.height must not exceed {} pixels (1920 x 1080)", kColorPixelsMax);
  }
  if (!planes_from_words(c.map.planes)) return "map.planes must be none, or color, label, sensor with commas between";
  if (c.depth.crop_m > 0 && c.depth.crop_m <= c.depth.range_min_m) return "depth.crop_m must exceed depth.range_min_m";
  if (c.depth.filter_voxel_m > 0 && c.depth.filter_voxel_m < 0.005) {
    return "depth.filter_voxel_m must be 0 or at least 0.005";
  }
  if (c.depth.plane_fit_px != 0 && (c.depth.plane_fit_px < 3 || c.depth.plane_fit_px % 2 == 0)) {
    return "depth.plane_fit_px must be 0 or an odd number from 3";
  }
  if (c.depth.range_min_m >= c.depth.range_trusted_m) return "depth.range_min_m must be below depth.range_trusted_m";
  if (c.depth.range_trusted_m > c.depth.range_max_m) return "depth.range_trusted_m must not exceed depth.range_max_m";
  if (c.calibration.views == "fixed48" && c.calibration.views_max < 52) {
    return "calibration.views: fixed48 takes 48 views after the 4 that find the camera: set calibration.views_max to "
           "52";
  }
  if (c.calibration.views == "fixed48" && c.boards.size() > 1) {
    return "calibration.views: fixed48 moves one board over the picture: give 'board' instead of 'boards'";
  }
  if (c.calibration.views_min > c.calibration.views_max) {
    return "calibration.views_min must not exceed calibration.views_max";
  }
  if (c.calibration.touch_tip == "estimate" && c.calibration.touch_corners < 4) {
    return "calibration.touch_corners must be 4 at least when the tip is estimated";
  }
  if (c.robot.tcp_offset && c.robot.tcp_offset->size() != 6) {
    return "robot.tcp_offset must be null or six numbers: [x, y, z, rx, ry, rz] in m and rad";
  }
  if (c.robot.none() && c.robot.calibration_file != "none") {
    return "robot.calibration_file needs robot.host: the arm of a simulated cell has the published kinematics";
  }
  if (c.robot.program_port == c.robot.control_port) return "robot.program_port and robot.control_port must differ";
  if (const auto targets = targets_of(c); !targets) return std::string(targets.error().detail());
  // Three views are the fewest that can determine a hand-eye transform (two motions about different axes).
  if (c.calibration.views_min - c.calibration.holdout_views < 3) {
    return "calibration.views_min must exceed calibration.holdout_views by at least 3";
  }
  return {};
}

}  // namespace firstlook
