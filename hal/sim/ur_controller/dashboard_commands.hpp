/// The commands of the dashboard server, for CB3 and e-Series, with the replies that UR documents.
#pragma once

#include <string>
#include <string_view>

#include "hal/sim/ur_controller/dashboard_session.hpp"

namespace firstlook::sim::ur {

/// Carries out one line (without its end) and returns the reply. Letters of a command may be large or small. What this
/// version does not know is answered as the controller does: "could not understand: '...'".
[[nodiscard]] std::string run_dashboard_command(std::string_view line, DashboardSession& session);

}  // namespace firstlook::sim::ur
