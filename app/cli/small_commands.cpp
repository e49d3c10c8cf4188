#include "app/cli/small_commands.hpp"

#include <charconv>
#include <cstdio>

#include "app/cli/exit_codes.hpp"
#include "platform/core/fault_table.hpp"

namespace firstlook {
namespace {

std::string_view severity_text(Severity severity) {
  switch (severity) {
    case Severity::kNotice:
      return "notice: the job goes on";
    case Severity::kRefusal:
      return "refusal: nothing is started, or the job ends with what it has";
    case Severity::kStop:
      return "stop: the arm stops and a person decides";
    case Severity::kInternal:
      return "internal: a fault of the program";
  }
  return "";
}

}  // namespace

// The build's version; CMakeLists.txt and this line change together (tests/unit/app/config_test.cpp compares them).
std::string version_text() { return "0.1.0"; }

int run_explain_command(const std::string& code) {
  const std::string digits = !code.empty() && (code[0] == 'E' || code[0] == 'e') ? code.substr(1) : code;
  int number = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  const bool whole = error == std::errc{} && end == digits.data() + digits.size();
  const std::optional<FaultRow> row = whole ? find_fault(number) : std::nullopt;
  if (!row) {
    fmt::print(stderr, "{}: no such code. Known are:\n", code);
    for (const FaultRow& known : fault_table()) {
      fmt::print(stderr, "  E{} {}\n", static_cast<int>(known.fault), known.text);
    }
    return kExitUsage;
  }
  fmt::print("E{} {}\n  {}\n  What to do: {}\n", number, row->text, severity_text(row->severity), row->remedy);
  return kExitDone;
}

int run_config_command(const ConfigCommandOptions& options) {
  if (options.defaults) {
    fmt::print("{}", print_config(Config{}));
    return kExitDone;
  }
  const Result<LoadedConfig> loaded = load_config(options.sources);
  if (!loaded) {
    fmt::print(stderr, "{}\n", describe(loaded.error()));
    return kExitData;
  }
  fmt::print("{}", print_config(loaded->config));
  return kExitDone;
}

}  // namespace firstlook
