/// Many configurations at once: whether the body may be there.
#pragma once

#include <cstdint>
#include <span>

#include "algorithms/motion/certificate.hpp"

namespace firstlook {

/// free[i] = configuration_is_free(..., q_rad[i], margin_m) ? 1 : 0, several times as fast where most are not free:
/// eight configurations lie side by side in floats, and points on the capsules' axes show which are blocked. What
/// floats do not decide is asked one by one. Both spans have the same size.
void configurations_are_free(const ArmModel& arm, const Body& body, const FreeSpace& space, const Clearance& clearance,
                             std::span<const JointVector> q_rad, double margin_m, std::span<std::uint8_t> free);

}  // namespace firstlook
