#include "hal/sim/depth_rendering.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "hal/sim/body_image.hpp"
#include "hal/sim/pixel_noise.hpp"
#include "hal/sim/row_bands.hpp"

namespace firstlook::sim {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr std::uint64_t kDepthNoise = 1;
constexpr float kShadowSlack_m = 0.002F;  // a surface does not shade itself

class DepthFrame {
 public:
  DepthFrame(const Scene& scene, const RayTracer& tracer, const DepthSensorModel& sensor, const PixelRays& rays,
             const CameraIntrinsics& full_camera, const Transform<Base, Depth>& base_T_depth, const Exposure& exposure)
      : scene_(scene),
        tracer_(tracer),
        sensor_(sensor),
        rays_(rays),
        base_T_depth_(base_T_depth.pose()),
        projector_in_base_(base_T_depth * Eigen::Vector3d(sensor.baseline_m, 0, 0)),
        camera_body_(exposure.body, base_T_depth_, projector_in_base_),
        projector_body_(exposure.body, projector_pose(), base_T_depth.translation()),
        noise_(exposure.seed, exposure.frame, kDepthNoise),
        disparity_focal_(full_camera.fx * sensor.baseline_m),
        edge_share_(static_cast<float>(rays.camera.width) / static_cast<float>(full_camera.width)),
        depth_(rays.x.size()),
        strength_(rays.x.size()) {
    // Of the stated sigma, what rounding to a disparity step (uniform: step² / 12) does not explain.
    const double sigma_px = sensor.sigma_at_1m_m * disparity_focal_;
    disparity_sigma_ =
        std::sqrt(std::max(0.0, sigma_px * sigma_px - sensor.disparity_step_px * sensor.disparity_step_px / 12));
  }

  void render(ImageView<std::uint16_t> out, WorkerPool* workers) {
    const int width = rays_.camera.width, height = rays_.camera.height;
    for_row_bands(workers, height, [&](int first, int last) {
      RayRow row(static_cast<std::size_t>(width));
      std::vector<std::uint8_t> shaded(row.size());
      for (int r = first; r < last; ++r) {
        trace_row(r, row);
        shade_row(r, row, shaded);
      }
    });
    for_row_bands(workers, height, [&](int first, int last) {
      for (int r = first; r < last; ++r) {
        for (int c = 0; c < width; ++c) out.at(c, r) = measure(c, r);
      }
    });
  }

 private:
  [[nodiscard]] Pose projector_pose() const {
    Pose pose = base_T_depth_;
    pose.translation() = projector_in_base_;
    return pose;
  }

  /// True depth of each pixel, and how much of the pattern comes back (0: nothing).
  void trace_row(int r, RayRow& row) {
    const std::size_t first = rays_.index(0, r);
    const Eigen::Matrix3f rotation = base_T_depth_.linear().cast<float>();
    for (std::size_t i = 0; i < row.size(); ++i) {
      const float x = rays_.x[first + i], y = rays_.y[first + i];
      row.x[i] = rotation(0, 0) * x + rotation(0, 1) * y + rotation(0, 2);
      row.y[i] = rotation(1, 0) * x + rotation(1, 1) * y + rotation(1, 2);
      row.z[i] = rotation(2, 0) * x + rotation(2, 1) * y + rotation(2, 2);
    }
    tracer_.trace(base_T_depth_.translation(), row, row.size());
    const BodyImage body = camera_body_.band(rays_.y[first], rays_.y[first]);  // undistorted: a row has one height
    for (std::size_t i = 0; i < row.size(); ++i) {
      const float length = std::sqrt(row.x[i] * row.x[i] + row.y[i] * row.y[i] + row.z[i] * row.z[i]);
      float cosine = -(row.nx[i] * row.x[i] + row.ny[i] * row.y[i] + row.nz[i] * row.z[i]) / length;
      float depth = row.t[i];
      bool returns = row.solid[i] >= 0 && scene_.solids[static_cast<std::size_t>(row.solid[i])].surface.returns_depth;
      BodyHit hit;
      const double x = rays_.x[first + i], y = rays_.y[first + i];
      if (body.intersect(x, y, depth, hit)) {
        depth = static_cast<float>(hit.depth_m);
        cosine = static_cast<float>(-hit.normal.dot(Eigen::Vector3d(x, y, 1))) / length;
        returns = true;
      }
      depth_[first + i] = depth;
      strength_[first + i] = returns && depth < sensor_.range_max_m * 1.1 ? grazing_strength(cosine) : 0;
    }
  }

  [[nodiscard]] float grazing_strength(float cosine) const {
    const auto none = static_cast<float>(sensor_.grazing_cos_none), full = static_cast<float>(sensor_.grazing_cos_full);
    return std::clamp((cosine - none) / (full - none), 0.0F, 1.0F);
  }

  /// No return from where the projector does not shine, or the second camera does not see.
  void shade_row(int r, RayRow& row, std::vector<std::uint8_t>& shaded) {
    if (sensor_.baseline_m == 0) return;
    const std::size_t first = rays_.index(0, r);
    const Eigen::Matrix3f rotation = base_T_depth_.linear().cast<float>();
    const auto baseline = static_cast<float>(sensor_.baseline_m);
    for (std::size_t i = 0; i < row.size(); ++i) {
      const float z = depth_[first + i];
      row.t[i] = strength_[first + i] > 0 ? 1 - kShadowSlack_m / z : 0;
      if (row.t[i] <= 0) continue;
      const Eigen::Vector3f d =
          rotation * Eigen::Vector3f(rays_.x[first + i] * z - baseline, rays_.y[first + i] * z, z);
      row.x[i] = d.x(), row.y[i] = d.y(), row.z[i] = d.z();
    }
    tracer_.find_blocked(projector_in_base_, row, row.size(), shaded);
    const BodyImage body = projector_body_.band(rays_.y[first], rays_.y[first]);
    for (std::size_t i = 0; i < row.size(); ++i) {
      float& strength = strength_[first + i];
      if (strength <= 0) continue;
      const double z = depth_[first + i];
      BodyHit hit;
      if (shaded[i] != 0 ||
          body.intersect(rays_.x[first + i] - sensor_.baseline_m / z, rays_.y[first + i], z - 0.01, hit)) {
        strength = 0;
      }
    }
  }

  /// The neighbour across the largest jump in depth, as its depth; 0 when no neighbour lies across one. On a slope,
  /// however steep, depth changes alike on both sides: that is no jump.
  [[nodiscard]] float across_edge(int c, int r) const {
    const float z = depth_[rays_.index(c, r)];
    const auto edge = static_cast<float>(sensor_.edge_step_m);
    float found = 0, largest = edge;
    const auto look = [&](int dc, int dr) {
      const int before_c = c - dc, before_r = r - dr, after_c = c + dc, after_r = r + dr;
      if (before_c < 0 || before_r < 0 || after_c >= rays_.camera.width || after_r >= rays_.camera.height) return;
      const float before = depth_[rays_.index(before_c, before_r)], after = depth_[rays_.index(after_c, after_r)];
      if (std::abs(after + before - 2 * z) <= edge) return;
      for (const float other : {before, after}) {
        if (std::abs(other - z) > largest) largest = std::abs(other - z), found = other;
      }
    };
    look(1, 0), look(0, 1);
    return found;
  }

  [[nodiscard]] std::uint16_t measure(int c, int r) const {
    const std::size_t i = rays_.index(c, r);
    if (strength_[i] <= 0 || !(depth_[i] > 0)) return 0;
    const std::uint64_t bits = noise_.bits(i);
    const float fate = uniform_of(bits, 2), share = uniform_of(bits, 3);
    if (fate >= strength_[i] * static_cast<float>(1 - sensor_.dropped)) return 0;
    float z = depth_[i];
    if (const float other = across_edge(c, r); other != 0) {
      const std::uint64_t edge_bits = mix64(bits);
      const float luck = uniform_of(edge_bits, 0);
      const auto dropped = edge_share_ * static_cast<float>(sensor_.edge_dropped);
      if (luck < dropped) return 0;
      if (luck < dropped + edge_share_ * static_cast<float>(sensor_.edge_mixed) && other < kInfinity) {
        z += share * (other - z);
      }
    }
    return quantised_mm(with_noise(z, normal_of(bits)));
  }

  /// A measured depth: noise and steps of disparity where the sensor triangulates, noise of depth itself.
  [[nodiscard]] double with_noise(double z, double normal) const {
    if (sensor_.disparity_step_px > 0) {
      const double disparity = disparity_focal_ / z + disparity_sigma_ * normal;
      const double steps = rounded(disparity / sensor_.disparity_step_px);
      if (steps < 1) return 0;
      return disparity_focal_ / (steps * sensor_.disparity_step_px);
    }
    return z + std::hypot(sensor_.sigma_floor_m, sensor_.sigma_at_1m_m * z * z) * normal;
  }

  /// Of what is not negative; the library's functions cost a call for each pixel.
  static double rounded(double value) {
    const double raised = value + 0.5;
    return static_cast<double>(static_cast<std::int64_t>(raised));
  }

  [[nodiscard]] std::uint16_t quantised_mm(double measured_m) const {
    if (measured_m < sensor_.range_min_m || measured_m > sensor_.range_max_m) return 0;
    return static_cast<std::uint16_t>(rounded(measured_m * 1000));
  }

  const Scene& scene_;
  const RayTracer& tracer_;
  const DepthSensorModel& sensor_;
  const PixelRays& rays_;
  const Pose base_T_depth_;
  const Eigen::Vector3d projector_in_base_;
  const BodyImage camera_body_, projector_body_;
  const PixelNoise noise_;
  const double disparity_focal_;  ///< focal length times baseline: px m
  const float edge_share_;        ///< of the pixels at an edge, those within one pixel of the full sensor
  double disparity_sigma_ = 0;    ///< px
  std::vector<float> depth_, strength_;
};

}  // namespace

void render_depth_image(const Scene& scene, const RayTracer& tracer, const DepthSensorModel& sensor,
                        const PixelRays& rays, const CameraIntrinsics& full_camera,
                        const Transform<Base, Depth>& base_T_depth, const Exposure& exposure,
                        ImageView<std::uint16_t> out, WorkerPool* workers) {
  DepthFrame(scene, tracer, sensor, rays, full_camera, base_T_depth, exposure).render(out, workers);
}

}  // namespace firstlook::sim
