#include "hal/sim/ur_controller/script_feed.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace firstlook::sim::ur {
namespace {

std::string_view trimmed(std::string_view line) {
  const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
  while (!line.empty() && blank(line.front())) line.remove_prefix(1);
  while (!line.empty() && blank(line.back())) line.remove_suffix(1);
  return line;
}

/// +1 where a line opens a block, -1 where it closes one.
int depth_change(std::string_view line) {
  constexpr std::array<std::string_view, 6> kOpening = {"def", "sec", "thread", "if", "while", "for"};
  std::size_t letters = 0;
  while (letters < line.size() && ((line[letters] >= 'a' && line[letters] <= 'z') || line[letters] == '_')) ++letters;
  const std::string_view word = line.substr(0, letters);
  const char next = letters < line.size() ? line[letters] : '\0';
  if (std::ranges::find(kOpening, word) != kOpening.end()) return next == ' ' || next == '\t' || next == '(' ? 1 : 0;
  return word == "end" && (next == '\0' || next == ' ' || next == '\t' || next == '#') ? -1 : 0;
}

}  // namespace

std::optional<std::string> ScriptFeed::take(bool at_end) {
  for (;;) {
    const std::size_t line_end = received_.find('\n', scanned_);
    if (line_end == std::string::npos && !(at_end && scanned_ < received_.size())) return std::nullopt;
    const std::size_t next = line_end == std::string::npos ? received_.size() : line_end + 1;
    const std::string_view line = trimmed(
        std::string_view(received_).substr(scanned_, next - scanned_ - (line_end != std::string::npos ? 1 : 0)));
    const bool begins = depth_ == 0;
    if (begins && (line.empty() || line.front() == '#')) {
      received_.erase(0, next);
      scanned_ = 0;
      continue;
    }
    depth_ = std::max(0, depth_ + depth_change(line));
    scanned_ = next;
    if (depth_ > 0) continue;
    std::string program = received_.substr(0, next);
    received_.erase(0, next);
    scanned_ = 0;
    return program;
  }
}

}  // namespace firstlook::sim::ur
