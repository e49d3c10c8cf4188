#include "platform/core/random.hpp"

#include <bit>
#include <cmath>
#include <numbers>

#include "platform/core/ensure.hpp"

namespace firstlook {

Random::Random(std::uint64_t seed, std::uint64_t stream) {
  std::uint64_t x = mix64(seed) ^ mix64(~stream);
  for (std::uint64_t& word : state_) word = x = mix64(x);
}

std::uint64_t Random::bits() {
  const std::uint64_t result = std::rotl(state_[0] + state_[3], 23) + state_[0];
  const std::uint64_t t = state_[1] << 17;
  state_[2] ^= state_[0];
  state_[3] ^= state_[1];
  state_[1] ^= state_[2];
  state_[0] ^= state_[3];
  state_[2] ^= t;
  state_[3] = std::rotl(state_[3], 45);
  return result;
}

double Random::uniform() { return static_cast<double>(bits() >> 11) * 0x1.0p-53; }
double Random::uniform(double low, double high) { return low + (high - low) * uniform(); }

int Random::below(int n) {
  ENSURE(1201, n >= 1);
  return static_cast<int>(uniform() * n);
}

double Random::normal() {
  const double radius = std::sqrt(-2 * std::log(1 - uniform()));
  return radius * std::cos(2 * std::numbers::pi * uniform());
}

Eigen::Vector3d Random::normal3() {
  const double x = normal();
  const double y = normal();
  const double z = normal();
  return {x, y, z};
}

Eigen::Vector3d Random::direction() {
  const double z = uniform(-1, 1);
  const double angle = 2 * std::numbers::pi * uniform();
  const double r = std::sqrt(1 - z * z);
  return {r * std::cos(angle), r * std::sin(angle), z};
}

Eigen::Quaterniond Random::rotation() {
  const double u = uniform();
  const double a = 2 * std::numbers::pi * uniform();
  const double b = 2 * std::numbers::pi * uniform();
  const double p = std::sqrt(1 - u);
  const double q = std::sqrt(u);
  return {q * std::cos(b), p * std::sin(a), p * std::cos(a), q * std::sin(b)};
}

}  // namespace firstlook
