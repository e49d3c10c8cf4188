#include "platform/core/ensure.hpp"

#include <atomic>
#include <cstdio>
#include <cstdlib>

namespace firstlook {
namespace {
std::atomic<EnsureHook> g_hook{nullptr};
constexpr int kExitInternalFault = 70;
}  // namespace

void set_ensure_hook(EnsureHook hook) { g_hook = hook; }

void ensure_failed(int number, const char* condition, const char* file, int line) noexcept {
  std::fprintf(stderr, "firstlook: ENSURE %d failed: %s (%s:%d)\n", number, condition, file, line);
  if (const EnsureHook hook = g_hook.exchange(nullptr)) hook();
  std::_Exit(kExitInternalFault);
}

}  // namespace firstlook
