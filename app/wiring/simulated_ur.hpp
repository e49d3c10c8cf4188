/// A simulated UR controller as the words of `firstlook ur-sim` ask for it, and that command.
#pragma once

#include <memory>

#include "app/cli/cli.hpp"
#include "hal/sim/scene.hpp"
#include "hal/sim/ur_controller/simulated_ur.hpp"

namespace firstlook {

/// @param scene  the cell whose arm it is: the same robot whatever the seed, which stands as that does and whose
/// encoders
///               are as noisy; null: it is alone
/// Errors: those of the programs' files, and kUsage for words that are not understood.
[[nodiscard]] Result<std::unique_ptr<sim::ur::SimulatedUr>> make_simulated_ur(const UrSimCommand& command,
                                                                              const sim::Scene* scene);

/// `firstlook ur-sim`. @return the exit code
int run_ur_sim(const UrSimCommand& command);

}  // namespace firstlook
