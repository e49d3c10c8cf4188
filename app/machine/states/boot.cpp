/// Boot: the self test. Every device must report once.
#include "app/machine/states/states.hpp"

namespace firstlook::states {
namespace {
constexpr double kDevicesWithin_s = 10;
}

void enter_boot(Machine& m) {
  m.light(hal::Light::kAmber);
  m.show("self test");
  m.set_timer(MachineTimer::kState, kDevicesWithin_s);
}

Handled on_boot(Machine& m, const MachineEvent& event) {
  if (const auto* timer = std::get_if<TimerFired>(&event); timer && timer->timer == MachineTimer::kState) {
    m.progress().ending = {Outcome::kFaulted, true, Fault::kDeviceMissing};
    m.transition(StateId::kFaulted);
    return Handled::kYes;
  }
  if (const auto* key = std::get_if<OperatorActed>(&event)) {
    if (key->device == OperatorDevice::kPendant && key->action == hal::OperatorAction::kPlay) {
      m.show("wait for the self test, then press Play again");
    }
    return Handled::kYes;
  }
  if (const auto* asked = std::get_if<ShutdownAsked>(&event)) {
    m.stop_for(asked->cause);
    return Handled::kYes;
  }
  if (m.arm_known() && m.color_seen() && m.depth_seen()) {
    m.cancel_timer(MachineTimer::kState);
    m.transition(StateId::kReady);
  }
  return Handled::kNo;
}

}  // namespace firstlook::states
