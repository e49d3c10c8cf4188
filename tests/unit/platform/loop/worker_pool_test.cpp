#include "platform/loop/worker_pool.hpp"

#include <atomic>
#include <catch2/catch.hpp>
#include <cmath>
#include <new>
#include <stdexcept>
#include <vector>

using namespace firstlook;

namespace {

std::vector<double> squares_of_roots(int workers, int count) {
  WorkerPool pool(workers);
  std::vector<double> slots(static_cast<std::size_t>(count));
  pool.parallel_for(count, [&](int index, int) {
    double sum = 0;
    for (int k = 1; k <= 50; ++k) sum += std::sqrt(static_cast<double>(index) / k);
    slots[static_cast<std::size_t>(index)] = sum;
  });
  return slots;
}

}  // namespace

TEST_CASE("a parallel loop gives the same bytes with every number of workers") {
  const auto one = squares_of_roots(1, 1000);
  for (int workers = 2; workers <= WorkerPool::kWorkersMax; ++workers) CHECK(squares_of_roots(workers, 1000) == one);
}

TEST_CASE("each index runs once, workers have their own numbers, loops follow each other") {
  WorkerPool pool(3);
  std::vector<std::atomic<int>> runs(500);
  std::atomic<bool> worker_out_of_range{false};
  std::array<std::atomic<int>, 3> inside{};
  std::atomic<bool> shared_worker{false};
  for (int round = 0; round < 20; ++round) {
    pool.parallel_for(500, [&](int index, int worker) {
      if (worker < 0 || worker >= 3) worker_out_of_range = true;
      if (inside[static_cast<std::size_t>(worker)].fetch_add(1) != 0) shared_worker = true;
      runs[static_cast<std::size_t>(index)].fetch_add(1);
      inside[static_cast<std::size_t>(worker)].fetch_sub(1);
    });
  }
  pool.parallel_for(0, [&](int, int) { worker_out_of_range = true; });
  CHECK_FALSE(worker_out_of_range);
  CHECK_FALSE(shared_worker);
  for (const auto& count : runs) CHECK(count == 20);
}

TEST_CASE("the exception of the lowest index comes out, and the pool goes on") {
  for (int workers = 1; workers <= 2; ++workers) {
    WorkerPool pool(workers);
    for (int round = 0; round < 50; ++round) {
      int caught = -1;
      try {
        pool.parallel_for(100, [](int index, int) {
          if (index >= 40) throw index;
        });
      } catch (int index) {
        caught = index;
      }
      CHECK(caught == 40);
    }
  }
}

TEST_CASE("all workers of a loop count to the heap of the job that called") {
  for (int workers = 1; workers <= 2; ++workers) {
    WorkerPool pool(workers);
    std::uint64_t allocations = 0;
    bool thrown = false;
    {
      const memory::JobHeapScope job(1 << 20);
      pool.parallel_for(64, [](int, int) {
        void* const block = ::operator new(64);
        ::operator delete(block);
      });
      allocations = job.allocations();
      try {
        pool.parallel_for(8, [](int, int) { ::operator delete(::operator new(2 << 20)); });
      } catch (const std::bad_alloc&) {
        thrown = true;
      }
    }
    CHECK(allocations == 64);
    CHECK(thrown);
  }
}
