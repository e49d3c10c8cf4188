#include "algorithms/vision/marker_codes.hpp"

#include <span>

#include "algorithms/vision/marker_tables.hpp"
#include "platform/core/ensure.hpp"

namespace firstlook {
namespace {

struct Family {
  MarkerFamily facts;
  std::span<const std::uint64_t> codes;  ///< empty: computed
};

// ArUco: half of OpenCV's maxCorrectionBits, rounded down to its default rate of 0.6. AprilTag: below half of (distance
// - 1) / 2, since a wrong marker costs more than a missed one.
using namespace marker_tables;  // NOLINT(google-build-using-namespace): one table below
const std::array<Family, kMarkerDictionaries> kFamilies = {{{{"4x4_50", 4, 50, 0}, kAruco4x4},
                                                            {{"4x4_100", 4, 100, 0}, kAruco4x4},
                                                            {{"4x4_250", 4, 250, 0}, kAruco4x4},
                                                            {{"4x4_1000", 4, 1000, 0}, kAruco4x4},
                                                            {{"5x5_50", 5, 50, 1}, kAruco5x5},
                                                            {{"5x5_100", 5, 100, 1}, kAruco5x5},
                                                            {{"5x5_250", 5, 250, 1}, kAruco5x5},
                                                            {{"5x5_1000", 5, 1000, 1}, kAruco5x5},
                                                            {{"6x6_50", 6, 50, 3}, kAruco6x6},
                                                            {{"6x6_100", 6, 100, 3}, kAruco6x6},
                                                            {{"6x6_250", 6, 250, 3}, kAruco6x6},
                                                            {{"6x6_1000", 6, 1000, 2}, kAruco6x6},
                                                            {{"7x7_50", 7, 50, 5}, kAruco7x7},
                                                            {{"7x7_100", 7, 100, 4}, kAruco7x7},
                                                            {{"7x7_250", 7, 250, 4}, kAruco7x7},
                                                            {{"7x7_1000", 7, 1000, 3}, kAruco7x7},
                                                            {{"aruco_original", 5, 1024, 0}, kArucoOriginal},
                                                            {{"apriltag_16h5", 4, 30, 0}, kAprilTag16h5},
                                                            {{"apriltag_25h9", 5, 35, 2}, kAprilTag25h9},
                                                            {{"apriltag_36h10", 6, 2320, 2}, kAprilTag36h10},
                                                            {{"apriltag_36h11", 6, 587, 3}, kAprilTag36h11},
                                                            {{"artoolkitplus_bch", 6, 4096, 2}, {}}}};

/// Product of two polynomials over GF(2), coefficient of x^i in bit i.
constexpr std::uint64_t times(std::uint64_t a, std::uint64_t b) {
  std::uint64_t product = 0;
  for (int i = 0; i < 32; ++i) {
    if (((b >> i) & 1U) != 0) product ^= a << i;
  }
  return product;
}

/// ARToolKitPlus (Wagner and Schmalstieg 2007): the BCH code of length 63 that corrects 4 errors, shortened to 36 bits;
/// the number in the 12 highest, then the 24 check bits. Its generator has the roots a, a^3, a^5, a^7 of GF(64) with
/// a^6 = a + 1. All is inverted by a mask, so that no marker is plain.
std::uint64_t bch_code(int id) {
  constexpr std::uint64_t kGenerator = times(times(0x43, 0x57), times(0x67, 0x49));
  constexpr std::uint64_t kMask = 0x8f80b8750;
  const std::uint64_t data = static_cast<std::uint64_t>(id) << 24;
  std::uint64_t rest = data;
  for (int bit = 35; bit >= 24; --bit) {
    if (((rest >> bit) & 1U) != 0) rest ^= kGenerator << (bit - 24);
  }
  return (data | rest) ^ kMask;
}

}  // namespace

const MarkerFamily& marker_family(MarkerDictionary dictionary) {
  return kFamilies[static_cast<std::size_t>(dictionary)].facts;
}

std::optional<MarkerDictionary> find_marker_dictionary(std::string_view name) {
  for (std::size_t i = 0; i < kFamilies.size(); ++i) {
    if (kFamilies[i].facts.name == name) return static_cast<MarkerDictionary>(i);
  }
  return std::nullopt;
}

std::uint64_t marker_code(MarkerDictionary dictionary, int id) {
  const Family& family = kFamilies[static_cast<std::size_t>(dictionary)];
  ENSURE(2304, id >= 0 && id < family.facts.count);
  return family.codes.empty() ? bch_code(id) : family.codes[static_cast<std::size_t>(id)];
}

std::uint64_t turned_code(std::uint64_t code, int bits) {
  std::uint64_t turned = 0;
  for (int row = 0; row < bits; ++row) {
    for (int column = 0; column < bits; ++column) {
      // What stood in column `row`, counted from below, comes to row `row`.
      const int from = (bits - 1 - column) * bits + row;
      turned = turned << 1U | ((code >> (bits * bits - 1 - from)) & 1U);
    }
  }
  return turned;
}

}  // namespace firstlook
