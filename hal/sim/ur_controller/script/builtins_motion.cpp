// What moves the arm. One thread at a time may.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "algorithms/kinematics/inverse_kinematics.hpp"
#include "hal/sim/ur_controller/script/builtins.hpp"
#include "hal/sim/ur_controller/script/inverse_pose.hpp"

namespace firstlook::sim::ur::script {
namespace {

constexpr double kSwitch_rad_s2 = 10;  // brakes what moves before a path begins
constexpr double kAcceleration_rad_s2 = 40;
constexpr double kAccelerationMin = 0.01;  // of speedj and speedl
constexpr const char* kInFreedrive = "The robot is in freedrive: it cannot follow a path";

/// The arm is this thread's and stands, or may go on from the blend at the end of its path; false while neither is so,
/// or when it is another's.
bool arm_ready(Call& c) {
  if (!c.machine().take_arm(c.thread())) {
    c.fail("Another thread is already controlling the robot");
    return false;
  }
  if (c.robot().teach_mode) c.fail(kInFreedrive);
  if (!c.ok()) return false;
  if (!c.controller().motion().busy() || c.controller().motion().blending()) return true;
  if (c.state().first) static_cast<void>(c.controller().motion().stop(kSwitch_rad_s2));
  c.wait();
  return false;
}

/// The tool's centre may leave the way within this radius of its end, given as argument `i`.
Blend blend_of(Call& c, std::size_t i) {
  const double radius_m = c.number(i);
  if (radius_m < 0) c.fail("The blend radius must not be negative");
  return {.radius_m = radius_m, .flange_T_tcp = c.controller().flange_T_tcp()};
}

/// Waits for a path; lets the arm go at its end.
void follow(Call& c) {
  if (!c.controller().motion().done(c.state().ticket)) return c.wait();
  c.machine().release_arm(c.thread());
}

void check_limits(Call& c, double speed, double acceleration, double time_s) {
  if (!(acceleration > 0)) c.fail("Acceleration must be positive");
  if (!(speed > 0) && !(time_s > 0)) c.fail("Speed must be positive");
}

/// No joint beyond its own speed, whatever the leading one's was asked to be.
double allowed_speed(const ArmModel& arm, const JointVector& way_rad, double speed_rad_s) {
  const double leading_rad = way_rad.max_abs();
  for (int j = 0; j < way_rad.size(); ++j) {
    const double share = leading_rad > 0 ? std::abs(way_rad[j]) / leading_rad : 0;
    if (share > 0) speed_rad_s = std::min(speed_rad_s, arm.speed_max_rad_s[static_cast<std::size_t>(j)] / share);
  }
  return speed_rad_s;
}

void movej(Call& c) {
  CallState& state = c.state();
  if (state.phase == 1) return follow(c);
  const double acceleration = c.number(1), time_s = c.number(3);
  check_limits(c, c.number(2), acceleration, time_s);
  if (!arm_ready(c)) return;
  const ArmMotion& motion = c.controller().motion();
  const Blend blend = blend_of(c, 4);
  JointVector target_rad = JointVector::zero(6);
  if (c.value(0).as<PoseValue>() != nullptr) {
    const auto joints = joints_at(c.controller(), c.pose(0), motion.path_end_rad());
    if (!joints) return c.fail("getInverseKin: no solution");
    target_rad = *joints;
  } else {
    target_rad = c.joints(0);
  }
  if (!c.ok()) return;
  if (target_rad.max_abs() > 2 * M_PI) return c.fail("A target joint is out of its range");
  const ArmModel& arm = c.controller().identity().arm;
  const double speed = allowed_speed(arm, target_rad - motion.path_end_rad(), std::max(c.number(2), 1e-6));
  state.ticket = c.controller().motion().movej(target_rad, speed, acceleration, time_s, blend);
  state.phase = 1;
  c.wait();
}

/// Where argument `i` wants the tool's centre; joints stand for the pose that they reach.
Pose tool_goal(Call& c, std::size_t i) {
  return c.value(i).as<List>() != nullptr ? c.controller().tcp_pose(c.joints(i)) : c.pose(i);
}

void begin_path(Call& c, const ToolPath& path, double speed, double acceleration, double time_s, const Blend& blend) {
  if (!c.ok()) return;
  c.state().ticket = c.controller().motion().follow(path, std::max(speed, 1e-6), acceleration, time_s, blend);
  c.state().phase = 1;
  c.wait();
}

Pose tool_before(Call& c) { return c.controller().tcp_pose(c.controller().motion().path_end_rad()); }

/// @param t, r  numbers of the arguments that are the time, if there is one, and the blend radius
void move_on_line(Call& c, std::optional<std::size_t> t, std::size_t r) {
  if (c.state().phase == 1) return follow(c);
  const double time_s = t ? c.number(*t) : 0;
  check_limits(c, c.number(2), c.number(1), time_s);
  if (!arm_ready(c)) return;
  begin_path(c, ToolPath::line(tool_before(c), tool_goal(c, 0)), c.number(2), c.number(1), time_s, blend_of(c, r));
}
void movel(Call& c) { move_on_line(c, 3, 4); }
void movep(Call& c) { move_on_line(c, {}, 3); }

/// Three points on a line are no circle: straight to the last one.
void movec(Call& c) {
  if (c.state().phase == 1) return follow(c);
  check_limits(c, c.number(3), c.number(2), 0);
  if (!arm_ready(c)) return;
  const Pose from = tool_before(c), to = tool_goal(c, 1);
  const auto turn = c.integer(5, 0, 1) == 1 ? ArcTurn::kWithTheCircle : ArcTurn::kSpread;
  const auto arc = ToolPath::arc(from, tool_goal(c, 0).translation(), to, turn);
  begin_path(c, arc ? *arc : ToolPath::line(from, to), c.number(3), c.number(2), 0, blend_of(c, 4));
}

/// servoj, speedj and speedl: the arm stays with the thread until it does something else.
bool streaming_ready(Call& c) {
  if (!c.machine().take_arm(c.thread())) c.fail("Another thread is already controlling the robot");
  if (c.robot().teach_mode) c.fail(kInFreedrive);
  return c.ok();
}

void servoj(Call& c) {
  const JointVector target_rad = c.joints(0);
  const double given_s = c.number(3);
  const double time_s = given_s > 0 ? given_s : c.machine().cycle_s();
  if (!streaming_ready(c)) return;
  if (c.state().first) c.controller().motion().servoj(target_rad, std::clamp(c.number(4), 0.03, 0.2));
  static_cast<void>(c.waited(time_s));
}

void servoc_pose(Call& c) {
  if (!streaming_ready(c)) return;
  const auto joints = joints_at(c.controller(), c.pose(0), c.controller().motion().position_rad());
  if (!joints) return c.fail("getInverseKin: no solution");
  if (c.state().first) c.controller().motion().servoj(*joints, 0.03);
  static_cast<void>(c.waited(c.machine().cycle_s()));
}

void speedj(Call& c) {
  const JointVector speed_rad_s = c.joints(0);
  // No change of speed in a step is an acceleration of 0 to some scripts.
  const double acceleration = std::max(c.number(1), kAccelerationMin), time_s = c.number(2);
  if (!streaming_ready(c)) return;
  if (c.state().first) c.controller().motion().speedj(speed_rad_s, std::min(acceleration, kAcceleration_rad_s2));
  // Without a time it returns when the speed is reached.
  const double change = (speed_rad_s - c.controller().motion().velocity_rad_s()).max_abs();
  static_cast<void>(c.waited(time_s > 0 ? time_s : std::max(change / acceleration, c.machine().cycle_s())));
}

void speedl(Call& c) {
  const Vector6 twist = c.six(0);
  // No change of speed in a step is an acceleration of 0 to some scripts.
  const double acceleration = std::max(c.number(1), kAccelerationMin), time_s = c.number(2);
  if (!streaming_ready(c)) return;
  if (c.state().first) {
    // The flange turns with the tool and moves so that the tool's centre has the speed.
    const Eigen::Vector3d turn(twist[3], twist[4], twist[5]);
    const Pose flange = forward(c.controller().identity().arm, c.controller().motion().position_rad()).flange().pose();
    const Eigen::Vector3d tool_to_flange = -(flange.linear() * c.controller().flange_T_tcp().translation());
    const Eigen::Vector3d speed = Eigen::Vector3d(twist[0], twist[1], twist[2]) + turn.cross(tool_to_flange);
    c.controller().motion().speedl({speed.x(), speed.y(), speed.z(), twist[3], twist[4], twist[5]}, acceleration);
  }
  static_cast<void>(c.waited(time_s > 0 ? time_s : std::max(0.5 / acceleration, c.machine().cycle_s())));
}

void stop_arm(Call& c) {
  const double deceleration = c.number(0);
  check_limits(c, 1, deceleration, 0);
  if (c.robot().teach_mode) return;  // nothing of a program's moves
  if (!streaming_ready(c)) return;
  if (c.state().first) c.state().ticket = c.controller().motion().stop(deceleration);
  follow(c);
}

/// Hands may lead the arm from where the program has brought it to rest. Free axes and their frame are not looked at.
void begin_freedrive(Call& c) {
  if (c.robot().teach_mode || !arm_ready(c)) return;
  if (c.controller().motion().busy()) return c.wait();  // the end of a path that would have blended
  c.machine().release_arm(c.thread());
  c.controller().set_teach_mode(true);
}
void end_freedrive(Call& c) { c.controller().set_teach_mode(false); }

void nothing(Call&) {}
void no_ticks(Call& c) { c.answer(0.0); }

constexpr Builtin kTable[] = {
    {"conveyor_pulse_decode", "type,A,B", nothing},
    {"encoder_enable_pulse_decode", "encoder_index,decoder_type,A,B", nothing},
    {"encoder_enable_set_tick_count", "encoder_index,range_id", nothing},
    {"encoder_get_tick_count", "encoder_index", no_ticks},
    {"encoder_set_tick_count", "encoder_index,count", nothing},
    {"encoder_unwind_delta_tick_count", "encoder_index,delta_tick_count", [](Call& c) { c.answer(c.number(1)); }},
    {"get_conveyor_tick_count", "", no_ticks},
    {"path_offset_disable", "a=20", nothing},
    {"path_offset_enable", "", nothing},
    {"path_offset_set", "offset,type=0", nothing},
    {"path_offset_set_alpha_filter", "alpha", nothing},
    {"path_offset_set_max_offset", "transLimit,rotLimit", nothing},
    {"set_conveyor_tick_count", "tick_count,absolute_encoder_resolution=0", nothing},
    {"set_safety_mode_transition_hardness", "type", nothing},
    {"stop_conveyor_tracking", "a=20", nothing},
    {"track_conveyor_circular", "center,ticks_per_revolution,rotate_tool=False,encoder_index=0", nothing},
    {"track_conveyor_linear", "direction,ticks_per_meter,encoder_index=0", nothing},
    {"enable_external_ft_sensor", "enable,sensor_mass=0,sensor_measuring_offset=[],sensor_cog=[]", nothing},
    {"end_force_mode", "", nothing},
    {"end_freedrive_mode", "", end_freedrive},
    {"force_mode", "task_frame,selection_vector,wrench,type,limits", nothing},
    {"force_mode_set_damping", "damping", nothing},
    {"force_mode_set_gain_scaling", "scaling", nothing},
    {"freedrive_mode", "freeAxes=[],feature=[]", begin_freedrive},
    {"freedrive_mode_no_incorrect_payload_check", "", begin_freedrive},
    {"get_freedrive_status", "", [](Call& c) { c.answer(std::int64_t{0}); }},
    {"ft_rtde_input_enable", "enable,sensor_mass=0,sensor_measuring_offset=[],sensor_cog=[]", nothing},
    {"movec", "pose_via,pose_to,a=1.2,v=0.25,r=0,mode=0", movec},
    {"movej", "q,a=1.4,v=1.05,t=0,r=0", movej},
    {"movel", "pose,a=1.2,v=0.25,t=0,r=0", movel},
    {"movep", "pose,a=1.2,v=0.25,r=0", movep},
    {"servoc", "pose,a=1.2,v=0.25,r=0", servoc_pose},
    {"servoj", "q,a=0,v=0,t=0,lookahead_time=0.1,gain=300", servoj},
    {"speedj", "qd,a=1.4,t=0", speedj},
    {"speedl", "xd,a=1.2,t=0,aRot=0", speedl},
    {"end_teach_mode", "", end_freedrive},
    {"stopj", "a=2", stop_arm},
    {"stopl", "a=2,aRot=0", stop_arm},
    {"teach_mode", "", begin_freedrive},
    {"tool_contact", "direction=[]", [](Call& c) { c.answer(std::int64_t{0}); }},
    {"zero_ftsensor", "", nothing},
};

}  // namespace

std::span<const Builtin> motion_builtins() { return kTable; }

}  // namespace firstlook::sim::ur::script
