/// Solids as triangles.
#pragma once

#include "hal/sim/scene.hpp"

namespace firstlook::sim {

/// A closed surface of triangles in the solid's own frame. Exact for boxes and meshes; a cylinder becomes a prism of 96
/// sides inside it (less than 0.06 % of the radius).
[[nodiscard]] Mesh triangulate(const Shape& shape);

}  // namespace firstlook::sim
