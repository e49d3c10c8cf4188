/// Heavy work beside the loop: bounded requests, executed by the application, completed as events.
#pragma once

#include <array>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <span>

#include "platform/core/result.hpp"
#include "platform/core/time.hpp"
#include "platform/linux/thread.hpp"
#include "platform/loop/clock.hpp"
#include "platform/loop/event.hpp"
#include "platform/memory/budget.hpp"

namespace firstlook {

inline constexpr std::size_t kJobArgumentBytesMax = 8192;
inline constexpr std::size_t kJobHeadBytes = 6;  ///< kind and number in front of the result in kEventJobDone
inline constexpr std::size_t kJobResultBytesMax = kEventBytesMax - kJobHeadBytes;
inline constexpr std::size_t kJobsMax = 8;  ///< outstanding: submitted and not yet collected

/// What to do. Only the first `size` bytes of the arguments mean anything.
struct JobRequest {
  std::uint16_t kind = 0;
  std::uint32_t number = 0;
  bool on_map_strand = false;  ///< touches the map: runs in order of submission with the others that do
  Duration virtual_duration{};
  std::uint32_t size = 0;
  std::array<std::byte, kJobArgumentBytesMax> arguments;

  [[nodiscard]] std::span<const std::byte> bytes() const { return {arguments.data(), size}; }
};

/// The application's side of a job.
class JobExecutor {
 public:
  virtual ~JobExecutor() = default;
  /// Does the work and writes the result (at most kJobResultBytesMax bytes); returns the bytes written. Runs inside a
  /// JobHeapScope: catches std::bad_alloc and says so in the result. Jobs of the strand and one other job may run at
  /// once.
  virtual std::size_t execute(const JobRequest& request, std::span<std::byte> result) noexcept = 0;
};

/// kVirtual: a job runs inside submit() and is completed virtual_duration later. kThreaded: one thread for the map
/// strand and one for the other jobs.
enum class JobMode : std::uint8_t { kVirtual, kThreaded };

struct JobCounters {
  std::uint64_t submitted = 0;
  std::uint64_t completed = 0;
  std::uint64_t refused_allocations = 0;
  std::size_t heap_peak_bytes = 0;  ///< largest of all jobs
};

/// Runs jobs. All calls from the loop thread; submit and collect never allocate, and block only in virtual mode. Its
/// buffers are accounted to Pool::kJobBuffers, which has room for one runner at a time (ENSURE 1411).
class JobRunner {
 public:
  JobRunner(JobExecutor& executor, Clock& clock, JobMode mode, std::size_t heap_cap_bytes = memory::kJobHeapBytes);
  /// Waits for the jobs that run; those that have not begun are dropped.
  ~JobRunner();
  JobRunner(const JobRunner&) = delete;
  JobRunner& operator=(const JobRunner&) = delete;

  /// Hands in a job. Error: kQueueFull with kJobsMax jobs outstanding.
  [[nodiscard]] Status submit(const JobRequest& request, Instant now);
  /// When the next completion can be collected; kNever when unknown or none.
  [[nodiscard]] Instant next_due() const;
  /// Puts completions into the queue as kEventJobDone, as many as fit: in virtual mode in order of due time, then
  /// number; in threaded mode in order of completion.
  void collect(Instant now, EventQueue& queue);
  [[nodiscard]] std::size_t outstanding() const;
  [[nodiscard]] JobCounters counters() const;

 private:
  enum class SlotState : std::uint8_t { kFree, kWaiting, kRunning, kDone };
  struct Slot {
    SlotState state = SlotState::kFree;
    JobRequest request;
    std::uint64_t order = 0;  ///< of submission while it waits, of completion when it is done
    Instant due{};            ///< virtual mode
    std::size_t result_bytes = 0;
    std::array<std::byte, kJobResultBytesMax> result;
  };
  using Slots = std::array<Slot, kJobsMax>;

  void execute(Slot& slot);
  void serve(bool map_strand);
  [[nodiscard]] Slot* next_waiting(bool map_strand);
  [[nodiscard]] Slot* next_done(Instant now);

  JobExecutor& executor_;
  Clock& clock_;
  const JobMode mode_;
  const std::size_t heap_cap_bytes_;
  memory::PoolShare share_;
  std::unique_ptr<Slots> slots_;
  mutable std::mutex mutex_;
  std::condition_variable submitted_;
  std::uint64_t submissions_ = 0;
  std::uint64_t completions_ = 0;
  JobCounters counters_;
  bool ending_ = false;
  std::optional<Thread> strand_;
  std::optional<Thread> worker_;
};

}  // namespace firstlook
