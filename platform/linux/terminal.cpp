#include "platform/linux/terminal.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <span>

#include "platform/linux/files.hpp"

namespace firstlook {
namespace {
constexpr std::size_t kTextMax = 511;
constexpr std::string_view kEraseLine = "\r\x1b[K";  // ECMA-48: erase to the end of the line

constexpr std::string_view prefix_of(Priority priority) {
  switch (priority) {
    case Priority::kError:
      return "<3>";
    case Priority::kWarning:
      return "<4>";
    case Priority::kInfo:
      break;
  }
  return "<6>";
}
}  // namespace

bool is_terminal(int descriptor) { return isatty(descriptor) == 1; }

bool color_wanted(int descriptor) {
  const char* const no_color = std::getenv("NO_COLOR");
  const char* const term = std::getenv("TERM");
  if (no_color != nullptr && *no_color != '\0') return false;
  return is_terminal(descriptor) && term != nullptr && std::string_view(term) != "dumb";
}

bool is_system_journal(int descriptor) {
  const char* const stream = std::getenv("JOURNAL_STREAM");
  unsigned long long device = 0, inode = 0;
  if (stream == nullptr || std::sscanf(stream, "%llu:%llu", &device, &inode) != 2) return false;
  struct stat file{};
  return fstat(descriptor, &file) == 0 && file.st_dev == device && file.st_ino == inode;
}

Narrator::Narrator(int descriptor, bool quiet)
    : descriptor_(descriptor),
      quiet_(quiet),
      terminal_(is_terminal(descriptor)),
      journal_(is_system_journal(descriptor)) {}

Narrator::~Narrator() { clear_progress(); }

void Narrator::line(std::string_view text, Priority priority) {
  clear_progress();
  write(journal_ ? prefix_of(priority) : std::string_view(), text, "\n");
}

void Narrator::progress(std::string_view text) {
  if (!terminal_) return;
  write(kEraseLine, text, "");
  progress_shown_ = true;
}

void Narrator::clear_progress() {
  if (!progress_shown_) return;
  write(kEraseLine, "", "");
  progress_shown_ = false;
}

void Narrator::write(std::string_view before, std::string_view text, std::string_view after) {
  if (quiet_) return;
  std::array<char, kTextMax + 16> buffer;
  auto end = std::ranges::copy(before, buffer.begin()).out;
  end = std::ranges::copy(text.substr(0, kTextMax), end).out;
  end = std::ranges::copy(after, end).out;
  (void)write_all(descriptor_, std::as_bytes(std::span(buffer.begin(), end)), "terminal");
}

}  // namespace firstlook
