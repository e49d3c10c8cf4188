// Structs, and methods: of lists, and of servers.
#include <algorithm>

#include "hal/sim/ur_controller/script/builtins.hpp"
#include "hal/sim/ur_controller/script/list_methods.hpp"
#include "hal/sim/ur_controller/script/operations.hpp"

namespace firstlook::sim::ur::script {
namespace {

/// Of names and values in turn.
void make_struct(Call& c) {
  StructValue made;
  for (std::size_t i = 0; i < c.values().size(); i += 2) {
    const std::string name = c.text(i);
    if (std::ranges::find(made.names, name) != made.names.end()) return c.fail("A struct has two members " + name);
    if (c.value(i + 1).empty()) return c.fail("Type error: member " + name + " has no value");
    made.names.push_back(name);
    made.values.push_back(c.value(i + 1));
  }
  c.answer(std::move(made));
}

/// `object` is changed where the method changes a list.
void call_on(Call& c, Value& object, const std::string& method, std::span<const Value> arguments) {
  if (const RpcHandle* rpc = object.as<RpcHandle>()) return call_remote(c, *rpc, method, arguments);
  if (object.as<List>() == nullptr) return c.fail("Type error: a method of " + std::string(type_name(object)));
  Computed answer = call_list_method(object, method, arguments);
  if (!answer) return c.fail(answer.error());
  c.answer(std::move(*answer));
}

/// object, method, arguments.
void call_method(Call& c) {
  Value object = c.value(0);
  call_on(c, object, c.text(1), c.values().subspan(2));
}

/// length of the path, variable, path, method, arguments: answers the variable with what the method changed in it, and
/// the method's answer. A server's method may have such a name, too.
void call_changing_method(Call& c) {
  const auto length = static_cast<std::size_t>(c.integer(0));
  const Value& variable = c.value(1);
  const auto path = c.values().subspan(2, length);
  Computed object = element_of(variable, path);
  if (!object) return c.fail(object.error());
  const bool list = object->as<List>() != nullptr;
  call_on(c, *object, c.text(2 + length), c.values().subspan(3 + length));
  if (!c.ok() || c.waits()) return;
  Computed changed = list ? with_element(variable, path, *object) : Computed(variable);
  if (!changed) return c.fail(changed.error());
  c.answer(List{std::move(*changed), std::move(c.answer())});
}

/// Names that no script can call: methods are compiled to them.
constexpr Builtin kTable[] = {
    {".", "", call_method},
    {".=", "", call_changing_method},
    {"struct", "", make_struct},
};

}  // namespace

std::span<const Builtin> object_builtins() { return kTable; }

}  // namespace firstlook::sim::ur::script
