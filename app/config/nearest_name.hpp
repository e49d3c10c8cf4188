/// The known name that somebody who mistyped probably meant.
#pragma once

#include <cstddef>
#include <span>
#include <string_view>

namespace firstlook {

/// Insertions, deletions, replacements and swaps of neighbours that turn `a` into `b` (optimal string alignment).
[[nodiscard]] std::size_t edit_distance(std::string_view a, std::string_view b);

/// The name nearest to `given`, the first of equals. Names with dots are also compared by their last part, so that a
/// key in the wrong section is found. `names` must not be empty.
[[nodiscard]] std::string_view nearest_name(std::string_view given, std::span<const std::string_view> names);

}  // namespace firstlook
