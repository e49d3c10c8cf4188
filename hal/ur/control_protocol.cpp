#include "hal/ur/control_protocol.hpp"

#include <cmath>

namespace firstlook::ur {
namespace {

void put(Command& command, std::int32_t value) { command.number(static_cast<std::uint32_t>(value), 4); }

/// UrArm has looked that it fits.
void put_micro(Command& command, double value) { put(command, static_cast<std::int32_t>(std::lround(value * 1e6))); }

Command begin(CommandKind kind, std::int32_t number) {
  Command command;
  put(command, kCommandMark);
  put(command, static_cast<std::int32_t>(kind));
  put(command, number);
  return command;
}

}  // namespace

Command plain_command(CommandKind kind, std::int32_t number) {
  Command command = begin(kind, number);
  for (std::size_t i = 3; i < kCommandNumbers; ++i) put(command, 0);
  return command;
}

Command move_command(const hal::Segment& segment) {
  Command command = begin(CommandKind::kMove, static_cast<std::int32_t>(segment.number));
  for (int j = 0; j < 6; ++j) put_micro(command, segment.target_rad[j]);
  put_micro(command, segment.speed_rad_s);
  put_micro(command, segment.acceleration_rad_s2);
  return command;
}

std::optional<ProgramReport> cut_report(std::string_view received) {
  if (received.size() < ProgramReport::kBytes) return std::nullopt;
  return ProgramReport{static_cast<ReportKind>(integer_at(received, 0)), integer_at(received, 4)};
}

}  // namespace firstlook::ur
