#include "platform/linux/child_process.hpp"

#include <unistd.h>

#include <array>
#include <catch2/catch.hpp>
#include <csignal>
#include <filesystem>

#include "platform/linux/files.hpp"
#include "tests/support/temporary_folder.hpp"

using namespace firstlook;

namespace {

ChildEnd wait_for_end(ChildProcess& child) {
  while (true) {
    if (const auto end = child.ended()) return *end;
    const std::array descriptors{child.descriptor()};
    wait_for_child(descriptors, 100);
  }
}

/// A shell with this script, its words in console.txt.
Result<ChildProcess> shell(const test::TemporaryFolder& folder, const std::string& script) {
  return ChildProcess::start({"/bin/sh", {"-c", script}, (folder.path() / "console.txt").string()});
}

ChildEnd run(const test::TemporaryFolder& folder, const std::string& script) {
  auto child = shell(folder, script);
  REQUIRE(child);
  return wait_for_end(*child);
}

}  // namespace

TEST_CASE("how a child ended, and what it said") {
  const test::TemporaryFolder folder("firstlook-child");
  const ChildEnd fine = run(folder, "echo out; echo err >&2; read nothing; exit 6");
  CHECK(fine.exit_code == 6);
  CHECK(fine.signal == 0);
  CHECK(fine.peak_resident_bytes > 100'000);
  CHECK(read_text_file((folder.path() / "console.txt").string(), 100).value() == "out\nerr\n");
  const ChildEnd crashed = run(folder, "kill -SEGV $$");
  CHECK(crashed.signal == SIGSEGV);
  CHECK(signal_name(crashed.signal) == "Segmentation fault");
  CHECK(read_text_file((folder.path() / "console.txt").string(), 100).value().empty());
}

TEST_CASE("a child can be ended, and ends with its parent's interest in it") {
  const test::TemporaryFolder folder("firstlook-child");
  pid_t pid = -1;
  {
    auto child = shell(folder, "exec sleep 1000");
    REQUIRE(child);
    pid = child->pid();
    CHECK_FALSE(child->ended());
    CHECK(kill(pid, 0) == 0);
    ChildProcess moved = std::move(*child);
    CHECK_FALSE(moved.ended());
  }
  CHECK(kill(pid, 0) != 0);
  auto killed = shell(folder, "exec sleep 1000");
  REQUIRE(killed);
  killed->kill();
  CHECK(wait_for_end(*killed).signal == SIGKILL);
}

TEST_CASE("what is sent to stop everything does not reach a child") {
  const test::TemporaryFolder folder("firstlook-child");
  // Not a shell: dash empties its signal mask each time it has started a program.
  auto child = ChildProcess::start({"/bin/sleep", {"1000"}, (folder.path() / "console.txt").string()});
  REQUIRE(child);
  kill(child->pid(), SIGTERM);
  kill(child->pid(), SIGINT);
  CHECK(getpgid(child->pid()) == child->pid());
  child->kill();
  CHECK(wait_for_end(*child).signal == SIGKILL);  // a stop signal would have ended it before
}

TEST_CASE("a program that is not there and a console that cannot be written") {
  const test::TemporaryFolder folder("firstlook-child");
  const auto absent = ChildProcess::start({"/nowhere/program", {}, (folder.path() / "console.txt").string()});
  REQUIRE_FALSE(absent);
  CHECK(absent.error().fault == Fault::kDataMissing);
  const auto silent = ChildProcess::start({"/bin/true", {}, "/nowhere/console.txt"});
  REQUIRE_FALSE(silent);
  CHECK(silent.error().fault == Fault::kDiskWrite);
}

TEST_CASE("there is a processor to run on") { CHECK(usable_processors() >= 1); }
