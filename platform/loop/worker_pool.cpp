#include "platform/loop/worker_pool.hpp"

#include <atomic>

#include "platform/core/ensure.hpp"

namespace firstlook {

/// One parallel_for while it lasts, on the stack of its caller.
struct WorkerPool::Loop {
  Body body;
  int count = 0;
  memory::AllocationContext context;
  std::atomic<int> next{0};
  std::atomic<bool> failed{false};
  std::mutex error_mutex{};
  std::exception_ptr error{};
  int error_index = 0;
};

WorkerPool::WorkerPool(int workers) : workers_(workers) {
  ENSURE(1421, workers >= 1 && workers <= kWorkersMax);
  for (int worker = 1; worker < workers_; ++worker) {
    threads_[worker] = std::make_unique<Thread>("pool " + std::to_string(worker), [this, worker] { serve(worker); });
  }
}

WorkerPool::~WorkerPool() {
  {
    const std::scoped_lock lock(mutex_);
    ending_ = true;
  }
  changed_.notify_all();
  for (auto& thread : threads_) thread.reset();
}

void WorkerPool::parallel_for(int count, Body body) {
  if (count <= 0) return;
  const std::scoped_lock one_loop(one_loop_);
  Loop loop{.body = body, .count = count, .context = memory::allocation_context()};
  {
    const std::scoped_lock lock(mutex_);
    loop_ = &loop;
    ++loop_number_;
  }
  changed_.notify_all();
  work(loop, 0);
  {
    std::unique_lock lock(mutex_);
    loop_ = nullptr;  // who has not woken up yet is not waited for: an idle computer can take milliseconds
    changed_.wait(lock, [&] { return helpers_busy_ == 0; });
  }
  if (loop.error) std::rethrow_exception(loop.error);
}

void WorkerPool::serve(int worker) {
  compute_in_the_background();
  std::uint64_t done = 0;
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [&] { return ending_ || (loop_ != nullptr && loop_number_ != done); });
    if (ending_) return;
    done = loop_number_;
    Loop& loop = *loop_;
    ++helpers_busy_;
    lock.unlock();
    {
      const memory::ContextScope as_caller(loop.context);
      work(loop, worker);
    }
    lock.lock();
    --helpers_busy_;
    changed_.notify_all();
  }
}

// Indices are handed out in ascending order and a taken one is always run, so the lowest that throws is the same with
// every number of workers.
void WorkerPool::work(Loop& loop, int worker) {
  while (!loop.failed.load()) {
    const int index = loop.next.fetch_add(1);
    if (index >= loop.count) return;
    try {
      loop.body(index, worker);
    } catch (...) {
      const std::scoped_lock lock(loop.error_mutex);
      if (!loop.error || index < loop.error_index) {
        loop.error = std::current_exception();
        loop.error_index = index;
      }
      loop.failed = true;
    }
  }
}

}  // namespace firstlook
