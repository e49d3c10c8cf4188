#include "app/shell/event_worth.hpp"

#include "app/machine/events.hpp"

namespace firstlook {

Worth worth_of(StateId state, std::uint16_t kind) {
  if (state != StateId::kReady && state != StateId::kPaused) return Worth::kRecord;
  switch (kind) {
    case ArmReported::kKind:
      return Worth::kHoldAsBasis;
    case ColorFrameArrived::kKind:
    case DepthFrameArrived::kKind:
      return Worth::kHold;
    default:
      return Worth::kRecord;
  }
}

}  // namespace firstlook
