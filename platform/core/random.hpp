/// Seeded random numbers with our own distributions, so that a seed gives the same bytes with every standard library.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>

namespace firstlook {

/// Mixes a counter into 64 well-distributed bits (splitmix64, Steele, Lea and Flood 2014).
[[nodiscard]] constexpr std::uint64_t mix64(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

/// A generator (xoshiro256++, Blackman and Vigna 2019) seeded by a run seed and a stream number: give each use its own
/// stream, so that one use drawing more numbers does not shift another's.
class Random {
 public:
  explicit Random(std::uint64_t seed, std::uint64_t stream = 0);

  [[nodiscard]] std::uint64_t bits();
  [[nodiscard]] double uniform();                         ///< [0, 1)
  [[nodiscard]] double uniform(double low, double high);  ///< [low, high)
  [[nodiscard]] int below(int n);                         ///< 0 .. n-1, n >= 1
  [[nodiscard]] double normal();                          ///< mean 0, standard deviation 1 (Box and Muller 1958)
  [[nodiscard]] Eigen::Vector3d normal3();
  [[nodiscard]] Eigen::Vector3d direction();    ///< uniform on the unit sphere
  [[nodiscard]] Eigen::Quaterniond rotation();  ///< uniform on SO(3) (Shoemake 1992)

 private:
  std::uint64_t state_[4];
};

}  // namespace firstlook
