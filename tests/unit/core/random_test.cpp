#include "platform/core/random.hpp"

#include <catch2/catch.hpp>
#include <cmath>

namespace firstlook {

TEST_CASE("one seed and stream give one sequence, another stream another", "[core]") {
  Random a(7, 1), b(7, 1), c(7, 2);
  const auto first = a.bits();
  CHECK(first == b.bits());
  CHECK(first != c.bits());
}

TEST_CASE("normal numbers have mean 0 and variance 1", "[core]") {
  Random random(42);
  double sum = 0, squares = 0;
  constexpr int kDraws = 100000;
  for (int i = 0; i < kDraws; ++i) {
    const double x = random.normal();
    sum += x;
    squares += x * x;
  }
  CHECK(std::abs(sum / kDraws) < 4 / std::sqrt(kDraws));
  CHECK(squares / kDraws == Approx(1).margin(4 * std::sqrt(2.0 / kDraws)));
}

}  // namespace firstlook
