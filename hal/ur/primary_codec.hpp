/// The primary interface of a UR controller: packets cut from its stream, and of them what firstlook reads. Pure, in
/// fixed memory, and safe with whatever bytes come. UR's client interface tables; all numbers big-endian.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "platform/core/fixed_vector.hpp"
#include "platform/core/result.hpp"

namespace firstlook::ur {

inline constexpr std::uint8_t kPrimaryState = 16;
inline constexpr std::uint8_t kPrimaryMessage = 20;

struct PrimaryPacket {
  std::uint8_t type = 0;
  std::string_view content;  ///< into the bytes that it was cut from
  std::size_t bytes = 0;     ///< of the whole packet
};
/// The packet that a stream begins with, or the sub-package that a robot state's content begins with; empty when more
/// bytes are needed. Error: kLinkLost for a size below its own header or beyond 64 KiB: the stream is out of step.
[[nodiscard]] Result<std::optional<PrimaryPacket>> primary_cut(std::string_view received);

struct ControllerVersion {
  int major = 0, minor = 0, bugfix = 0, build = 0;
};
/// Of a message packet; empty when it is another message, or too short.
[[nodiscard]] std::optional<ControllerVersion> version_message(const PrimaryPacket& packet);

/// One joint's row as the factory measured it: standard DH, metres and radians, added to the joint's angle.
struct KinematicsRow {
  double theta_rad = 0, d_m = 0, a_m = 0, alpha_rad = 0;
};
struct Kinematics {
  std::array<std::uint32_t, 6> checksums{};
  std::array<KinematicsRow, 6> rows{};
  bool operator==(const Kinematics& other) const { return checksums == other.checksums; }
};

/// What a robot state tells of the robot itself; empty: not in this packet.
struct PrimaryState {
  std::optional<int> robot_mode{};
  std::optional<int> safety_mode{};
  std::optional<Kinematics> kinematics{};
  std::optional<int> robot_type{};
  std::optional<std::array<double, 6>> tcp_offset{};  ///< flange_T_tcp: metres, rotation vector
};
/// Error: kLinkLost for sub-packages that do not fit into it.
[[nodiscard]] Result<PrimaryState> primary_state(const PrimaryPacket& packet);

/// The name that ArmModel has for a robot type in a controller of this generation; empty for one that firstlook does
/// not know.
[[nodiscard]] std::string_view arm_name_of(int robot_type, int major_version);

}  // namespace firstlook::ur
