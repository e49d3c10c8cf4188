#include "app/report/result_json.hpp"

#include <nlohmann/json.hpp>

#include "app/report/alignment_json.hpp"
#include "app/report/hand_eye_json.hpp"
#include "app/report/map_json.hpp"
#include "app/report/ros_files.hpp"
#include "app/report/settling.hpp"

namespace firstlook {
namespace {

using Json = nlohmann::ordered_json;

template <typename T>
Json or_null(const std::optional<T>& value) {
  return value ? Json(*value) : Json(nullptr);
}

Json phases_json(const RunRecord& record) {
  Json phases = Json::array();
  for (const PhaseRecord& phase : record.phases) {
    phases.push_back({{"name", phase.name}, {"start_s", phase.start_s}, {"end_s", phase.end_s}});
  }
  return phases;
}

Json mapping_json(const MappingRecord& mapping) {
  Json remaining = Json::array();
  for (const RemainingRecord& cluster : mapping.remaining) {
    remaining.push_back({{"voxels", cluster.voxels},
                         {"reason", cluster.reason},
                         {"center_m", {cluster.center_m.x(), cluster.center_m.y(), cluster.center_m.z()}}});
  }
  Json refused = Json::object();
  for (std::size_t i = 0; i < kFrameFlaws; ++i) {
    refused[std::string(to_string(static_cast<FrameFlaw>(i)))] = mapping.frames_refused[i];
  }
  Json planes = nullptr;
  if (mapping.planes) {
    planes = planes_json(mapping.planes->counts);
    if (mapping.planes->counts.planes.color) planes["color"]["looks"] = mapping.planes->looks_colored;
  }
  return {{"views", mapping.views.size()},
          {"resolution_m", mapping.resolution_m},
          {"voxels", counts_json(mapping.voxels)},
          {"grid_voxels", counts_json(mapping.grid_voxels)},
          {"frames",
           {{"integrated", mapping.frames_integrated},
            {"dropped", mapping.frames_dropped()},
            {"refused", refused},
            {"infinite_pixels", mapping.infinite_pixels},
            {"pixels_left_out", mapping.pixels_left_out},
            {"pixels_fitted", mapping.pixels_fitted}}},
          {"planes", planes},
          {"fine", mapping.fine ? Json{{"resolution_m", mapping.fine->resolution_m},
                                       {"voxels", counts_json(mapping.fine->voxels)}}
                                : Json(nullptr)},
          {"holes",
           {{"policy", mapping.holes.policy},
            {"pixels_open", mapping.holes.pixels_open},
            {"voxels_cleared", mapping.holes.voxels_cleared}}},
          {"occupied_forgotten", mapping.occupied_forgotten},
          {"remaining", remaining},
          {"prior", mapping.since_prior ? change_json(*mapping.since_prior) : Json(nullptr)},
          {"objects", objects_json(mapping.objects)}};
}

Json safety_json(const SafetyRecord& safety) {
  Json stops = Json::array();
  for (const StopRecord& stop : safety.stops) stops.push_back({{"time_s", stop.time_s}, {"cause", stop.cause}});
  return {{"clearance_m", safety.clearance ? Json(safety.clearance->voxels_m) : Json(nullptr)},
          {"min_clearance_m", or_null(safety.min_clearance_m())},
          {"min_clearance_calibrating_m", or_null(safety.min_clearance_calibrating_m)},
          {"min_clearance_mapping_m", or_null(safety.min_clearance_mapping_m)},
          {"stops", stops}};
}

Json robot_json(const RobotRecord& robot) {
  Json checksums = Json::array(), rows = Json::array();
  for (const std::uint32_t checksum : robot.kinematics_checksums) checksums.push_back(fmt::format("{:08x}", checksum));
  for (const DhRow& row : robot.dh) {
    rows.push_back({{"theta_rad", row.theta_offset_rad},
                    {"d_m", row.d_m},
                    {"a_m", row.a_m},
                    {"alpha_rad", row.alpha_rad},
                    {"beta_rad", row.beta_rad},
                    {"gamma_rad", row.gamma_rad}});
  }
  Json file(nullptr);
  if (robot.calibration_file) {
    file = {{"path", robot.calibration_file->path},
            {"hash", robot.calibration_file->hash},
            {"hash_agrees", robot.calibration_file->hash_agrees},
            {"flange_off_m", robot.calibration_file->flange_off_m}};
  }
  return {{"model", robot.model},
          {"software", robot.software},
          {"serial", robot.serial.empty() ? Json(nullptr) : Json(robot.serial)},
          {"kinematics",
           {{"checksums", checksums}, {"ur_calibration_hash", robot.calibration_hash}, {"file", file}, {"dh", rows}}},
          {"play_to_consent_s", robot.consent_s},
          {"segment_begins_within_s", robot.accept_s},
          {"stop_stands_within_s", robot.stop_s},
          {"stop_answered_within_s", or_null(robot.react_s)},
          {"link_loss_answered_within_s", or_null(robot.lost_s)},
          {"joint_reports", robot.reports},
          {"streams_broken", robot.broken}};
}

Json memory_json(const MemoryRecord& memory) {
  return {{"budget_bytes", memory.budget_bytes},
          {"peak_bytes", memory.peak_bytes},
          {"loop_allocations_after_seal", memory.loop_allocations_after_seal}};
}

Json wall_json(const WallRecord& wall) {
  Json jobs = Json::array();
  for (const JobTimesRecord& job : wall.jobs)
    jobs.push_back({{"name", job.name}, {"count", job.count}, {"total_s", job.total_s}, {"longest_s", job.longest_s}});
  return {{"started", wall.started},
          {"total_s", wall.total_s},
          {"stall_s", wall.stall_s},
          {"real_time", wall.real_time},
          {"rss_bytes", wall.rss_bytes},
          {"boot_heap_bytes", wall.boot_heap_bytes},
          {"job_heap_peak_bytes", wall.job_heap_peak_bytes},
          {"library_bytes", wall.library_bytes},
          {"folder", wall.folder},
          {"workers", wall.workers},
          {"jobs", std::move(jobs)}};
}

Json way_json(const std::optional<TruthRecord::Way>& way) {
  if (!way) return nullptr;
  return {{"time_s", way->time_s}, {"views", way->views}};
}

Json truth_json(const TruthRecord& truth) {
  Json regions = Json::array();
  for (const TruthRecord::Region& region : truth.regions) {
    regions.push_back({{"name", region.name},
                       {"observable", region.observable},
                       {"known_after_sweep", region.known_after_sweep},
                       {"known", region.known}});
  }
  return {{"hand_eye_error_mm", or_null(truth.hand_eye_error_mm)},
          {"hand_eye_error_mrad", or_null(truth.hand_eye_error_mrad)},
          {"hand_eye_mahalanobis2", or_null(truth.hand_eye_mahalanobis2)},
          {"depth_camera_error_mm", or_null(truth.depth_camera_error_mm)},
          {"depth_camera_error_mrad", or_null(truth.depth_camera_error_mrad)},
          {"color_stamps_error_s", or_null(truth.color_stamps_error_s)},
          {"depth_stamps_error_s", or_null(truth.depth_stamps_error_s)},
          {"contacts", truth.contacts},
          {"unknown_entries", truth.unknown_entries},
          {"coverage_of_observable", or_null(truth.coverage_of_observable)},
          {"to_95", way_json(truth.to_95)},
          {"to_99", way_json(truth.to_99)},
          {"false_free_voxels", or_null(truth.false_free_voxels)},
          {"false_occupied_fraction", or_null(truth.false_occupied_fraction)},
          {"regions", regions}};
}

/// A cell from a file goes by the file's name: paths differ from machine to machine.
std::string cell_name(const std::string& cell) { return cell.substr(cell.rfind('/') + 1); }

}  // namespace

std::string result_json(const RunRecord& record) {
  Json json;
  json["outcome"] = name_of(record.outcome);
  json["reason"] = record.reason;
  json["remedy"] = record.remedy.empty() ? Json() : Json(record.remedy);
  json["seed"] = record.seed;
  json["cell"] = cell_name(record.cell);
  json["phases"] = phases_json(record);
  json["decisions_hash"] = record.decisions_hash;
  json["hand_eye"] =
      record.hand_eye ? Json(hand_eye_json(*record.hand_eye, kFlangeFrame, record.solver)) : Json(nullptr);
  if (record.hand_eye && record.verified) {
    nlohmann::json hand_eye = json["hand_eye"];
    describe_stored(*record.verified, hand_eye);
    json["hand_eye"] = hand_eye;
  }
  if (const auto settling = settling_of(record.calibration_views); settling && record.hand_eye) {
    json["hand_eye"]["settling"] = {{"corner_scatter_px", settling->scatter_px},
                                    {"moved_max_px", settling->moved_max_px},
                                    {"stops_looked_at_again", settling->looked_again},
                                    {"looks_max", settling->looks_max},
                                    {"stops_never_still", settling->restless}};
  }
  if (record.hand_eye && record.comparison) {
    json["hand_eye"]["solver_comparison"] = solver_comparison_json(*record.comparison);
  }
  if (record.hand_eye && record.target_names.size() > 1) {
    nlohmann::json hand_eye = json["hand_eye"];
    describe_targets(*record.hand_eye, record.target_names, hand_eye);
    json["hand_eye"] = hand_eye;
  }
  const bool aligned = record.hand_eye && record.alignment;
  json["depth_camera"] = aligned ? Json(depth_camera_json(record.alignment->depth_camera)) : Json(nullptr);
  json["time_offset"] = aligned ? Json(time_offset_json(*record.alignment)) : Json(nullptr);
  json["mapping"] = record.mapping ? mapping_json(*record.mapping) : Json(nullptr);
  json["safety"] = record.safety ? safety_json(*record.safety) : Json(nullptr);
  json["robot"] = record.robot ? robot_json(*record.robot) : Json(nullptr);
  json["memory"] = record.memory ? memory_json(*record.memory) : Json(nullptr);
  json["wall"] = wall_json(record.wall);
  json["truth"] = record.truth ? truth_json(*record.truth) : Json(nullptr);
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace firstlook
