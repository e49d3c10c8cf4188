/// The cells that come with the program, as YAML text of the same schema as the user's.
#pragma once

#include <optional>
#include <span>
#include <string_view>

namespace firstlook::sim {

struct BuiltInCell {
  std::string_view name;
  std::string_view yaml;
};

/// empty, workshop, machine_tending, cluttered, hall, two_joint, pr2_like.
[[nodiscard]] std::span<const BuiltInCell> built_in_cells();
[[nodiscard]] std::optional<BuiltInCell> find_built_in_cell(std::string_view name);

}  // namespace firstlook::sim
