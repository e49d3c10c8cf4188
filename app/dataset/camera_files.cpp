/// The adapter to yaml-cpp for board.yaml and camera_info.yaml: its types and exceptions end here.
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>

#include "algorithms/vision/camera_model.hpp"
#include "algorithms/vision/target_names.hpp"
#include "app/dataset/calibration_dataset.hpp"

namespace firstlook {
namespace {

/// What a file says in a wrong way; turned into an Error where the file is read.
struct Complaint {
  int line = 0;
  std::string text;
};

template <typename T>
T value_of(const YAML::Node& parent, const char* key) {
  const YAML::Node node = parent[key];
  if (!node) throw Complaint{parent.Mark().line + 1, fmt::format("no key '{}'", key)};
  try {
    return node.as<T>();
  } catch (const YAML::Exception&) {
    throw Complaint{node.Mark().line + 1, fmt::format("'{}' has an unusable value", key)};
  }
}

/// Loads the file and lets `parse` make a T of it; complaints become kDataMalformed with file and line.
template <typename T, typename Parse>
Result<T> load(const std::filesystem::path& file, Parse parse) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored)) {
    return failure(Fault::kDataMissing, "{}: no such file", file.string());
  }
  const std::string name = file.filename().string();
  try {
    const YAML::Node root = YAML::LoadFile(file.string());
    if (!root.IsMap()) throw Complaint{1, "not a list of keys and values"};
    return parse(root);
  } catch (const Complaint& complaint) {
    return failure(Fault::kDataMalformed, "{}:{}: {}", name, complaint.line, complaint.text);
  } catch (const YAML::Exception& e) {
    return failure(Fault::kDataMalformed, "{}:{}: {}", name, e.mark.line + 1, e.msg);
  }
}

BoardSpec parse_board(const YAML::Node& root) {
  TargetWords words;
  words.type = value_of<std::string>(root, "type");
  if (std::ranges::find(target_type_names(), words.type) == target_type_names().end()) {
    throw Complaint{root["type"].Mark().line + 1, fmt::format("boards of type '{}' cannot be read, only {}", words.type,
                                                              fmt::join(target_type_names(), ", "))};
  }
  const bool alone = words.type == "marker" || words.type == "artoolkit";
  const bool corners = words.type == "checkerboard" || words.type == "charuco";
  const char* const spacing_key = alone ? "mark_size_m" : corners ? "square_size_m" : "spacing_m";
  if (!alone) {
    words.columns = value_of<int>(root, corners ? "inner_columns" : "columns");
    words.rows = value_of<int>(root, corners ? "inner_rows" : "rows");
  }
  words.spacing_m = value_of<double>(root, spacing_key);
  if (!alone && root["mark_size_m"]) words.mark_size_m = value_of<double>(root, "mark_size_m");
  if (root["dictionary"]) words.dictionary = value_of<std::string>(root, "dictionary");
  if (root["first_id"]) words.first_id = value_of<int>(root, "first_id");
  if (root["legacy"]) words.legacy = value_of<bool>(root, "legacy");
  const int size_line = root[spacing_key].Mark().line + 1;
  if (words.spacing_m > 1) {
    throw Complaint{size_line, fmt::format("{} is {}: that looks like millimetres", spacing_key, words.spacing_m)};
  }
  const auto board = target_from_words(words);
  if (!board) throw Complaint{size_line, std::string(board.error().detail())};
  return *board;
}

std::vector<NamedTarget> parse_targets(const YAML::Node& root) {
  const YAML::Node list = root["boards"];
  if (!list) return {{std::string(), parse_board(root)}};
  const int line = list.Mark().line + 1;
  if (root["type"]) throw Complaint{line, "'boards' and a board beside them: put that one into the list, too"};
  if (!list.IsSequence()) throw Complaint{line, "'boards' is not a list; each entry begins with '- name: ...'"};
  std::vector<NamedTarget> targets;
  for (const YAML::Node& entry : list) {
    if (!entry.IsMap()) throw Complaint{entry.Mark().line + 1, "an entry of 'boards' is not a list of keys and values"};
    targets.push_back({value_of<std::string>(entry, "name"), parse_board(entry)});
    // After each one, so that the complaint has the line of the second of two that do not go together.
    if (const Status distinct = check_distinct(targets); !distinct) {
      throw Complaint{entry.Mark().line + 1, std::string(distinct.error().detail())};
    }
  }
  if (targets.empty()) throw Complaint{line, "no board in the list 'boards'"};
  return targets;
}

std::vector<double> numbers(const YAML::Node& root, const char* key, std::size_t least, std::size_t most) {
  const YAML::Node node = root[key];
  if (!node || !node.IsMap()) throw Complaint{root.Mark().line + 1, fmt::format("no matrix '{}'", key)};
  auto values = value_of<std::vector<double>>(node, "data");
  if (values.size() < least || values.size() > most) {
    throw Complaint{node.Mark().line + 1, fmt::format("'{}' has {} numbers instead of {}", key, values.size(), most)};
  }
  return values;
}

CameraIntrinsics parse_camera_info(const YAML::Node& root) {
  const YAML::Node model = root["distortion_model"];
  if (model && value_of<std::string>(root, "distortion_model") != "plumb_bob") {
    throw Complaint{model.Mark().line + 1, "only the distortion model plumb_bob is known"};
  }
  const std::vector<double> k = numbers(root, "camera_matrix", 9, 9);
  std::vector<double> d = numbers(root, "distortion_coefficients", 4, 5);
  d.resize(5, 0.0);
  const CameraIntrinsics camera{value_of<int>(root, "image_width"),
                                value_of<int>(root, "image_height"),
                                k[0],
                                k[4],
                                k[2],
                                k[5],
                                d[0],
                                d[1],
                                d[2],
                                d[3],
                                d[4]};
  const int line = root["camera_matrix"].Mark().line + 1;
  if (!is_usable(camera) || camera.width > 8192 || camera.height > 8192) {
    throw Complaint{line, "image size, focal lengths or coefficients are not usable"};
  }
  if (k[1] != 0 || k[3] != 0 || k[6] != 0 || k[7] != 0 || k[8] != 1) {
    throw Complaint{line, "camera_matrix is not [fx 0 cx; 0 fy cy; 0 0 1]"};
  }
  return camera;
}

TipOffset parse_tip(const YAML::Node& root) {
  for (const auto& entry : root) {
    const auto key = entry.first.as<std::string>();
    if (key != "flange_p_tip_m" && key != "sigma_m") {
      throw Complaint{entry.first.Mark().line + 1, fmt::format("unknown key '{}': flange_p_tip_m, sigma_m", key)};
    }
  }
  const auto at = value_of<std::vector<double>>(root, "flange_p_tip_m");
  const int line = root["flange_p_tip_m"].Mark().line + 1;
  if (at.size() != 3) throw Complaint{line, fmt::format("flange_p_tip_m has {} numbers instead of 3", at.size())};
  TipOffset tip;
  tip.flange_p_tip_m = {at[0], at[1], at[2]};
  if (root["sigma_m"]) tip.sigma_m = value_of<double>(root, "sigma_m");
  constexpr double kTipMax_m = 2;  // no tool is longer
  if (!(tip.flange_p_tip_m.norm() <= kTipMax_m)) {
    throw Complaint{
        line, fmt::format("a tip {:.0f} m from the flange: that looks like millimetres", tip.flange_p_tip_m.norm())};
  }
  if (!(tip.sigma_m >= 0 && tip.sigma_m <= 0.1)) {
    throw Complaint{root["sigma_m"].Mark().line + 1, "sigma_m must lie in [0, 0.1]"};
  }
  return tip;
}

}  // namespace

std::string board_yaml(const BoardSpec& board) {
  const TargetWords words = words_of(board);
  std::string text = fmt::format("type: {}\n", words.type);
  if (board.type == TargetType::kCheckerboard || board.type == TargetType::kCharuco) {
    text += fmt::format("inner_columns: {}\ninner_rows: {}\nsquare_size_m: {}\n", words.columns, words.rows,
                        words.spacing_m);
  } else if (words.type != "marker" && words.type != "artoolkit") {
    text += fmt::format("columns: {}\nrows: {}\nspacing_m: {}\n", words.columns, words.rows, words.spacing_m);
  }
  if (words.mark_size_m > 0) text += fmt::format("mark_size_m: {}\n", words.mark_size_m);
  if (words.dictionary != "auto")
    text += fmt::format("dictionary: {}\nfirst_id: {}\n", words.dictionary, words.first_id);
  if (words.legacy) text += "legacy: true\n";
  return text;
}

Result<std::vector<NamedTarget>> read_targets(const std::filesystem::path& file) {
  return load<std::vector<NamedTarget>>(file, parse_targets);
}

Result<BoardSpec> read_board(const std::filesystem::path& file) {
  const auto targets = read_targets(file);
  if (!targets) return std::unexpected(targets.error());
  if (targets->size() == 1) return targets->front().board;
  return failure(Fault::kDataMalformed, "{}: {} boards where one is wanted", file.filename().string(), targets->size());
}

Result<TipOffset> read_tip(const std::filesystem::path& file) { return load<TipOffset>(file, parse_tip); }

Result<CameraIntrinsics> read_camera_info(const std::filesystem::path& file) {
  return load<CameraIntrinsics>(file, parse_camera_info);
}

}  // namespace firstlook
