#include "hal/ur/primary_codec.hpp"

#include <cmath>

#include "hal/ur/bytes.hpp"

namespace firstlook::ur {
namespace {

constexpr std::size_t kHeaderBytes = 5;
constexpr std::size_t kPacketMax = 64 * 1024;

// Sub-packages, and what of them is read.
constexpr std::uint8_t kModeData = 0;
constexpr std::size_t kModeAt = 15;  // behind the time and seven flags
constexpr std::uint8_t kMasterboardData = 3;
constexpr std::size_t kSafetyModeAt = 60;  // behind digital, analog and power readings
constexpr std::uint8_t kCartesianInfo = 4;
constexpr std::size_t kTcpOffsetAt = 48;
constexpr std::uint8_t kKinematicsInfo = 5;
constexpr std::size_t kKinematicsBytes = 6 * 4 + 4 * 6 * 8;
constexpr std::uint8_t kConfigurationData = 6;
constexpr std::size_t kRobotTypeAt = 6 * 16 + 6 * 16 + 5 * 8 + 4 * 6 * 8 + 2 * 4;

constexpr std::uint8_t kVersionMessage = 3;

Kinematics kinematics_of(std::string_view content) {
  Kinematics kinematics;
  for (std::size_t j = 0; j < 6; ++j) {
    kinematics.checksums[j] = static_cast<std::uint32_t>(number_at(content, 4 * j, 4));
    const auto column = [&](std::size_t i) { return real_at(content, 24 + 48 * i + 8 * j); };
    kinematics.rows[j] = {column(0), column(2), column(1), column(3)};
  }
  return kinematics;
}

}  // namespace

Result<std::optional<PrimaryPacket>> primary_cut(std::string_view received) {
  if (received.size() < kHeaderBytes) return std::nullopt;
  const std::size_t size = number_at(received, 0, 4);
  if (size < kHeaderBytes || size > kPacketMax) {
    return failure(Fault::kLinkLost, "primary interface: a packet of {} bytes", size);
  }
  if (received.size() < size) return std::nullopt;
  return PrimaryPacket{static_cast<std::uint8_t>(received[4]), received.substr(kHeaderBytes, size - kHeaderBytes),
                       size};
}

std::optional<ControllerVersion> version_message(const PrimaryPacket& packet) {
  // Time, source, kind; then the product's name with its length, and the numbers.
  const std::string_view content = packet.content;
  if (packet.type != kPrimaryMessage || content.size() < 11 || content[9] != kVersionMessage) return std::nullopt;
  const std::size_t at = 11 + static_cast<std::uint8_t>(content[10]);
  if (content.size() < at + 10) return std::nullopt;
  return ControllerVersion{static_cast<std::uint8_t>(content[at]), static_cast<std::uint8_t>(content[at + 1]),
                           integer_at(content, at + 2), integer_at(content, at + 6)};
}

Result<PrimaryState> primary_state(const PrimaryPacket& packet) {
  PrimaryState state;
  if (packet.type != kPrimaryState) return state;
  for (std::string_view rest = packet.content; !rest.empty();) {
    const auto part = primary_cut(rest);
    if (!part) return std::unexpected(part.error());
    if (!*part) return failure(Fault::kLinkLost, "primary interface: a robot state that ends in the middle");
    const std::string_view content = (*part)->content;
    if ((*part)->type == kModeData && content.size() > kModeAt) {
      state.robot_mode = static_cast<signed char>(content[kModeAt]);
    } else if ((*part)->type == kMasterboardData && content.size() > kSafetyModeAt) {
      state.safety_mode = static_cast<std::uint8_t>(content[kSafetyModeAt]);
    } else if ((*part)->type == kCartesianInfo && content.size() >= kTcpOffsetAt + 48) {
      state.tcp_offset.emplace();
      for (std::size_t i = 0; i < 6; ++i) (*state.tcp_offset)[i] = real_at(content, kTcpOffsetAt + 8 * i);
    } else if ((*part)->type == kKinematicsInfo && content.size() >= kKinematicsBytes) {
      state.kinematics = kinematics_of(content);
    } else if ((*part)->type == kConfigurationData && content.size() >= kRobotTypeAt + 4) {
      state.robot_type = integer_at(content, kRobotTypeAt);
    }
    rest.remove_prefix((*part)->bytes);
  }
  return state;
}

std::string_view arm_name_of(int robot_type, int major_version) {
  const bool e_series = major_version >= 5;
  switch (robot_type) {
    case 1:
      return e_series ? "ur5e" : "ur5";
    case 2:
      return e_series ? "ur10e" : "ur10";
    case 3:
      return e_series ? "ur3e" : "ur3";
    default:
      return {};
  }
}

}  // namespace firstlook::ur
