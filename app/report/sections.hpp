/// The sections of report.html, in their order. Each gives HTML; one that has nothing to say gives an empty text or
/// says why it is empty.
#pragma once

#include <string>

#include "app/report/run_record.hpp"

namespace firstlook {

/// Views of the board that a page shows as figures; the charts have all of them.
inline constexpr std::size_t kViewsShownMax = 60;

[[nodiscard]] std::string summary_section(const RunRecord& record);     ///< verdict, key figures, time line
[[nodiscard]] std::string verification_table(const RunRecord& record);  ///< in place of the quality of a solve
[[nodiscard]] std::string alignment_table(const RunRecord& record);     ///< depth camera and stamps; empty without
[[nodiscard]] std::string hand_eye_section(const RunRecord& record);
[[nodiscard]] std::string touch_test_section(const RunRecord& record);  ///< empty without a touch test
[[nodiscard]] std::string calibration_views_section(const RunRecord& record);
[[nodiscard]] std::string solver_comparison_section(const RunRecord& record);
[[nodiscard]] std::string map_section(const RunRecord& record);
[[nodiscard]] std::string mapping_views_section(const RunRecord& record);
[[nodiscard]] std::string remaining_section(const RunRecord& record);
[[nodiscard]] std::string safety_section(const RunRecord& record);
[[nodiscard]] std::string truth_section(const RunRecord& record);
[[nodiscard]] std::string memory_section(const RunRecord& record);
[[nodiscard]] std::string provenance_section(const RunRecord& record);
[[nodiscard]] std::string wall_section(const RunRecord& record);  ///< the only one that reads record.wall

}  // namespace firstlook
