/// The Real-Time Data Exchange of a UR controller, from the client's side: requests as bytes, bytes as answers. Pure,
/// and safe with whatever bytes come. UR's RTDE guide; all numbers big-endian.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

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
  std::string_view payload;  ///< into the reader's buffer: valid until its next call
};

/// Cuts a stream into packages.
class RtdeReader {
 public:
  void add(std::string_view bytes) { received_.append(bytes); }
  /// The next whole package; empty when more bytes are needed. Error: kLinkLost for a package shorter than its header
  /// or of an unknown kind: the stream is out of step, and only a new connection helps.
  [[nodiscard]] Result<std::optional<RtdePackage>> next();

 private:
  std::string received_;
  std::size_t taken_ = 0;  ///< of `received_`: handed out at the last call
};

// Requests.
[[nodiscard]] std::string rtde_protocol_request(std::uint16_t version);
[[nodiscard]] std::string rtde_version_request();
/// Protocol 2. Names joined by commas.
[[nodiscard]] std::string rtde_outputs_request(double frequency_hz, std::string_view names);
[[nodiscard]] std::string rtde_inputs_request(std::string_view names);
[[nodiscard]] std::string rtde_start_request();
[[nodiscard]] std::string rtde_pause_request();

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
};
struct RtdeRecipe {
  std::uint8_t number = 0;
  std::vector<RtdeType> types;
  [[nodiscard]] std::size_t data_bytes() const;  ///< of a data package's payload, with the number
};
/// Of outputs (protocol 2) and inputs. Error: kDeviceMissing for a name that is NOT_FOUND or IN_USE, named by its place
/// in `names`; kLinkLost for types that nobody knows, or another count than that of `names`.
[[nodiscard]] Result<RtdeRecipe> rtde_recipe(std::string_view payload, std::string_view names);

/// The values of a data package, in the recipe's order, vectors one after the other. Integers and bits as numbers: 64
/// bits lose nothing below 2^53. Error: kLinkLost for another recipe or size.
[[nodiscard]] Result<std::vector<double>> rtde_values(const RtdeRecipe& recipe, std::string_view payload);

}  // namespace firstlook::ur
