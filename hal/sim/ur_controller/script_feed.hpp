/// Cuts what a client sends to a script port into programs: a `def`, `sec` or `thread` block to its last `end`, or one
/// line.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace firstlook::sim::ur {

inline constexpr std::size_t kScriptBytesMax = 1 << 20;

/// Without the blanks at its ends.
[[nodiscard]] std::string_view trimmed(std::string_view line);

class ScriptFeed {
 public:
  void add(std::string_view bytes) { received_.append(bytes); }
  /// The next whole program, blank lines before it left out. At the end of the stream a last line needs no line end.
  [[nodiscard]] std::optional<std::string> take(bool at_end = false);
  /// More was sent than any program may have, without an end.
  [[nodiscard]] bool overflown() const { return received_.size() > kScriptBytesMax; }

 private:
  std::string received_;
  std::size_t scanned_ = 0;  ///< of `received_`: whole lines that belong to the program under way
  int depth_ = 0;            ///< blocks that are open there
};

}  // namespace firstlook::sim::ur
