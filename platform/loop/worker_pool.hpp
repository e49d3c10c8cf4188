/// Threads that share the indices of one loop inside a job.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <exception>
#include <memory>
#include <mutex>
#include <string>

#include "platform/core/function_ref.hpp"
#include "platform/linux/thread.hpp"
#include "platform/memory/allocation_guard.hpp"

namespace firstlook {

/// `workers` threads, the caller's own among them; created at boot.
class WorkerPool {
 public:
  static constexpr int kWorkersMax = 4;

  /// workers: 1 .. kWorkersMax; with 1 everything runs on the caller's thread.
  explicit WorkerPool(int workers);
  ~WorkerPool();
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  using Body = FunctionRef<void(int index, int worker)>;
  /// Calls body(index, worker) once for each index in 0 .. count-1, in no particular order, and returns when all are
  /// done. worker in 0 .. workers()-1 names the thread, for scratch buffers. The result must depend on the index only:
  /// write to one slot for each index and combine them afterwards in order. Counts as the caller's heap. When bodies
  /// throw, the exception of the lowest index that threw is thrown here. One loop at a time: a second caller waits.
  void parallel_for(int count, Body body);
  [[nodiscard]] int workers() const { return workers_; }

 private:
  struct Loop;
  void serve(int worker);
  static void work(Loop& loop, int worker);

  const int workers_;
  std::mutex one_loop_;
  std::mutex mutex_;
  std::condition_variable changed_;
  Loop* loop_ = nullptr;
  std::uint64_t loop_number_ = 0;
  int helpers_busy_ = 0;
  bool ending_ = false;
  std::unique_ptr<Thread> threads_[kWorkersMax];
};

}  // namespace firstlook
