#include "algorithms/calibration/chi_square.hpp"

#include <catch2/catch.hpp>
#include <cmath>

using namespace firstlook;

TEST_CASE("chi-square: the textbook's quantiles", "[calibration]") {
  // Abramowitz and Stegun, table 26.8.
  CHECK(chi_square_quantile(0.95, 1) == Approx(3.84146).epsilon(1e-5));
  CHECK(chi_square_quantile(0.999, 6) == Approx(22.4577).epsilon(1e-5));
  CHECK(chi_square_quantile(0.999, 12) == Approx(32.9095).epsilon(1e-5));
  CHECK(chi_square_quantile(0.01, 30) == Approx(14.9535).epsilon(1e-5));
  CHECK(chi_square_quantile(0.995, 100) == Approx(140.169).epsilon(1e-5));
}

TEST_CASE("chi-square: closed forms, and both branches meet", "[calibration]") {
  for (const double x : {0.1, 1.0, 3.9, 4.1, 20.0, 60.0}) {
    CHECK(chi_square_probability(x, 2) == Approx(1 - std::exp(-x / 2)).epsilon(1e-12));
    CHECK(chi_square_probability(x, 1) == Approx(std::erf(std::sqrt(x / 2))).epsilon(1e-12));
    CHECK(chi_square_probability(x, 4) == Approx(1 - std::exp(-x / 2) * (1 + x / 2)).epsilon(1e-11));
  }
  CHECK(chi_square_probability(0, 3) == 0);
  CHECK(chi_square_probability(-1, 3) == 0);
  CHECK(chi_square_probability(1e4, 3) == Approx(1));
}

TEST_CASE("noncentral chi-square: one shifted square is a shifted normal", "[calibration]") {
  const auto normal = [](double z) { return 0.5 * std::erfc(-z / std::sqrt(2.0)); };
  for (const double mean : {0.0, 0.5, 2.0, 6.0}) {
    for (const double x : {0.5, 4.0, 30.0}) {
      const double root = std::sqrt(x);
      CHECK(chi_square_probability(x, 1, mean * mean) ==
            Approx(normal(root - mean) - normal(-root - mean)).epsilon(1e-9).margin(1e-12));
    }
  }
}

TEST_CASE("what a test finds: the power is met exactly", "[calibration]") {
  const double n = detectable_noncentrality(12, 0.001, 0.99);
  CHECK(1 - chi_square_probability(chi_square_quantile(0.999, 12), 12, n) == Approx(0.99).epsilon(1e-6));
  CHECK(n > detectable_noncentrality(12, 0.01, 0.99));
  CHECK(n > detectable_noncentrality(6, 0.001, 0.99));
  // One degree of freedom: the z-scores of both risks add up (the far tail does not matter).
  CHECK(std::sqrt(detectable_noncentrality(1, 0.05, 0.975)) == Approx(1.95996 + 1.95996).epsilon(1e-4));
}
