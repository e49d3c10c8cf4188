/// The touch_test object of result.json.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>

#include "algorithms/calibration/touch_test.hpp"

namespace firstlook {

/// Null without a touch test. Errors are eq. 8-6 of the thesis in the camera's axes: mm, mrad about the axes.
[[nodiscard]] nlohmann::json touch_test_json(const std::optional<TouchTest>& test);

}  // namespace firstlook
