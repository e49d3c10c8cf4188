/// What firstlook and its program on the robot say to each other: whole 32-bit numbers, big-endian, as URScript's
/// socket functions send and read them. Pure.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "hal/api/robot_arm.hpp"
#include "hal/ur/bytes.hpp"

namespace firstlook::ur {

/// Changes when either side would misunderstand the other.
inline constexpr std::int32_t kControlProtocol = 1;
/// Begins every command: a program that finds something else has lost its place in the stream, and ends.
inline constexpr std::int32_t kCommandMark = 5310;

/// To the robot: kCommandMark, kind, number, six joint angles (µrad), speed and acceleration (µrad/s, µrad/s²), and the
/// sum of all these, which tells a command that was cut or mixed up.
enum class CommandKind : std::int32_t {
  kStay = 0,    ///< nothing new; that it comes says that firstlook is there
  kMove = 1,    ///< movej to the joints; the number is the segment's
  kStop = 2,    ///< brake, and report kStopped with this number
  kEnd = 3,     ///< end the program
  kRefuse = 4,  ///< the same, and tell the person at the pendant that the versions do not fit
};
inline constexpr std::size_t kCommandNumbers = 12;
inline constexpr std::int32_t kNumberMax = 1'000'000'000;  ///< of a segment or stop: sums fit 32 bits
using Command = Message<4 * kCommandNumbers>;
[[nodiscard]] Command plain_command(CommandKind kind, std::int32_t number);
[[nodiscard]] Command move_command(const hal::Segment& segment);

/// From the robot: kind and number.
enum class ReportKind : std::int32_t {
  kHello = 1,     ///< the first on a connection for commands; the number is the program's protocol
  kText = 2,      ///< the first on a connection for lines of text; the same
  kAccepted = 3,  ///< the segment begins
  kDone = 4,      ///< the segment's movej has returned
  kStopped = 5,   ///< the arm stands, by the command of this number
};
struct ProgramReport {
  static constexpr std::size_t kBytes = 8;
  ReportKind kind = ReportKind::kHello;
  std::int32_t number = 0;
};
/// The report that a stream begins with; empty when more bytes are needed. Of kinds that nobody knows, too: who reads
/// decides.
[[nodiscard]] std::optional<ProgramReport> cut_report(std::string_view received);

}  // namespace firstlook::ur
