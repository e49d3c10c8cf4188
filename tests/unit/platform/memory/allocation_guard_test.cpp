#include "platform/memory/allocation_guard.hpp"

#include <unistd.h>

#include <array>
#include <catch2/catch.hpp>
#include <cstdlib>
#include <cstring>
#include <new>
#include <string>
#include <thread>
#include <vector>

#include "platform/core/function_ref.hpp"

using namespace firstlook;

namespace {

/// Keeps the compiler from removing an allocation whose result nobody looks at.
template <typename T>
void keep(T* pointer) {
  asm volatile("" : : "g"(pointer) : "memory");
}

/// Allocations of `work` that are counted on a sealed loop thread. Catch2's macros allocate: none inside.
std::uint64_t counted(FunctionRef<void()> work) {
  memory::seal();
  work();
  const std::uint64_t count = memory::loop_allocations_after_seal();
  memory::unseal();
  return count;
}

void use_malloc(std::size_t size) {
  void* const block = std::malloc(size);
  keep(block);
  std::free(block);
}

void use_new(std::size_t size) {
  char* const block = new char[size];
  keep(block);
  delete[] block;
}

}  // namespace

TEST_CASE("after seal() every kind of allocation on the loop thread is counted") {
  CHECK(counted([] {}) == 0);
  CHECK(counted([] { use_new(10); }) == 1);
  CHECK(counted([] {
          const std::string text(100, 'x');
          keep(text.data());
        }) == 1);
  CHECK(counted([] {
          const std::vector<int> numbers(10);
          keep(numbers.data());
        }) == 1);
  CHECK(counted([] {
          struct alignas(64) Line {
            char bytes[64];
          };
          Line* const line = new Line;
          keep(line);
          delete line;
        }) == 1);
  if (!memory::counts_malloc()) return;
  CHECK(counted([] { use_malloc(10); }) == 1);
  CHECK(counted([] {
          void* block = std::calloc(3, 5);
          keep(block);
          block = std::realloc(block, 100);
          keep(block);
          std::free(block);
        }) == 2);
  CHECK(counted([] {
          void* block = nullptr;
          if (posix_memalign(&block, 64, 128) != 0) return;
          keep(block);
          std::free(block);
          block = std::aligned_alloc(32, 64);
          keep(block);
          std::free(block);
        }) == 2);
  CHECK(counted([] {
          char* const copy = strdup("allocated inside the C library");
          keep(copy);
          std::free(copy);
        }) == 1);
}

TEST_CASE("the first counted allocation is remembered, with where it came from") {
  memory::seal();
  use_new(123);
  use_new(456);
  memory::unseal();
  CHECK(memory::first_loop_allocation_bytes() == 123);
  int ends[2];
  REQUIRE(pipe(ends) == 0);
  memory::print_first_loop_allocation(ends[1]);
  close(ends[1]);
  std::array<char, 4096> text{};
  CHECK(read(ends[0], text.data(), text.size()) > 0);
  close(ends[0]);
}

TEST_CASE(
    "the simulated cell, jobs and other threads may allocate while the loop is sealed, before and after all may") {
  CHECK(counted([] {
          const memory::SimulationScope simulation;
          use_new(10);
        }) == 0);
  CHECK(counted([] {
          const memory::JobHeapScope job(1000);
          use_new(10);
          const memory::SimulationScope simulation;
          use_new(5000);
        }) == 0);
  CHECK(counted([] {
          {
            const memory::SimulationScope simulation;
          }
          use_new(10);
        }) == 1);
  std::uint64_t others = 0;
  {
    std::atomic<bool> go{false};
    std::thread other([&go] {
      while (!go) {
      }
      use_new(10);
    });
    others = counted([&] {
      go = true;
      other.join();
    });
  }
  CHECK(others == 0);
  use_new(10);
  CHECK(counted([] {}) == 0);
}

TEST_CASE("a job beyond its cap gets bad_alloc, and can go on within it") {
  bool thrown = false;
  std::uint64_t refused = 0;
  std::size_t peak = 0;
  std::int64_t left = -1;
  {
    const memory::JobHeapScope job(100'000);
    try {
      const std::vector<char> within(60'000);
      keep(within.data());
      const std::vector<char> beyond(60'000);
      keep(beyond.data());
    } catch (const std::bad_alloc&) {
      thrown = true;
    }
    const std::vector<char> again(90'000);
    keep(again.data());
    refused = job.refused();
    peak = job.peak_bytes();
  }
  {
    const memory::JobHeapScope job(100'000);
    use_new(50'000);
    left = job.outstanding_bytes();
  }
  CHECK(thrown);
  CHECK(refused == 1);
  CHECK(peak >= 90'000);
  CHECK(peak <= 100'000);
  CHECK(left == 0);
}

TEST_CASE("malloc in a job gives null beyond the cap, and an absurd size, too") {
  if (!memory::counts_malloc()) return;
  void* within = nullptr;
  void* grown = nullptr;
  void* kept = nullptr;
  void* absurd = nullptr;
  void* product = nullptr;
  int aligned = 0;
  std::int64_t left = -1;
  {
    const memory::JobHeapScope job(10'000);
    // volatile: the compiler would warn of, or remove, what it can see through
    volatile std::size_t huge = static_cast<std::size_t>(-1);
    within = std::malloc(4000);
    grown = std::realloc(within, 20'000);
    absurd = std::malloc(huge);
    product = std::calloc(huge, 16);
    void* block = nullptr;
    aligned = posix_memalign(&block, 64, 20'000);
    kept = std::realloc(within, 5000);
    std::free(kept);
    left = job.outstanding_bytes();
  }
  CHECK(within != nullptr);
  CHECK(grown == nullptr);
  CHECK(absurd == nullptr);
  CHECK(product == nullptr);
  CHECK(aligned == ENOMEM);
  CHECK(kept != nullptr);
  CHECK(left == 0);
}

TEST_CASE("for every N the Nth allocation of a job fails, once") {
  constexpr int kAllocations = 20;
  for (std::uint64_t nth = 1; nth <= kAllocations + 1; ++nth) {
    int done = 0;
    int failed = 0;
    {
      const memory::JobHeapScope job(1 << 20);
      memory::fail_job_allocation(nth);
      for (int i = 0; i < kAllocations; ++i) {
        void* const block = ::operator new(16, std::nothrow);
        if (block == nullptr) {
          ++failed;
        } else {
          ++done;
          ::operator delete(block);
        }
      }
      memory::fail_job_allocation(0);
    }
    CHECK(failed == (nth <= kAllocations ? 1 : 0));
    CHECK(done == kAllocations - failed);
  }
}

TEST_CASE("a thread that works for a job counts to the job's account") {
  std::size_t peak = 0;
  bool thrown = false;
  std::atomic<bool> go{false};
  memory::AllocationContext context;
  std::thread helper([&] {
    while (!go) {
    }
    const memory::ContextScope as_job(context);
    try {
      use_new(30'000);
      use_new(80'000);
    } catch (const std::bad_alloc&) {
      thrown = true;
    }
  });
  {
    const memory::JobHeapScope job(50'000);
    context = memory::allocation_context();
    go = true;
    helper.join();
    peak = job.peak_bytes();
  }
  CHECK(thrown);
  CHECK(peak >= 30'000);
  CHECK(peak <= 50'000);
}
