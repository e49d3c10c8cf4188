// Where the arm is, what it carries, what it could reach.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "hal/sim/ur_controller/rtde_table.hpp"
#include "hal/sim/ur_controller/script/builtins.hpp"
#include "hal/sim/ur_controller/script/inverse_pose.hpp"
#include "hal/sim/ur_controller/steady_readings.hpp"

namespace firstlook::sim::ur::script {
namespace {

void joint_positions(Call& c) { c.answer(list_of(c.robot().q_rad)); }
void actual_joint_positions(Call& c) { c.answer(list_of(c.controller().measured_q_rad())); }
void joint_speeds(Call& c) { c.answer(list_of(c.robot().qd_rad_s)); }
void joint_accelerations(Call& c) { c.answer(list_of(c.robot().qdd_rad_s2)); }
void actual_tcp_pose(Call& c) { c.answer(PoseValue{c.controller().measured_tcp_pose()}); }
void tcp_pose(Call& c) { c.answer(PoseValue{c.robot().tcp_pose}); }
void tcp_speed(Call& c) { c.answer(list_of(c.robot().tcp_speed)); }
void tcp_force(Call& c) { c.answer(list_of(c.robot().external_wrench)); }

void flange_pose(Call& c) {
  c.answer(PoseValue{vector_of(pose_of(c.robot().tcp_pose) * c.controller().flange_T_tcp().inverse(Eigen::Isometry))});
}

/// A pose, where the argument is one: "active_tcp" and other words leave the active one.
Pose tool(Call& c, std::size_t i) {
  return c.value(i).as<PoseValue>() != nullptr ? c.pose(i) : c.controller().flange_T_tcp();
}

void forward_kin(Call& c) {
  const bool given = c.value(0).as<List>() != nullptr;
  const JointVector q_rad = given ? c.joints(0) : c.controller().motion().position_rad();
  const Pose flange = forward(c.controller().identity().arm, q_rad).flange().pose();
  c.answer(PoseValue{vector_of(flange * tool(c, 1))});
}

std::optional<JointVector> inverse_kin_of(Call& c) {
  const List* near = c.value(1).as<List>();
  const bool given = near != nullptr && near->size() == kJoints;
  const JointVector near_rad = given ? c.joints(1) : c.controller().motion().position_rad();
  const Pose other_tool = tool(c, 4);
  const Pose base_T_tcp = c.pose(0) * other_tool.inverse(Eigen::Isometry) * c.controller().flange_T_tcp();
  return joints_at(c.controller(), base_T_tcp, near_rad);
}

void inverse_kin(Call& c) {
  const auto joints = inverse_kin_of(c);
  if (!joints) return c.fail("getInverseKin: no solution");
  List list;
  for (int j = 0; j < 6; ++j) list.emplace_back((*joints)[j]);
  c.answer(std::move(list));
}

void inverse_kin_exists(Call& c) { c.answer(inverse_kin_of(c).has_value()); }

void within_limits(Call& c) {
  const bool pose = c.value(0).as<PoseValue>() != nullptr;
  const JointVector here_rad = c.controller().motion().position_rad();
  c.answer(pose ? joints_at(c.controller(), c.pose(0), here_rad).has_value() : c.joints(0).max_abs() <= 2 * M_PI);
}

void set_payload(Call& c) {
  Payload payload = c.robot().payload;
  payload.mass_kg = c.number(0);
  if (payload.mass_kg < 0) c.fail("Payload must not be negative");
  const List* center = c.value(1).as<List>();
  if (center != nullptr && !center->empty()) payload.center_m = c.three(1);
  const List* inertia = c.value(2).as<List>();
  if (inertia != nullptr && !inertia->empty()) payload.inertia_kg_m2 = c.six(2);
  if (c.ok()) c.controller().set_payload(payload);
}

void set_payload_center(Call& c) {
  Payload payload = c.robot().payload;
  payload.center_m = c.three(0);
  if (c.ok()) c.controller().set_payload(payload);
}

void payload_center(Call& c) {
  List list;
  for (const double value : c.robot().payload.center_m) list.emplace_back(value);
  c.answer(std::move(list));
}

void set_tcp(Call& c) {
  const Vector6 offset = c.six(0);
  if (c.ok()) c.controller().set_tcp_offset(offset);
}

void tool_accelerometer(Call& c) {
  List list;
  for (const double value : tool_acceleration(c.robot())) list.emplace_back(value);
  c.answer(std::move(list));
}

void joint_temperature(Call& c) { c.answer(kJointTemperatures_c[static_cast<std::size_t>(c.integer(0, 0, 5))]); }

/// At the TCP, as `external_force_torque` says (N).
void force(Call& c) {
  const Vector6& f = c.robot().external_wrench;
  c.answer(std::sqrt(f[0] * f[0] + f[1] * f[1] + f[2] * f[2]));
}

void set_gravity(Call& c) {
  const Vector3 gravity_m_s2 = c.three(0);
  if (c.ok()) c.controller().set_gravity(gravity_m_s2);
}

/// Over an input of an RTDE client, renewed so often (Hz): else the program is paused, stopped, or goes on.
void set_watchdog(Call& c) {
  using Action = RtdeWatchdogs::Action;
  const std::string name = c.text(0);
  std::string action = c.text(2);
  const double frequency_hz = c.number(1);
  std::ranges::transform(action, action.begin(), [](unsigned char ch) { return static_cast<char>(std::tolower(ch)); });
  const ControllerIdentity& identity = c.controller().identity();
  const RtdeInput input = find_rtde_input(name, identity);
  if (input.read == nullptr) c.fail(fmt::format("rtde_set_watchdog: no input {}", name));
  if (!(frequency_hz > 0)) c.fail("rtde_set_watchdog: the frequency must be positive");
  if (action != "ignore" && action != "pause" && action != "stop") {
    c.fail("rtde_set_watchdog: the action is \"ignore\", \"pause\" or \"stop\"");
  }
  if (!c.ok()) return;
  const auto period_cycles = static_cast<std::uint64_t>(std::min(identity.frequency_hz() / frequency_hz, 1e9));
  const Action asked = action == "ignore" ? Action::kIgnore : action == "pause" ? Action::kPause : Action::kStop;
  c.controller().watchdogs().set({input.row, input.index}, period_cycles, asked, c.robot().control_step);
}

void nothing(Call&) {}

constexpr Builtin kTable[] = {
    {"force", "", force},
    {"get_actual_joint_positions", "", actual_joint_positions},
    {"get_actual_joint_positions_history", "steps=0", actual_joint_positions},
    {"get_actual_joint_speeds", "", joint_speeds},
    {"get_actual_tcp_pose", "", actual_tcp_pose},
    {"get_actual_tcp_speed", "", tcp_speed},
    {"get_actual_tool_flange_pose", "", flange_pose},
    {"get_controller_temp", "", [](Call& c) { c.answer(kBoardTemperature_c); }},
    {"get_forward_kin", "q=\"current\",tcp=\"active\"", forward_kin},
    {"get_inverse_kin", "x,qnear=[],maxPositionError=1e-10,maxOrientationError=1e-10,tcp=\"active\"", inverse_kin},
    {"get_inverse_kin_has_solution", "x,qnear=[],maxPositionError=1e-10,maxOrientationError=1e-10,tcp=\"active\"",
     inverse_kin_exists},
    {"get_joint_positions", "", joint_positions},
    {"get_joint_speeds", "", joint_speeds},
    {"get_joint_temp", "j", joint_temperature},
    {"get_joint_torques", "", [](Call& c) { c.answer(list_of(joint_moments_nm(c.robot()))); }},
    {"get_steptime", "", [](Call& c) { c.answer(c.machine().cycle_s()); }},
    {"get_target_joint_accelerations", "", joint_accelerations},
    {"get_target_joint_positions", "", joint_positions},
    {"get_target_joint_speeds", "", joint_speeds},
    {"get_target_payload", "", [](Call& c) { c.answer(c.robot().payload.mass_kg); }},
    {"get_target_payload_cog", "", payload_center},
    {"get_target_payload_inertia", "", [](Call& c) { c.answer(list_of(c.robot().payload.inertia_kg_m2)); }},
    {"get_target_tcp_pose", "", tcp_pose},
    {"get_target_tcp_pose_along_path", "", tcp_pose},
    {"get_target_tcp_speed_along_path", "", tcp_speed},
    {"get_target_tcp_speed", "", tcp_speed},
    {"get_target_waypoint", "", tcp_pose},
    {"get_tcp_force", "", tcp_force},
    {"get_tcp_offset", "", [](Call& c) { c.answer(PoseValue{c.robot().tcp_offset}); }},
    {"get_tool_accelerometer_reading", "", tool_accelerometer},
    {"get_tool_current", "", [](Call& c) { c.answer(0.0); }},
    {"is_steady", "", [](Call& c) { c.answer(c.controller().motion().standing()); }},
    {"is_within_safety_limits", "x,qnear=[]", within_limits},
    {"position_deviation_warning", "enabled,threshold=0.8", nothing},
    {"reset_revolution_counter", "qNear=[]", nothing},
    {"rtde_set_watchdog", "variable_name,min_frequency,action=\"pause\"", set_watchdog},
    {"set_gravity", "d", set_gravity},
    {"set_payload", "m,cog=[],inertia=[]", set_payload},
    {"set_payload_cog", "cog", set_payload_center},
    {"set_payload_mass", "m,cog=[],inertia=[]", set_payload},
    {"set_target_payload", "m,cog=[],inertia=[],transition_time=0", set_payload},
    {"set_tcp", "pose,tcp_name=\"\"", set_tcp},
};

}  // namespace

std::span<const Builtin> robot_builtins() { return kTable; }

}  // namespace firstlook::sim::ur::script
