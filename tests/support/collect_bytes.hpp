/// What a writer puts into its ByteSink, as one string.
#pragma once

#include <cstddef>
#include <span>
#include <string>

namespace firstlook {

template <typename Write>
[[nodiscard]] std::string collect(Write write) {
  std::string text;
  write([&](std::span<const std::byte> bytes) {
    text.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  });
  return text;
}

}  // namespace firstlook
