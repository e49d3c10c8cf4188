#include "hal/ur/control_protocol.hpp"

#include <array>
#include <cmath>

namespace firstlook::ur {
namespace {

/// The numbers of a command but for the sum.
using Numbers = std::array<std::int32_t, kCommandNumbers - 1>;

Command with_sum(const Numbers& numbers) {
  Command command;
  std::int32_t sum = 0;
  for (const std::int32_t number : numbers) {
    command.number(static_cast<std::uint32_t>(number), 4);
    sum += number;
  }
  command.number(static_cast<std::uint32_t>(sum), 4);
  return command;
}

/// UrRobot has looked that it fits.
std::int32_t micro(double value) { return static_cast<std::int32_t>(std::lround(value * 1e6)); }

}  // namespace

Command plain_command(CommandKind kind, std::int32_t number) {
  return with_sum({kCommandMark, static_cast<std::int32_t>(kind), number});
}

Command move_command(const hal::Segment& segment) {
  Numbers numbers{kCommandMark, static_cast<std::int32_t>(CommandKind::kMove),
                  static_cast<std::int32_t>(segment.number)};
  for (int j = 0; j < 6; ++j) numbers[3 + static_cast<std::size_t>(j)] = micro(segment.target_rad[j]);
  numbers[9] = micro(segment.speed_rad_s);
  numbers[10] = micro(segment.acceleration_rad_s2);
  return with_sum(numbers);
}

std::optional<ProgramReport> cut_report(std::string_view received) {
  if (received.size() < ProgramReport::kBytes) return std::nullopt;
  return ProgramReport{static_cast<ReportKind>(integer_at(received, 0)), integer_at(received, 4)};
}

}  // namespace firstlook::ur
