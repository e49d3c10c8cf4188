#include "platform/linux/files.hpp"

#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <csignal>
#include <filesystem>

using namespace firstlook;
namespace fs = std::filesystem;

namespace {

struct TemporaryFolder {
  TemporaryFolder() : path(fs::temp_directory_path() / ("firstlook_files_" + std::to_string(getpid()))) {
    fs::create_directories(path);
  }
  ~TemporaryFolder() { fs::remove_all(path); }
  [[nodiscard]] std::string operator/(const char* name) const { return (path / name).string(); }
  fs::path path;
};

/// While it lives no file may grow beyond `bytes`: a full disk for everybody, root included.
struct FullDisk {
  explicit FullDisk(rlim_t bytes) : before_signal(std::signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &before);
    const rlimit limit{bytes, before.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FullDisk() {
    setrlimit(RLIMIT_FSIZE, &before);
    std::signal(SIGXFSZ, before_signal);
  }
  rlimit before{};
  void (*before_signal)(int);
};

}  // namespace

TEST_CASE("a file is written whole, replaced whole, and nothing is left beside it") {
  const TemporaryFolder folder;
  const std::string path = folder / "result.json";
  REQUIRE(write_file_atomically(path, "first"));
  CHECK(read_text_file(path, 100).value() == "first");
  REQUIRE(write_file_atomically(path, "second, longer"));
  CHECK(read_text_file(path, 100).value() == "second, longer");
  REQUIRE(write_file_atomically(path, ""));
  CHECK(read_text_file(path, 100).value().empty());
  CHECK(std::distance(fs::directory_iterator(folder.path), fs::directory_iterator()) == 1);
}

TEST_CASE("large files are written in parts and come back") {
  const TemporaryFolder folder;
  const std::string path = folder / "map.bt";
  std::string expected;
  {
    auto file = AtomicFile::create(path);
    REQUIRE(file);
    for (int i = 0; i < 3000; ++i) {
      const std::string part(static_cast<std::size_t>(i % 97), static_cast<char>('a' + i % 26));
      REQUIRE(file->write(part));
      expected += part;
    }
    const std::string large(200'000, 'L');
    REQUIRE(file->write(large));
    REQUIRE(file->write("end"));
    expected += large + "end";
    CHECK_FALSE(fs::exists(path));
    REQUIRE(file->commit());
  }
  CHECK(read_text_file(path, 1 << 20).value() == expected);
}

TEST_CASE("a full disk gives an error and leaves the old file") {
  const TemporaryFolder folder;
  const std::string path = folder / "result.json";
  REQUIRE(write_file_atomically(path, "old"));
  for (const std::size_t size : {std::size_t{5000}, std::size_t{500'000}}) {
    const std::string text(size, 'n');
    const auto write = [&] {
      const FullDisk full(1000);
      return write_file_atomically(path, text);
    };
    const Status status = write();
    REQUIRE_FALSE(status);
    CHECK(status.error().fault == Fault::kDiskWrite);
    CHECK(status.error().detail() == path + ": File too large");
    CHECK(read_text_file(path, 100).value() == "old");
    CHECK_FALSE(fs::exists(path + ".part"));
  }
}

TEST_CASE("a target that cannot be written gives an error and leaves it as it was") {
  const TemporaryFolder folder;
  const Status absent = write_file_atomically(folder / "none/result.json", "x");
  REQUIRE_FALSE(absent);
  CHECK(absent.error().fault == Fault::kDiskWrite);
  CHECK(absent.error().detail().find("No such file or directory") != std::string_view::npos);
  fs::create_directories(folder.path / "taken" / "inside");
  CHECK_FALSE(write_file_atomically(folder / "taken", "x"));
  CHECK(fs::exists(folder.path / "taken" / "inside"));
  CHECK_FALSE(fs::exists(folder.path / "taken.part"));
}

TEST_CASE("a file that is not committed leaves no trace") {
  const TemporaryFolder folder;
  const std::string path = folder / "report.html";
  REQUIRE(write_file_atomically(path, "old"));
  {
    auto file = AtomicFile::create(path);
    REQUIRE(file);
    REQUIRE(file->write("half of the new"));
  }
  CHECK(read_text_file(path, 100).value() == "old");
  CHECK_FALSE(fs::exists(path + ".part"));
}

TEST_CASE("reading refuses what is absent, too large, or no file") {
  const TemporaryFolder folder;
  const auto fault = [](const auto& result) {
    REQUIRE_FALSE(result);
    return result.error().fault;
  };
  CHECK(fault(read_file(folder / "none", 10)) == Fault::kDataMissing);
  REQUIRE(write_file_atomically(folder / "ten", "0123456789"));
  CHECK(read_file(folder / "ten", 10).value().size() == 10);
  CHECK(fault(read_file(folder / "ten", 9)) == Fault::kDataMalformed);
  CHECK(fault(read_file(folder.path.string(), 10)) == Fault::kDataMalformed);
  REQUIRE(mkfifo((folder / "pipe").c_str(), 0600) == 0);
  CHECK(fault(read_file(folder / "pipe", 10)) == Fault::kDataMalformed);
}

TEST_CASE("folders are made with those above them, empty and absent ones count as empty") {
  const TemporaryFolder folder;
  const std::string deep = folder / "a/b/c";
  CHECK(folder_is_empty(deep).value());
  REQUIRE(make_directories(deep));
  REQUIRE(make_directories(deep));
  CHECK(folder_is_empty(deep).value());
  REQUIRE(write_file_atomically(deep + "/file", "x"));
  CHECK_FALSE(folder_is_empty(deep).value());
  CHECK_FALSE(folder_is_empty(deep + "/file"));
  CHECK_FALSE(make_directories(deep + "/file/below"));
}
