/// Colour camera images: grey values, or one of their colours.
#pragma once

#include "hal/sim/pixel_rays.hpp"
#include "hal/sim/ray_tracer.hpp"
#include "hal/sim/renderer.hpp"
#include "platform/loop/worker_pool.hpp"

namespace firstlook::sim {

/// Reflectance of a board's front at a point of its plane, in board coordinates: ink, or white.
[[nodiscard]] float board_reflectance(const BoardPlacement& board, double x_m, double y_m);

/// Brightness of a diffuse surface: reflectance, times the light at a point with this unit normal.
[[nodiscard]] double shade(const Light& light, double reflectance, const Eigen::Vector3d& point_m,
                           const Eigen::Vector3d& normal);

/// What a picture shows of the light.
enum class Channel : std::uint8_t { kRed, kGreen, kBlue, kGray };

/// Fills `out`, which has the size of `rays.camera`: antialiased, blurred as by the lens, with noise, 8 bits. With
/// `workers` its threads share the rows; the picture is the same.
void render_color_image(const Scene& scene, const RayTracer& tracer, const PixelRays& rays,
                        const Transform<Base, Camera>& base_T_camera, const Exposure& exposure, Channel channel,
                        MutableGrayImage out, WorkerPool* workers = nullptr);

}  // namespace firstlook::sim
