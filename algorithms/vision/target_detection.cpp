#include "algorithms/vision/target_detection.hpp"

#include "algorithms/vision/circle_grid.hpp"
#include "algorithms/vision/square_markers.hpp"

namespace firstlook {

Result<CornerSet> detect_target(GrayImage image, const BoardSpec& board, const DetectionOptions& options) {
  switch (board.type) {
    case TargetType::kCheckerboard:
      return detect_checkerboard(image, board, options);
    case TargetType::kCircles:
    case TargetType::kAsymmetricCircles:
      return detect_circle_grid(image, board);
    default:
      return detect_marker_target(image, board);
  }
}

}  // namespace firstlook
