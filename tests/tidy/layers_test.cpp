/// The layer rules of ARCHITECTURE.md, read from the include lines of every source file.
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <set>
#include <string>
#include <vector>

namespace {

struct Rule {
  std::string folder;                ///< files below this
  std::vector<std::string> allowed;  ///< may include ours only from below these
};

// The most specific folder counts: it stands before the wider one.
const std::vector<Rule> kRules = {
    {"platform/core/", {"platform/core/"}},
    {"platform/", {"platform/"}},
    {"algorithms/", {"algorithms/", "platform/core/"}},
    {"hal/api/", {"hal/api/", "platform/"}},
    {"hal/can/", {"hal/can/", "hal/api/", "platform/"}},
    {"hal/ur/", {"hal/ur/", "hal/api/", "platform/"}},
    {"hal/freenect/", {"hal/freenect/", "hal/api/", "platform/"}},
    {"hal/openni/", {"hal/openni/", "hal/api/", "platform/"}},
    {"hal/usb/", {"hal/usb/", "hal/api/", "platform/"}},
    {"hal/v4l2/", {"hal/v4l2/", "hal/api/", "platform/"}},
    {"hal/sim/", {"hal/sim/", "hal/api/", "platform/", "algorithms/"}},
    {"app/main.cpp", {"app/", "hal/", "platform/", "algorithms/"}},
    {"app/wiring/", {"app/", "hal/", "platform/", "algorithms/"}},
    {"app/", {"app/", "hal/api/", "platform/", "algorithms/"}},
};
const std::vector<std::string> kTops = {"platform/", "hal/", "algorithms/", "app/", "tests/", "toolchain/"};

bool starts_with(const std::string& text, const std::string& head) { return text.rfind(head, 0) == 0; }

const Rule* rule_for(const std::string& file) {
  for (const Rule& rule : kRules) {
    if (starts_with(file, rule.folder)) return &rule;
  }
  return nullptr;
}

std::vector<std::string> includes_of(const std::filesystem::path& file) {
  std::vector<std::string> found;
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    if (!starts_with(line, "#include \"")) continue;
    found.push_back(line.substr(10, line.find('"', 10) - 10));
  }
  return found;
}

std::vector<std::string> sources() {
  std::vector<std::string> files;
  const std::filesystem::path root = FIRSTLOOK_SOURCE_DIR;
  for (const char* top : {"platform", "hal", "algorithms", "app"}) {
    for (const auto& entry : std::filesystem::recursive_directory_iterator(root / top)) {
      const std::string extension = entry.path().extension();
      if (extension == ".cpp" || extension == ".hpp") files.push_back(entry.path().lexically_relative(root));
    }
  }
  return files;
}

bool allowed(const std::string& file, const std::string& include) {
  const Rule* rule = rule_for(file);
  if (rule == nullptr) return false;
  for (const std::string& folder : rule->allowed) {
    if (starts_with(include, folder)) return true;
  }
  return false;
}

}  // namespace

TEST_CASE("every include keeps to its layer", "[tidy]") {
  const auto files = sources();
  REQUIRE(files.size() > 50);
  for (const std::string& file : files) {
    for (const std::string& include : includes_of(std::filesystem::path(FIRSTLOOK_SOURCE_DIR) / file)) {
      INFO(file << " includes " << include);
      bool from_the_top = false;
      for (const std::string& top : kTops) from_the_top = from_the_top || starts_with(include, top);
      CHECK(from_the_top);
      CHECK(allowed(file, include));
    }
  }
}

TEST_CASE("the layer check finds a breach", "[tidy]") {
  CHECK_FALSE(allowed("algorithms/mapping/voxel_map.cpp", "hal/api/cameras.hpp"));
  CHECK_FALSE(allowed("platform/core/result.hpp", "platform/loop/clock.hpp"));
  CHECK_FALSE(allowed("app/machine/machine.cpp", "hal/sim/grader.hpp"));
  CHECK_FALSE(allowed("hal/sim/scene.cpp", "app/config/config.hpp"));
  CHECK_FALSE(allowed("hal/can/can_panel.cpp", "hal/v4l2/v4l2_camera.hpp"));
  CHECK(allowed("app/main.cpp", "hal/sim/simulated_cell.hpp"));
}

TEST_CASE("heavy libraries stay out of headers", "[tidy]") {
  const std::set<std::string> heavy = {"opencv2/", "ceres/",   "CLI/",         "nlohmann/json.hpp", "yaml-cpp/",
                                       "octomap/", "embree3/", "urdf_parser/", "urdf_model/",       "console_bridge/"};
  for (const std::string& file : sources()) {
    if (!file.ends_with(".hpp")) continue;
    std::ifstream in(std::filesystem::path(FIRSTLOOK_SOURCE_DIR) / file);
    for (std::string line; std::getline(in, line);) {
      for (const std::string& name : heavy) {
        INFO(file << ": " << line);
        CHECK_FALSE(starts_with(line, "#include <" + name));
      }
    }
  }
}

TEST_CASE("ENSURE numbers are unique", "[tidy]") {
  std::set<std::string> seen;
  for (const std::string& file : sources()) {
    std::ifstream in(std::filesystem::path(FIRSTLOOK_SOURCE_DIR) / file);
    for (std::string line; std::getline(in, line);) {
      for (auto at = line.find("ENSURE("); at != std::string::npos; at = line.find("ENSURE(", at + 1)) {
        const std::string number = line.substr(at + 7, line.find(',', at) - at - 7);
        if (number.empty() || number.find_first_not_of("0123456789") != std::string::npos) continue;
        INFO(file << ": " << line);
        CHECK(seen.insert(number).second);
      }
    }
  }
}
