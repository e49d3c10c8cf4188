/// Joints for a pose of the tool.
#pragma once

#include <optional>

#include "hal/sim/ur_controller/controller.hpp"

namespace firstlook::sim::ur::script {

/// The solution for `base_T_tcp` that is nearest to `near_rad`; empty when the pose is out of reach.
[[nodiscard]] std::optional<JointVector> joints_at(const Controller& controller, const Pose& base_T_tcp,
                                                   const JointVector& near_rad);

}  // namespace firstlook::sim::ur::script
