#include "hal/ur/rtde_codec.hpp"

#include <algorithm>
#include <bit>

namespace firstlook::ur {
namespace {

constexpr std::size_t kHeaderBytes = 3;
constexpr std::string_view kKinds = "VvMUOISP";

struct TypeRow {
  std::string_view name;
  RtdeType type;
  std::size_t count, bytes;  ///< of numbers, and of each
};
constexpr TypeRow kTypes[] = {
    {"BOOL", RtdeType::kBool, 1, 1},
    {"UINT8", RtdeType::kUint8, 1, 1},
    {"UINT32", RtdeType::kUint32, 1, 4},
    {"UINT64", RtdeType::kUint64, 1, 8},
    {"INT32", RtdeType::kInt32, 1, 4},
    {"DOUBLE", RtdeType::kDouble, 1, 8},
    {"VECTOR3D", RtdeType::kVector3d, 3, 8},
    {"VECTOR6D", RtdeType::kVector6d, 6, 8},
    {"VECTOR6INT32", RtdeType::kVector6Int32, 6, 4},
    {"VECTOR6UINT32", RtdeType::kVector6Uint32, 6, 4},
};

const TypeRow& row_of(RtdeType type) { return kTypes[static_cast<std::size_t>(type)]; }

void put(std::string& out, std::uint64_t value, int bytes) {
  for (int shift = 8 * (bytes - 1); shift >= 0; shift -= 8) out.push_back(static_cast<char>(value >> shift));
}

std::uint64_t number_at(std::string_view bytes, std::size_t at, std::size_t count) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < count; ++i) value = value << 8 | static_cast<std::uint8_t>(bytes[at + i]);
  return value;
}

std::string request(char kind, std::string_view payload) {
  std::string bytes;
  put(bytes, kHeaderBytes + payload.size(), 2);
  bytes.push_back(kind);
  bytes.append(payload);
  return bytes;
}

/// Takes the word before the next comma from the front.
std::string_view next_word(std::string_view& list) {
  const std::size_t comma = list.find(',');
  const std::string_view word = list.substr(0, comma);
  list.remove_prefix(comma == std::string_view::npos ? list.size() : comma + 1);
  return word;
}

double value_at(RtdeType type, std::string_view bytes, std::size_t at) {
  const std::uint64_t bits = number_at(bytes, at, row_of(type).bytes);
  switch (type) {
    case RtdeType::kDouble:
    case RtdeType::kVector3d:
    case RtdeType::kVector6d:
      return std::bit_cast<double>(bits);
    case RtdeType::kInt32:
    case RtdeType::kVector6Int32:
      return static_cast<std::int32_t>(bits);
    default:
      return static_cast<double>(bits);
  }
}

}  // namespace

Result<std::optional<RtdePackage>> RtdeReader::next() {
  received_.erase(0, taken_);
  taken_ = 0;
  if (received_.size() < kHeaderBytes) return std::nullopt;
  const std::size_t size = number_at(received_, 0, 2);
  if (size < kHeaderBytes) return failure(Fault::kLinkLost, "RTDE: a package of {} bytes", size);
  if (kKinds.find(received_[2]) == std::string_view::npos) {
    return failure(Fault::kLinkLost, "RTDE: a package of kind {}", static_cast<std::uint8_t>(received_[2]));
  }
  if (received_.size() < size) return std::nullopt;
  taken_ = size;
  return RtdePackage{static_cast<RtdeKind>(received_[2]),
                     std::string_view(received_).substr(kHeaderBytes, size - kHeaderBytes)};
}

std::string rtde_protocol_request(std::uint16_t version) {
  std::string payload;
  put(payload, version, 2);
  return request('V', payload);
}

std::string rtde_version_request() { return request('v', {}); }

std::string rtde_outputs_request(double frequency_hz, std::string_view names) {
  std::string payload;
  put(payload, std::bit_cast<std::uint64_t>(frequency_hz), 8);
  payload.append(names);
  return request('O', payload);
}

std::string rtde_inputs_request(std::string_view names) { return request('I', names); }
std::string rtde_start_request() { return request('S', {}); }
std::string rtde_pause_request() { return request('P', {}); }

Result<bool> rtde_accepted(std::string_view payload) {
  if (payload.size() != 1) return failure(Fault::kLinkLost, "RTDE: an answer of {} bytes", payload.size());
  return payload[0] != 0;
}

Result<std::array<std::uint32_t, 4>> rtde_version(std::string_view payload) {
  if (payload.size() != 16) return failure(Fault::kLinkLost, "RTDE: a version of {} bytes", payload.size());
  std::array<std::uint32_t, 4> version{};
  for (std::size_t i = 0; i < 4; ++i) version[i] = static_cast<std::uint32_t>(number_at(payload, 4 * i, 4));
  return version;
}

std::size_t RtdeRecipe::data_bytes() const {
  std::size_t bytes = 1;
  for (const RtdeType type : types) bytes += row_of(type).count * row_of(type).bytes;
  return bytes;
}

Result<RtdeRecipe> rtde_recipe(std::string_view payload, std::string_view names) {
  if (payload.empty()) return failure(Fault::kLinkLost, "RTDE: an empty answer to a recipe");
  RtdeRecipe recipe;
  recipe.number = static_cast<std::uint8_t>(payload[0]);
  std::string_view words = payload.substr(1);
  while (!words.empty() && !names.empty()) {
    const std::string_view word = next_word(words), name = next_word(names);
    if (word == "NOT_FOUND") return failure(Fault::kDeviceMissing, "RTDE: the controller has no '{}'", name);
    if (word == "IN_USE") return failure(Fault::kDeviceMissing, "RTDE: another client controls '{}'", name);
    const auto row = std::ranges::find(kTypes, word, &TypeRow::name);
    if (row == std::end(kTypes)) return failure(Fault::kLinkLost, "RTDE: '{}' is of type '{}'", name, word);
    recipe.types.push_back(row->type);
  }
  if (!words.empty() || !names.empty()) return failure(Fault::kLinkLost, "RTDE: not one type for each name");
  return recipe;
}

Result<std::vector<double>> rtde_values(const RtdeRecipe& recipe, std::string_view payload) {
  if (payload.size() != recipe.data_bytes() || static_cast<std::uint8_t>(payload[0]) != recipe.number) {
    return failure(Fault::kLinkLost, "RTDE: {} bytes of data, {} expected of recipe {}", payload.size(),
                   recipe.data_bytes(), recipe.number);
  }
  std::vector<double> values;
  std::size_t at = 1;
  for (const RtdeType type : recipe.types) {
    for (std::size_t i = 0; i < row_of(type).count; ++i, at += row_of(type).bytes) {
      values.push_back(value_at(type, payload, at));
    }
  }
  return values;
}

}  // namespace firstlook::ur
