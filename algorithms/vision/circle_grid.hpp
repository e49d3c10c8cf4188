/// Finds grids of dark discs, symmetric and asymmetric, in a grey image.
#pragma once

#include "algorithms/vision/target.hpp"

namespace firstlook {

/// Centres of all circles of the target, where the centre of the disc is seen (not the centre of its image, which
/// perspective moves by up to some tenths of a pixel).
/// @return kBoardNotFound when the grid is not seen whole; kConfigBadValue, kDataMalformed, kOutOfMemory as
/// detect_checkerboard
[[nodiscard]] Result<CornerSet> detect_circle_grid(GrayImage image, const BoardSpec& board);

}  // namespace firstlook
