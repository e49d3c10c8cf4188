/// Everything that an operator can set, as plain values with the defaults that a cart starts with.
/// app/config/config_keys.cpp holds the one table of keys: name, limits and meaning of every field below.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "platform/core/joint_vector.hpp"

namespace firstlook {

struct Config {
  std::string cell = "workshop";  ///< simulated cell: a built-in name, random:SEED, or a YAML file
  std::int64_t seed = 1;
  int workers = 2;
  std::string start_source = "pendant";  ///< pendant | panel

  struct Arm {
    std::string model = "ur5";
    std::string file = "none";       ///< .urdf or .yaml of an arm that is not built in; none: `model` is
    std::string base_link = "auto";  ///< of a URDF's chain; auto: the only one that there is
    std::string tip_link = "auto";
    std::string links_without_body = "none";  ///< names (URDF) or numbers, with commas between
    std::string mounting = "upright";         ///< upright | tilted: axis 1 plumb or not
    double speed_max_m_s = 0.25;              ///< of every point of the body (safety rule 8)
    double speed_max_rad_s = 1.0;
    double acceleration_rad_s2 = 1.4;
    bool operator==(const Arm&) const = default;
  } arm;

  struct Robot {                            ///< a Universal Robots controller on the network
    std::string host = "auto";              ///< name or address; in a simulated cell auto, simulated, none, too
    std::string own_address = "auto";       ///< this computer's, as the controller sees it
    int program_port = 50002;               ///< where the External Control URCap asks for our program
    int control_port = 50001;               ///< where that program asks for commands
    int port_offset = 0;                    ///< added to the controller's ports
    double payload_kg = -1;                 ///< that the controller must have set; below 0: whatever it has
    std::optional<JointVector> tcp_offset;  ///< that it must have set: m, and a rotation vector in rad; empty: any
    std::string calibration_file = "none";  ///< of ur_calibration: the factory correction, compared with its own
    bool operator==(const Robot&) const = default;
    [[nodiscard]] bool none() const { return host == "none"; }  ///< the simulated cell moves its arm itself
  } robot;

  struct SafeZone {
    double radius_m = 0.5;
    double height_m = 1.15;  ///< above the cart's top
    bool operator==(const SafeZone&) const = default;
  } safe_zone;

  struct Cart {
    double top_m = -0.02;  ///< z of the cart's own top in base
    bool operator==(const Cart&) const = default;
  } cart;

  struct BaseAllowance {  ///< cylinder about axis 1 where links 0 and 1 are at home (safety rule 3)
    double radius_m = 0.30;
    double height_m = 0.25;
    bool operator==(const BaseAllowance&) const = default;
  } base_allowance;

  struct KeepOut {  ///< axis-aligned box in base that nothing may enter
    std::array<double, 3> low_m{};
    std::array<double, 3> high_m{};
    bool operator==(const KeepOut&) const = default;
  };
  std::vector<KeepOut> keep_out;  ///< at most 16

  double camera_envelope_radius_m = 0.20;
  std::optional<JointVector> parking_rad;  ///< empty: the arm's default start

  struct Board {
    std::string type = "checkerboard";
    int inner_columns = 9;
    int inner_rows = 6;
    double square_size_m = 0.03;
    double mark_size_m = 0;  ///< 0: usual for the type
    std::string dictionary = "auto";
    int first_id = 0;
    std::string legacy = "no";  ///< yes | no: ChArUco as OpenCV drew it before 4.6
    std::string detector = "default";
    bool operator==(const Board&) const = default;
  } board;

  struct NamedBoard {
    std::string name;
    Board board;
    bool operator==(const NamedBoard&) const = default;
  };
  std::vector<NamedBoard> boards;  ///< several, spread over the cell; empty: `board` is the only one

  struct Calibration {
    std::string solver = "park-martin";  ///< what starts the joint refinement
    std::string intrinsics = "given";    ///< given | estimate: together with everything else
    std::string depth = "estimate";      ///< given | estimate: where the depth camera sits on the colour camera
    double depth_sigma_mm = 3;           ///< of where it is said to be, each axis
    double depth_sigma_mrad = 5;
    std::string time_offset = "estimate";  ///< given | estimate: between the cameras' stamps and the arm's
    std::string views = "designed";        ///< designed | fixed48: algorithms/view_planning/fixed_views.hpp
    int views_min = 8;
    int views_max = 30;
    int holdout_views = 4;
    double target_sigma_mm = 0.14;  ///< predicted, norm over the axes: enough views
    double target_sigma_mrad = 0.30;
    double settle_time_s = 0.2;  ///< before the first look; then until the picture stands still
    int frames_per_view = 3;
    double corner_sigma_px = 0.10;  ///< used to predict, and as what is expected of it; the solve estimates its own
    double robot_sigma_mm =
        0.10;  ///< repeatability of the arm, each axis; used to predict, and as what is expected of it
    double robot_sigma_mrad = 0.20;
    double sigma_max_mm = 1.0;  ///< from here on the limits of the verdict
    double sigma_max_mrad = 2.0;
    double holdout_rms_max_px = 2.0;
    double subset_spread_max_mm = 3.0;
    double gripper_tolerance_m = 0.01;
    double usable_distance_min_m = 0.3;
    std::string touch_test = "no";  ///< yes: a person leads the arm's tip onto corners before the calibration counts
    int touch_corners = 12;
    std::string touch_tip = "estimate";            ///< given | estimate: from the touches
    std::array<double, 3> touch_tip_m{0, 0, 0.2};  ///< of the flange
    double touch_tip_sigma_mm = 0.5;
    double touch_error_max_mm = 10;  ///< limits of the verdict: of the camera's place and rotation
    double touch_error_max_mrad = 20;
    std::string stored = "none";  ///< hand_eye.yaml of an earlier run; none: no calibration is stored
    int verify_views = 3;         ///< views that a stored calibration is tested on at least
    bool operator==(const Calibration&) const = default;
  } calibration;

  struct Camera {
    std::string device = "none";  ///< /dev/v4l/by-id/... | freenect | none: the simulated cell's camera
    int width = 640, height = 480;
    std::string format = "auto";  ///< auto | YUYV | NV12 | GREY | MJPG
    double rate_hz = 30;
    int exposure_us = 0;        ///< fixed for the job; 0: as the camera has it
    int gain = -1;              ///< -1: as the camera has it
    int focus = -1;             ///< -1: as the camera has it
    int white_balance_k = 0;    ///< 0: as the camera has it
    std::string info = "none";  ///< camera_info.yaml; none: intrinsics are not known
    bool operator==(const Camera&) const = default;
  } camera;

  struct Panel {
    std::string can_interface = "none";  ///< of Linux: can0; none: the simulated cell's panel
    int node_id = 10;
    std::int64_t vendor_id = 0;     ///< of object 1018h; 0: any
    std::int64_t product_code = 0;  ///< of object 1018h; 0: any
    int start_input = 0;            ///< numbers of bits; -1: there is none
    int stop_input = 1;
    int confirm_input = 2;
    int enabling_input = 3;
    std::string stop_contact = "opens";  ///< opens | closes when pressed
    int red_output = 0;
    int amber_output = 1;
    int green_output = 2;
    int buzzer_output = 3;
    bool operator==(const Panel&) const = default;
  } panel;

  struct Depth {
    std::string sensor = "kinect";  ///< whose figures the fields below are where no key overrides them
    double range_min_m = 0.5;
    double range_max_m = 5.0;
    double range_trusted_m = 3.0;
    double noise_floor_m = 0;
    double noise_at_1m_m = 0.00285;   ///< times z²
    double baseline_m = 0.075;        ///< to the projector or second camera
    double crop_m = 0;                ///< returns beyond it are left out; 0: none is
    double filter_voxel_m = 0;        ///< of returns in one cube of this edge one is kept; 0: all are
    int plane_fit_px = 0;             ///< window of the plane fit before insertion; 0: there is none
    std::string device = "none";      ///< openni | its URI | FILE.oni | freenect[:SERIAL] | none: the simulated cell's
    std::string info = "none";        ///< camera_info.yaml; none: by the device's field of view
    std::array<double, 3> mount_m{};  ///< on the colour camera, of a real one: camera_T_depth as its maker states it
    std::array<double, 3> mount_rpy_deg{};  ///< the same: about x, then y, then z of the colour camera
    /// Standard deviation of a depth.
    [[nodiscard]] double sigma_m(double z_m) const { return std::hypot(noise_floor_m, noise_at_1m_m * z_m * z_m); }
    bool operator==(const Depth&) const = default;
  } depth;

  struct Map {
    double resolution_m = 0.05;
    std::array<double, 3> low_m{-1.5, -1.5, -0.3};
    std::array<double, 3> high_m{1.5, 1.5, 1.5};
    double free_max_age_s = 600;
    double occupied_max_age_s = 0;    ///< 0: occupied voxels stay
    double pose_sigma_max_m = 0.001;  ///< at 1.5 m; frames of a moving camera known worse are not used
    std::string holes = "ignore";     ///< ignore | clear_when_corroborated
    double fine_resolution_m = 0;     ///< of a finer map of a part of the cell; 0: there is none
    std::array<double, 3> fine_low_m{};
    std::array<double, 3> fine_high_m{};
    double ground_height_m = 0;     ///< of a level floor that clears only
    double ground_tolerance_m = 0;  ///< 0: the floor is mapped as anything else
    std::string planes = "none";    ///< words of planes_from_words (map_planes.hpp): color, label, sensor
    std::string prior = "none";     ///< .bt or .ot of an earlier map of the cell; none: there is none
    bool operator==(const Map&) const = default;
  } map;

  struct Explore {
    int views_max = 150;
    int candidates = 400;
    int certificate_samples = 1000;
    int cluster_voxels_min = 12;
    double frames_while_moving_hz = 2;
    std::string views = "firstlook";  ///< firstlook | thesis2014
    bool operator==(const Explore&) const = default;
  } explore;

  struct Clearance {
    double tracking_sigma_m = 0.0005;
    double sag_m = 0.001;
    double reaction_time_s = 0.016;  ///< two loop turns at 125 Hz
    double deceleration_m_s2 = 2.5;  ///< at the body's outermost point
    bool operator==(const Clearance&) const = default;
  } clearance;

  struct Memory {
    int budget_mib = 256;
    bool operator==(const Memory&) const = default;
  } memory;

  bool operator==(const Config&) const = default;
};

}  // namespace firstlook
