/// The same problem as solve_bundle, solved by Ceres.
#pragma once

#include "algorithms/calibration/bundle.hpp"

namespace firstlook::test {

/// Arguments and result as of solve_bundle. Numbers must be finite.
[[nodiscard]] Status solve_bundle_with_ceres(std::span<const BoardSpec> boards, std::span<const BundleView> views,
                                             const BundleNoise& noise, const IntrinsicsBelief& intrinsics,
                                             int iterations_max, BundleState& state);

}  // namespace firstlook::test
