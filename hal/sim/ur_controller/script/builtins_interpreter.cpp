// Interpreter mode, seen from the program.
#include "hal/sim/ur_controller/script/builtins.hpp"

namespace firstlook::sim::ur::script {
namespace {

/// The compiler puts behind it what runs the statements.
void interpreter_mode(Call& c) {
  const bool clear_queue = c.flag(0), clear_on_end = c.flag(1);
  if (c.controller().identity().series == Series::kCb3) c.fail("interpreter_mode: a CB3 has no interpreter");
  if (c.ok() && !c.machine().enter_interpreter_mode(c.thread(), clear_queue, clear_on_end)) {
    c.fail("interpreter_mode: in the main thread only, and not nested");
  }
}

void end_interpreter(Call& c) { c.machine().interpreter().end(); }

void clear_interpreter(Call& c) {
  if (!c.machine().interpreter().active()) return c.fail("clear_interpreter: not in interpreter mode");
  c.machine().interpreter().clear();
}

constexpr Builtin kTable[] = {
    {"clear_interpreter", "", clear_interpreter},
    {"end_interpreter", "", end_interpreter},
    {"interpreter_mode", "clearQueueOnEnter=True,clearOnEnd=True", interpreter_mode},
};

}  // namespace

std::span<const Builtin> interpreter_builtins() { return kTable; }

}  // namespace firstlook::sim::ur::script
