/// Narration on stderr: plain lines for everybody, one line that rewrites itself for a person at a terminal, lines with
/// their priority for the system's journal.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace firstlook {

[[nodiscard]] bool is_terminal(int descriptor);
/// A terminal, and neither NO_COLOR is set nor TERM is "dumb" (no-color.org).
[[nodiscard]] bool color_wanted(int descriptor);

/// How urgent a line is, in the levels of syslog(3).
enum class Priority : std::uint8_t { kError = 3, kWarning = 4, kInfo = 6 };

/// Whether a descriptor leads to systemd's journal: JOURNAL_STREAM names its device and inode (systemd.exec(5)).
[[nodiscard]] bool is_system_journal(int descriptor);

/// Writes whole lines by one write(2) each; does not allocate, ignores errors of the terminal.
class Narrator {
 public:
  /// descriptor: 2 is stderr. quiet: nothing is written.
  explicit Narrator(int descriptor = 2, bool quiet = false);
  ~Narrator();
  Narrator(const Narrator&) = delete;
  Narrator& operator=(const Narrator&) = delete;

  /// A line that stays. Cut at 511 bytes. The system's journal gets its priority (sd-daemon(3): "<4>" before it).
  void line(std::string_view text, Priority priority = Priority::kInfo);
  /// The line at the bottom, replaced by the next one. On a terminal only; nothing elsewhere.
  void progress(std::string_view text);
  /// Removes the line at the bottom.
  void clear_progress();
  [[nodiscard]] bool on_terminal() const { return terminal_; }

 private:
  void write(std::string_view before, std::string_view text, std::string_view after);

  int descriptor_;
  bool quiet_;
  bool terminal_;
  bool journal_;
  bool progress_shown_ = false;
};

}  // namespace firstlook
