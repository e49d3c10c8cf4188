#include "algorithms/calibration/view_subsets.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace firstlook {

ViewSubsets::ViewSubsets(std::size_t n, double share, std::uint64_t seed)
    : n_(n),
      count_(
          std::min(n, std::max<std::size_t>(3, static_cast<std::size_t>(std::ceil(share * static_cast<double>(n)))))),
      random_(seed, 2201) {}

std::vector<std::size_t> ViewSubsets::next() {
  std::vector<std::size_t> all(n_);
  std::iota(all.begin(), all.end(), std::size_t{0});
  for (std::size_t i = 0; i < count_; ++i) {
    std::swap(all[i], all[i + static_cast<std::size_t>(random_.below(static_cast<int>(n_ - i)))]);
  }
  all.resize(count_);
  std::sort(all.begin(), all.end());
  return all;
}

}  // namespace firstlook
