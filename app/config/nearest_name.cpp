#include "app/config/nearest_name.hpp"

#include <algorithm>
#include <vector>

#include "platform/core/ensure.hpp"

namespace firstlook {

std::size_t edit_distance(std::string_view a, std::string_view b) {
  const std::size_t columns = b.size() + 1;
  std::vector<std::size_t> cost((a.size() + 1) * columns);
  for (std::size_t i = 0; i <= a.size(); ++i) {
    for (std::size_t j = 0; j <= b.size(); ++j) {
      std::size_t& here = cost[i * columns + j];
      if (i == 0 || j == 0) {
        here = i + j;
        continue;
      }
      const std::size_t replaced = cost[(i - 1) * columns + j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      here = std::min({cost[(i - 1) * columns + j] + 1, cost[i * columns + j - 1] + 1, replaced});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
        here = std::min(here, cost[(i - 2) * columns + j - 2] + 1);
      }
    }
  }
  return cost.back();
}

std::string_view nearest_name(std::string_view given, std::span<const std::string_view> names) {
  ENSURE(7301, !names.empty());
  given = given.substr(0, 80);  // nobody meant more; keeps the cost bounded for hostile input
  const auto last_part = [](std::string_view name) { return name.substr(name.rfind('.') + 1); };
  const auto cost = [&](std::string_view name) {
    // A right word in the wrong section costs one.
    return std::min(edit_distance(given, name), edit_distance(last_part(given), last_part(name)) + 1);
  };
  return *std::min_element(names.begin(), names.end(),
                           [&](std::string_view a, std::string_view b) { return cost(a) < cost(b); });
}

}  // namespace firstlook
