/// What the readers of arm files have in common.
#pragma once

#include <string>
#include <string_view>

#include "algorithms/kinematics/arm_model.hpp"
#include "platform/core/result.hpp"

namespace firstlook {

/// Refuses names that other files could not hold (hand_eye.yaml) or that a built-in arm has.
[[nodiscard]] inline Status check_arm_name(std::string_view name, std::string_view file) {
  const bool plain = name.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-.") ==
                     std::string_view::npos;
  if (name.empty() || name.size() > 31 || !plain) {
    return failure(Fault::kConfigBadValue, "{:.120}: the arm's name '{:.40}' must be 1 to 31 letters, digits, _ - .",
                   file, name);
  }
  if (find_arm_model(name)) {
    return failure(Fault::kConfigBadValue, "{:.120}: '{}' is the name of a built-in arm; give this one another", file,
                   name);
  }
  return {};
}

/// Of an arm's capsules: what an arm carries needs room beside them.
inline constexpr std::size_t kArmFileCapsulesMax = 16;

}  // namespace firstlook
