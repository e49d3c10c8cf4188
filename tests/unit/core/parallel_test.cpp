#include "platform/core/parallel.hpp"

#include <catch2/catch.hpp>
#include <vector>

using namespace firstlook;

TEST_CASE("a function reference calls what it refers to", "[parallel]") {
  std::vector<int> seen;
  const auto body = [&](int index, int worker) { seen.push_back(10 * index + worker); };
  RunParallel run = run_serially;
  run(3, body);
  REQUIRE(seen == std::vector<int>{0, 10, 20});
}
