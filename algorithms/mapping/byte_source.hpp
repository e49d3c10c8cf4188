/// Where readers get their bytes: algorithms do no I/O, the caller does.
#pragma once

#include <cstddef>
#include <span>

#include "platform/core/function_ref.hpp"

namespace firstlook {

/// Fills the span from its front and returns how many bytes it put there; fewer than asked for only at the end.
using ByteSource = FunctionRef<std::size_t(std::span<std::byte>)>;

}  // namespace firstlook
