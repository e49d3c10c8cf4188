/// From where boards were seen, and from where they were not though they should have been: something hides them there.
#pragma once

#include <cstdint>
#include <span>

#include "algorithms/calibration/view_design.hpp"

namespace firstlook {

/// A look that should have shown boards.
struct BoardLookOutcome {
  Transform<Base, Flange> base_T_flange;
  std::uint32_t expected = 0;  ///< bit masks of models
  std::uint32_t seen = 0;
};

/// How likely model number `k` of a view from `base_T_flange` is not hidden, in (0, 1): 0.8 where nobody looked yet,
/// less beside lines of sight that failed, more beside those that did not. A line that failed says less about one that
/// ends nearer to the board, one that succeeded less about one that ends farther off.
[[nodiscard]] double sight_likelihood(const ViewDesignModel& model, std::size_t k,
                                      const Transform<Base, Flange>& base_T_flange,
                                      std::span<const BoardLookOutcome> looks);

}  // namespace firstlook
