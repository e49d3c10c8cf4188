#include <fmt/format.h>

#include <cctype>

#include "app/config/config_keys.hpp"
#include "app/config/load_config.hpp"

namespace firstlook {
namespace {

/// Plain where YAML cannot misread it, else double-quoted.
std::string yaml_text(std::string_view text) {
  const auto plain_char = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 ||
           std::string_view("_./:-").find(c) != std::string_view::npos;
  };
  bool plain = !text.empty() && (std::isalpha(static_cast<unsigned char>(text.front())) != 0 || text.front() == '/') &&
               text.back() != ':' && text != "null" && text != "Null" && text != "NULL";
  for (const char c : text) plain = plain && plain_char(c);
  if (plain) return std::string(text);
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      quoted += {'\\', c};
    } else if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) {
      quoted += fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
    } else {
      quoted += c;
    }
  }
  return quoted + '"';
}

std::string yaml_value(double v) { return fmt::format("{}", v); }
std::string yaml_value(int v) { return fmt::format("{}", v); }
std::string yaml_value(std::int64_t v) { return fmt::format("{}", v); }
std::string yaml_value(const std::string& v) { return yaml_text(v); }
std::string yaml_value(const std::array<double, 3>& v) { return fmt::format("[{}, {}, {}]", v[0], v[1], v[2]); }
std::string yaml_value(const std::optional<JointVector>& v) {
  if (!v) return "null";
  return fmt::format("[{}]", fmt::join(v->values.begin(), v->values.begin() + v->count, ", "));
}
std::string yaml_value(const std::vector<Config::KeepOut>& v) {
  std::string boxes;
  for (const Config::KeepOut& box : v) {
    boxes += fmt::format("{}{{low_m: {}, high_m: {}}}", boxes.empty() ? "" : ", ", yaml_value(box.low_m),
                         yaml_value(box.high_m));
  }
  return "[" + boxes + "]";
}
std::string yaml_value(const std::vector<Config::NamedBoard>& v) {
  std::string boards;
  for (Config::NamedBoard named : v) {
    boards += fmt::format("{}{{name: {}", boards.empty() ? "" : ", ", yaml_text(named.name));
    for (const ConfigKey& key : board_keys(named.board)) {
      const std::string value = std::visit(
          [](const auto* field) -> std::string {
            if constexpr (std::is_same_v<decltype(field), const std::vector<Config::NamedBoard>*>) {
              return {};  // a board holds no boards
            } else {
              return yaml_value(*field);
            }
          },
          key.field);
      boards += fmt::format(", {}: {}", key.path.substr(key.path.find('.') + 1), value);
    }
    boards += '}';
  }
  return "[" + boards + "]";
}

std::string limits_text(const ConfigKey& key) {
  if (!key.choices.empty()) return fmt::format("; {}", fmt::join(key.choices, " | "));
  if (std::holds_alternative<std::string*>(key.field)) return {};
  if (std::holds_alternative<std::vector<Config::NamedBoard>*>(key.field)) return fmt::format("; at most {}", key.high);
  return fmt::format("; {} to {}", key.low, key.high);
}

}  // namespace

std::string print_config(const Config& config) {
  Config copy = config;
  std::string out =
      "# Configuration of firstlook. A flag beats the environment (FIRSTLOOK_ARM_MODEL for arm.model), which beats "
      "this\n"
      "# file (/etc/firstlook/firstlook.yaml or --config FILE), which beats the defaults.\n";
  std::string_view section;
  for (const ConfigKey& key : config_keys(copy)) {
    const std::size_t dot = key.path.find('.');
    const std::string_view key_section = dot == std::string_view::npos ? std::string_view() : key.path.substr(0, dot);
    const std::string_view name = dot == std::string_view::npos ? key.path : key.path.substr(dot + 1);
    if (key_section == "board" && !config.boards.empty()) continue;  // one or the other
    if (!key_section.empty() && key_section != section) out += fmt::format("\n{}:\n", key_section);
    if (key_section.empty()) out += '\n';
    section = key_section;
    const std::string_view indent = key_section.empty() ? "" : "  ";
    const std::string value = std::visit([](const auto* field) { return yaml_value(*field); }, key.field);
    out += fmt::format("{}# {}{}\n{}{}: {}\n", indent, key.meaning, limits_text(key), indent, name, value);
  }
  return out;
}

}  // namespace firstlook
