/// Values for errors that can happen in operation. Programmer errors are ENSURE (ensure.hpp).
#pragma once

#include <fmt/format.h>

#include <array>
#include <expected>
#include <string>
#include <string_view>
#include <utility>

#include "platform/core/fault_table.hpp"

namespace firstlook {

/// What went wrong: a row of the fault table, and what and where in words. Trivially copyable; never allocates.
struct Error {
  Fault fault = Fault::kInternal;
  std::array<char, 232> text{};  ///< zero-terminated, cut when too long

  [[nodiscard]] std::string_view detail() const { return {text.data()}; }
};

template <typename T>
using Result = std::expected<T, Error>;
using Status = Result<void>;

/// An error with its detail formatted in place, e.g. `return failure(Fault::kDataMissing, "{}: no such file", path);`
template <typename... Args>
[[nodiscard]] std::unexpected<Error> failure(Fault fault, fmt::format_string<Args...> format, Args&&... args) {
  Error error;
  error.fault = fault;
  const auto end = fmt::format_to_n(error.text.data(), error.text.size() - 1, format, std::forward<Args>(args)...).out;
  *end = '\0';
  return std::unexpected(error);
}

/// "E6102 poses.csv:3: x is not a number" followed by the remedy of the fault table on a second line.
[[nodiscard]] std::string describe(const Error& error);

}  // namespace firstlook
