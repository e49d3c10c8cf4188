/// A scripted pendant that remembers every line it was shown.
#pragma once

#include <string>
#include <vector>

#include "tests/support/mock_operator.hpp"

namespace firstlook::mock {

class MockPendant final : public hal::Pendant {
 public:
  ScriptedPresses keys;
  std::vector<std::string> lines;

  [[nodiscard]] std::optional<hal::OperatorEvent> poll(Instant now) override { return keys.poll(now); }
  [[nodiscard]] Instant next_due() const override { return keys.next_due(); }
  void show(std::string_view line) override { lines.emplace_back(line); }
};

}  // namespace firstlook::mock
