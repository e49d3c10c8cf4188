/// Depth images of a sensor that triangulates, or measures the time of flight.
#pragma once

#include <cstdint>

#include "hal/sim/pixel_rays.hpp"
#include "hal/sim/ray_tracer.hpp"
#include "hal/sim/renderer.hpp"
#include "platform/loop/worker_pool.hpp"

namespace firstlook::sim {

/// Fills `out` (millimetres along the optical axis, 0 without return), which has the size of `rays.camera`.
/// `full_camera` is the sensor's own resolution: quantisation, noise and edges are those of its pixels, also when
/// `rays` are fewer. With `workers` its threads share the rows; the picture is the same.
void render_depth_image(const Scene& scene, const RayTracer& tracer, const DepthSensorModel& sensor,
                        const PixelRays& rays, const CameraIntrinsics& full_camera,
                        const Transform<Base, Depth>& base_T_depth, const Exposure& exposure,
                        ImageView<std::uint16_t> out, WorkerPool* workers = nullptr);

}  // namespace firstlook::sim
