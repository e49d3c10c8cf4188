/// The objects depth_camera and time_offset of result.json.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "app/report/run_record.hpp"

namespace firstlook {

/// "given", "estimated" or "stored".
[[nodiscard]] std::string_view name_of(ValueSource source);

/// Pose of the depth camera on the colour camera with sigmas along and about the colour camera's axes (0 when taken as
/// exact), depth scale, and of an estimate how it moved, what it was made of, what it could not tell and whether what
/// was stated is contradicted. SI units unless the name says otherwise; members that only an estimate has are null
/// without one.
[[nodiscard]] nlohmann::json depth_camera_json(const DepthCameraRecord& record);

/// For `color` and `depth` what was added to the camera's stamps to have the arm's time (s), with its sigma.
[[nodiscard]] nlohmann::json time_offset_json(const AlignmentRecord& record);

}  // namespace firstlook
