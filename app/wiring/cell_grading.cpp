#include "app/wiring/cell_grading.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "app/config/board_config.hpp"

namespace firstlook {
namespace {

/// Pictures of a part that the cell's description names, with what the grader says of it.
void add_part_pictures(const sim::RegionFigure& region, double known_after_sweep, const Cart& cart, RunRecord& record) {
  const auto known = [](double share) { return fmt::format(": {:.0f} % of what can be observed known", 100 * share); };
  std::string name = region.name;
  std::ranges::replace(name, '_', ' ');
  if (!name.empty()) name[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(name[0])));
  for (MapPicture& picture : cart.pictures_of_part({name, region.low_m, region.high_m}, known(known_after_sweep),
                                                   known(region.known_fraction))) {
    record.map_pictures.push_back(std::move(picture));
  }
}

/// What mapping had taken until a moment of the job; empty: that moment never came.
std::optional<TruthRecord::Way> way_to(const std::optional<double>& time_s, const RunRecord& record) {
  const auto sweep = std::ranges::find(record.phases, "Sweep", &PhaseRecord::name);
  if (!time_s || !record.mapping || sweep == record.phases.end()) return std::nullopt;
  const auto views = std::ranges::count_if(record.mapping->views, [&](const MappingViewRecord& view) {
    return view.phase != "end" && view.time_s <= *time_s;
  });
  return TruthRecord::Way{*time_s - sweep->start_s, static_cast<int>(views)};
}

}  // namespace

void describe_cell(const sim::CellDescription& cell, Config& config) {
  if (cell.arm_file.empty()) config.arm.model = cell.arm.name.view();
  config.arm.file = cell.arm_file.empty() ? "none" : cell.arm_file;
  config.safe_zone = {cell.safe_zone.radius_m, cell.safe_zone.height_m};
  config.cart.top_m = cell.cart_top_m;
  set_targets(cell.boards, config);
  config.calibration.touch_tip_m = {cell.flange_p_tip_m.x(), cell.flange_p_tip_m.y(), cell.flange_p_tip_m.z()};
  for (const sim::KeepOut& box : cell.keep_out) {
    config.keep_out.push_back(
        {{box.low_m.x(), box.low_m.y(), box.low_m.z()}, {box.high_m.x(), box.high_m.y(), box.high_m.z()}});
  }
  if (cell.camera_envelope_m > 0) config.camera_envelope_radius_m = cell.camera_envelope_m;
  if (cell.map) {
    config.map.low_m = {cell.map->low_m.x(), cell.map->low_m.y(), cell.map->low_m.z()};
    config.map.high_m = {cell.map->high_m.x(), cell.map->high_m.y(), cell.map->high_m.z()};
  }
  if (!config.parking_rad) config.parking_rad = cell.start_rad;
}

void grade(sim::Grader& grader, const Cart& cart, const Config& config, RunRecord& record) {
  const Workbench& bench = cart.bench();
  sim::FinalClaims claims;
  if (bench.hand_eye()) {
    claims.flange_T_camera = bench.hand_eye()->flange_T_camera;
    claims.covariance = bench.hand_eye()->covariance;
    claims.camera_T_depth = bench.alignment().depth_camera.mount.camera_T_depth;
    claims.color_offset_s = bench.alignment().color_stamps.offset_s;
    claims.depth_offset_s = bench.alignment().depth_stamps.offset_s;
  }
  if (bench.mapped()) {
    claims.map = &bench.map();
    claims.reach_zone = bench.zone();
  }
  claims.now_s = bench.last_stamp_s();
  claims.free_max_age_s = config.map.free_max_age_s;
  if (bench.clearance_terms()) claims.observable.clearance = bench.clearance_terms()->clearance();
  claims.observable.sensor_range_min_m = config.depth.range_min_m;
  claims.observable.sensor_range_max_m = config.depth.range_max_m;
  claims.observable.sensor_range_trusted_m = config.depth.range_trusted_m;
  claims.observable.zone_floor_m = config.map.low_m[2];
  const sim::TruthFigures figures = grader.grade(claims);
  TruthRecord& truth = record.truth.emplace();
  truth.hand_eye_error_mm = figures.hand_eye_error_mm;
  truth.hand_eye_error_mrad = figures.hand_eye_error_mrad;
  truth.hand_eye_mahalanobis2 = figures.hand_eye_mahalanobis2;
  truth.depth_camera_error_mm = figures.depth_camera_error_mm;
  truth.depth_camera_error_mrad = figures.depth_camera_error_mrad;
  truth.color_stamps_error_s = figures.color_stamps_error_s;
  truth.depth_stamps_error_s = figures.depth_stamps_error_s;
  truth.contacts = figures.contacts;
  truth.unknown_entries = figures.unknown_entries;
  truth.coverage_of_observable = figures.coverage_of_observable;
  truth.to_95 = way_to(figures.known_95_s, record);
  truth.to_99 = way_to(figures.known_99_s, record);
  truth.false_free_voxels = figures.false_free_voxels;
  truth.false_occupied_fraction = figures.false_occupied_fraction;
  if (claims.map == nullptr) return;
  const VoxelMap swept = bench.map_after_sweep();
  claims.map = &swept;
  const auto after_sweep = grader.regions(claims);
  for (std::size_t i = 0; i < figures.regions.size() && i < after_sweep.size(); ++i) {
    const sim::RegionFigure& region = figures.regions[i];
    truth.regions.push_back({region.name, region.observable, after_sweep[i].known_fraction, region.known_fraction});
    add_part_pictures(region, after_sweep[i].known_fraction, cart, record);
  }
}

}  // namespace firstlook
