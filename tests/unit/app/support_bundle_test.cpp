/// The bundle for support: read back by tar itself, and refused where there is nothing to pack.
#include "app/bundle/support_bundle.hpp"

#include <sys/stat.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "app/bundle/tar.hpp"
#include "platform/core/random.hpp"
#include "tests/support/temporary_folder.hpp"

using namespace firstlook;
namespace fs = std::filesystem;

namespace {

void write(const fs::path& path, const std::string& text) {
  fs::create_directories(path.parent_path());
  std::ofstream(path, std::ios::binary) << text;
}

std::string text_of(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

/// Unpacks with the system's tar, which must be content.
void unpack(const fs::path& archive, const fs::path& into) {
  fs::create_directories(into);
  const std::string command =
      "tar -xzf '" + archive.string() + "' -C '" + into.string() + "' 2>'" + into.string() + ".err'";
  REQUIRE(std::system(command.c_str()) == 0);  // NOLINT: the peer
  CHECK(text_of(into.string() + ".err").empty());
}

std::string noise(std::size_t bytes) {
  Random random(bytes);
  std::string text(bytes, '\0');
  for (char& c : text) c = static_cast<char>(random.bits());
  return text;
}

}  // namespace

TEST_CASE("what is packed comes out as it was", "[bundle]") {
  const test::TemporaryFolder folder("firstlook-bundle");
  const fs::path run = folder.path() / "run-7", out = folder.path() / "run-7.tar.gz";
  // Sizes around the blocks of tar and the buffers of the writer.
  for (const std::size_t size : {0, 1, 511, 512, 513, 65536, 65537, 300000}) {
    write(run / ("noise" + std::to_string(size)), noise(size));
  }
  write(run / "result.json", "{}");
  write(run / "report.html", "<html>");
  write(run / "ros" / "scene.yaml", "a: 1");
  write(run / "dataset" / "view1.png", "png");
  write(run / "journal.flj.part", "half");
  fs::create_symlink("/etc/passwd", run / "link");
  BundleOptions options{run, out, "seed: 3\n"};
  options.file_bytes_max = 300000;
  write(run / "huge", noise(300001));
  write(folder.path() / "status.json", "{\"state\":\"ready\"}");
  options.system_files = {folder.path() / "status.json", folder.path() / "nothing"};
  const auto summary = write_support_bundle(options);
  REQUIRE(summary.has_value());
  unpack(out, folder.path() / "out");
  for (const auto& entry : fs::directory_iterator(run)) {
    if (!entry.path().filename().string().starts_with("noise")) continue;
    CHECK(text_of(entry.path()) == text_of(folder.path() / "out" / "run-7" / entry.path().filename()));
  }
  const fs::path inside = folder.path() / "out";
  CHECK(text_of(inside / "run-7" / "ros" / "scene.yaml") == "a: 1");
  CHECK(text_of(inside / "system" / "firstlook.yaml") == "seed: 3\n");
  CHECK(text_of(inside / "system" / "status.json") == "{\"state\":\"ready\"}");
  CHECK(text_of(inside / "system" / "versions.txt").starts_with("firstlook 0."));
  CHECK_FALSE(fs::exists(inside / "run-7" / "dataset"));
  CHECK_FALSE(fs::exists(inside / "run-7" / "link"));
  CHECK_FALSE(fs::exists(inside / "run-7" / "journal.flj.part"));
  CHECK_FALSE(fs::exists(inside / "run-7" / "huge"));
  std::vector<std::string> left;
  for (const LeftOut& l : summary->left_out) left.push_back(l.name);
  std::ranges::sort(left);
  CHECK(left == std::vector<std::string>{"dataset/", "huge", "link"});
  CHECK(summary->with_pictures == std::vector<std::string>{"run-7/report.html"});
  std::size_t files = 0;
  for (const auto& entry : fs::recursive_directory_iterator(inside)) files += entry.is_regular_file();
  CHECK(files == summary->packed.size());
}

TEST_CASE("an archive inside the run is not packed into itself, and is replaced only by a whole one", "[bundle]") {
  const test::TemporaryFolder folder("firstlook-bundle");
  write(folder.path() / "result.json", "{}");
  const fs::path out = folder.path() / "run.tar.gz";
  write(out, "old");
  const auto summary = write_support_bundle({folder.path(), out, "", 1 << 20, {}});
  REQUIRE(summary.has_value());
  CHECK(summary->packed.size() == 2);
  CHECK(text_of(out) != "old");
  write(folder.path() / "kept.tar.gz", "old");
  const auto refused =
      write_support_bundle({folder.path() / "nowhere", folder.path() / "kept.tar.gz", "", 1 << 20, {}});
  REQUIRE_FALSE(refused.has_value());
  CHECK(text_of(folder.path() / "kept.tar.gz") == "old");
}

TEST_CASE("there is nothing to pack, or nowhere to write", "[bundle]") {
  const test::TemporaryFolder folder("firstlook-bundle");
  const auto missing = write_support_bundle({folder.path() / "none", folder.path() / "a.tar.gz", "", 1 << 20, {}});
  REQUIRE_FALSE(missing.has_value());
  CHECK(missing.error().fault == Fault::kDataMissing);
  write(folder.path() / "run" / "notes.txt", "hello");
  const auto empty = write_support_bundle({folder.path() / "run", folder.path() / "a.tar.gz", "", 1 << 20, {}});
  REQUIRE_FALSE(empty.has_value());
  CHECK(empty.error().detail().find("no run in it") != std::string_view::npos);
  CHECK_FALSE(fs::exists(folder.path() / "a.tar.gz"));
  write(folder.path() / "run" / "journal.flj", "x");
  const auto nowhere =
      write_support_bundle({folder.path() / "run", folder.path() / "no" / "a.tar.gz", "", 1 << 20, {}});
  REQUIRE_FALSE(nowhere.has_value());
  CHECK(nowhere.error().fault == Fault::kDiskWrite);
}

TEST_CASE("a file that is longer than the archive's names can say is left out and named", "[bundle]") {
  const test::TemporaryFolder folder("firstlook-bundle");
  write(folder.path() / "run" / "result.json", "{}");
  write(folder.path() / "run" / std::string(120, 'n'), "x");
  const auto summary = write_support_bundle({folder.path() / "run", folder.path() / "a.tar.gz", "", 1 << 20, {}});
  REQUIRE(summary.has_value());
  REQUIRE(summary->left_out.size() == 1);
  CHECK(summary->left_out[0].why == "its name is too long for the archive");
}
