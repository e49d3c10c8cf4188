/// Which events a journal needs.
#pragma once

#include <cstdint>

#include "app/machine/state_table.hpp"
#include "platform/loop/event_loop.hpp"

namespace firstlook {

/// Of an event of this kind that comes while the machine is in this state. Where it waits for a person it remembers of
/// reports and frames no more than the newest report (exit_ready, exit_paused): one that decides nothing is not needed
/// for a replay, and a service may wait for weeks, a paused job for an hour.
[[nodiscard]] Worth worth_of(StateId state, std::uint16_t kind);

}  // namespace firstlook
