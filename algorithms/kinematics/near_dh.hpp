/// A DH table whose frames lie near the links, for an arm that was measured with ones far away.
#pragma once

#include <array>

#include "algorithms/kinematics/arm_model.hpp"

namespace firstlook {

struct NearDh {
  std::array<DhRow, kJointsMax> dh{};
  double rms_m = 0, rms_rad = 0;      ///< of the flange, from where the measured table has it
  double worst_m = 0, worst_rad = 0;  ///< over the configurations that were tried
};

/// The table nearest to `measured` in where it puts the flange, with frames near those of `published`. Two axes that
/// are measured to be parallel but for some tenths of a milliradian have their common normal metres or hundreds of
/// metres along them: such a table is exact at the flange and useless for the links, whose frames it puts there. DH
/// rows near the links cannot tilt one such axis against the next about the link's own y, so something remains: it is
/// told. Least squares over random configurations (Levenberg-Marquardt on theta, d, a, alpha of each joint). Some
/// milliseconds; allocates.
[[nodiscard]] NearDh near_dh(const ArmModel& published, const std::array<DhRow, kJointsMax>& measured);

}  // namespace firstlook
