#include "algorithms/calibration/chi_square.hpp"

#include <cmath>

#include "platform/core/ensure.hpp"

namespace firstlook {
namespace {

constexpr int kTermsMax = 2000;
constexpr double kTermMin = 1e-14;

/// P(a, x), for x < a + 1.
double gamma_by_series(double a, double x) {
  double term = 1 / a, sum = term;
  for (int n = 1; n < kTermsMax && term > kTermMin * sum; ++n) {
    term *= x / (a + n);
    sum += term;
  }
  return sum * std::exp(a * std::log(x) - x - std::lgamma(a));
}

/// Q(a, x) = 1 - P(a, x), for x >= a + 1: Lentz's evaluation of the continued fraction.
double gamma_by_fraction(double a, double x) {
  constexpr double kTiny = 1e-300;
  double b = x + 1 - a, c = 1 / kTiny, d = 1 / b, h = d;
  for (int n = 1; n < kTermsMax; ++n) {
    const double an = -n * (n - a);
    b += 2;
    d = an * d + b;
    d = 1 / (std::abs(d) < kTiny ? kTiny : d);
    c = b + an / c;
    if (std::abs(c) < kTiny) c = kTiny;
    h *= d * c;
    if (std::abs(d * c - 1) < kTermMin) break;
  }
  return h * std::exp(a * std::log(x) - x - std::lgamma(a));
}

/// Where the rising `f` reaches `level`, from 0 on.
template <typename Function>
double solve_rising(Function f, double level) {
  double low = 0, high = 1;
  while (f(high) < level && high < 1e12) {
    low = high;
    high *= 2;
  }
  for (int i = 0; i < 100 && high - low > 1e-12 * high; ++i) {
    const double middle = 0.5 * (low + high);
    (f(middle) < level ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace

double chi_square_probability(double x, int dof) {
  ENSURE(2601, dof > 0);
  if (!(x > 0)) return 0;
  const double a = 0.5 * dof, half = 0.5 * x;
  return half < a + 1 ? gamma_by_series(a, half) : 1 - gamma_by_fraction(a, half);
}

double chi_square_probability(double x, int dof, double noncentrality) {
  ENSURE(2602, noncentrality >= 0);
  if (noncentrality == 0) return chi_square_probability(x, dof);
  const double mean = 0.5 * noncentrality;
  double sum = 0, weights = 0;
  for (int j = 0; j < kTermsMax && weights < 1 - kTermMin; ++j) {
    const double weight = std::exp(j * std::log(mean) - mean - std::lgamma(j + 1.0));
    weights += weight;
    sum += weight * chi_square_probability(x, dof + 2 * j);
  }
  return sum;
}

double chi_square_quantile(double probability, int dof) {
  ENSURE(2603, probability > 0 && probability < 1);
  return solve_rising([dof](double x) { return chi_square_probability(x, dof); }, probability);
}

double detectable_noncentrality(int dof, double significance, double power) {
  ENSURE(2604, significance < power && power < 1);
  const double limit = chi_square_quantile(1 - significance, dof);
  return solve_rising([&](double n) { return 1 - chi_square_probability(limit, dof, n); }, power);
}

}  // namespace firstlook
