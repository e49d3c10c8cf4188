/// The numbers of a pinhole camera with plumb-bob distortion, as camera_info.yaml has them.
#pragma once

namespace firstlook {

/// Pixel centres at integers; u = fx x'' + cx, v = fy y'' + cy with the distorted normalised point (x'', y'')
/// (Brown 1966; the order of coefficients is OpenCV's and ROS plumb_bob's: k1 k2 p1 p2 k3).
struct CameraIntrinsics {
  int width = 0;
  int height = 0;
  double fx = 0, fy = 0, cx = 0, cy = 0;  ///< px
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;
  bool operator==(const CameraIntrinsics&) const = default;
};

}  // namespace firstlook
