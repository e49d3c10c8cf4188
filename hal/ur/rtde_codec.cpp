#include "hal/ur/rtde_codec.hpp"

#include <algorithm>

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
    {"NOT_FOUND", RtdeType::kNotFound, 0, 0},
};

const TypeRow& row_of(RtdeType type) { return kTypes[static_cast<std::size_t>(type)]; }

/// A request whose payload begins with `head`.
RtdeRequest request(char kind, std::string_view head, std::string_view names = {}) {
  RtdeRequest bytes;
  bytes.number(kHeaderBytes + head.size() + names.size(), 2);
  bytes.byte(kind);
  bytes.text(head);
  bytes.text(names);
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

Result<std::optional<RtdePackage>> rtde_cut(std::string_view received) {
  if (received.size() < kHeaderBytes) return std::nullopt;
  const std::size_t size = number_at(received, 0, 2);
  if (size < kHeaderBytes) return failure(Fault::kLinkLost, "RTDE: a package of {} bytes", size);
  if (kKinds.find(received[2]) == std::string_view::npos) {
    return failure(Fault::kLinkLost, "RTDE: a package of kind {}", static_cast<std::uint8_t>(received[2]));
  }
  if (received.size() < size) return std::nullopt;
  return RtdePackage{static_cast<RtdeKind>(received[2]), received.substr(kHeaderBytes, size - kHeaderBytes), size};
}

RtdeRequest rtde_protocol_request(std::uint16_t version) {
  Message<2> payload;
  payload.number(version, 2);
  return request('V', payload.view());
}

RtdeRequest rtde_version_request() { return request('v', {}); }

RtdeRequest rtde_outputs_request(int protocol, double frequency_hz, std::string_view names) {
  if (protocol == 1) return request('O', names);
  Message<8> frequency;
  frequency.real(frequency_hz);
  return request('O', frequency.view(), names);
}

RtdeRequest rtde_inputs_request(std::string_view names) { return request('I', names); }
RtdeRequest rtde_start_request() { return request('S', {}); }
RtdeRequest rtde_pause_request() { return request('P', {}); }

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
  std::size_t bytes = numbered ? 1 : 0;
  for (const RtdeType type : types) bytes += row_of(type).count * row_of(type).bytes;
  return bytes;
}

std::size_t RtdeRecipe::values() const {
  std::size_t count = 0;
  for (const RtdeType type : types) count += row_of(type).count;
  return count;
}

bool RtdeRecipe::complete() const { return std::ranges::find(types, RtdeType::kNotFound) == types.end(); }

Result<RtdeRecipe> rtde_recipe(int protocol, std::string_view payload, std::string_view names) {
  RtdeRecipe recipe;
  recipe.numbered = protocol != 1;
  if (recipe.numbered) {
    if (payload.empty()) return failure(Fault::kLinkLost, "RTDE: an empty answer to a recipe");
    recipe.number = static_cast<std::uint8_t>(payload[0]);
    payload.remove_prefix(1);
  }
  while (!payload.empty() && !names.empty() && !recipe.types.full()) {
    const std::string_view word = next_word(payload), name = next_word(names);
    if (word == "IN_USE") return failure(Fault::kDeviceMissing, "RTDE: another client controls '{:.60}'", name);
    const auto row = std::ranges::find(kTypes, word, &TypeRow::name);
    if (row == std::end(kTypes)) return failure(Fault::kLinkLost, "RTDE: '{:.60}' is of type '{:.60}'", name, word);
    recipe.types.push_back(row->type);
  }
  if (!payload.empty() || !names.empty()) return failure(Fault::kLinkLost, "RTDE: not one type for each name");
  return recipe;
}

Status rtde_values(const RtdeRecipe& recipe, std::string_view payload, std::span<double> values) {
  ENSURE(5394, values.size() >= recipe.values());
  const bool other = recipe.numbered && !payload.empty() && static_cast<std::uint8_t>(payload[0]) != recipe.number;
  if (payload.size() != recipe.data_bytes() || other) {
    return failure(Fault::kLinkLost, "RTDE: {} bytes of data, {} expected of recipe {}", payload.size(),
                   recipe.data_bytes(), recipe.number);
  }
  std::size_t at = recipe.numbered ? 1 : 0, value = 0;
  for (const RtdeType type : recipe.types) {
    for (std::size_t i = 0; i < row_of(type).count; ++i, at += row_of(type).bytes) {
      values[value++] = value_at(type, payload, at);
    }
  }
  return {};
}

std::string_view rtde_text(int protocol, std::string_view payload) {
  if (payload.empty()) return {};
  if (protocol == 1) return payload.substr(1);
  return payload.substr(1, static_cast<std::uint8_t>(payload[0]));
}

}  // namespace firstlook::ur
