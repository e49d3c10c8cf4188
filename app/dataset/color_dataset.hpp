/// The colour pictures of a recording in the TUM RGB-D layout, for the colours of its map.
#pragma once

#include <filesystem>
#include <vector>

#include "algorithms/mapping/color_registration.hpp"
#include "app/dataset/mapping_dataset.hpp"
#include "app/dataset/picture_file.hpp"

namespace firstlook {

/// The picture that belongs to a depth frame.
struct ColorPicture {
  int line = 0;                ///< of rgb.txt
  std::filesystem::path file;  ///< empty: there is none
};

struct ColorDataset {
  ColorSensor sensor;
  std::vector<ColorPicture> of_frame;  ///< one for each of MappingDataset::frames
  std::vector<RefusedLine> refused;    ///< lines of rgb.txt
  [[nodiscard]] std::size_t frames_without() const;
};

/// Reads rgb.txt of `folder`. A depth frame takes the picture with the nearest stamp, at most kPoseAssociation_s away;
/// the lines may come in any order. The colour camera is that of rgb_camera_info.yaml with its key `camera_T_depth`
/// {translation_m, quaternion_xyzw}; without that file depth is taken as registered to colour, as TUM's is: the same
/// intrinsics, the same place.
/// @param depth  of the same folder
/// @return kDataMissing without rgb.txt, kDataMalformed naming file and line; also when no frame has a picture
[[nodiscard]] Result<ColorDataset> read_color_dataset(const std::filesystem::path& folder, const MappingDataset& depth);

/// The pixels of a frame's picture.
/// @return kDataMissing or kDataMalformed, "rgb.txt:7: what is wrong"; also for another size than the colour camera's
[[nodiscard]] Result<ColorPixels> read_color_picture(const ColorDataset& dataset, const ColorPicture& picture);

}  // namespace firstlook
