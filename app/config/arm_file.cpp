#include "app/config/arm_file.hpp"

#include <filesystem>

#include "platform/linux/files.hpp"

namespace firstlook {
namespace {

constexpr std::size_t kFileBytesMax = 4 << 20;

std::vector<std::string> words(const std::string& list) {
  std::vector<std::string> found;
  if (list == "none") return found;
  std::string word;
  for (const char c : list + ",") {
    if (c == ',') {
      if (!word.empty()) found.push_back(word);
      word.clear();
    } else if (c != ' ') {
      word += c;
    }
  }
  return found;
}

}  // namespace

ArmFileOptions arm_file_options(const Config::Arm& config) {
  const auto named = [](const std::string& word) { return word == "auto" ? std::string() : word; };
  return {named(config.base_link), named(config.tip_link), words(config.links_without_body)};
}

Result<ArmFromFile> read_arm_file(const std::string& path, const ArmFileOptions& options) {
  const std::filesystem::path file(path);
  const std::string extension = file.extension();
  const bool urdf = extension == ".urdf";
  if (!urdf && extension != ".yaml" && extension != ".yml") {
    const char* hint = extension == ".xacro" ? "; make a URDF of it first: xacro arm.xacro > arm.urdf" : "";
    return failure(Fault::kConfigBadValue, "arm.file: {:.120} is neither .urdf nor .yaml{}", path, hint);
  }
  const Result<std::string> text = read_text_file(path, kFileBytesMax);
  if (!text) return failure(text.error().fault, "arm.file: {}", text.error().detail());
  return urdf ? parse_arm_urdf(*text, path, file.parent_path().string(), options)
              : parse_arm_yaml(*text, path, options);
}

}  // namespace firstlook
