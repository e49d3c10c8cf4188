#include "hal/sim/ray_tracer.hpp"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "hal/sim/triangulation.hpp"
#include "platform/core/ensure.hpp"

namespace firstlook::sim {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr std::size_t kPacket = 8;

void attach(RTCDevice device, RTCScene scene, const Solid& solid, unsigned id) {
  const Mesh mesh = triangulate(solid.shape);
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                               3 * sizeof(float), mesh.vertices_m.size()));
  auto* indices = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(std::uint32_t), mesh.triangles.size()));
  ENSURE(5202, vertices != nullptr && indices != nullptr);
  for (const Eigen::Vector3d& vertex : mesh.vertices_m) {
    const Eigen::Vector3f v = (solid.base_T_solid * vertex).cast<float>();
    vertices = std::copy(v.data(), v.data() + 3, vertices);
  }
  for (const auto& triangle : mesh.triangles) indices = std::copy(triangle.begin(), triangle.end(), indices);
  rtcCommitGeometry(geometry);
  rtcAttachGeometryByID(scene, geometry, id);
  rtcReleaseGeometry(geometry);
}

RTCIntersectContext coherent_context() {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  return context;
}

/// Rays beyond the end of the row are switched off.
void fill_origin_and_mask(RTCRay8& ray, int (&valid)[kPacket], const Eigen::Vector3f& origin, std::size_t live) {
  for (std::size_t lane = 0; lane < kPacket; ++lane) {
    valid[lane] = lane < live ? -1 : 0;
    ray.org_x[lane] = origin.x(), ray.org_y[lane] = origin.y(), ray.org_z[lane] = origin.z();
    ray.tnear[lane] = 0, ray.tfar[lane] = kInfinity;
    ray.time[lane] = 0, ray.mask[lane] = ~0U, ray.id[lane] = 0, ray.flags[lane] = 0;
    ray.dir_x[lane] = 0, ray.dir_y[lane] = 0, ray.dir_z[lane] = 1;
  }
}

}  // namespace

struct RayTracer::State {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
};

RayTracer::RayTracer(const Scene& scene) : state_(std::make_unique<State>()) {
  // One instruction set everywhere: the same bits on every machine.
  state_->device = rtcNewDevice("isa=avx2,threads=1,set_affinity=0");
  ENSURE(5201, state_->device != nullptr);
  state_->scene = rtcNewScene(state_->device);
  rtcSetSceneFlags(state_->scene, RTC_SCENE_FLAG_ROBUST);  // no ray slips between two triangles
  for (std::size_t i = 0; i < scene.solids.size(); ++i) {
    attach(state_->device, state_->scene, scene.solids[i], static_cast<unsigned>(i));
  }
  rtcCommitScene(state_->scene);
}

RayTracer::~RayTracer() {
  rtcReleaseScene(state_->scene);
  rtcReleaseDevice(state_->device);
}

void RayTracer::trace(const Eigen::Vector3d& origin_m, RayRow& row, std::size_t count) const {
  RTCIntersectContext context = coherent_context();
  const Eigen::Vector3f origin = origin_m.cast<float>();
  alignas(32) RTCRayHit8 packet;
  alignas(32) int valid[kPacket];
  for (std::size_t first = 0; first < count; first += kPacket) {
    const std::size_t live = std::min(kPacket, count - first);
    fill_origin_and_mask(packet.ray, valid, origin, live);
    for (std::size_t lane = 0; lane < kPacket; ++lane) {
      packet.hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;
      packet.hit.instID[0][lane] = RTC_INVALID_GEOMETRY_ID;
    }
    std::copy_n(&row.x[first], live, packet.ray.dir_x);
    std::copy_n(&row.y[first], live, packet.ray.dir_y);
    std::copy_n(&row.z[first], live, packet.ray.dir_z);
    rtcIntersect8(valid, state_->scene, &context, &packet);
    for (std::size_t lane = 0; lane < live; ++lane) {
      const std::size_t i = first + lane;
      const bool hit = packet.hit.geomID[lane] != RTC_INVALID_GEOMETRY_ID;
      row.solid[i] = hit ? static_cast<std::int32_t>(packet.hit.geomID[lane]) : -1;
      row.t[i] = hit ? packet.ray.tfar[lane] : kInfinity;
      Eigen::Vector3f n(packet.hit.Ng_x[lane], packet.hit.Ng_y[lane], packet.hit.Ng_z[lane]);
      if (!hit) n = Eigen::Vector3f::UnitZ();
      n.normalize();
      if (n.x() * row.x[i] + n.y() * row.y[i] + n.z() * row.z[i] > 0) n = -n;
      row.nx[i] = n.x(), row.ny[i] = n.y(), row.nz[i] = n.z();
    }
  }
}

void RayTracer::find_blocked(const Eigen::Vector3d& origin_m, const RayRow& row, std::size_t count,
                             std::vector<std::uint8_t>& blocked) const {
  RTCIntersectContext context = coherent_context();
  const Eigen::Vector3f origin = origin_m.cast<float>();
  alignas(32) RTCRay8 ray;
  alignas(32) int valid[kPacket];
  for (std::size_t first = 0; first < count; first += kPacket) {
    const std::size_t live = std::min(kPacket, count - first);
    fill_origin_and_mask(ray, valid, origin, live);
    std::copy_n(&row.x[first], live, ray.dir_x);
    std::copy_n(&row.y[first], live, ray.dir_y);
    std::copy_n(&row.z[first], live, ray.dir_z);
    std::copy_n(&row.t[first], live, ray.tfar);
    for (std::size_t lane = 0; lane < live; ++lane) {
      if (!(ray.tfar[lane] > 0)) valid[lane] = 0;
    }
    rtcOccluded8(valid, state_->scene, &context, &ray);
    // Embree sets tfar to minus infinity where it met something.
    for (std::size_t lane = 0; lane < live; ++lane) blocked[first + lane] = valid[lane] != 0 && ray.tfar[lane] < 0;
  }
}

double RayTracer::distance_m(const Eigen::Vector3d& origin_m, const Eigen::Vector3d& direction) const {
  RTCIntersectContext context = coherent_context();
  RTCRayHit hit{};
  const Eigen::Vector3f origin = origin_m.cast<float>(), d = direction.cast<float>();
  hit.ray.org_x = origin.x(), hit.ray.org_y = origin.y(), hit.ray.org_z = origin.z();
  hit.ray.dir_x = d.x(), hit.ray.dir_y = d.y(), hit.ray.dir_z = d.z();
  hit.ray.tfar = kInfinity;
  hit.ray.mask = ~0U;
  hit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  hit.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(state_->scene, &context, &hit);
  return hit.hit.geomID == RTC_INVALID_GEOMETRY_ID ? std::numeric_limits<double>::infinity()
                                                   : static_cast<double>(hit.ray.tfar);
}

}  // namespace firstlook::sim
