/// Values of URScript as XML-RPC has them: bool, int, float and string by their types, a list as an array, a pose as a
/// struct of x, y, z, rx, ry and rz, a struct as itself.
#pragma once

#include <expected>
#include <span>
#include <string>
#include <string_view>

#include "hal/sim/ur_controller/script/value.hpp"

namespace firstlook::sim::ur::script {

/// The call of a method. Error: of an argument that XML-RPC has no type for.
[[nodiscard]] std::expected<std::string, std::string> xml_rpc_call(std::string_view method,
                                                                   std::span<const Value> arguments);

/// The value that a call answered; none where it has none. Error: a fault that the server tells, or what is no answer.
[[nodiscard]] std::expected<Value, std::string> read_xml_rpc_answer(std::string_view xml);

}  // namespace firstlook::sim::ur::script
