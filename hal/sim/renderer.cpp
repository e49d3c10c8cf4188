#include "hal/sim/renderer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "algorithms/kinematics/self_collision.hpp"
#include "algorithms/vision/camera_model.hpp"
#include "hal/sim/body_image.hpp"
#include "hal/sim/color_rendering.hpp"
#include "hal/sim/depth_rendering.hpp"
#include "hal/sim/pixel_rays.hpp"
#include "hal/sim/ray_tracer.hpp"
#include "platform/core/ensure.hpp"
#include "platform/core/random.hpp"

namespace firstlook::sim {
namespace {

using Eigen::Vector3d;

constexpr int kFastBinning = 4;
constexpr double kEndSlack_m = 0.001;        // a point on a surface is not hidden by that surface
constexpr double kBoardTiltMax_rad = 1.22;   // 70 degrees: squares become slivers
constexpr double kSquareWidthMin_px = 6;     // below that no detector finds corners
constexpr std::uint64_t kCornerStream = 5001;


}  // namespace

struct Renderer::State {
  State(const Scene& s, const DepthSensorModel& d)
      : scene(s), sensor(d), tracer(s), color(s.mount.color), depth(s.mount.depth), fast(binned(s.mount.depth, kFastBinning)) {}
  Scene scene;
  DepthSensorModel sensor;
  RayTracer tracer;
  PixelRays color, depth, fast;
};

Renderer::Renderer(const Scene& scene, const DepthSensorModel& sensor)
    : state_(std::make_unique<State>(scene, sensor)) {}
Renderer::~Renderer() = default;
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&&) noexcept = default;

const Scene& Renderer::scene() const { return state_->scene; }
const DepthSensorModel& Renderer::sensor() const { return state_->sensor; }

const CameraIntrinsics& Renderer::depth_intrinsics(DepthDetail detail) const {
  return detail == DepthDetail::kFull ? state_->depth.camera : state_->fast.camera;
}

void Renderer::render_color(const Transform<Base, Camera>& base_T_camera, const Exposure& exposure,
                            MutableGrayImage out) const {
  ENSURE(5211, out.width == state_->color.camera.width && out.height == state_->color.camera.height);
  render_color_image(state_->scene, state_->tracer, state_->color, base_T_camera, exposure, out);
}

void Renderer::render_depth(const Transform<Base, Depth>& base_T_depth, const Exposure& exposure, DepthDetail detail,
                            ImageView<std::uint16_t> out) const {
  const PixelRays& rays = detail == DepthDetail::kFull ? state_->depth : state_->fast;
  ENSURE(5212, out.width == rays.camera.width && out.height == rays.camera.height);
  render_depth_image(state_->scene, state_->tracer, state_->sensor, rays, state_->depth.camera, base_T_depth, exposure,
                     out);
}

double Renderer::ray_m(const Vector3d& origin_m, const Vector3d& direction) const {
  return state_->tracer.distance_m(origin_m, direction);
}

bool Renderer::sees(const Vector3d& from_m, const Vector3d& to_m) const {
  const double length_m = (to_m - from_m).norm();
  if (length_m <= kEndSlack_m) return true;
  return state_->tracer.distance_m(from_m, (to_m - from_m) / length_m) >= length_m - kEndSlack_m;
}

bool Renderer::board_in_view(const Transform<Base, Camera>& base_T_camera, const Capsules& body,
                             double margin_px) const {
  const BoardPlacement& board = state_->scene.board;
  const CameraIntrinsics& camera = state_->scene.mount.color;
  const Transform<Camera, Board> camera_T_board = base_T_camera.inverse() * board.base_T_board;
  const Vector3d center = camera_T_board * board.spec.center();
  const double facing = center.dot(camera_T_board.rotation().col(2)) / center.norm();
  if (!(center.z() > 0) || facing < std::cos(kBoardTiltMax_rad)) return false;
  if (camera.fx * board.spec.square_size_m * facing / center.z() < kSquareWidthMin_px) return false;
  const BodyImage hiding(body, base_T_camera.pose(), base_T_camera.translation());
  const Vector3d eye = base_T_camera.translation();
  // The inner corners and one square more all around: the outer squares belong to the pattern.
  for (int row = -1; row <= board.spec.inner_rows; ++row) {
    for (int column = -1; column <= board.spec.inner_columns; ++column) {
      const Vector3d on_board = board.spec.square_size_m * Vector3d(column, row, 0);
      const Vector3d at = camera_T_board * on_board;
      const auto pixel = project(camera, at);
      if (!pixel || !in_image(camera, *pixel, margin_px)) return false;
      BodyHit hit;
      if (hiding.intersect(at.x() / at.z(), at.y() / at.z(), at.z(), hit)) return false;
      if (!sees(eye, board.base_T_board * on_board)) return false;
    }
  }
  return true;
}

hal::CornerObservation Renderer::observe_corners(const Transform<Base, Camera>& base_T_camera,
                                                 const Exposure& exposure, double sigma_px) const {
  hal::CornerObservation observation;
  if (!board_in_view(base_T_camera, exposure.body)) return observation;
  const BoardPlacement& board = state_->scene.board;
  const Transform<Camera, Board> camera_T_board = base_T_camera.inverse() * board.base_T_board;
  Random random(mix64(exposure.seed) ^ exposure.frame, kCornerStream);
  for (int i = 0; i < board.spec.corners(); ++i) {
    const auto pixel = project(state_->scene.mount.color, camera_T_board * board.spec.corner(i));
    ENSURE(5213, pixel.has_value());
    const double u = pixel->x() + sigma_px * random.normal();
    const double v = pixel->y() + sigma_px * random.normal();
    observation.corners_px.push_back({static_cast<float>(u), static_cast<float>(v)});
  }
  return observation;
}

namespace {

/// Colours and shadows of one sample of an overview.
class OverviewPainter {
 public:
  OverviewPainter(const Scene& scene, const RayTracer& tracer, const Capsules& body, const Pose& base_T_eye)
      : scene_(scene), tracer_(tracer), base_T_eye_(base_T_eye), body_(body),
        seen_body_(body, base_T_eye, base_T_eye.translation()), toward_(scene.light.toward.normalized()) {}

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
    if (solid == scene_.board_solid) {
      const Vector3d at = scene_.board.base_T_board.inverse() * point;
      return Vector3d::Constant(at.z() < 1e-4 ? board_reflectance(scene_.board, at.x(), at.y()) : 0.85);
    }
    const auto& c = scene_.solids[solid].surface.color;
    return {c[0], c[1], c[2]};
  }

  [[nodiscard]] bool in_shadow(const Vector3d& point) const {
    // The lamp hangs below any ceiling, so that rooms are lit.
    constexpr double kLampDistance_m = 1.5;
    if (tracer_.distance_m(point, toward_) < kLampDistance_m) return true;
    const Vector3d end = point + kLampDistance_m * toward_;
    return std::ranges::any_of(body_, [&](const Capsule& c) {
      return segment_distance_m(c.a, c.b, point, end) < c.radius_m;
    });
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

Overview Renderer::render_overview(const Vector3d& eye_m, const Vector3d& look_at_m, const Capsules& body, int width,
                                   int height, double horizontal_fov_rad) const {
  constexpr int kSamples = 2;  // in each direction
  const Pose base_T_eye = looking(eye_m, look_at_m);
  const OverviewPainter painter(state_->scene, state_->tracer, body, base_T_eye);
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
      state_->tracer.trace(eye_m, row, columns);
      for (std::size_t i = 0; i < columns; ++i) line[i / kSamples] += painter.paint(row, i, x_of(i), y);
    }
    for (std::size_t i = 0; i < line.size() * 3; ++i) {
      // sRGB's gamma, nearly: what a person sees on a screen.
      const double value = std::pow(std::clamp(line[i / 3][static_cast<int>(i % 3)] / (kSamples * kSamples), 0.0, 1.0), 0.7);
      picture.rgb[static_cast<std::size_t>(r) * line.size() * 3 + i] = static_cast<std::uint8_t>(std::lround(255 * value));
    }
  }
  return picture;
}

}  // namespace firstlook::sim
