/// Cells from YAML, built in or the user's own.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "hal/sim/scene.hpp"
#include "platform/core/result.hpp"

namespace firstlook::sim {

/// The cell of a name (`built_in_cell_names`, "random:SEED") or of a YAML file. `seed` is the run's: it turns and
/// shifts the true camera mount a little, so that no two seeds have the same answer. Errors: kDataMissing for a file
/// that cannot be opened, kCellInvalid (with line and column) for one that cannot be used.
[[nodiscard]] Result<Scene> load_cell(std::string_view name_or_file, std::uint64_t seed);

/// The same from YAML text; `name` stands in front of errors and becomes the scene's name. Keys: hal/sim/README.md.
[[nodiscard]] Result<Scene> parse_cell(std::string_view yaml, const std::string& name, std::uint64_t seed);

/// Says why the arm could not work here: a solid other than a board within the safe zone. kCellInvalid.
[[nodiscard]] Status check_cell(const Scene& scene);

}  // namespace firstlook::sim
