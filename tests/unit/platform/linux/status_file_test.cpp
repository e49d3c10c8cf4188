#include "platform/linux/status_file.hpp"

#include <catch2/catch.hpp>

#include "platform/linux/files.hpp"
#include "tests/support/temporary_folder.hpp"

using namespace firstlook;

TEST_CASE("a status file holds the latest text, whole, and is gone with its writer") {
  const test::TemporaryFolder folder("firstlook-status");
  const std::string path = (folder.path() / "status.json").string();
  {
    const StatusFile file(path);
    REQUIRE(file.present());
    CHECK(file.write("a long first text\n"));
    CHECK(file.write("short\n"));
    CHECK(read_text_file(path, 100).value() == "short\n");
    CHECK(folder_is_empty((folder.path() / "nothing else").string()).value());
    CHECK(std::distance(std::filesystem::directory_iterator(folder.path()), {}) == 1);
  }
  CHECK_FALSE(std::filesystem::exists(path));
}

TEST_CASE("without a path, with one that is too long, or in no folder nothing is written") {
  CHECK_FALSE(StatusFile("").present());
  CHECK_FALSE(StatusFile("").write("x"));
  CHECK_FALSE(StatusFile("/" + std::string(300, 'x')).present());
  const StatusFile nowhere("/no/such/folder/status.json");
  CHECK(nowhere.present());
  CHECK_FALSE(nowhere.write("x"));
}
