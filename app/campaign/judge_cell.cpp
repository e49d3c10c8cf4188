#include "app/campaign/judge_cell.hpp"

#include <fmt/format.h>

namespace firstlook {
namespace {

constexpr std::size_t kReasonMax = 300;
constexpr int kExitData = 3;

/// The exit codes of `firstlook run` (DESIGN 12); a fault of a device that is missing has one of its own.
bool exit_code_fits(CellOutcome outcome, int exit_code) {
  switch (outcome) {
    case CellOutcome::kDone:
      return exit_code == 0;
    case CellOutcome::kCalibrationRejected:
      return exit_code == 5;
    case CellOutcome::kSafelyStopped:
      return exit_code == 6;
    default:
      return exit_code == 4 || exit_code == 70;
  }
}

/// The last line that says something, cut to a reason's length; the remedy below an error belongs to it.
std::string last_words(std::string_view console) {
  while (!console.empty() && (console.back() == '\n' || console.back() == ' ')) console.remove_suffix(1);
  const std::size_t named = console.rfind("firstlook: ");
  const std::size_t line = console.rfind('\n');
  const std::size_t begin = named != std::string_view::npos ? named : line == std::string_view::npos ? 0 : line + 1;
  std::string words(console.substr(begin, kReasonMax));
  for (char& c : words) {
    if (c == '\n') c = ' ';
  }
  return words;
}

std::string with_last_words(std::string reason, std::string_view console) {
  const std::string words = last_words(console);
  return words.empty() ? reason : fmt::format("{}; it said last: {}", reason, words);
}

CellRecord ended_badly(CellOutcome outcome, const std::string& reason, const CellTraces& traces) {
  CellRecord cell;
  cell.outcome = outcome;
  cell.reason = with_last_words(reason, traces.console);
  return cell;
}

}  // namespace

Result<CellRecord> judge_cell(const CellTraces& traces, std::int64_t seed) {
  if (traces.at_limit && traces.end.signal != 0) {
    return ended_badly(CellOutcome::kHung, fmt::format("not at its end after {:g} s", traces.limit_s), traces);
  }
  if (traces.end.signal != 0) {
    return ended_badly(CellOutcome::kCrashed,
                       fmt::format("signal {} ({})", traces.end.signal, signal_name(traces.end.signal)), traces);
  }
  if (traces.end.exit_code == kExitData &&
      traces.console.find(fmt::format("E{}", static_cast<int>(Fault::kDiskWrite))) != std::string::npos) {
    return failure(Fault::kDiskWrite, "the run with seed {}: {}", seed, last_words(traces.console));
  }
  const std::string code = fmt::format("exit code {}", traces.end.exit_code);
  if (!traces.result_json) return ended_badly(CellOutcome::kFailed, code + " and no result.json", traces);
  Result<CellResult> result = read_cell_result(*traces.result_json);
  if (!result) return ended_badly(CellOutcome::kFailed, fmt::format("{}; {}", code, result.error().detail()), traces);
  if (!exit_code_fits(result->outcome, traces.end.exit_code)) {
    return ended_badly(CellOutcome::kFailed, fmt::format("{}, but result.json says {}", code, name_of(result->outcome)),
                       traces);
  }
  if (result->seed != seed) {
    return ended_badly(CellOutcome::kFailed, fmt::format("result.json is of seed {}", result->seed), traces);
  }
  CellRecord cell;
  cell.outcome = result->outcome;
  cell.reason = std::move(result->reason);
  cell.figures = result->figures;
  cell.decisions_hash = std::move(result->decisions_hash);
  cell.remaining = std::move(result->remaining);
  return cell;
}

}  // namespace firstlook
