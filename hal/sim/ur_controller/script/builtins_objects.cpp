// Structs, and methods: of lists, and of servers.
#include <set>

#include "hal/sim/ur_controller/script/builtins.hpp"
#include "hal/sim/ur_controller/script/list_methods.hpp"
#include "hal/sim/ur_controller/script/places.hpp"

namespace firstlook::sim::ur::script {
namespace {

/// Of names and values in turn.
void make_struct(Call& c) {
  StructValue made;
  std::set<std::string> names;
  for (std::size_t i = 0; i < c.values().size(); i += 2) {
    const std::string name = c.text(i);
    if (!names.insert(name).second) return c.fail("A struct has two members " + name);
    if (c.value(i + 1).empty()) return c.fail("Type error: member " + name + " has no value");
    made.names.push_back(name);
    made.values.push_back(c.value(i + 1));
  }
  c.answer(std::move(made));
}

/// object, method, arguments.
void call_method(Call& c) {
  const auto arguments = c.values().subspan(2);
  if (const RpcHandle* rpc = c.value(0).as<RpcHandle>()) return call_remote(c, *rpc, c.text(1), arguments);
  Value object = c.value(0);
  c.machine().charge(object.weight);
  c.answer_or_fail(call_list_method(object, c.text(1), arguments));
}

/// slot of a variable, length of a path, path, method, arguments. A server's method may have the name of one that
/// changes a list.
void call_changing_method(Call& c) {
  const int slot = static_cast<int>(c.integer(0));
  Value& variable = c.variable(slot);
  const auto length = static_cast<std::size_t>(c.integer(1));
  const auto path = c.values().subspan(2, length), arguments = c.values().subspan(3 + length);
  const std::string method = c.text(2 + length);
  if (c.state().first) {  // another thread may change the variable while the server computes
    if (variable.empty()) return c.fail(c.machine().no_value_yet(slot));
    c.machine().charge_for(variable);
    const Value* object = find_element(variable, path);
    const RpcHandle* rpc = object != nullptr ? object->as<RpcHandle>() : nullptr;
    if (rpc != nullptr) c.state().rpc_url = rpc->url;
  }
  if (!c.state().rpc_url.empty()) return call_remote(c, RpcHandle(c.state().rpc_url), method, arguments);
  if (method == "insert" || method == "remove") c.machine().charge(variable.weight / 2);  // the others make way
  c.answer_or_fail(call_at(variable, path, method, arguments));
  c.fail_excess(variable);
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
