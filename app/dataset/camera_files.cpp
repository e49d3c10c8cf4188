/// The adapter to yaml-cpp for board.yaml and camera_info.yaml: its types and exceptions end here.
#include <yaml-cpp/yaml.h>

#include <cmath>

#include "algorithms/vision/camera_model.hpp"
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
  const auto type = value_of<std::string>(root, "type");
  if (type != "checkerboard") {
    throw Complaint{root["type"].Mark().line + 1,
                    fmt::format("boards of type '{}' cannot be read, only checkerboard", type)};
  }
  const BoardSpec board{value_of<int>(root, "inner_columns"), value_of<int>(root, "inner_rows"),
                        value_of<double>(root, "square_size_m")};
  const int size_line = root["square_size_m"].Mark().line + 1;
  if (board.square_size_m > 1) {
    throw Complaint{size_line, fmt::format("square_size_m is {}: that looks like millimetres", board.square_size_m)};
  }
  if (const Status fine = check_board(board); !fine) throw Complaint{size_line, std::string(fine.error().detail())};
  return board;
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

}  // namespace

Result<BoardSpec> read_board(const std::filesystem::path& file) { return load<BoardSpec>(file, parse_board); }

Result<CameraIntrinsics> read_camera_info(const std::filesystem::path& file) {
  return load<CameraIntrinsics>(file, parse_camera_info);
}

}  // namespace firstlook
