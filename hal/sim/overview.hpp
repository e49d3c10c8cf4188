/// Pictures of a cell for people.
#pragma once

#include "hal/sim/ray_tracer.hpp"
#include "hal/sim/renderer.hpp"

namespace firstlook::sim {

/// See Renderer::render_overview.
[[nodiscard]] Overview paint_overview(const Scene& scene, const RayTracer& tracer, const Eigen::Vector3d& eye_m,
                                      const Eigen::Vector3d& look_at_m, const Capsules& body, int width, int height,
                                      double horizontal_fov_rad);

}  // namespace firstlook::sim
