#include "hal/sim/ur_controller/script_feed.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace firstlook::sim::ur {
namespace {

bool is_letter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
}

/// Blocks that a line opens, less those that it closes. Strings and comments are passed over.
int depth_change(std::string_view line) {
  constexpr std::array<std::string_view, 6> kOpening = {"def", "sec", "thread", "if", "while", "for"};
  int change = 0;
  for (std::size_t at = 0; at < line.size() && line[at] != '#';) {
    if (line[at] == '"') {
      at = std::min(line.find('"', at + 1), line.size() - 1) + 1;
      continue;
    }
    std::size_t end = at;
    while (end < line.size() && is_letter(line[end])) ++end;
    const std::string_view word = line.substr(at, end - at);
    const char next = end < line.size() ? line[end] : '\0';
    const bool opens = std::ranges::find(kOpening, word) != kOpening.end();
    if (opens && (next == ' ' || next == '\t' || next == '(')) ++change;
    if (word == "end") --change;
    at = std::max(end, at + 1);
  }
  return change;
}

}  // namespace

std::string_view trimmed(std::string_view line) {
  const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
  while (!line.empty() && blank(line.front())) line.remove_prefix(1);
  while (!line.empty() && blank(line.back())) line.remove_suffix(1);
  return line;
}

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
