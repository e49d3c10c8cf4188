/// Which cells a campaign has, which of them are a shard's, and the command that runs one.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "platform/core/result.hpp"

namespace firstlook {

inline constexpr int kCellsMax = 1'000'000;
inline constexpr int kShardsMax = 10'000;

/// Part `number` of `count`, counted from 1: cells whose index leaves the remainder number - 1.
struct Shard {
  int number = 1;
  int count = 1;
  [[nodiscard]] bool whole() const { return count == 1; }
  [[nodiscard]] bool has(int index) const { return index % count == number - 1; }
  /// "2/4"
  [[nodiscard]] std::string text() const;
  bool operator==(const Shard&) const = default;
};
/// Reads "2/4". Error: kUsage.
[[nodiscard]] Result<Shard> parse_shard(std::string_view text);

/// Cell i of a campaign is random:(first_seed + i), run with that seed.
struct CellList {
  std::int64_t first_seed = 1;
  int cells = 0;
  std::string faults;  ///< specification for every run; empty: none

  [[nodiscard]] std::int64_t seed(int index) const { return first_seed + index; }
  /// Indices of a shard, rising.
  [[nodiscard]] std::vector<int> indices(const Shard& shard) const;
};

/// Arguments of `firstlook` that run a cell into `folder`.
[[nodiscard]] std::vector<std::string> run_arguments(std::int64_t seed, const std::string& faults,
                                                     const std::string& folder);
/// The same as a line for a shell, without the folder.
[[nodiscard]] std::string run_command(std::int64_t seed, const std::string& faults);

}  // namespace firstlook
