// Strings, messages, time.
#include <charconv>
#include <cmath>

#include "hal/sim/ur_controller/script/builtins.hpp"

namespace firstlook::sim::ur::script {
namespace {

using Kind = ControllerEvent::Kind;

void textmsg(Call& c) { c.controller().tell({.kind = Kind::kText, .text = text_of(c.value(0)) + text_of(c.value(1))}); }

void sleep(Call& c) { static_cast<void>(c.waited(std::max(0.0, c.number(0)))); }

void sync(Call& c) {
  if (c.state().first) c.wait();
}

void str_cat(Call& c) {
  std::string text = text_of(c.value(0)) + text_of(c.value(1));
  if (text.size() > kTextBytesMax) c.fail("Out of memory: a string is too long");
  c.answer(std::move(text));
}

void str_at(Call& c) {
  const std::string text = c.text(0);
  const int at = c.integer(1, 0, static_cast<int>(text.size()) - 1);
  if (c.ok()) c.answer(text.substr(static_cast<std::size_t>(at), 1));
}

void str_find(Call& c) {
  const std::string text = c.text(0);
  const std::size_t found = text.find(c.text(1), static_cast<std::size_t>(c.integer(2, 0, 65536)));
  c.answer(found == std::string::npos ? std::int64_t{-1} : static_cast<std::int64_t>(found));
}

void str_sub(Call& c) {
  const std::string text = c.text(0);
  const auto at = static_cast<std::size_t>(c.integer(1, 0, static_cast<int>(text.size())));
  const std::int64_t count = c.integer(2);
  if (c.ok()) c.answer(text.substr(at, count < 0 ? std::string::npos : static_cast<std::size_t>(count)));
}

void to_num(Call& c) {
  const std::string text = c.text(0);
  const char* const end = text.data() + text.size();
  std::int64_t integer = 0;
  if (const auto got = std::from_chars(text.data(), end, integer); got.ec == std::errc{} && got.ptr == end) {
    return c.answer(integer);
  }
  double real = 0;
  const auto got = std::from_chars(text.data(), end, real);
  if (got.ec != std::errc{} || got.ptr != end || !std::isfinite(real)) c.fail("to_num: not a number");
  c.answer(real);
}

void halt_program(Call& c) { c.machine().halt(); }

void powerdown(Call& c) {
  c.machine().halt();
  c.controller().power_off();
}

void protective_stop(Call& c) { c.controller().protective_stop("asked for by the program"); }

/// "$" is no name that a script could call: a line with a label is compiled to it.
void tell_label(Call& c) {
  c.controller().tell({.kind = Kind::kLabel, .code = c.integer(0, 0, INT32_MAX), .text = c.text(1)});
}

constexpr Builtin kTable[] = {
    {"$", "id,text", tell_label},
    {"halt", "", halt_program},
    {"powerdown", "", powerdown},
    {"protective_stop", "", protective_stop},
    {"sleep", "t", sleep},
    {"str_at", "src,index", str_at},
    {"str_cat", "op1,op2", str_cat},
    {"str_empty", "str", [](Call& c) { c.answer(c.text(0).empty()); }},
    {"str_find", "src,target,start_from=0", str_find},
    {"str_len", "str", [](Call& c) { c.answer(static_cast<std::int64_t>(c.text(0).size())); }},
    {"str_sub", "src,index,len=-1", str_sub},
    {"sync", "", sync},
    {"textmsg", "s1,s2=\"\"", textmsg},
    {"to_num", "str", to_num},
    {"to_str", "val", [](Call& c) { c.answer(text_of(c.value(0))); }},
};

}  // namespace

std::span<const Builtin> text_builtins() { return kTable; }

}  // namespace firstlook::sim::ur::script
