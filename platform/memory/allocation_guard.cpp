#include "platform/memory/allocation_guard.hpp"

#include <execinfo.h>

#include <array>
#include <cstdlib>
#include <new>

#include "platform/core/ensure.hpp"
#include "platform/memory/heap_gate.hpp"

namespace firstlook::memory {
namespace {

using Role = AllocationContext::Role;

// Constant-initialised and in the program itself, so reading it never allocates: malloc asks it from the first
// instruction of every thread on.
constinit thread_local AllocationContext t_context{};

std::atomic<bool> g_sealed{false};
std::atomic<OnViolation> g_on_violation{OnViolation::kCount};
std::atomic<std::uint64_t> g_violations{0};
std::atomic<std::uint64_t> g_fail_countdown{0};

constexpr int kFramesMax = 24;
struct FirstViolation {
  std::size_t bytes = 0;
  std::array<void*, kFramesMax> frames{};
  int frame_count = 0;
};
FirstViolation g_first;  // written and read by the loop thread

void note_violation(std::size_t bytes) {
  if (g_violations.fetch_add(1) == 0) {
    const ContextScope outside({Role::kFree, nullptr});
    g_first.bytes = bytes;
    g_first.frame_count = backtrace(g_first.frames.data(), kFramesMax);
  }
  if (g_on_violation.load() == OnViolation::kEnsure) {
    const ContextScope outside({Role::kFree, nullptr});
    print_first_loop_allocation(2);
    constexpr bool kLoopAllocatedAfterSeal = true;
    ENSURE(1311, !kLoopAllocatedAfterSeal);
  }
}

/// Counts an allocation on purpose: a guard that watches nothing would report zero for ever.
[[nodiscard]] bool hooks_are_linked() {
  const JobHeapScope probe(1024);
  void* const block = counts_malloc() ? std::malloc(1) : ::operator new(1, std::nothrow);
  asm volatile("" : : "g"(block) : "memory");  // the compiler may not remove the pair
  if (counts_malloc()) {
    std::free(block);
  } else {
    ::operator delete(block);
  }
  return probe.allocations() == 1;
}

[[nodiscard]] bool injected_failure_is_due() {
  std::uint64_t countdown = g_fail_countdown.load();
  while (countdown != 0) {
    if (g_fail_countdown.compare_exchange_weak(countdown, countdown - 1)) return countdown == 1;
  }
  return false;
}

[[nodiscard]] bool admit_to_job(HeapAccount& account, std::size_t bytes) {
  account.allocations.fetch_add(1);
  const auto wanted = static_cast<std::int64_t>(bytes);
  bool admitted = wanted >= 0 && wanted <= account.cap_bytes && !injected_failure_is_due();
  if (admitted && account.outstanding_bytes.fetch_add(wanted) + wanted > account.cap_bytes) {
    account.outstanding_bytes.fetch_sub(wanted);
    admitted = false;
  }
  if (!admitted) account.refused.fetch_add(1);
  return admitted;
}

}  // namespace

namespace heap_gate {

bool admit(std::size_t bytes) noexcept {
  switch (t_context.role) {
    case Role::kFree:
    case Role::kSimulation:
      return true;
    case Role::kLoop:
      if (g_sealed.load(std::memory_order_relaxed)) note_violation(bytes);
      return true;
    case Role::kJob:
      return admit_to_job(*t_context.account, bytes);
  }
  return true;
}

void settle(std::size_t admitted_bytes, std::size_t actual_bytes) noexcept {
  if (t_context.role != Role::kJob) return;
  HeapAccount& account = *t_context.account;
  const std::int64_t change = static_cast<std::int64_t>(actual_bytes) - static_cast<std::int64_t>(admitted_bytes);
  const std::int64_t now = account.outstanding_bytes.fetch_add(change) + change;
  std::int64_t peak = account.peak_bytes.load();
  while (peak < now && !account.peak_bytes.compare_exchange_weak(peak, now)) {
  }
}

bool counts_frees() noexcept { return t_context.role == Role::kJob; }

void freed(std::size_t actual_bytes) noexcept {
  if (t_context.role == Role::kJob) {
    t_context.account->outstanding_bytes.fetch_sub(static_cast<std::int64_t>(actual_bytes));
  }
}

}  // namespace heap_gate

void seal(OnViolation on_violation) {
  // The first backtrace() loads libgcc, which allocates: do that before the door closes.
  std::array<void*, 2> frames{};
  (void)backtrace(frames.data(), static_cast<int>(frames.size()));
  ENSURE(1312, hooks_are_linked());
  g_first = {};
  g_violations = 0;
  g_on_violation = on_violation;
  t_context.role = Role::kLoop;
  g_sealed = true;
}

void unseal() {
  g_sealed = false;
  if (t_context.role == Role::kLoop) t_context.role = Role::kFree;
}

bool sealed() { return g_sealed.load(); }
std::uint64_t loop_allocations_after_seal() { return g_violations.load(); }
std::size_t first_loop_allocation_bytes() { return g_first.bytes; }

void print_first_loop_allocation(int file_descriptor) {
  backtrace_symbols_fd(g_first.frames.data(), g_first.frame_count, file_descriptor);
}

AllocationContext allocation_context() { return t_context; }

ContextScope::ContextScope(AllocationContext context) : outer_(t_context) { t_context = context; }
ContextScope::~ContextScope() { t_context = outer_; }

JobHeapScope::JobHeapScope(std::size_t cap_bytes)
    : account_{.cap_bytes = static_cast<std::int64_t>(cap_bytes)}, scope_({Role::kJob, &account_}) {}
std::size_t JobHeapScope::peak_bytes() const { return static_cast<std::size_t>(account_.peak_bytes.load()); }
std::int64_t JobHeapScope::outstanding_bytes() const { return account_.outstanding_bytes.load(); }
std::uint64_t JobHeapScope::allocations() const { return account_.allocations.load(); }
std::uint64_t JobHeapScope::refused() const { return account_.refused.load(); }

void fail_job_allocation(std::uint64_t nth) { g_fail_countdown = nth; }

SimulationScope::SimulationScope() : scope_({Role::kSimulation, nullptr}) {}

}  // namespace firstlook::memory
