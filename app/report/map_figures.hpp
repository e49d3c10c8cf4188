/// The pictures of the map as figures of the page.
#pragma once

#include <span>
#include <string>

#include "app/report/run_record.hpp"

namespace firstlook {

/// Every picture with its marks as an SVG that a click enlarges, in groups as they come. Pictures whose size and pixels
/// do not agree are left out. @param first_number  of the figures' anchors: figures of one page must differ
[[nodiscard]] std::string map_figures(std::span<const MapPicture> pictures, int first_number = 1);

}  // namespace firstlook
