/// The way of the tool's centre, as a simulated controller interpolates it: a straight line or an arc.
#pragma once

#include <optional>

#include "platform/core/transform.hpp"

namespace firstlook::sim::ur {

/// What the tool's turn does on an arc.
enum class ArcTurn : std::uint8_t {
  kSpread,        ///< evenly over the way, from the first orientation to the last
  kWithTheCircle  ///< it keeps its orientation to the circle; that of the last pose is not looked at
};

/// Poses of the tool's centre in Base.
class ToolPath {
 public:
  /// The turn spread evenly over the way.
  [[nodiscard]] static ToolPath line(const Pose& from, const Pose& to);
  /// The circle through three points, from the first by way of the second to the third. Empty when they lie on a line
  /// or in one place.
  [[nodiscard]] static std::optional<ToolPath> arc(const Pose& from, const Eigen::Vector3d& via, const Pose& to,
                                                   ArcTurn turn);

  /// Metres, or radians of the turn where those are more: a turn in place takes a radian for a metre.
  [[nodiscard]] double way() const;
  /// @param share  of the way, 0 to 1
  [[nodiscard]] Pose at(double share) const;
  [[nodiscard]] Pose end() const { return at(1); }

 private:
  struct Circle {
    Eigen::Vector3d center, axis;
    double angle_rad = 0;
  };
  ToolPath(const Pose& from, const Pose& to) : from_(from), to_(to) {}

  Pose from_, to_;
  std::optional<Circle> circle_;
  bool turns_with_circle_ = false;
};

}  // namespace firstlook::sim::ur
