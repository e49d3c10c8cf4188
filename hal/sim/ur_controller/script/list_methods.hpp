/// What lists can be asked and told: aa.length(), aa.append(88). Methods and their meaning as UR's developers proposed
/// them for 5.15 (forum thread 30144); extend, remove, slice and excess_capacity by their names.
#pragma once

#include <span>
#include <string_view>

#include "hal/sim/ur_controller/script/operations.hpp"

namespace firstlook::sim::ur::script {

/// By its name alone: append, clear, extend, insert, pop, remove.
[[nodiscard]] bool is_changing_method(std::string_view method);

/// What the method answers, none for many. Changes `list` where the method does; never beyond its capacity. Error: no
/// list, a method that lists have not, arguments that do not fit, no room.
[[nodiscard]] Computed call_list_method(Value& list, std::string_view method, std::span<const Value> arguments);

}  // namespace firstlook::sim::ur::script
