#include "hal/sim/overview.hpp"

#include <algorithm>
#include <cmath>

#include "algorithms/kinematics/self_collision.hpp"
#include "hal/sim/body_image.hpp"
#include "hal/sim/color_rendering.hpp"

namespace firstlook::sim {
namespace {

using Eigen::Vector3d;

/// Colours and shadows of one sample of an overview.
class OverviewPainter {
 public:
  OverviewPainter(const Scene& scene, const RayTracer& tracer, const Capsules& body, const Pose& base_T_eye)
      : scene_(scene),
        tracer_(tracer),
        base_T_eye_(base_T_eye),
        body_(body),
        seen_body_(body, base_T_eye, base_T_eye.translation()),
        toward_(scene.light.toward) {}

  [[nodiscard]] Vector3d paint(const RayRow& row, std::size_t i, double x, double y) const {
    constexpr double kSky = 0.93;
    Vector3d normal(row.nx[i], row.ny[i], row.nz[i]);
    Vector3d color = Vector3d::Constant(kSky);
    double t = row.t[i];
    BodyHit hit;
    if (seen_body_.intersect(x, y, t, hit)) {
      t = hit.depth_m;
      normal = base_T_eye_.linear() * hit.normal;
      color = Vector3d(0.35, 0.55, 0.78);
    } else if (row.solid[i] < 0) {
      return color;
    } else {
      color = color_of(static_cast<std::size_t>(row.solid[i]), base_T_eye_ * Vector3d(t * Vector3d(x, y, 1)));
    }
    const Vector3d point = base_T_eye_ * Vector3d(t * Vector3d(x, y, 1)) + 1e-3 * normal;
    Light light = scene_.light;
    if (in_shadow(point)) light.directed = 0;
    return color * shade(light, 1.0, point, normal);
  }

 private:
  [[nodiscard]] Vector3d color_of(std::size_t solid, const Vector3d& point) const {
    if (const BoardPlacement* board = board_of_solid(scene_, solid)) {
      const Vector3d at = board->base_T_board.inverse() * point;
      return Vector3d::Constant(at.z() < 1e-4 ? board_reflectance(*board, at.x(), at.y()) : 0.85);
    }
    const auto& c = scene_.solids[solid].surface.color;
    return {c[0], c[1], c[2]};
  }

  [[nodiscard]] bool in_shadow(const Vector3d& point) const {
    // The lamp hangs below any ceiling, so that rooms are lit.
    constexpr double kLampDistance_m = 1.5;
    if (tracer_.distance_m(point, toward_) < kLampDistance_m) return true;
    const Vector3d end = point + kLampDistance_m * toward_;
    return std::ranges::any_of(body_,
                               [&](const Capsule& c) { return segment_distance_m(c.a, c.b, point, end) < c.radius_m; });
  }

  const Scene& scene_;
  const RayTracer& tracer_;
  const Pose base_T_eye_;
  const Capsules& body_;
  const BodyImage seen_body_;
  const Vector3d toward_;
};

Pose looking(const Vector3d& eye_m, const Vector3d& look_at_m) {
  Pose pose = Pose::Identity();
  const Vector3d z = (look_at_m - eye_m).normalized();
  const Vector3d side = z.cross(Vector3d::UnitZ());
  const Vector3d x = side.norm() > 1e-6 ? Vector3d(side.normalized()) : Vector3d::UnitX();
  pose.linear() << x, z.cross(x), z;
  pose.translation() = eye_m;
  return pose;
}

}  // namespace

Overview paint_overview(const Scene& scene, const RayTracer& tracer, const Vector3d& eye_m, const Vector3d& look_at_m,
                        const Capsules& body, int width, int height, double horizontal_fov_rad) {
  constexpr int kSamples = 2;  // in each direction
  const Pose base_T_eye = looking(eye_m, look_at_m);
  const OverviewPainter painter(scene, tracer, body, base_T_eye);
  const double step = 2 * std::tan(0.5 * horizontal_fov_rad) / (width * kSamples);
  const auto columns = static_cast<std::size_t>(width * kSamples);
  Overview picture{width, height, std::vector<std::uint8_t>(static_cast<std::size_t>(width * height) * 3)};
  std::vector<Vector3d> line(static_cast<std::size_t>(width));
  RayRow row(columns);
  for (int r = 0; r < height; ++r) {
    std::ranges::fill(line, Vector3d::Zero());
    for (int s = 0; s < kSamples; ++s) {
      const double y = (r * kSamples + s + 0.5 - 0.5 * height * kSamples) * step;
      const auto x_of = [&](std::size_t i) { return (static_cast<double>(i) + 0.5 - 0.5 * width * kSamples) * step; };
      for (std::size_t i = 0; i < columns; ++i) {
        const Eigen::Vector3f d = (base_T_eye.linear() * Vector3d(x_of(i), y, 1)).cast<float>();
        row.x[i] = d.x(), row.y[i] = d.y(), row.z[i] = d.z();
      }
      tracer.trace(eye_m, row, columns);
      for (std::size_t i = 0; i < columns; ++i) line[i / kSamples] += painter.paint(row, i, x_of(i), y);
    }
    for (std::size_t i = 0; i < line.size() * 3; ++i) {
      // sRGB's gamma, nearly: what a person sees on a screen.
      const double value =
          std::pow(std::clamp(line[i / 3][static_cast<int>(i % 3)] / (kSamples * kSamples), 0.0, 1.0), 0.7);
      picture.rgb[static_cast<std::size_t>(r) * line.size() * 3 + i] =
          static_cast<std::uint8_t>(std::lround(255 * value));
    }
  }
  return picture;
}

}  // namespace firstlook::sim
