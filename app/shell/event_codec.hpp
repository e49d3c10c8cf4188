/// From an event of the loop, or of a journal, to an event of the machine.
#pragma once

#include <optional>

#include "app/machine/events.hpp"

namespace firstlook {

/// Empty for kinds that the machine does not know and for bytes that do not fit the kind. A JobCompleted refers to
/// `bytes`.
[[nodiscard]] std::optional<MachineEvent> decode_event(std::uint16_t kind, std::span<const std::byte> bytes);

}  // namespace firstlook
