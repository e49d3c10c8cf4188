#include "hal/sim/ur_controller/statement_queue.hpp"

#include <fmt/format.h>

namespace firstlook::sim::ur {
namespace {

constexpr std::size_t kWaitingMax = 8500;  // as many as a program holds
constexpr std::size_t kWaitingBytesMax = 1 << 20;
constexpr int kAtOnce = 100;  // lines that one cycle compiles: clients of other ports wait meanwhile

// The reasons, as clients of real controllers look for them.
constexpr std::string_view kNotRunning = "Program is in an invalid state";
constexpr std::string_view kTooMany = "Too many interpreted messages";
constexpr std::string_view kCleared = "Cleaned up before interpretation";
constexpr std::string_view kSyntax = "Syntax error";
constexpr std::string_view kCompile = "Compile error";

void discard(const Mailbox& to, std::string_view reason, std::string_view line) {
  *to += fmt::format("discard: {}: {}\n", reason, line);
}

bool makes_room(std::string_view line) {
  return line.starts_with("clear_interpreter") || line.starts_with("end_interpreter");
}

/// "abort" and "skipbuffer" are acknowledged with an id that means nothing; the state commands with a number.
struct Command {
  std::string_view word, answer;
  std::size_t (*run)(StatementQueue&, script::Machine&);
};

std::size_t number(int id) { return static_cast<std::size_t>(id); }

constexpr Command kCommands[] = {
    {"abort", "ack", [](StatementQueue&, script::Machine& p) { return p.abort_path(), number(0); }},
    {"skipbuffer", "ack", [](StatementQueue& queue, script::Machine& p) { return queue.skip(p), number(0); }},
    {"statelastexecuted", "state",
     [](StatementQueue&, script::Machine& p) { return number(p.interpreter().ids().executed); }},
    {"statelastinterpreted", "state",
     [](StatementQueue&, script::Machine& p) { return number(p.interpreter().ids().interpreted); }},
    {"statelastcleared", "state",
     [](StatementQueue&, script::Machine& p) { return number(p.interpreter().ids().cleared); }},
    {"stateunexecuted", "state",
     [](StatementQueue& queue, script::Machine& p) { return number(p.interpreter().unexecuted()) + queue.waiting(); }},
};

}  // namespace

void StatementQueue::receive(std::string_view line, const Mailbox& to, script::Machine* program) {
  for (const Command& command : kCommands) {
    if (line != command.word) continue;
    // Without a program there is no id.
    const std::size_t value = program == nullptr ? 0 : command.run(*this, *program);
    *to += fmt::format("{}: {}: {}\n", command.answer, value, line);
    return;
  }
  if (program == nullptr) return discard(to, kNotRunning, line);
  if (waiting_.size() >= kWaitingMax || waiting_bytes_ >= kWaitingBytesMax) return discard(to, kTooMany, line);
  waiting_.push_back({std::string(line), to});
  waiting_bytes_ += line.size();
  step(program);
}

void StatementQueue::step(script::Machine* program) {
  if (program == nullptr) return discard_all(kNotRunning);
  if (program->interpreter().take_clear_queue()) discard_all(kCleared);
  for (int i = 0; i < kAtOnce && !waiting_.empty() && program->interpreter().takes(); ++i) {
    interpret(waiting_.front(), *program);
    waiting_bytes_ -= waiting_.front().text.size();
    waiting_.pop_front();
  }
}

void StatementQueue::interpret(const Line& line, script::Machine& program) {
  if (program.interpreter().full() && !makes_room(line.text)) return discard(line.to, kTooMany, line.text);
  const auto id = program.interpret(line.text);
  if (id) {
    *line.to += fmt::format("ack: {}: {}\n", *id, line.text);
  } else {
    discard(line.to, id.error().text.starts_with("syntax_error") ? kSyntax : kCompile, line.text);
  }
}

void StatementQueue::skip(script::Machine& program) {
  program.interpreter().skip();
  discard_all(kCleared);
}

void StatementQueue::discard_all(std::string_view reason) {
  for (const Line& line : waiting_) discard(line.to, reason, line.text);
  waiting_.clear();
  waiting_bytes_ = 0;
}

}  // namespace firstlook::sim::ur
