/// Random parts of a set of views: what validation solves again and again.
#pragma once

#include <cstdint>
#include <vector>

#include "platform/core/random.hpp"

namespace firstlook {

/// A sequence of subsets of 0 .. n-1, each `share` of them (at least three, when there are so many), ascending and
/// without repetition. The same seed gives the same sequence, so that solvers can be compared on the same views.
class ViewSubsets {
 public:
  ViewSubsets(std::size_t n, double share, std::uint64_t seed);
  [[nodiscard]] std::size_t size() const { return count_; }  ///< of each subset
  [[nodiscard]] std::vector<std::size_t> next();

 private:
  std::size_t n_, count_;
  Random random_;
};

}  // namespace firstlook
