/// Between the replaced malloc (allocation_hooks.cpp) and the rules of who may allocate (allocation_guard.cpp).
#pragma once

#include <cstddef>

namespace firstlook::memory::heap_gate {

/// Asks for an allocation on the calling thread. False: it has to fail. In a job, `bytes` are reserved.
[[nodiscard]] bool admit(std::size_t bytes) noexcept;
/// The allocation that was admitted takes `actual_bytes` (0: the system had none).
void settle(std::size_t admitted_bytes, std::size_t actual_bytes) noexcept;
/// True when frees of the calling thread have to be told.
[[nodiscard]] bool counts_frees() noexcept;
void freed(std::size_t actual_bytes) noexcept;

}  // namespace firstlook::memory::heap_gate
