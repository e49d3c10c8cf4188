// Connections that the program opens.
#include <bit>
#include <charconv>
#include <cmath>
#include <limits>

#include "hal/sim/ur_controller/script/builtins.hpp"
#include "hal/sim/ur_controller/wire.hpp"

namespace firstlook::sim::ur::script {
namespace {

constexpr double kOpenTimeout_s = 2;
constexpr std::size_t kSocketsMax = 16;
constexpr std::int64_t kNoInteger = -1;
constexpr double kNoFloat = std::numeric_limits<double>::quiet_NaN();

bool is_open(Call& c, std::uint64_t socket) {
  return socket != 0 && c.machine().sockets()->state(socket) == Sockets::State::kOpen;
}

void close_named(Call& c, const std::string& name) {
  std::uint64_t& socket = c.machine().socket(name);
  if (socket != 0) c.machine().sockets()->close(socket);
  socket = 0;
}

void socket_open(Call& c) {
  const std::string host = c.text(0), name = c.text(2);
  const int port = c.integer(1, 1, 65535);
  if (!c.ok()) return;
  if (c.machine().sockets() == nullptr) return c.answer(false);
  std::uint64_t& socket = c.machine().socket(name);
  if (c.state().first) {
    close_named(c, name);
    if (c.machine().open_sockets() >= kSocketsMax) return c.fail("Too many sockets");
    socket = c.machine().sockets()->open(host, static_cast<std::uint16_t>(port));
  }
  const auto state = socket != 0 ? c.machine().sockets()->state(socket) : Sockets::State::kClosed;
  if (state == Sockets::State::kConnecting && !c.waited(kOpenTimeout_s)) return;
  c.answer(state == Sockets::State::kOpen);
  if (state != Sockets::State::kOpen) close_named(c, name);
}

void socket_close(Call& c) {
  const std::string name = c.text(0);
  if (c.ok() && c.machine().sockets() != nullptr) close_named(c, name);
}

void send(Call& c, const std::string& bytes, std::size_t name_at) {
  const std::string name = c.text(name_at);
  if (!c.ok()) return;
  const std::uint64_t socket = c.machine().socket(name);
  c.answer(is_open(c, socket) && c.machine().sockets()->send(socket, bytes));
}

void send_string(Call& c) { send(c, text_of(c.value(0)), 1); }
void send_line(Call& c) { send(c, text_of(c.value(0)) + "\n", 1); }

void send_int(Call& c) {
  std::string bytes;
  WireWriter(bytes).i32(static_cast<std::int32_t>(c.integer(0)));
  send(c, bytes, 1);
}

void send_byte(Call& c) { send(c, std::string(1, static_cast<char>(c.integer(0, -128, 255))), 1); }

void set_var(Call& c) { send(c, "SET " + c.text(0) + " " + text_of(c.value(1)) + "\n", 2); }

/// The bytes that came on a named connection; null when there is none. A closed one keeps what came before.
std::string* received(Call& c, const std::string& name) {
  const std::uint64_t socket = c.machine().socket(name);
  return socket == 0 ? nullptr : &c.machine().sockets()->received(socket);
}

/// True when reading is over without success: nothing more can come, or the time is up. 0 s: waits for ever.
bool gave_up(Call& c, const std::string& name, double timeout_s) {
  const bool open = is_open(c, c.machine().socket(name));
  if (!open) return true;
  if (timeout_s <= 0) return c.wait(), false;
  return c.waited(timeout_s);
}

/// A list of its length and `count` values: after a timeout of length 0, and each is `missing`.
void answer_values(Call& c, List values, std::int64_t count, const Value& missing) {
  List answer;
  answer.emplace_back(values.empty() ? std::int64_t{0} : count);
  values.resize(static_cast<std::size_t>(count), missing);
  for (Value& value : values) answer.push_back(std::move(value));
  c.answer(std::move(answer));
}

template <std::size_t Bytes>
void read_binary(Call& c) {
  const int count = c.integer(0, 0, 100);
  const std::string name = c.text(1);
  const double timeout_s = c.number(2);
  if (!c.ok()) return;
  std::string* bytes = received(c, name);
  const std::size_t wanted = static_cast<std::size_t>(count) * Bytes;
  if (bytes == nullptr || bytes->size() < wanted) {
    if (bytes == nullptr || gave_up(c, name, timeout_s)) answer_values(c, {}, count, kNoInteger);
    return;
  }
  List values;
  WireReader wire(*bytes);
  for (int i = 0; i < count; ++i) {
    values.emplace_back(Bytes == 4 ? std::int64_t{wire.i32()} : std::int64_t{wire.u8()});
  }
  bytes->erase(0, wanted);
  answer_values(c, std::move(values), count, kNoInteger);
}

/// "(1.5, 2, 3)": so many numbers between brackets.
void read_ascii_float(Call& c) {
  const int count = c.integer(0, 0, 30);
  const std::string name = c.text(1);
  const double timeout_s = c.number(2);
  if (!c.ok()) return;
  std::string* bytes = received(c, name);
  const std::size_t end = bytes == nullptr ? std::string::npos : bytes->find(')');
  if (end == std::string::npos) {
    if (bytes == nullptr || gave_up(c, name, timeout_s)) answer_values(c, {}, count, kNoFloat);
    return;
  }
  const std::size_t begin = bytes->rfind('(', end);
  List values;
  const char* at = bytes->data() + (begin == std::string::npos ? 0 : begin + 1);
  const char* const stop = bytes->data() + end;
  while (at < stop && values.size() < static_cast<std::size_t>(count)) {
    double value = 0;
    const auto got = std::from_chars(at, stop, value);
    if (got.ec == std::errc{} && std::isfinite(value)) values.emplace_back(value);
    at = got.ec == std::errc{} ? got.ptr : at + 1;
  }
  bytes->erase(0, end + 1);
  if (values.size() < static_cast<std::size_t>(count)) values.clear();
  answer_values(c, std::move(values), count, kNoFloat);
}

void read_line(Call& c) {
  const std::string name = c.text(0);
  const double timeout_s = c.number(1);
  if (!c.ok()) return;
  std::string* bytes = received(c, name);
  const std::size_t end = bytes == nullptr ? std::string::npos : bytes->find('\n');
  if (end == std::string::npos) {
    if (bytes == nullptr || gave_up(c, name, timeout_s)) c.answer(std::string());
    return;
  }
  std::string line = bytes->substr(0, end);
  bytes->erase(0, end + 1);
  if (!line.empty() && line.back() == '\r') line.pop_back();
  c.answer(std::move(line));
}

/// All that came, or what is between prefix and suffix where these are given.
void read_string(Call& c) {
  const std::string name = c.text(0), prefix = c.text(1), suffix = c.text(2);
  const double timeout_s = c.number(4);
  if (!c.ok()) return;
  std::string* bytes = received(c, name);
  if (bytes != nullptr && !bytes->empty()) {
    const std::size_t begin = bytes->find(prefix);
    const std::size_t from = begin == std::string::npos ? begin : begin + prefix.size();
    const std::size_t end = suffix.empty()                                ? bytes->size()
                            : from == begin && begin == std::string::npos ? std::string::npos
                                                                          : bytes->find(suffix, from);
    if (from != std::string::npos && end != std::string::npos) {
      std::string text = bytes->substr(from, std::min(end - from, kTextBytesMax));
      bytes->erase(0, end + suffix.size());
      return c.answer(std::move(text));
    }
  }
  if (bytes == nullptr || gave_up(c, name, timeout_s)) c.answer(std::string());
}

/// Asks a server for a variable: "GET name\n" is answered by "name value\n".
void get_var(Call& c) {
  const std::string variable = c.text(0), name = c.text(1);
  if (!c.ok()) return;
  if (c.state().phase == 0) {
    send(c, "GET " + variable + "\n", 1);
    c.state().phase = 1;
  }
  std::string* bytes = received(c, name);
  const std::size_t end = bytes == nullptr ? std::string::npos : bytes->find('\n');
  if (end == std::string::npos) {
    if (bytes == nullptr || gave_up(c, name, 2)) c.answer(std::int64_t{0});
    return;
  }
  std::int64_t value = 0;
  const std::size_t blank = bytes->find(' ');
  if (blank < end) std::from_chars(bytes->data() + blank + 1, bytes->data() + end, value);
  bytes->erase(0, end + 1);
  c.answer(value);
}

constexpr Builtin kTable[] = {
    {"socket_close", "socket_name=\"socket_0\"", socket_close},
    {"socket_get_var", "name,socket_name=\"socket_0\"", get_var},
    {"socket_open", "address,port,socket_name=\"socket_0\"", socket_open},
    {"socket_read_ascii_float", "number,socket_name=\"socket_0\",timeout=2", read_ascii_float},
    {"socket_read_binary_integer", "number,socket_name=\"socket_0\",timeout=2", read_binary<4>},
    {"socket_read_byte_list", "number,socket_name=\"socket_0\",timeout=2", read_binary<1>},
    {"socket_read_line", "socket_name=\"socket_0\",timeout=2", read_line},
    {"socket_read_string", "socket_name=\"socket_0\",prefix=\"\",suffix=\"\",interpret_escape=False,timeout=2",
     read_string},
    {"socket_send_byte", "value,socket_name=\"socket_0\"", send_byte},
    {"socket_send_int", "value,socket_name=\"socket_0\"", send_int},
    {"socket_send_line", "str,socket_name=\"socket_0\"", send_line},
    {"socket_send_string", "str,socket_name=\"socket_0\"", send_string},
    {"socket_set_var", "name,value,socket_name=\"socket_0\"", set_var},
};

}  // namespace

std::span<const Builtin> socket_builtins() { return kTable; }

}  // namespace firstlook::sim::ur::script
