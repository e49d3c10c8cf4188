/// Numbers in YAML that every reader takes for numbers.
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <string>

namespace firstlook {

/// The shortest text that reads back to the same bits. A mantissa always has its point: YAML 1.1 (PyYAML, so most of
/// ROS) takes 1e-05 for a word and 1.0e-05 for a number, and nan for a word and .nan for a number.
[[nodiscard]] inline std::string yaml_number(double value) {
  if (std::isnan(value)) return ".nan";
  if (std::isinf(value)) return value > 0 ? ".inf" : "-.inf";
  std::string text = fmt::format("{}", value + 0.0);  // -0 prints as "-0"; adding 0 makes it plain
  const std::size_t exponent = text.find('e');
  if (exponent != std::string::npos && text.find('.') == std::string::npos) text.insert(exponent, ".0");
  return text;
}

}  // namespace firstlook
