#include "platform/linux/terminal.hpp"

#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <catch2/catch.hpp>
#include <string>

using namespace firstlook;

namespace {
/// What was written, until nothing more comes for a while: a terminal hands it on piece by piece.
std::string read_all(int descriptor) {
  std::string all;
  std::array<char, 4096> text{};
  pollfd ready{.fd = descriptor, .events = POLLIN, .revents = 0};
  while (poll(&ready, 1, all.empty() ? 10'000 : 300) > 0) {
    const ssize_t got = read(descriptor, text.data(), text.size());
    if (got <= 0) break;
    all.append(text.data(), static_cast<std::size_t>(got));
  }
  return all;
}
}  // namespace

TEST_CASE("into a file or pipe go whole lines only, no progress, no control sequences") {
  int ends[2];
  REQUIRE(pipe(ends) == 0);
  {
    Narrator narrator(ends[1]);
    CHECK_FALSE(narrator.on_terminal());
    narrator.progress("12 %");
    narrator.line("sweep");
    narrator.line(std::string(2000, 'x'));
    Narrator quiet(ends[1], true);
    quiet.line("not to be seen");
  }
  CHECK(read_all(ends[0]) == "sweep\n" + std::string(511, 'x') + "\n");
  CHECK_FALSE(color_wanted(ends[1]));
  close(ends[0]);
  close(ends[1]);
}

TEST_CASE("on a terminal the progress line is rewritten and gives way to lines that stay") {
  const int master = posix_openpt(O_RDWR | O_NOCTTY);
  REQUIRE(master >= 0);
  REQUIRE(grantpt(master) == 0);
  REQUIRE(unlockpt(master) == 0);
  const int terminal = open(ptsname(master), O_RDWR | O_NOCTTY);
  REQUIRE(terminal >= 0);
  {
    Narrator narrator(terminal);
    CHECK(narrator.on_terminal());
    narrator.progress("1 %");
    narrator.progress("2 %");
    narrator.line("done");
  }
  CHECK(read_all(master) == "\r\x1b[K1 %\r\x1b[K2 %\r\x1b[Kdone\r\n");
  setenv("TERM", "xterm", 1);
  unsetenv("NO_COLOR");
  CHECK(color_wanted(terminal));
  setenv("NO_COLOR", "1", 1);
  CHECK_FALSE(color_wanted(terminal));
  unsetenv("NO_COLOR");
  setenv("TERM", "dumb", 1);
  CHECK_FALSE(color_wanted(terminal));
  close(terminal);
  close(master);
}

TEST_CASE("lines for the system's journal have their priority, and only when it is the journal that reads") {
  int ends[2];
  REQUIRE(pipe(ends) == 0);
  struct stat file{};
  REQUIRE(fstat(ends[1], &file) == 0);
  const auto stream = [&](unsigned long long inode) {
    return std::to_string(file.st_dev) + ":" + std::to_string(inode);
  };
  setenv("JOURNAL_STREAM", stream(file.st_ino).c_str(), 1);
  CHECK(is_system_journal(ends[1]));
  {
    Narrator narrator(ends[1]);
    narrator.line("sweep");
    narrator.line("E5002 lost the link", Priority::kWarning);
    narrator.line("E1000", Priority::kError);
  }
  setenv("JOURNAL_STREAM", stream(file.st_ino + 1).c_str(), 1);
  CHECK_FALSE(is_system_journal(ends[1]));
  setenv("JOURNAL_STREAM", "nonsense", 1);
  CHECK_FALSE(is_system_journal(ends[1]));
  unsetenv("JOURNAL_STREAM");
  CHECK_FALSE(is_system_journal(ends[1]));
  CHECK(read_all(ends[0]) == "<6>sweep\n<4>E5002 lost the link\n<3>E1000\n");
  close(ends[0]);
  close(ends[1]);
}
