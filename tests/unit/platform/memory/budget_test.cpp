#include "platform/memory/budget.hpp"

#include <catch2/catch.hpp>

#include "platform/memory/pool_buffer.hpp"

using namespace firstlook;
using memory::Pool;

TEST_CASE("a pool gives what its row has and refuses the byte after it, with the numbers") {
  memory::reset_accounts();
  const std::size_t row = memory::budget_row(Pool::kViewCandidates).bytes();
  REQUIRE(memory::account(Pool::kViewCandidates, row - 10));
  const Status refused = memory::account(Pool::kViewCandidates, 11);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().fault == Fault::kOutOfMemory);
  CHECK(refused.error().detail() ==
        fmt::format("view candidates: 11 bytes asked, {} of {} bytes taken", row - 10, row));
  CHECK(memory::accounted_bytes(Pool::kViewCandidates) == row - 10);
  CHECK(memory::account(Pool::kViewCandidates, 10));
  CHECK_FALSE(memory::account(Pool::kViewCandidates, static_cast<std::size_t>(-1)));
  memory::reset_accounts();
}

TEST_CASE("the peak is the sum of the high-water marks of the rows") {
  memory::reset_accounts();
  REQUIRE(memory::account(Pool::kPlannerNodes, 1000));
  memory::release(Pool::kPlannerNodes, 600);
  REQUIRE(memory::account(Pool::kPlannerNodes, 100));
  REQUIRE(memory::account(Pool::kViewCandidates, 50));
  CHECK(memory::peak_bytes(Pool::kPlannerNodes) == 1000);
  CHECK(memory::peak_bytes() == 1050);
  CHECK(memory::accounted_bytes(Pool::kPlannerNodes) == 500);
  memory::reset_accounts();
  CHECK(memory::peak_bytes() == 0);
}

TEST_CASE("standing rows are counted whole, once") {
  memory::reset_accounts();
  REQUIRE(memory::account_standing_rows());
  CHECK(memory::peak_bytes() == memory::budget_row(Pool::kThreadStacks).bytes() +
                                    memory::budget_row(Pool::kJobHeap).bytes() +
                                    memory::budget_row(Pool::kLibraryPages).bytes());
  CHECK_FALSE(memory::account_standing_rows());
  memory::reset_accounts();
}

TEST_CASE("a pool buffer is zeroed, accounted while it lives, and refused beyond its row") {
  memory::reset_accounts();
  {
    auto buffer = memory::PoolBuffer<std::uint32_t>::make(Pool::kApplication, 1000);
    REQUIRE(buffer);
    CHECK(buffer->size() == 1000);
    for (const std::uint32_t item : buffer->items()) CHECK(item == 0);
    CHECK(memory::accounted_bytes(Pool::kApplication) == 4000);
    const memory::PoolBuffer<std::uint32_t> moved = std::move(*buffer);
    CHECK(memory::accounted_bytes(Pool::kApplication) == 4000);
  }
  CHECK(memory::accounted_bytes(Pool::kApplication) == 0);
  CHECK_FALSE(memory::PoolBuffer<std::uint64_t>::make(Pool::kApplication, 1 << 20));
  CHECK_FALSE(memory::PoolBuffer<std::uint64_t>::make(Pool::kApplication, static_cast<std::size_t>(-1)));
  CHECK(memory::accounted_bytes(Pool::kApplication) == 0);
  memory::reset_accounts();
}
