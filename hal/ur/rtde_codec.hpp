/// The Real-Time Data Exchange of a UR controller, from the client's side: requests as bytes, bytes as answers. Pure,
/// in fixed memory, and safe with whatever bytes come. UR's RTDE guide; all numbers big-endian.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "hal/ur/bytes.hpp"
#include "platform/core/fixed_vector.hpp"
#include "platform/core/result.hpp"

namespace firstlook::ur {

enum class RtdeKind : std::uint8_t {
  kProtocol = 'V',
  kVersion = 'v',
  kText = 'M',
  kData = 'U',
  kOutputs = 'O',
  kInputs = 'I',
  kStart = 'S',
  kPause = 'P',
};

struct RtdePackage {
  RtdeKind kind = RtdeKind::kText;
  std::string_view payload;  ///< into the bytes that it was cut from
  std::size_t bytes = 0;     ///< of the whole package
};

/// The package that a stream begins with; empty when more bytes are needed. Error: kLinkLost for a package shorter than
/// its header or of an unknown kind: the stream is out of step, and only a new connection helps.
[[nodiscard]] Result<std::optional<RtdePackage>> rtde_cut(std::string_view received);

// Requests. Names are joined by commas, 480 characters at most.
using RtdeRequest = Message<512>;
[[nodiscard]] RtdeRequest rtde_protocol_request(std::uint16_t version);
[[nodiscard]] RtdeRequest rtde_version_request();
/// Protocol 1 has a fixed frequency: it is not sent.
[[nodiscard]] RtdeRequest rtde_outputs_request(int protocol, double frequency_hz, std::string_view names);
[[nodiscard]] RtdeRequest rtde_inputs_request(std::string_view names);
[[nodiscard]] RtdeRequest rtde_start_request();
[[nodiscard]] RtdeRequest rtde_pause_request();

// Answers; each gives an error of kind kLinkLost for a payload that is too short or too long.
/// Of protocol, start and pause: accepted or not.
[[nodiscard]] Result<bool> rtde_accepted(std::string_view payload);
/// Major, minor, bugfix, build.
[[nodiscard]] Result<std::array<std::uint32_t, 4>> rtde_version(std::string_view payload);

enum class RtdeType : std::uint8_t {
  kBool,
  kUint8,
  kUint32,
  kUint64,
  kInt32,
  kDouble,
  kVector3d,
  kVector6d,
  kVector6Int32,
  kVector6Uint32,
  kNotFound,  ///< the controller does not have it
};
struct RtdeRecipe {
  static constexpr std::size_t kFieldsMax = 32;
  bool numbered = true;  ///< its data begin with its number: protocol 2
  std::uint8_t number = 0;
  FixedVector<RtdeType, kFieldsMax> types;
  [[nodiscard]] std::size_t data_bytes() const;  ///< of a data package's payload, with the number
  [[nodiscard]] std::size_t values() const;      ///< that a data package has
  [[nodiscard]] bool complete() const;           ///< the controller has all
};
/// Of outputs and, in protocol 2, inputs. Names that the controller does not have are kNotFound; then nothing is set
/// up. Error: kDeviceMissing for an input that is IN_USE, by its name; kLinkLost for types that nobody knows, or
/// another count than that of `names`.
[[nodiscard]] Result<RtdeRecipe> rtde_recipe(int protocol, std::string_view payload, std::string_view names);

/// The values of a data package, in the recipe's order, vectors one after the other, to the front of `values`, which
/// has room for them. Integers and bits as numbers: 64 bits lose nothing below 2^53. Error: kLinkLost for another
/// recipe or size.
[[nodiscard]] Status rtde_values(const RtdeRecipe& recipe, std::string_view payload, std::span<double> values);

/// What a text message says, without source and level.
[[nodiscard]] std::string_view rtde_text(int protocol, std::string_view payload);

}  // namespace firstlook::ur
