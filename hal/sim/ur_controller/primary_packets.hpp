/// Packets of the primary and secondary interfaces (30001, 30002), as UR's client interface tables have them.
#pragma once

#include <string>

#include "hal/sim/ur_controller/controller.hpp"

namespace firstlook::sim::ur {

/// The first message on every connection: project, version, build.
[[nodiscard]] std::string version_message(const Controller& controller);

/// A robot state message with all its sub-packages: mode, joints, tool, masterboard, cartesian, kinematics,
/// configuration, force mode, additional; tool communication and tool mode on the e-Series.
[[nodiscard]] std::string robot_state_message(const Controller& controller);

/// Text, key, popup, safety mode, error code or runtime exception.
[[nodiscard]] std::string event_message(const ControllerEvent& event);

}  // namespace firstlook::sim::ur
