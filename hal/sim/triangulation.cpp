#include "hal/sim/triangulation.hpp"

#include <cmath>
#include <numbers>

namespace firstlook::sim {
namespace {

constexpr int kCylinderSides = 96;

Mesh mesh_of(const Box& box) {
  Mesh mesh;
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d sign(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1);
    mesh.vertices_m.push_back(sign.cwiseProduct(box.half_m));
  }
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

Mesh mesh_of(const Cylinder& cylinder) {
  Mesh mesh;
  mesh.vertices_m = {{0, 0, -cylinder.half_height_m}, {0, 0, cylinder.half_height_m}};
  for (int i = 0; i < kCylinderSides; ++i) {
    const double angle = 2 * std::numbers::pi * i / kCylinderSides;
    const double x = cylinder.radius_m * std::cos(angle), y = cylinder.radius_m * std::sin(angle);
    mesh.vertices_m.emplace_back(x, y, -cylinder.half_height_m);
    mesh.vertices_m.emplace_back(x, y, cylinder.half_height_m);
  }
  for (std::uint32_t i = 0; i < kCylinderSides; ++i) {
    const std::uint32_t low = 2 + 2 * i, next = 2 + 2 * ((i + 1) % kCylinderSides);
    mesh.triangles.push_back({0, next, low});
    mesh.triangles.push_back({1, low + 1, next + 1});
    mesh.triangles.push_back({low, next, low + 1});
    mesh.triangles.push_back({next, next + 1, low + 1});
  }
  return mesh;
}

Mesh mesh_of(const Mesh& mesh) { return mesh; }

}  // namespace

Mesh triangulate(const Shape& shape) {
  return std::visit([](const auto& solid) { return mesh_of(solid); }, shape);
}

}  // namespace firstlook::sim
