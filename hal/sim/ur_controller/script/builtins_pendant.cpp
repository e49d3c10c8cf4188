// What a program shows on the pendant, and asks there.
#include "hal/sim/ur_controller/script/builtins.hpp"

namespace firstlook::sim::ur::script {
namespace {

using Kind = ControllerEvent::Kind;

/// A blocking one suspends the program, as the script manual has it, not its thread alone.
void popup(Call& c) {
  const bool warning = c.flag(2), error = c.flag(3), blocking = c.flag(4) && !c.machine().code().secondary;
  if (!c.ok()) return;
  if (!c.state().first) {
    if (!c.controller().held_by_popup()) return;
  } else {
    c.controller().tell({.kind = Kind::kPopup,
                         .warning = warning,
                         .error = error,
                         .blocking = blocking,
                         .title = text_of(c.value(1)).substr(0, 255),
                         .text = text_of(c.value(0))});
    if (!blocking) return;
  }
  c.controller().hold_by_popup();
  c.wait();
}

/// Waits until somebody has entered a value.
template <RequestedType Type>
void request(Call& c) {
  const std::string message = c.text(0);
  if (message.empty()) c.fail("The message of a request must not be empty");
  if (!c.ok()) return;
  if (c.state().first) c.state().ticket = c.controller().ask_operator(Type, message);
  auto entry = c.controller().requests().take(static_cast<PendantRequests::Id>(c.state().ticket));
  if (!entry) return c.wait();
  std::visit([&](auto& value) { c.answer(std::move(value)); }, *entry);
}

constexpr Builtin kTable[] = {
    {"popup", "s,title=\"Popup\",warning=False,error=False,blocking=False", popup},
    {"request_boolean_from_primary_client", "message", request<RequestedType::kBoolean>},
    {"request_float_from_primary_client", "message", request<RequestedType::kFloat>},
    {"request_integer_from_primary_client", "message", request<RequestedType::kInteger>},
    {"request_string_from_primary_client", "message", request<RequestedType::kString>},
};

}  // namespace

std::span<const Builtin> pendant_builtins() { return kTable; }

}  // namespace firstlook::sim::ur::script
