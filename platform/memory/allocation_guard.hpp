/// Who may allocate when: the loop thread not after seal(), a job only within its allowance, the simulated cell freely.
/// allocation_hooks.cpp replaces malloc and its kin in the final program, so every library is counted, too.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>

namespace firstlook::memory {

/// True when malloc itself is counted; false under AddressSanitizer and ThreadSanitizer, which need malloc for
/// themselves: there only operator new is.
[[nodiscard]] bool counts_malloc();

/// What happens at an allocation of the loop thread after seal().
enum class OnViolation : std::uint8_t { kCount, kEnsure };

/// Ends the boot phase: from now on an allocation of the calling thread (the loop) outside the scopes below is counted.
/// ENSURE 1312 when this program's malloc is not ours.
void seal(OnViolation on_violation = OnViolation::kCount);
/// Ends the sealed phase: the calling thread may allocate again. The count stays until the next seal().
void unseal();
[[nodiscard]] bool sealed();
[[nodiscard]] std::uint64_t loop_allocations_after_seal();
/// Size of the first counted allocation; 0 when there is none.
[[nodiscard]] std::size_t first_loop_allocation_bytes();
/// Prints where the first counted allocation came from, as addresses, to a file descriptor. Does not allocate.
void print_first_loop_allocation(int file_descriptor);

/// The heap of one job, shared by all threads that work for it.
struct HeapAccount {
  std::int64_t cap_bytes = 0;
  std::atomic<std::int64_t> outstanding_bytes{0};  ///< may be negative: a job may free what it found
  std::atomic<std::int64_t> peak_bytes{0};
  std::atomic<std::uint64_t> allocations{0};
  std::atomic<std::uint64_t> refused{0};
};

/// What the calling thread may do now; handed to the threads that work for it.
struct AllocationContext {
  enum class Role : std::uint8_t { kFree, kLoop, kJob, kSimulation };
  Role role = Role::kFree;
  HeapAccount* account = nullptr;
};
[[nodiscard]] AllocationContext allocation_context();

/// Gives the calling thread a context until the end of the scope. Scopes nest.
class ContextScope {
 public:
  explicit ContextScope(AllocationContext context);
  ~ContextScope();
  ContextScope(const ContextScope&) = delete;
  ContextScope& operator=(const ContextScope&) = delete;

 private:
  AllocationContext outer_;
};

inline constexpr std::size_t kHeapUncapped = SIZE_MAX / 4;  ///< to measure, not to limit

/// The calling thread runs a job: at most `cap_bytes` may be allocated and not yet freed; beyond that malloc returns
/// null, so that C++ throws std::bad_alloc. What a nested scope takes is not counted in the outer one.
class JobHeapScope {
 public:
  explicit JobHeapScope(std::size_t cap_bytes);
  [[nodiscard]] std::size_t peak_bytes() const;
  [[nodiscard]] std::int64_t outstanding_bytes() const;
  [[nodiscard]] std::uint64_t allocations() const;
  [[nodiscard]] std::uint64_t refused() const;  ///< allocations that got null, injected ones included

 private:
  HeapAccount account_;
  ContextScope scope_;
};

/// Makes the `nth` allocation (1: the next) in job scopes of all threads fail, once. 0: none.
void fail_job_allocation(std::uint64_t nth);

/// The calling thread works for the simulated cell, which is not part of the program on the cart: not counted.
class SimulationScope {
 public:
  SimulationScope();

 private:
  ContextScope scope_;
};

}  // namespace firstlook::memory
