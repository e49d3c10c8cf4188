#include "hal/sim/renderer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "algorithms/vision/camera_model.hpp"
#include "algorithms/vision/target_pattern.hpp"
#include "hal/sim/body_image.hpp"
#include "hal/sim/color_rendering.hpp"
#include "hal/sim/depth_rendering.hpp"
#include "hal/sim/overview.hpp"
#include "hal/sim/pixel_rays.hpp"
#include "hal/sim/ray_tracer.hpp"
#include "platform/core/ensure.hpp"
#include "platform/core/random.hpp"

namespace firstlook::sim {
namespace {

using Eigen::Vector3d;

constexpr int kFastBinning = 4;
constexpr double kEndSlack_m = 0.001;       // a point on a surface is not hidden by that surface
constexpr double kBoardTiltMax_rad = 1.22;  // 70 degrees: squares become slivers
constexpr double kSquareWidthMin_px = 6;    // below that no detector finds corners
constexpr std::uint64_t kCornerStream = 5001;

double neighbour_distance_m(const BoardSpec& board) {
  return board.has_marker_corners() ? board.mark_size_m : board.square_size_m;
}

/// What of a board a detector must see.
InkExtent detected_part(const BoardSpec& board) {
  if (board.type != TargetType::kCheckerboard) return ink_extent(board);
  constexpr double kAround = 0.35;  // of a square: what tells that black and white alternate at a corner
  const Eigen::Vector2d squares(board.inner_columns - 1 + 2 * kAround, board.inner_rows - 1 + 2 * kAround);
  return {.center_m = ink_extent(board).center_m, .size_m = board.square_size_m * squares};
}

}  // namespace

DepthSensorModel depth_sensor_model(const SensorPreset& preset) {
  DepthSensorModel model;
  model.range_min_m = preset.range_min_m;
  model.range_max_m = preset.range_max_m;
  model.baseline_m = preset.baseline_m;
  model.disparity_step_px = preset.disparity_step_px;
  model.sigma_floor_m = preset.noise_floor_m;
  model.sigma_at_1m_m = preset.noise_at_1m_m;
  model.edge_mixed = preset.edge_mixed_share;
  return model;
}

struct Renderer::State {
  State(const Scene& s, const DepthSensorModel& d, WorkerPool* w)
      : scene(s),
        sensor(d),
        workers(w),
        tracer(s),
        color(s.mount.color),
        depth(s.mount.depth),
        fast(binned(s.mount.depth, kFastBinning)) {}
  Scene scene;
  DepthSensorModel sensor;
  WorkerPool* workers;
  RayTracer tracer;
  PixelRays color, depth, fast;
};

Renderer::Renderer(const Scene& scene, const DepthSensorModel& sensor, WorkerPool* workers)
    : state_(std::make_unique<State>(scene, sensor, workers)) {}
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
  render_color_image(state_->scene, state_->tracer, state_->color, base_T_camera, exposure, Channel::kGray, out,
                     state_->workers);
}

void Renderer::render_rgb(const Transform<Base, Camera>& base_T_camera, const Exposure& exposure,
                          ImageView<std::array<std::uint8_t, 3>> out) const {
  ENSURE(5214, out.width == state_->color.camera.width && out.height == state_->color.camera.height);
  std::vector<std::uint8_t> one(out.size());
  for (const Channel channel : {Channel::kRed, Channel::kGreen, Channel::kBlue}) {
    render_color_image(state_->scene, state_->tracer, state_->color, base_T_camera, exposure, channel,
                       {one.data(), out.width, out.height}, state_->workers);
    for (std::size_t i = 0; i < one.size(); ++i) out.data[i][static_cast<std::size_t>(channel)] = one[i];
  }
}

void Renderer::render_depth(const Transform<Base, Depth>& base_T_depth, const Exposure& exposure, DepthDetail detail,
                            ImageView<std::uint16_t> out) const {
  const PixelRays& rays = detail == DepthDetail::kFull ? state_->depth : state_->fast;
  ENSURE(5212, out.width == rays.camera.width && out.height == rays.camera.height);
  render_depth_image(state_->scene, state_->tracer, state_->sensor, rays, state_->depth.camera, base_T_depth, exposure,
                     out, state_->workers);
}

double Renderer::ray_m(const Vector3d& origin_m, const Vector3d& direction) const {
  return state_->tracer.distance_m(origin_m, direction);
}

void Renderer::trace(const Vector3d& origin_m, RayRow& row) const { state_->tracer.trace(origin_m, row, row.size()); }

bool Renderer::sees(const Vector3d& from_m, const Vector3d& to_m) const {
  const double length_m = (to_m - from_m).norm();
  if (length_m <= kEndSlack_m) return true;
  return state_->tracer.distance_m(from_m, (to_m - from_m) / length_m) >= length_m - kEndSlack_m;
}

bool Renderer::board_in_view(const Transform<Base, Camera>& base_T_camera, const Capsules& body, double margin_px,
                             std::size_t which) const {
  return is_in_view(base_T_camera, body, margin_px, which, ink_extent(state_->scene.boards[which].spec));
}

bool Renderer::is_in_view(const Transform<Base, Camera>& base_T_camera, const Capsules& body, double margin_px,
                          std::size_t which, const InkExtent& part) const {
  const BoardPlacement& board = state_->scene.boards[which];
  const CameraIntrinsics& camera = state_->scene.mount.color;
  const Transform<Camera, Board> camera_T_board = base_T_camera.inverse() * board.base_T_board;
  const Vector3d center = camera_T_board * board.spec.center();
  const double facing = center.dot(camera_T_board.rotation().col(2)) / center.norm();
  if (!(center.z() > 0) || facing < std::cos(kBoardTiltMax_rad)) return false;
  // Of the finest detail that a detector must resolve.
  const double width_px = camera.fx * neighbour_distance_m(board.spec) * facing / center.z();
  if (width_px / board.spec.detail_ratio() < kSquareWidthMin_px) return false;
  const BodyImage hiding(body, base_T_camera.pose(), base_T_camera.translation());
  const Vector3d eye = base_T_camera.translation();
  // A lattice over the part: of a whole checkerboard the corners of all squares.
  const int columns = board.spec.inner_columns + 1, rows = board.spec.inner_rows + 1;
  for (int row = 0; row <= rows; ++row) {
    for (int column = 0; column <= columns; ++column) {
      const Eigen::Vector2d share(static_cast<double>(column) / columns - 0.5, static_cast<double>(row) / rows - 0.5);
      const Eigen::Vector2d in_part = part.center_m + share.cwiseProduct(part.size_m);
      const Vector3d on_board(in_part.x(), in_part.y(), 0);
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

hal::CornerObservation Renderer::observe_corners(const Transform<Base, Camera>& base_T_camera, const Exposure& exposure,
                                                 std::size_t which, double sigma_px) const {
  hal::CornerObservation observation;
  const BoardPlacement& board = state_->scene.boards[which];
  if (!is_in_view(base_T_camera, exposure.body, kBoardMargin_px, which, detected_part(board.spec))) return observation;
  const Transform<Camera, Board> camera_T_board = base_T_camera.inverse() * board.base_T_board;
  Random random(mix64(exposure.seed) ^ exposure.frame, kCornerStream + (std::uint64_t{which} << 32));
  for (int i = 0; i < board.spec.corners(); ++i) {
    const auto pixel = project(state_->scene.mount.color, camera_T_board * board.spec.corner(i));
    ENSURE(5213, pixel.has_value());
    const double u = pixel->x() + sigma_px * random.normal();
    const double v = pixel->y() + sigma_px * random.normal();
    observation.corners_px.push_back({static_cast<float>(u), static_cast<float>(v)});
  }
  return observation;
}

Overview Renderer::render_overview(const Vector3d& eye_m, const Vector3d& look_at_m, const Capsules& body, int width,
                                   int height, double horizontal_fov_rad) const {
  return paint_overview(state_->scene, state_->tracer, eye_m, look_at_m, body, width, height, horizontal_fov_rad);
}

}  // namespace firstlook::sim
