#include "platform/linux/append_file.hpp"

#include <sys/resource.h>

#include <catch2/catch.hpp>
#include <csignal>
#include <filesystem>

#include "platform/linux/files.hpp"
#include "tests/support/temporary_folder.hpp"

using namespace firstlook;

TEST_CASE("lines are appended, and stay when the file is opened again") {
  const test::TemporaryFolder folder("firstlook-append");
  const std::string path = (folder.path() / "lines").string();
  for (const char* line : {"first", "second"}) {
    auto file = AppendFile::open(path);
    REQUIRE(file);
    REQUIRE(file->append_line(line));
  }
  CHECK(read_text_file(path, 100).value() == "first\nsecond\n");
  auto file = AppendFile::open(path);
  REQUIRE(file);
  REQUIRE(file->truncate(6));
  REQUIRE(file->append_line("third"));
  CHECK(read_text_file(path, 100).value() == "first\nthird\n");
}

TEST_CASE("a file has one writer at a time") {
  const test::TemporaryFolder folder("firstlook-append");
  const std::string path = (folder.path() / "lines").string();
  CHECK_FALSE(is_being_appended(path));
  {
    const auto file = AppendFile::open(path);
    REQUIRE(file);
    CHECK(is_being_appended(path));
    const auto second = AppendFile::open(path);
    REQUIRE_FALSE(second);
    CHECK(second.error().fault == Fault::kOutputNotEmpty);
  }
  CHECK_FALSE(is_being_appended(path));
  CHECK(AppendFile::open(path).has_value());
  CHECK(AppendFile::open("/nowhere/lines").error().fault == Fault::kDiskWrite);
}

TEST_CASE("a line that does not fit the disk leaves none of itself") {
  const test::TemporaryFolder folder("firstlook-append");
  const std::string path = (folder.path() / "lines").string();
  auto file = AppendFile::open(path);
  REQUIRE(file);
  REQUIRE(file->append_line("first"));
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const rlimit limit{10, before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &limit);
  const Status status = file->append_line("second line");
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  REQUIRE_FALSE(status);
  CHECK(status.error().fault == Fault::kDiskWrite);
  CHECK(read_text_file(path, 100).value() == "first\n");
}
