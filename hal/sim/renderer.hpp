/// What the cameras see of a scene: colour images, depth images, corners, and pictures for people.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "algorithms/kinematics/arm_model.hpp"
#include "algorithms/mapping/sensor_presets.hpp"
#include "algorithms/vision/target_pattern.hpp"
#include "hal/api/cameras.hpp"
#include "hal/sim/ray_tracer.hpp"
#include "hal/sim/scene.hpp"
#include "platform/core/image_view.hpp"
#include "platform/loop/worker_pool.hpp"

namespace firstlook::sim {

/// One exposure. The same view gives the same bytes, whatever was rendered before it and on which thread.
struct Exposure {
  Capsules body;  ///< arm and camera housing where they truly are (base coordinates); those around the eye are left out
  std::uint64_t seed = 0;   ///< of all noise, together with
  std::uint64_t frame = 0;  ///< the frame's number
};

/// A depth sensor; by default structured light like the first Kinect. Smisek, Jancosek and Pajdla 2011, "3D with
/// Kinect"; Khoshelham and Elberink 2012, "Accuracy and resolution of Kinect depth data".
struct DepthSensorModel {
  double range_min_m = 0.5;
  double range_max_m = 5.0;
  double baseline_m = 0.075;         ///< projector or second camera at x = +baseline in the Depth frame; 0: none
  double disparity_step_px = 0.125;  ///< 2.8 mm at 1 m; 0: depths are not triangulated
  double sigma_floor_m = 0;          ///< of noise at any distance, where depths are not triangulated
  double sigma_at_1m_m = 0.00285;    ///< of noise and disparity steps together; grows with z²
  double grazing_cos_none = 0.10;    ///< no return where rays hit flatter than this
  double grazing_cos_full = 0.25;    ///< full return where steeper; linear in between
  double edge_step_m = 0.05;         ///< a jump to a neighbour larger than this makes an edge pixel
  double edge_dropped = 0.5;         ///< share of edge pixels without return
  double edge_mixed = 0.15;          ///< share with a depth between the two sides
  double dropped = 0.002;            ///< share of all pixels without return
};

/// What is stated of a sensor, with the behaviour above for what is not.
[[nodiscard]] DepthSensorModel depth_sensor_model(const SensorPreset& preset);

enum class DepthDetail : std::uint8_t { kFull, kFast };

/// The picture of render_overview.
struct Overview {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> rgb;  ///< row-major, three bytes for each pixel
};

/// Renders the scene that it was built from (copied); build another one when the scene changes. All calls are const and
/// thread-safe (Embree, AVX2). The threads of `workers`, which must outlive it, share the rows of a camera's image.
class Renderer {
 public:
  static constexpr double kBoardMargin_px = 8;

  explicit Renderer(const Scene& scene, const DepthSensorModel& sensor = {}, WorkerPool* workers = nullptr);
  ~Renderer();
  Renderer(Renderer&&) noexcept;
  Renderer& operator=(Renderer&&) noexcept;

  [[nodiscard]] const Scene& scene() const;
  [[nodiscard]] const DepthSensorModel& sensor() const;
  /// Of the images that render_depth fills: the mount's own, or a quarter of it in both directions.
  [[nodiscard]] const CameraIntrinsics& depth_intrinsics(DepthDetail detail) const;

  /// Grey values as the mount's colour camera delivers them; `out` has the size of scene().mount.color.
  void render_color(const Transform<Base, Camera>& base_T_camera, const Exposure& exposure, MutableGrayImage out) const;
  /// The same view in colours: red, green, blue.
  void render_rgb(const Transform<Base, Camera>& base_T_camera, const Exposure& exposure,
                  ImageView<std::array<std::uint8_t, 3>> out) const;
  /// Millimetres along the optical axis, 0 without return; `out` has the size of depth_intrinsics(detail).
  void render_depth(const Transform<Base, Depth>& base_T_depth, const Exposure& exposure, DepthDetail detail,
                    ImageView<std::uint16_t> out) const;
  /// The corners of one of the scene's boards with `sigma_px` of noise; empty unless a detector would find them: as
  /// board_in_view, but of a checkerboard the surroundings of its inner corners are enough.
  [[nodiscard]] hal::CornerObservation observe_corners(const Transform<Base, Camera>& base_T_camera,
                                                       const Exposure& exposure, std::size_t which = 0,
                                                       double sigma_px = 0.1) const;
  /// True when the camera sees the whole pattern: inside the picture with `margin_px`, from the front at a tilt of at
  /// most 70 degrees, squares at least 6 px wide, nothing in between.
  [[nodiscard]] bool board_in_view(const Transform<Base, Camera>& base_T_camera, const Capsules& body,
                                   double margin_px = kBoardMargin_px, std::size_t which = 0) const;

  /// Distance to the first surface along a unit direction, the arm left out; infinity when there is none. To 1e-5 m.
  [[nodiscard]] double ray_m(const Eigen::Vector3d& origin_m, const Eigen::Vector3d& direction) const;
  /// The first surface along each ray of a row, the arm left out.
  void trace(const Eigen::Vector3d& origin_m, RayRow& row) const;
  /// Nothing solid between two points (the last 1 mm before `to` left out); the arm is not looked at.
  [[nodiscard]] bool sees(const Eigen::Vector3d& from_m, const Eigen::Vector3d& to_m) const;

  /// A shaded picture with cast shadows of the scene and the arm, for people.
  [[nodiscard]] Overview render_overview(const Eigen::Vector3d& eye_m, const Eigen::Vector3d& look_at_m,
                                         const Capsules& body, int width, int height,
                                         double horizontal_fov_rad = 1.0) const;

 private:
  struct State;
  [[nodiscard]] bool is_in_view(const Transform<Base, Camera>& base_T_camera, const Capsules& body, double margin_px,
                                std::size_t which, const InkExtent& part) const;
  std::unique_ptr<State> state_;
};

}  // namespace firstlook::sim
