/// Arms of the test cells that are no UR: they show that nothing hangs on six joints or on a closed form.
#pragma once

#include <optional>
#include <string_view>

#include "algorithms/kinematics/arm_model.hpp"

namespace firstlook {

/// "two_joint": a link of 1.1 m that pans and tilts, as in the thesis's first simulation (chapter 3).
/// "pr2_like": an arm with seven joints beside a torso with a head and another arm, which are parts of its link 0;
/// joints and lengths as published for the PR2's right arm, sizes of the bodies estimated. Empty for any other name.
[[nodiscard]] std::optional<ArmModel> find_other_arm(std::string_view name);

}  // namespace firstlook
