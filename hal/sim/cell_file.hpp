/// Cells from YAML, built in or the user's own.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

#include "hal/sim/scene.hpp"
#include "platform/core/result.hpp"

namespace firstlook::sim {

/// Arms that come from files, which this folder does not read itself.
struct ArmChoice {
  std::string file;  ///< of an arm that takes the place of the cell's own; empty: there is none
  /// Reads the file of an arm. Empty: a cell that names one is refused.
  std::function<Result<ArmModel>(const std::string& path)> load;
};

/// The cell of a name (`built_in_cell_names`, "random:SEED") or of a YAML file. `seed` is the run's: it turns and
/// shifts the true camera mount a little, so that no two seeds have the same answer. Errors: kDataMissing for a file
/// that cannot be opened, kCellInvalid (with line and column) for one that cannot be used; those of ArmChoice::load.
/// With an arm in place of the cell's own, that arm starts where it says itself and its last link carries the camera.
[[nodiscard]] Result<Scene> load_cell(std::string_view name_or_file, std::uint64_t seed, const ArmChoice& arm = {});

/// The same from YAML text; `name` stands in front of errors and becomes the scene's name. Keys: hal/sim/README.md.
[[nodiscard]] Result<Scene> parse_cell(std::string_view yaml, const std::string& name, std::uint64_t seed,
                                       const ArmChoice& arm = {});

/// Says why the arm could not work here: a solid other than a board within the safe zone. kCellInvalid.
[[nodiscard]] Status check_cell(const Scene& scene);

}  // namespace firstlook::sim
