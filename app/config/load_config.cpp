#include "app/config/load_config.hpp"

#include <unistd.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <set>

#include "app/config/config_keys.hpp"
#include "app/config/nearest_name.hpp"
#include "platform/linux/files.hpp"

extern char** environ;  // POSIX; unistd.h declares it only with extensions

namespace firstlook {
namespace {

constexpr std::size_t kFileBytesMax = 1 << 20;
constexpr std::size_t kKeepOutMax = 16;
constexpr std::string_view kEnvironmentPrefix = "FIRSTLOOK_";

/// "file:line:column" as people count; for overrides the name of the variable or flag.
struct Place {
  std::string_view source;
  bool has_position = false;
  int line = 0, column = 0;

  [[nodiscard]] std::string text() const {
    return has_position ? fmt::format("{}:{}:{}", source, line, column) : std::string(source);
  }
};

Place place_of(std::string_view source, const YAML::Mark& mark, bool in_file) {
  return {source, in_file && !mark.is_null(), mark.line + 1, mark.column + 1};
}

std::unexpected<Error> bad_value(const Place& place, const ConfigKey& key, std::string_view what) {
  return failure(Fault::kConfigBadValue, "{}: {} {}", place.text(), key.path, what);
}

std::string range_text(const ConfigKey& key) { return fmt::format("must be between {} and {}", key.low, key.high); }

template <typename Number>
Status parse_number(std::string_view text, bool quoted, const ConfigKey& key, const Place& place, Number& target) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool whole = error == std::errc{} && end == text.data() + text.size() && !text.empty() && !quoted;
  if (!whole || !std::isfinite(static_cast<double>(value))) {
    const char* kind = std::is_same_v<Number, double> ? "a finite number" : "a whole number";
    return bad_value(place, key, fmt::format("must be {}, not '{:.40}'; {}", kind, text, range_text(key)));
  }
  if (static_cast<double>(value) < key.low || static_cast<double>(value) > key.high) {
    return bad_value(place, key, fmt::format("is {}; {}", value, range_text(key)));
  }
  target = value;
  return {};
}

Status parse_text(std::string_view text, const ConfigKey& key, const Place& place, std::string& target) {
  if (!key.choices.empty() && std::find(key.choices.begin(), key.choices.end(), text) == key.choices.end()) {
    return bad_value(place, key, fmt::format("is '{:.40}'; must be one of: {}", text, fmt::join(key.choices, ", ")));
  }
  if (text.empty()) return bad_value(place, key, "is empty");
  target = text;
  return {};
}

/// Assigns YAML nodes to fields; one for each key and place in the sources.
class FieldReader {
 public:
  FieldReader(const ConfigKey& key, std::string_view source, bool in_file)
      : key_(key), source_(source), in_file_(in_file) {}

  Status read(const YAML::Node& node) {
    return std::visit([&](auto* field) { return read(node, *field); }, key_.field);
  }

 private:
  [[nodiscard]] Place place(const YAML::Node& node) const { return place_of(source_, node.Mark(), in_file_); }
  [[nodiscard]] auto wrong(const YAML::Node& node, std::string_view what) const {
    return bad_value(place(node), key_, what);
  }

  template <typename Number>
    requires std::is_arithmetic_v<Number>
  Status read(const YAML::Node& node, Number& target) {
    if (!node.IsScalar()) return wrong(node, fmt::format("must be one number; {}", range_text(key_)));
    return parse_number(node.Scalar(), node.Tag() == "!", key_, place(node), target);
  }

  Status read(const YAML::Node& node, std::string& target) {
    if (!node.IsScalar()) return wrong(node, "must be a text");
    return parse_text(node.Scalar(), key_, place(node), target);
  }

  Status read(const YAML::Node& node, std::array<double, 3>& target) {
    if (!node.IsSequence() || node.size() != 3) return wrong(node, "must be three numbers: [x, y, z]");
    std::array<double, 3> values{};
    for (std::size_t i = 0; i < 3; ++i) {
      if (Status status = read(node[i], values[i]); !status) return status;
    }
    target = values;
    return {};
  }

  Status read(const YAML::Node& node, std::optional<JointVector>& target) {
    if (node.IsNull()) {
      target.reset();
      return {};
    }
    if (!node.IsSequence() || node.size() < 2 || node.size() > kJointsMax) {
      return wrong(node, "must be null or a list of joint angles in radians");
    }
    JointVector joints = JointVector::zero(static_cast<int>(node.size()));
    for (int i = 0; i < joints.size(); ++i) {
      if (Status status = read(node[static_cast<std::size_t>(i)], joints[i]); !status) return status;
    }
    target = joints;
    return {};
  }

  Status read(const YAML::Node& node, std::vector<Config::KeepOut>& target) {
    if (!node.IsSequence() || node.size() > kKeepOutMax) return wrong(node, "must be a list of at most 16 boxes");
    std::vector<Config::KeepOut> boxes;
    for (const YAML::Node& box : node) {
      if (!box.IsMap() || box.size() != 2 || !box["low_m"] || !box["high_m"]) {
        return wrong(box, "needs low_m: [x, y, z] and high_m: [x, y, z] in each box, and nothing else");
      }
      Config::KeepOut read_box;
      if (Status status = read(box["low_m"], read_box.low_m); !status) return status;
      if (Status status = read(box["high_m"], read_box.high_m); !status) return status;
      boxes.push_back(read_box);
    }
    target = std::move(boxes);
    return {};
  }

  const ConfigKey& key_;
  std::string_view source_;
  bool in_file_;
};

const ConfigKey* find_key(const std::vector<ConfigKey>& keys, std::string_view path) {
  const auto found = std::find_if(keys.begin(), keys.end(), [&](const ConfigKey& key) { return key.path == path; });
  return found == keys.end() ? nullptr : &*found;
}

bool is_section(const std::vector<ConfigKey>& keys, const std::string& path) {
  return std::any_of(keys.begin(), keys.end(), [&](const ConfigKey& key) { return key.path.starts_with(path + "."); });
}

std::string nearest_key(const std::vector<ConfigKey>& keys, std::string_view path) {
  std::vector<std::string_view> names;
  for (const ConfigKey& key : keys) {
    names.push_back(key.path);
    const std::string_view section = key.path.substr(0, key.path.find('.'));
    if (section != key.path && std::find(names.begin(), names.end(), section) == names.end()) names.push_back(section);
  }
  return std::string(nearest_name(path, names));
}

/// Walks the sections of a file and assigns every leaf.
Status read_section(const YAML::Node& node, const std::string& prefix, const std::vector<ConfigKey>& keys,
                    std::string_view source) {
  if (!node.IsMap()) {
    const std::string what = prefix.empty() ? "the file" : prefix.substr(0, prefix.size() - 1);
    return failure(Fault::kConfigBadValue, "{}: {} must be a map of keys", place_of(source, node.Mark(), true).text(),
                   what);
  }
  std::set<std::string> seen;
  for (const auto& pair : node) {
    const Place place = place_of(source, pair.first.Mark(), true);
    if (!pair.first.IsScalar()) return failure(Fault::kConfigUnreadable, "{}: a key must be a word", place.text());
    const std::string path = prefix + pair.first.Scalar();
    if (!seen.insert(path).second) {
      return failure(Fault::kConfigBadValue, "{}: {:.60} is given twice", place.text(), path);
    }
    if (const ConfigKey* key = find_key(keys, path)) {
      if (Status status = FieldReader(*key, source, true).read(pair.second); !status) return status;
    } else if (is_section(keys, path)) {
      if (pair.second.IsNull()) continue;  // a section whose keys are all commented out
      if (Status status = read_section(pair.second, path + ".", keys, source); !status) return status;
    } else {
      return failure(Fault::kConfigUnknownKey, "{}: {:.60}; did you mean {}?", place.text(), path,
                     nearest_key(keys, path));
    }
  }
  return {};
}

Status apply_yaml(std::string_view yaml, std::string_view name, Config& config) {
  try {
    const std::vector<YAML::Node> documents = YAML::LoadAll(std::string(yaml));
    if (documents.size() > 1) {
      return failure(Fault::kConfigUnreadable, "{}: more than one document", name);
    }
    if (documents.empty() || documents.front().IsNull()) return {};
    return read_section(documents.front(), "", config_keys(config), name);
  } catch (const YAML::Exception& e) {
    return failure(Fault::kConfigUnreadable, "{}: {}", place_of(name, e.mark, true).text(), e.msg);
  }
}

/// One value from a flag or a variable: text is taken as it stands, lists as YAML writes them.
Status apply_override(const ConfigOverride& given, const std::vector<ConfigKey>& keys) {
  const Place place{given.origin};
  const ConfigKey* key = find_key(keys, given.path);
  if (key == nullptr) {
    return failure(Fault::kConfigUnknownKey, "{}: {:.60}; did you mean {}?", given.origin, given.path,
                   nearest_key(keys, given.path));
  }
  if (auto* const* text = std::get_if<std::string*>(&key->field)) return parse_text(given.value, *key, place, **text);
  try {
    return FieldReader(*key, given.origin, false).read(YAML::Load(given.value));
  } catch (const YAML::Exception& e) {
    return failure(Fault::kConfigBadValue, "{}: {} is not readable: {}", given.origin, key->path, e.msg);
  }
}

std::string variable_name(std::string_view path) {
  std::string name(kEnvironmentPrefix);
  for (const char c : path) {
    name += c == '.' ? '_' : static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  }
  return name;
}

Status apply_environment(const std::vector<std::string>& environment, const std::vector<ConfigKey>& keys) {
  for (const std::string& entry : environment) {
    if (!entry.starts_with(kEnvironmentPrefix)) continue;
    const std::string name = entry.substr(0, entry.find('='));
    const std::string value = name.size() < entry.size() ? entry.substr(name.size() + 1) : std::string();
    const auto key =
        std::find_if(keys.begin(), keys.end(), [&](const ConfigKey& k) { return variable_name(k.path) == name; });
    if (key == keys.end()) {
      std::vector<std::string> names;
      for (const ConfigKey& k : keys) names.push_back(variable_name(k.path));
      const std::vector<std::string_view> views(names.begin(), names.end());
      return failure(Fault::kConfigUnknownKey, "environment: {:.60}; did you mean {}?", name,
                     nearest_name(name, views));
    }
    if (Status status = apply_override({std::string(key->path), value, name}, keys); !status) return status;
  }
  return {};
}

/// Applies the sources to the defaults of the sensor that they name: any key of any source beats its figures.
template <typename Apply>
Result<Config> configured(Apply apply) {
  Config named;
  if (Status status = apply(named); !status) return std::unexpected(status.error());
  Config config;
  set_sensor(find_sensor_preset(named.depth.sensor).value(), config.depth);
  if (Status status = apply(config); !status) return std::unexpected(status.error());
  return config;
}

Status check_rules(const Config& config, std::string_view source) {
  const std::string rule = broken_rule(config);
  if (!rule.empty()) return failure(Fault::kConfigBadValue, "{}: {}", source, rule);
  return {};
}

}  // namespace

std::vector<std::string> process_environment() {
  std::vector<std::string> entries;
  for (char** entry = environ; entry != nullptr && *entry != nullptr; ++entry) entries.emplace_back(*entry);
  return entries;
}

Result<Config> parse_config(std::string_view yaml, std::string_view name) {
  Result<Config> config = configured([&](Config& c) { return apply_yaml(yaml, name, c); });
  if (!config) return config;
  if (Status status = check_rules(*config, name); !status) return std::unexpected(status.error());
  return config;
}

Result<LoadedConfig> load_config(const ConfigSources& sources) {
  LoadedConfig loaded;
  std::error_code ignored;
  if (sources.file) {
    loaded.file = sources.file->string();
  } else if (std::filesystem::exists(sources.system_file, ignored)) {
    loaded.file = sources.system_file.string();
  }
  Result<std::string> text;
  if (!loaded.file.empty()) text = read_text_file(loaded.file, kFileBytesMax);
  if (!text) return failure(Fault::kConfigUnreadable, "{}", text.error().detail());
  const Result<Config> config = configured([&](Config& c) -> Status {
    if (Status status = apply_yaml(*text, loaded.file, c); !status) return status;
    const std::vector<ConfigKey> keys = config_keys(c);
    if (Status status = apply_environment(sources.environment, keys); !status) return status;
    for (const ConfigOverride& flag : sources.flags) {
      if (const Status status = apply_override(flag, keys); !status) {
        return failure(Fault::kUsage, "{}", status.error().detail());
      }
    }
    return {};
  });
  if (!config) return std::unexpected(config.error());
  loaded.config = *config;
  const std::string_view source = loaded.file.empty() ? std::string_view("configuration") : loaded.file;
  if (Status status = check_rules(loaded.config, source); !status) return std::unexpected(status.error());
  return loaded;
}

}  // namespace firstlook
