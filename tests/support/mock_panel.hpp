/// A scripted panel that remembers every light.
#pragma once

#include <vector>

#include "tests/support/mock_operator.hpp"

namespace firstlook::mock {

class MockPanel final : public hal::Panel {
 public:
  ScriptedPresses keys;
  std::vector<hal::Light> lights;

  [[nodiscard]] std::optional<hal::OperatorEvent> poll(Instant now) override { return keys.poll(now); }
  [[nodiscard]] Instant next_due() const override { return keys.next_due(); }
  void light(hal::Light color) override { lights.push_back(color); }
};

}  // namespace firstlook::mock
