/// The report's pictures of the map: what is drawn, from where, and what is marked in them.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "algorithms/mapping/voxel_map.hpp"
#include "app/report/run_record.hpp"

namespace firstlook {

/// A place that the camera looked from, in base.
struct CameraPlace {
  std::string phase;  ///< as in MappingViewRecord
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d ahead = Eigen::Vector3d::Zero();  ///< unit vector, where it looked
};

struct MapPictureInputs {
  const VoxelMap& map;                                     ///< at the end
  const VoxelMap* swept = nullptr;                         ///< as the sweep left it; null when the sweep did not end
  std::span<const std::uint8_t> zone;                      ///< one byte for each voxel, not 0 in the reach of the arm
  std::span<const CameraPlace> places;                     ///< in order; their numbers are those of views.csv
  std::vector<std::array<Eigen::Vector3d, 4>> boards_m{};  ///< outermost corners of each, in base
};

/// A part of the cell that has a name, as a box in base.
struct NamedPart {
  std::string name;
  Eigen::Vector3d low_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d high_m = Eigen::Vector3d::Zero();
};

/// The whole map from two sides with the camera's path; the numbered views from above; what was unknown before
/// exploration and at the end, in space and as layers.
[[nodiscard]] std::vector<MapPicture> map_pictures(const MapPictureInputs& inputs);

/// A layer through the middle of a part, before exploration and at the end (thesis, figures 11-9 and 11-10). Empty when
/// the sweep did not end or the part lies outside the map.
/// @param after_sweep, at_end  what the captions say beside "before exploration" and "at the end"
[[nodiscard]] std::vector<MapPicture> part_pictures(const MapPictureInputs& inputs, const NamedPart& part,
                                                    const std::string& after_sweep, const std::string& at_end);

}  // namespace firstlook
