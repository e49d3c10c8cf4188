// Functions of other computers, called by XML-RPC.
#include <fmt/format.h>

#include "hal/sim/ur_controller/script/builtins.hpp"
#include "hal/sim/ur_controller/script/http_exchange.hpp"
#include "hal/sim/ur_controller/script/xml_rpc.hpp"

namespace firstlook::sim::ur::script {
namespace {

constexpr double kConnect_s = 2;

using SocketState = Sockets::State;

/// One call at a time and thread has a connection. The machine closes what a program leaves open.
std::string connection_name(Call& c) { return fmt::format("xmlrpc of thread {}", c.thread().number); }
std::uint64_t& connection(Call& c) { return c.machine().socket(connection_name(c)); }

void hang_up(Call& c) {
  if (const std::uint64_t socket = connection(c); socket != 0) c.machine().sockets()->close(socket);
  c.machine().forget_socket(connection_name(c));
}

void fail(Call& c, std::string_view url, std::string_view why) {
  if (c.machine().sockets() != nullptr) hang_up(c);
  c.fail(fmt::format("XML-RPC with {}: {}", url, why));
}

/// Dials, and waits until the connection is there; false before, and when it never will be.
bool connected(Call& c, const RpcHandle& rpc) {
  const auto url = read_http_url(rpc.url);
  if (!url) return fail(c, rpc.url, "not an address like http://192.168.0.2:8080/RPC2"), false;
  if (c.machine().sockets() == nullptr) return fail(c, rpc.url, "no network"), false;
  if (c.state().first) connection(c) = c.machine().sockets()->open(url->host, url->port);
  const std::uint64_t socket = connection(c);
  const SocketState state = socket == 0 ? SocketState::kClosed : c.machine().sockets()->state(socket);
  if (state == SocketState::kOpen) return true;
  if (state == SocketState::kClosed || c.waited(kConnect_s)) fail(c, rpc.url, "nobody answers");
  return false;
}

/// A server that is not there fails the program, as the script manual has it.
void rpc_factory(Call& c) {
  const std::string type = c.text(0);
  const RpcHandle rpc{c.text(1)};
  if (c.ok() && type != "xmlrpc") c.fail(fmt::format("rpc_factory: no type {}, but xmlrpc", type));
  if (!c.ok() || !connected(c, rpc)) return;
  hang_up(c);
  c.answer(rpc);
}

constexpr Builtin kTable[] = {
    {"rpc_factory", "type,url", rpc_factory},
};

}  // namespace

void call_remote(Call& c, const RpcHandle& rpc, const std::string& method, std::span<const Value> arguments) {
  if (method == "closeXMLRPCClientConnection") return;  // each call has a connection of its own
  if (c.state().phase == 0) {
    if (!connected(c, rpc)) return;
    const auto call = xml_rpc_call(method, arguments);
    if (!call) return fail(c, rpc.url, call.error());
    static_cast<void>(c.machine().sockets()->send(connection(c), http_post(*read_http_url(rpc.url), *call)));
    c.state().phase = 1;
  }
  const std::uint64_t socket = connection(c);
  const bool ended = c.machine().sockets()->state(socket) != SocketState::kOpen;
  const auto answer = read_http_answer(c.machine().sockets()->received(socket), ended);
  if (!answer) return fail(c, rpc.url, answer.error());
  if (!*answer) return c.wait();
  hang_up(c);
  auto value = read_xml_rpc_answer(**answer);
  if (!value) return fail(c, rpc.url, fmt::format("{}: {}", method, value.error()));
  c.answer(std::move(*value));
}

std::span<const Builtin> rpc_builtins() { return kTable; }

}  // namespace firstlook::sim::ur::script
