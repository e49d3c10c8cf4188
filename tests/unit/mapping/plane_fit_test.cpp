#include "algorithms/mapping/plane_fit.hpp"

#include <Eigen/Geometry>
#include <catch2/catch.hpp>
#include <vector>

#include "platform/core/random.hpp"

namespace firstlook {
namespace {

constexpr CameraIntrinsics kCamera{96, 72, 90, 90, 47.5, 35.5};
constexpr double kUnits = 10000;  // of 0.1 mm: rounding stays out of the noise
constexpr PlaneFitOptions kOptions{7, 0, 0.003};

/// Depth along the axis to the plane normal . p = offset_m, camera coordinates.
double depth_of(const Eigen::Vector3d& normal, double offset_m, int u, int v) {
  return offset_m / normal.dot(Eigen::Vector3d((u - kCamera.cx) / kCamera.fx, (v - kCamera.cy) / kCamera.fy, 1));
}

struct Picture {
  std::vector<std::uint16_t> noisy;
  std::vector<double> true_m;
};

template <typename Depth>
Picture picture(Random& random, Depth depth_m) {
  Picture p;
  for (int v = 0; v < kCamera.height; ++v) {
    for (int u = 0; u < kCamera.width; ++u) {
      const double z = depth_m(u, v);
      p.true_m.push_back(z);
      p.noisy.push_back(static_cast<std::uint16_t>(
          z > 0 ? std::lround(kUnits * (z + kOptions.noise_at_1m_m * z * z * random.normal())) : 0));
    }
  }
  return p;
}

bool at_rim(int u, int v, int rim_px) {
  return u < rim_px || v < rim_px || u >= kCamera.width - rim_px || v >= kCamera.height - rim_px;
}

}  // namespace

TEST_CASE("a tilted plane is freed of a window's worth of noise, and is not moved", "[mapping]") {
  Random random(1);
  for (int trial = 0; trial < 20; ++trial) {
    const Eigen::Vector3d normal = Eigen::Vector3d(random.uniform(-1, 1), random.uniform(-1, 1), 2).normalized();
    const double offset_m = random.uniform(0.6, 2);
    Picture p = picture(random, [&](int u, int v) { return depth_of(normal, offset_m, u, v); });
    PlaneFit fit(kCamera, kOptions);
    const std::uint32_t replaced = fit.apply({p.noisy.data(), kCamera.width, kCamera.height}, kUnits);
    double squared = 0, bias = 0;
    int count = 0;
    for (int v = 0; v < kCamera.height; ++v) {
      for (int u = 0; u < kCamera.width; ++u) {
        if (at_rim(u, v, 3)) continue;
        const auto i = static_cast<std::size_t>(v * kCamera.width + u);
        const double sigma = kOptions.noise_at_1m_m * p.true_m[i] * p.true_m[i];
        const double error = (p.noisy[i] / kUnits - p.true_m[i]) / sigma;
        squared += error * error, bias += error, ++count;
      }
    }
    CAPTURE(trial, offset_m);
    CHECK(replaced > 0.97 * count);
    // 1/7 of the noise, and what stayed as it was; neighbours share most of their windows.
    CHECK(std::sqrt(squared / count) < 0.25);
    CHECK(std::abs(bias / count) < 0.06);
  }
}

TEST_CASE("steps, thin rods and gaps stay as they were read", "[mapping]") {
  Random random(2);
  const auto depth_m = [](int u, int v) {
    if (v == 60 && u > 60) return 0.0;                           // a gap
    if (u < 40) return 1.0;                                      // a wall
    return v >= 30 && v < 33 && u >= 60 && u < 80 ? 1.15 : 1.3;  // another with a rod of three pixels
  };
  Picture p = picture(random, depth_m);
  const std::vector<std::uint16_t> before = p.noisy;
  PlaneFit fit(kCamera, kOptions);
  CHECK(fit.apply({p.noisy.data(), kCamera.width, kCamera.height}, kUnits) > 2500);
  for (int v = 0; v < kCamera.height; ++v) {
    for (int u = 0; u < kCamera.width; ++u) {
      const auto i = static_cast<std::size_t>(v * kCamera.width + u);
      const bool at_step = u >= 37 && u < 43, at_gap = std::abs(v - 60) <= 3 && u > 57;
      const bool at_rod = v >= 27 && v < 36 && u >= 57 && u < 83;
      CAPTURE(u, v);
      if (at_rim(u, v, 3) || at_step || at_gap || at_rod) REQUIRE(p.noisy[i] == before[i]);
      if (p.true_m[i] > 0) REQUIRE(std::abs(p.noisy[i] / kUnits - p.true_m[i]) < 6 * 0.003 * 1.3 * 1.3);
    }
  }
}

TEST_CASE("a plane fit that is off takes no memory and changes nothing", "[mapping]") {
  std::vector<std::uint16_t> pixels(static_cast<std::size_t>(kCamera.width * kCamera.height), 1234);
  PlaneFit fit(kCamera, {});
  CHECK(PlaneFit::required_bytes(kCamera, {}) == 0);
  CHECK(fit.apply({pixels.data(), kCamera.width, kCamera.height}, kUnits) == 0);
  CHECK(std::all_of(pixels.begin(), pixels.end(), [](std::uint16_t z) { return z == 1234; }));
}

}  // namespace firstlook
