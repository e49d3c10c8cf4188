/// The program that runs on the robot, in URScript.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace firstlook::ur {

/// How long the program waits for the next command before it stops the arm and ends: the dead man's switch.
inline constexpr double kScriptRead_s = 0.2;
/// With which it brakes, rad/s² of the leading joint.
inline constexpr double kScriptStop_rad_s2 = 4;

/// The program's text for firstlook at `host` (an address of this computer as the controller sees it) and its control
/// port. It stands inside a program: the External Control URCap puts it there, or a node "Script" of kind "File".
[[nodiscard]] std::string control_script(std::string_view host, std::uint16_t port);

}  // namespace firstlook::ur
