/// The packet of the realtime interface (30003): every field a double but the length.
#pragma once

#include <string>

#include "hal/sim/ur_controller/controller.hpp"

namespace firstlook::sim::ur {

/// 1116 bytes for a CB3, 1220 for an e-Series controller: the tables RealTime 5.9 and 5.10 of UR.
void append_realtime_packet(const Controller& controller, std::string& out);

}  // namespace firstlook::sim::ur
