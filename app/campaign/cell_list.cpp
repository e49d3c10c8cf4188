#include "app/campaign/cell_list.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <charconv>

namespace firstlook {
namespace {

bool read_whole_number(std::string_view text, int& number) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc{} && end == text.data() + text.size();
}

/// The words of a cell's run, which the folder of the run follows.
std::vector<std::string> run_words(std::int64_t seed, const std::string& faults) {
  std::vector<std::string> words = {
      "run",       "--cell", fmt::format("random:{}", seed), "--seed", std::to_string(seed), "--sensor", "fast",
      "--workers", "1"};
  if (!faults.empty()) words.insert(words.end(), {"--faults", faults});
  return words;
}

}  // namespace

std::string Shard::text() const { return fmt::format("{}/{}", number, count); }

Result<Shard> parse_shard(std::string_view text) {
  const std::size_t slash = text.find('/');
  Shard shard;
  const bool read = slash != std::string_view::npos && read_whole_number(text.substr(0, slash), shard.number) &&
                    read_whole_number(text.substr(slash + 1), shard.count);
  if (!read || shard.count < 1 || shard.count > kShardsMax || shard.number < 1 || shard.number > shard.count) {
    return failure(Fault::kUsage, "--shard {}: I/N, with N from 1 to {} and I from 1 to N", text, kShardsMax);
  }
  return shard;
}

std::vector<int> CellList::indices(const Shard& shard) const {
  std::vector<int> found;
  for (int index = shard.number - 1; index < cells; index += shard.count) found.push_back(index);
  return found;
}

std::vector<std::string> run_arguments(std::int64_t seed, const std::string& faults, const std::string& folder) {
  std::vector<std::string> words = run_words(seed, faults);
  words.insert(words.end(), {"--out", folder});
  return words;
}

std::string run_command(std::int64_t seed, const std::string& faults) {
  return fmt::format("firstlook {}", fmt::join(run_words(seed, faults), " "));
}

}  // namespace firstlook
