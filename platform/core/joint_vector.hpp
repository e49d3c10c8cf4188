/// Joint angles of an arm with up to seven joints: plain data, trivially copyable, no allocation.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <type_traits>

namespace firstlook {

inline constexpr int kJointsMax = 7;

/// `count` joint values in radians (or rad/s, rad/s²: the name of the variable says which). The rest is zero.
struct JointVector {
  std::array<double, kJointsMax> values{};
  std::int32_t count = 0;

  JointVector() = default;
  JointVector(std::initializer_list<double> list) : count(static_cast<std::int32_t>(list.size())) {
    std::copy(list.begin(), list.end(), values.begin());
  }
  [[nodiscard]] static JointVector zero(int joints) {
    JointVector q;
    q.count = joints;
    return q;
  }

  [[nodiscard]] int size() const { return count; }
  [[nodiscard]] double operator[](int i) const { return values[static_cast<std::size_t>(i)]; }
  [[nodiscard]] double& operator[](int i) { return values[static_cast<std::size_t>(i)]; }
  [[nodiscard]] bool operator==(const JointVector&) const = default;

  [[nodiscard]] double max_abs() const {
    double largest = 0;
    for (const double v : values) largest = std::max(largest, std::abs(v));
    return largest;
  }
  [[nodiscard]] bool all_finite() const {
    return std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
  }
};
static_assert(std::is_trivially_copyable_v<JointVector>);

[[nodiscard]] inline JointVector operator+(JointVector a, const JointVector& b) {
  for (std::size_t i = 0; i < a.values.size(); ++i) a.values[i] += b.values[i];
  return a;
}
[[nodiscard]] inline JointVector operator-(JointVector a, const JointVector& b) {
  for (std::size_t i = 0; i < a.values.size(); ++i) a.values[i] -= b.values[i];
  return a;
}
[[nodiscard]] inline JointVector operator*(JointVector a, double s) {
  for (double& v : a.values) v *= s;
  return a;
}
/// a at t = 0, b at t = 1: the point of the joint-linear segment between them.
[[nodiscard]] inline JointVector interpolate(const JointVector& a, const JointVector& b, double t) {
  return a + (b - a) * t;
}

}  // namespace firstlook
