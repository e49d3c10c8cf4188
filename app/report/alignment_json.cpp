#include "app/report/alignment_json.hpp"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

namespace firstlook {
namespace {

using nlohmann::json;

template <typename Vector>
json array_of(const Vector& vector) {
  json array = json::array();
  for (Eigen::Index i = 0; i < vector.size(); ++i) array.push_back(vector(i));
  return array;
}

json reason_json(const std::string& reason) { return reason.empty() ? json(nullptr) : json(reason); }

json estimate_json(const DepthToColor& estimate) {
  json untold = json::array();
  for (const UntoldDirection& direction : estimate.untold) {
    untold.push_back({{"direction", direction.name}, {"sigma_ratio", direction.sigma_ratio}});
  }
  const auto used = std::ranges::count_if(estimate.stops, [](const DepthStopFit& stop) { return stop.used; });
  return {{"moved_mm", 1e3 * estimate.moved.head<3>().norm()},
          {"moved_mrad", 1e3 * estimate.moved.tail<3>().norm()},
          {"views_used", used},
          {"noise_at_1m_mm", 1e3 * estimate.noise_at_1m},
          {"offset_rms_mm", 1e3 * estimate.offset_rms_m},
          {"excess_offset_mm", 1e3 * estimate.excess.offset_m},
          {"excess_tilt_mrad", 1e3 * estimate.excess.tilt_rad},
          {"untold", untold},
          {"stated",
           {{"chi2", estimate.belief.chi2},
            {"degrees_of_freedom", estimate.belief.degrees_of_freedom},
            {"chi2_limit", estimate.belief.chi2_limit},
            {"contradicted", estimate.belief.contradicted()}}}};
}

json stamps_json(const StampRecord& record) {
  json object = {{"source", name_of(record.source)},
                 {"reason", reason_json(record.reason)},
                 {"offset_s", record.offset_s},
                 {"sigma_s", record.source == ValueSource::kGiven ? json(nullptr) : json(record.sigma_s)}};
  const auto& estimate = record.estimate;
  object["frames"] = estimate ? json(estimate->frames) : json(nullptr);
  object["frames_left_out"] = estimate ? json(estimate->left_out) : json(nullptr);
  object["motions"] = estimate ? json(estimate->motions) : json(nullptr);
  object["speed_max_m_s"] = estimate ? json(estimate->speed_max_m_s) : json(nullptr);
  object["misfit"] = estimate ? json(estimate->misfit) : json(nullptr);
  return object;
}

}  // namespace

std::string_view name_of(ValueSource source) {
  constexpr std::array<std::string_view, 3> kNames = {"given", "estimated", "stored"};
  return kNames[static_cast<std::size_t>(source)];
}

json depth_camera_json(const DepthCameraRecord& record) {
  const Transform<Camera, Depth>& pose = record.mount.camera_T_depth;
  Eigen::Vector4d q = pose.quaternion().coeffs();
  if (q.w() < 0) q = -q;  // one of the two that mean the same
  const Vector7d sigma = record.mount.covariance.diagonal().cwiseSqrt();
  json object = {{"source", name_of(record.source)},
                 {"reason", reason_json(record.reason)},
                 {"translation_m", array_of(pose.translation())},
                 {"quaternion_xyzw", array_of(q)},
                 {"sigma_translation_mm", array_of(Eigen::Vector3d(1e3 * sigma.head<3>()))},
                 {"sigma_rotation_mrad", array_of(Eigen::Vector3d(1e3 * sigma.segment<3>(3)))},
                 {"depth_scale", record.mount.depth_scale},
                 {"sigma_depth_scale", sigma[6]},
                 {"views", record.views}};
  object["estimate"] = record.estimate ? estimate_json(*record.estimate) : json(nullptr);
  return object;
}

json time_offset_json(const AlignmentRecord& record) {
  return {{"color", stamps_json(record.color_stamps)}, {"depth", stamps_json(record.depth_stamps)}};
}

}  // namespace firstlook
