/// A folder of its own with the program in it: one scenario's runs and what they left behind.
#pragma once

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/support/run_program.hpp"

namespace firstlook::test {

using Json = nlohmann::ordered_json;

class JobFolder {
 public:
  JobFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "firstlook-scenario-XXXXXX").string();
    REQUIRE(mkdtemp(name.data()) != nullptr);
    path_ = name;
    options.folder = path_;
  }
  ~JobFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  JobFolder(const JobFolder&) = delete;
  JobFolder& operator=(const JobFolder&) = delete;

  ProgramOptions options;

  [[nodiscard]] std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

  /// `firstlook` with these words, in this folder.
  ProgramResult run(const std::vector<std::string>& words) const {
    ProgramResult result = run_program(FIRSTLOOK_PROGRAM, words, options);
    REQUIRE_FALSE(result.timed_out);
    return result;
  }
  /// The job in the empty cell with the fast sensor, into the folder `out`; more words may follow.
  ProgramResult run_job(const std::string& out, const std::vector<std::string>& more = {}) const {
    std::vector<std::string> words = {"run", "--cell", "empty", "--seed", "1", "--sensor", "fast", "--out", out};
    words.insert(words.end(), more.begin(), more.end());
    return run(words);
  }

  void write(const std::string& name, const std::string& text) const { std::ofstream(path_ / name) << text; }
  [[nodiscard]] std::string read(const std::string& name) const {
    std::ifstream file(path_ / name, std::ios::binary);
    INFO(name);
    REQUIRE(file);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  [[nodiscard]] Json read_json(const std::string& name) const { return Json::parse(read(name)); }
  /// Names in a folder below this one, sorted.
  [[nodiscard]] std::vector<std::string> names(const std::string& folder = ".") const {
    std::vector<std::string> found;
    for (const auto& entry : std::filesystem::directory_iterator(path_ / folder)) {
      found.push_back(entry.path().filename().string());
    }
    std::sort(found.begin(), found.end());
    return found;
  }

 private:
  std::filesystem::path path_;
};

/// What must hold of every run, however it ended.
inline void check_safe(const Json& result) {
  CHECK(result["truth"]["contacts"] == 0);
  CHECK(result["truth"]["unknown_entries"] == 0);
  CHECK(result["memory"]["loop_allocations_after_seal"] == 0);
  CHECK(result["memory"]["peak_bytes"].get<std::uint64_t>() <= result["memory"]["budget_bytes"].get<std::uint64_t>());
}

}  // namespace firstlook::test
