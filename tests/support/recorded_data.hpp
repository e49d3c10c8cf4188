/// Writing recorded calibration data for tests: the folder, and the lines of its files.
#pragma once

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <fstream>
#include <iterator>
#include <string>

#include "platform/core/camera_intrinsics.hpp"
#include "platform/core/transform.hpp"
#include "tests/support/temporary_folder.hpp"

namespace firstlook::test {

/// A folder of one test with text files.
class DataFolder : public TemporaryFolder {
 public:
  DataFolder() : TemporaryFolder("firstlook-calibration") {}
  void write(const std::string& name, const std::string& text) const { std::ofstream(path() / name) << text; }
  [[nodiscard]] std::string read(const std::string& name) const {
    std::ifstream stream(path() / name, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }
};

inline const std::string kPosesHeader = "image,x,y,z,qx,qy,qz,qw\n";

/// x,y,z,qx,qy,qz,qw
inline std::string numbers(const Pose& pose) {
  const Eigen::Quaterniond q(pose.linear());
  const Eigen::Vector3d t = pose.translation();
  return fmt::format("{:.12g},{:.12g},{:.12g},{:.12g},{:.12g},{:.12g},{:.12g}", t.x(), t.y(), t.z(), q.x(), q.y(),
                     q.z(), q.w());
}

/// camera_info.yaml
inline std::string camera_yaml(const CameraIntrinsics& c) {
  return fmt::format(
      "image_width: {}\nimage_height: {}\ncamera_matrix: {{rows: 3, cols: 3, data: [{}, 0, {}, 0, {}, {}, 0, 0, 1]}}\n"
      "distortion_model: plumb_bob\ndistortion_coefficients: {{rows: 1, cols: 5, data: [{}, {}, {}, {}, {}]}}\n",
      c.width, c.height, c.fx, c.cx, c.fy, c.cy, c.k1, c.k2, c.p1, c.p2, c.k3);
}

/// A row of corners.csv of one board, checkerboards' corners numbered row by row.
inline std::string corner_row(int image, int corner, int columns, const Eigen::Vector2d& px) {
  return fmt::format("{}.png,{},{},{:.9g},{:.9g}\n", image, corner % columns, corner / columns, px.x(), px.y());
}

}  // namespace firstlook::test
