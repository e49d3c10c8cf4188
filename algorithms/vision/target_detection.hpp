/// Finds a target of any type in a grey image.
#pragma once

#include <optional>
#include <string_view>

#include "algorithms/vision/checkerboard.hpp"

namespace firstlook {

/// Points of the target in the image: all of them, or, for targets that allow it, those that are seen.
/// @return kBoardNotFound, kConfigBadValue, kDataMalformed, kOutOfMemory as the detectors of the types
[[nodiscard]] Result<CornerSet> detect_target(GrayImage image, const BoardSpec& board,
                                              const DetectionOptions& options = {});

}  // namespace firstlook
