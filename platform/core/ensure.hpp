/// Assertions that stay on in release. Each has a stable number and one exit path.
#pragma once

namespace firstlook {

/// What runs before the process ends after a failed ENSURE: stop the arm, close the journal. Must not allocate or
/// throw.
using EnsureHook = void (*)();
void set_ensure_hook(EnsureHook hook);

/// Prints number, condition and place to stderr, runs the hook once, and ends the process with exit code 70.
[[noreturn]] void ensure_failed(int number, const char* condition, const char* file, int line) noexcept;

}  // namespace firstlook

/// Ends the process safely when a condition that the program guarantees does not hold. Numbers are unique in the tree.
#define ENSURE(number, condition)                                                           \
  do {                                                                                      \
    if (!(condition)) ::firstlook::ensure_failed((number), #condition, __FILE__, __LINE__); \
  } while (false)
