/// The report's diagrams, as SVG text to put into a page.
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "app/report/run_record.hpp"

namespace firstlook {

/// Unknown, free and occupied voxels against the number of the view (thesis, figure 11-8). Empty without views.
[[nodiscard]] std::string voxel_chart(std::span<const MappingViewRecord> views);

/// Reprojection RMS of each calibration view as bars: solved with it, and held out of the solve.
[[nodiscard]] std::string view_rms_chart(std::span<const CalibrationViewRecord> views);

/// Every corner's reprojection error (detected - reprojected, px) as a dot, with circles at round distances.
[[nodiscard]] std::string residual_chart(std::span<const CalibrationViewRecord> views);

/// The phases of the job on a time line, without those that were only passed through. Empty when none is left.
[[nodiscard]] std::string phase_chart(std::span<const PhaseRecord> phases);

/// The peak of each pool inside what it reserves, and all of them inside the budget; declared rows in grey.
[[nodiscard]] std::string memory_chart(const MemoryRecord& memory);

/// The boxes of some figures of every solver's transforms (thesis, figures 8-2 and 8-3), one panel for each figure,
/// side by side. What lies far from where most solvers are stands as an arrow on the panel's rim.
[[nodiscard]] std::string solver_box_chart(const SolverComparison& comparison, std::span<const PoseFigure> figures,
                                           std::string_view label);

/// A calibration picture with detected (rings) and reprojected (crosses) corners. `jpeg_base64` may be empty: then the
/// corners stand on a plain ground. Sizes in px of the camera's frame; `picture_*` is the part that the picture covers.
struct CornerPicture {
  int width = 0, height = 0;
  double picture_width = 0, picture_height = 0;
  std::string jpeg_base64;
};
[[nodiscard]] std::string corner_picture(const CalibrationViewRecord& view, const CornerPicture& picture);

}  // namespace firstlook
