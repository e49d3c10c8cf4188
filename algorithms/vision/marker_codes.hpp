/// The codes of square markers: which cells are white in the marker of a number.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

namespace firstlook {

/// Families of markers. `N x N _count` are ArUco's predefined ones as OpenCV numbers them, the AprilTag families are in
/// OpenCV's orientation, kArtoolkitPlusBch is ARToolKitPlus's BCH(36,12) with 4096 markers.
enum class MarkerDictionary : std::uint8_t {
  k4x4_50,
  k4x4_100,
  k4x4_250,
  k4x4_1000,
  k5x5_50,
  k5x5_100,
  k5x5_250,
  k5x5_1000,
  k6x6_50,
  k6x6_100,
  k6x6_250,
  k6x6_1000,
  k7x7_50,
  k7x7_100,
  k7x7_250,
  k7x7_1000,
  kArucoOriginal,
  kAprilTag16h5,
  kAprilTag25h9,
  kAprilTag36h10,
  kAprilTag36h11,
  kArtoolkitPlusBch,
};
inline constexpr int kMarkerDictionaries = 22;

struct MarkerFamily {
  std::string_view name;
  int bits = 0;         ///< cells of the code each way; a black border of one cell stands around them
  int count = 0;        ///< markers 0 to count - 1
  int correctable = 0;  ///< wrong cells that are forgiven: about half of what the code could correct
};

[[nodiscard]] const MarkerFamily& marker_family(MarkerDictionary dictionary);
[[nodiscard]] std::optional<MarkerDictionary> find_marker_dictionary(std::string_view name);

/// Cells of marker `id` (below the family's count), row by row from the upper left, the first in the highest of bits *
/// bits bits; 1 is white.
[[nodiscard]] std::uint64_t marker_code(MarkerDictionary dictionary, int id);

/// The same cells after a quarter turn of the marker clockwise.
[[nodiscard]] std::uint64_t turned_code(std::uint64_t code, int bits);

}  // namespace firstlook
