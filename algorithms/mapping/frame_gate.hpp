/// Which depth frames may go into a map at all, and what becomes of those that may not: each kind is counted.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "algorithms/mapping/depth_rays.hpp"

namespace firstlook {

/// Why a frame was not used.
enum class FrameFlaw : std::uint8_t {
  kUnreadable,      ///< the device did not give its pixels
  kWrongSize,       ///< not the sensor's columns and rows
  kWrongScale,      ///< depths that the sensor cannot measure, e.g. millimetres taken for metres
  kBadPose,         ///< not finite, or no rigid motion
  kStampBackwards,  ///< not later than the frame before it
  kPoseUnknown,     ///< the arm's joints at its stamp are not known (safety rule 10)
  kPoseUncertain,   ///< known too badly: the arm moved too fast for how well the stamp is known
  kFrozen,          ///< pixel for pixel the picture before it
};
inline constexpr std::size_t kFrameFlaws = 8;
/// "unreadable", "wrong_size", ...: the words of result.json.
[[nodiscard]] std::string_view to_string(FrameFlaw flaw);

using FlawCounts = std::array<std::uint64_t, kFrameFlaws>;

/// Looks at the frames of one sensor, in the order in which they come.
class FrameGate {
 public:
  explicit FrameGate(const DepthSensor& sensor) : sensor_(sensor) {}

  /// The first flaw of a frame. Pixels of the largest value, which stand for infinity, become pixels without a return:
  /// what a sensor cannot see is not free.
  [[nodiscard]] std::optional<FrameFlaw> inspect(ImageView<std::uint16_t> pixels, double units_per_m,
                                                 const Transform<Base, Depth>& base_T_depth, double stamp_s);
  /// Of all frames so far.
  [[nodiscard]] std::uint64_t infinite_pixels() const { return infinite_pixels_; }

 private:
  [[nodiscard]] bool has_wrong_scale(ImageView<std::uint16_t> pixels, double units_per_m) const;

  DepthSensor sensor_;
  std::optional<double> last_stamp_s_;
  std::uint64_t infinite_pixels_ = 0;
};

}  // namespace firstlook
