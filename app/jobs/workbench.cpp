#include "app/jobs/workbench.hpp"
#include "app/config/board_config.hpp"

#include <algorithm>

#include "algorithms/mapping/reach_zone.hpp"
#include "app/dataset/map_file.hpp"

namespace firstlook {
namespace {
constexpr double kFieldMax_m = 0.6;     // farther is as good as free: the largest body radius and clearance are below
constexpr double kZoneMargin_m = 0.10;  // stopping distance and a voxel, as the reach zone wants
constexpr std::size_t kViewRecordsMax = 512;
constexpr std::size_t kWaySightsMax = 60;  // as many as the machine takes
// Known free space that expires within this share of its greatest age wants a look: a few views renew all of it, and a
// job that lasts longer does not find its way back closed.
constexpr double kFreshShareOfAge = 1.0 / 3;
constexpr double kRoomToSpare_m = 0.015;  // beyond rule 5 when there is a choice: surfaces flicker by parts of a voxel
constexpr double kSlowSpeed_m_s = 0.05;   // stops within 1.3 mm instead of 16.5

DepthSensor sensor_of(const Config& config, const hal::DepthCamera& camera) {
  return {camera.intrinsics(), config.depth.range_min_m, config.depth.range_max_m, config.depth.range_trusted_m,
          config.depth.baseline_m};
}

VoxelMap::Planes planes_of(const Config& config) {
  return config.map.holes == "ignore" ? VoxelMap::Planes::kAll : VoxelMap::Planes::kWithOpenRays;
}

PlaneChoice map_planes_of(const Config& config) {
  return planes_from_words(config.map.planes).value_or(PlaneChoice{});  // load_config has refused other words
}

Eigen::Vector3d vector_of(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }

GridGeometry fine_geometry(const Config& config) {
  return GridGeometry::covering(vector_of(config.map.fine_low_m), vector_of(config.map.fine_high_m),
                                config.map.fine_resolution_m);
}

/// Of the prior map, and of what rays meet in it.
std::size_t prior_bytes(const GridGeometry& geometry) {
  return VoxelMap::required_bytes(geometry, VoxelMap::Planes::kLogOddsOnly) + GainModel::prior_bytes(geometry);
}

std::size_t fine_map_bytes(const Config& config) {
  return config.map.fine_resolution_m > 0
             ? VoxelMap::required_bytes(fine_geometry(config), VoxelMap::Planes::kLogOddsOnly)
             : 0;
}

DepthFilterOptions filter_of(const Config& config) { return {config.depth.crop_m, config.depth.filter_voxel_m}; }

PlaneFitOptions plane_fit_of(const Config& config) {
  return {config.depth.plane_fit_px, config.depth.noise_floor_m, config.depth.noise_at_1m_m};
}

GroundPlane ground_of(const Config& config) { return {config.map.ground_height_m, config.map.ground_tolerance_m}; }

/// Safe zone, sweep and certificates hold about axis 1 wherever it points. A level floor and what stands on it do not.
Status check_mounting(const Config& config) {
  if (config.arm.mounting != "tilted") return {};
  const char* const key = config.map.ground_tolerance_m > 0 ? "map.ground_tolerance_m"
                          : map_planes_of(config).label     ? "map.planes: label"
                                                            : nullptr;
  if (key == nullptr) return {};
  return failure(Fault::kConfigBadValue,
                 "{} needs z of the arm's base to point up, which arm.mounting: tilted says it does not", key);
}

ClearanceInputs clearance_inputs(const Config& config) {
  ClearanceInputs in;
  in.voxel_m = config.map.resolution_m;
  in.sigma_depth_floor_m = config.depth.noise_floor_m;
  in.sigma_depth_at_1m_m = config.depth.noise_at_1m_m;
  in.sigma_tracking_m = config.clearance.tracking_sigma_m;
  in.payload_sag_m = config.clearance.sag_m;
  in.speed_m_s = config.arm.speed_max_m_s;
  in.reaction_s = config.clearance.reaction_time_s;
  in.deceleration_m_s2 = config.clearance.deceleration_m_s2;
  return in;
}
}  // namespace

Result<std::unique_ptr<Workbench>> Workbench::make(const Config& config, const CellFacts& facts,
                                                   hal::ColorCamera& color, hal::DepthCamera& depth,
                                                   WorkerPool& workers) {
  const auto arm = facts.arm ? facts.arm : find_arm_model(config.arm.model);
  if (!arm) return failure(Fault::kConfigBadValue, "arm.model: {} is not built in", config.arm.model);
  if (const Status stands = check_mounting(config); !stands) return std::unexpected(stands.error());
  if (config.parking_rad && config.parking_rad->size() != arm->joints) {
    return failure(Fault::kConfigBadValue, "parking_rad: {} angles, but the arm {} has {} joints",
                   config.parking_rad->size(), arm->name.view(), arm->joints);
  }
  if (facts.stored) {
    const Status fits = check_belongs(*facts.stored, *arm, color.intrinsics(), facts.camera_T_depth,
                                      config.calibration.intrinsics == "estimate");
    if (!fits) return failure(fits.error().fault, "{}: {}", config.calibration.stored, fits.error().detail());
  }
  const GridGeometry geometry =
      GridGeometry::covering(vector_of(config.map.low_m), vector_of(config.map.high_m), config.map.resolution_m);
  const bool has_prior = config.map.prior != "none";
  const std::size_t needed = VoxelMap::required_bytes(geometry, planes_of(config)) + 3 * geometry.count() +
                             fine_map_bytes(config) + MapPlanes::required_bytes(geometry, map_planes_of(config)) +
                             (has_prior ? prior_bytes(geometry) : 0);
  if (needed > memory::budget_row(memory::Pool::kVoxelPlanes).bytes()) {
    return failure(Fault::kMapTooLarge, "{} x {} x {} voxels of {} m{}{} need {:.1f} MiB, the budget holds {:.1f} MiB",
                   geometry.size.x(), geometry.size.y(), geometry.size.z(), geometry.resolution_m,
                   map_planes_of(config).any() ? " with map.planes" : "",
                   fine_map_bytes(config) > 0 ? " and the finer map" : "", static_cast<double>(needed) / memory::kMiB,
                   static_cast<double>(memory::budget_row(memory::Pool::kVoxelPlanes).bytes()) / memory::kMiB);
  }
  if (map_planes_of(config).color && !color.delivers_color())
    return failure(Fault::kConfigBadValue, "map.planes: {}: the colour camera delivers grey values only",
                   config.map.planes);
  std::optional<VoxelMap> prior;
  if (has_prior) {
    auto read = read_map_file_into(config.map.prior, geometry);
    if (!read) return failure(read.error().fault, "map.prior: {}", read.error().detail());
    prior = std::move(read->map);
  }
  auto bench = std::unique_ptr<Workbench>(new Workbench(config, facts, *arm, color, depth, workers, geometry));
  if (prior) bench->take_prior(std::move(*prior));
  if (const Status taken = bench->take_memory(); !taken) return std::unexpected(taken.error());
  return bench;
}

Workbench::Workbench(const Config& config, const CellFacts& facts, const ArmModel& arm, hal::ColorCamera& color,
                     hal::DepthCamera& depth, WorkerPool& workers, const GridGeometry& geometry)
    : config_(config),
      facts_(facts),
      arm_(arm),
      color_(color),
      depth_(depth),
      workers_(workers),
      targets_(targets_of(config).value_or(std::vector<NamedTarget>(1))),  // load_config has refused what is none
      boards_(boards_of(targets_)),
      limits_{config.arm.speed_max_m_s, config.arm.speed_max_rad_s, config.arm.acceleration_rad_s2},
      zone_cylinder_{config.safe_zone.radius_m, config.safe_zone.height_m, config.cart.top_m},
      searching_body_(body_with_envelopes(arm, config.camera_envelope_radius_m)),
      envelope_body_(body_with_envelope(arm, config.camera_envelope_radius_m)),
      camera_body_(envelope_body_),
      blind_terms_(required_clearance(clearance_inputs(config))),
      map_(geometry, planes_of(config)),
      inserter_(geometry, sensor_of(config, depth)),
      gate_(sensor_of(config, depth)),
      field_(geometry, kFieldMax_m),
      free_mask_(geometry.count(), 0),
      zone_(geometry.count(), 0),
      revoked_field_(geometry, kFieldMax_m),
      chooser_(geometry, sensor_of(config, depth), config.explore.candidates, workers.workers(),
               config.explore.certificate_samples,
               GainSampling{.cluster_voxels_min = config.explore.cluster_voxels_min}),
      swept_log_odds_(geometry.count(), kUnknownLogOdds),
      published_(geometry, kFieldMax_m) {
  take_options();
  map_.set_safe_zone(zone_cylinder_);
  for (const Capsule& capsule : place(arm_.body, forward(arm_, facts_.start_rad))) {
    if (capsule.link == 0) map_.note_fixed_body(capsule, kSelfPadding_m);
  }
  for (const Config::KeepOut& box : config.keep_out) map_.block(AxisBox{vector_of(box.low_m), vector_of(box.high_m)});
  mapping_views_.reserve(kViewRecordsMax);
  identify_reference_.resize(boards_.size());
  located_.resize(boards_.size());
  sought_.resize(boards_.size());
  observations_.reserve((stops_max() + 1) * boards_.size());
  way_sights_.reserve(kWaySightsMax);
  begin_alignment();
  searches_inner_links_ = configuration_is_free(arm_, searching_body_, space_of(MotionPhase::kLinkUnknown),
                                                blind_terms_.clearance(), facts_.start_rad);
  if (!searches_inner_links_) searching_body_ = envelope_body_;
  publish_blind(0, searching_phase());
  published_.take();
}

/// What is off by default.
void Workbench::take_options() {
  const GridGeometry& g = map_.geometry();
  const DepthSensor& sensor = inserter_.sensor();
  holes_record_.policy = config_.map.holes;
  if (config_.map.holes != "ignore") open_rays_.emplace(g, sensor);
  if (filter_of(config_).is_on()) filter_.emplace(g, sensor, filter_of(config_));
  if (plane_fit_of(config_).is_on()) plane_fit_.emplace(sensor.intrinsics, plane_fit_of(config_));
  const GroundPlane ground = ground_of(config_);
  if (ground.tolerance_m > 0) {
    inserter_.set_ground(ground);
    map_.block(HalfSpace{-Eigen::Vector3d::UnitZ(), -ground.top_m()});
  }
  planes_ = MapPlanes(g, map_planes_of(config_));
  if (planes_.color) color_registration_.emplace(g, sensor, color_.intrinsics());
  if (config_.map.fine_resolution_m == 0) return;
  fine_map_.emplace(fine_geometry(config_), VoxelMap::Planes::kLogOddsOnly);
  fine_inserter_.emplace(fine_map_->geometry(), sensor);
  if (ground.tolerance_m > 0) fine_inserter_->set_ground(ground);
}

Status Workbench::take_memory() {
  const GridGeometry& g = map_.geometry();
  const auto account = [this](memory::Pool pool, std::size_t bytes) -> Status {
    auto share = memory::PoolShare::take(pool, bytes);
    if (!share) return std::unexpected(share.error());
    shares_.push_back(std::move(*share));
    return {};
  };
  const DepthSensor& sensor = inserter_.sensor();
  const std::size_t options = (open_rays_ ? OpenRays::required_bytes(g, sensor) : 0) +
                              (filter_ ? DepthFilter::required_bytes(g, sensor, filter_of(config_)) : 0) +
                              PlaneFit::required_bytes(sensor.intrinsics, plane_fit_of(config_)) +
                              (planes_.color ? ColorRegistration::required_bytes(sensor, color_.intrinsics()) : 0) +
                              (fine_map_ ? Inserter::required_bytes(fine_map_->geometry(), sensor) : 0);
  const std::size_t snapshot = 2 * DistanceField::required_bytes(g) + g.count();
  const std::size_t views = stops_max() + 1;
  // A stop may show every target, a frame on the way counts for one of them.
  std::size_t view = 0, points_max = 0;
  for (const BoardSpec& board : boards_) {
    const std::size_t point = sizeof(Eigen::Vector2d) + (board.allows_partial_views() ? sizeof(int) : 0);
    const std::size_t points = static_cast<std::size_t>(board.corners()) * point;
    view += sizeof(Observation) + points;
    points_max = std::max(points_max, points);
  }
  const std::size_t way_sight =
      sizeof(WaySight) + decltype(WayArguments::joints)::capacity() * sizeof(JointSample) + points_max;
  for (const auto& [pool, bytes] : {
           std::pair{memory::Pool::kVoxelPlanes,
                     VoxelMap::required_bytes(g, planes_of(config_)) + 3 * g.count() + fine_map_bytes(config_) +
                         MapPlanes::required_bytes(g, planes_.choice()) + (prior_ ? prior_bytes(g) : 0)},
           std::pair{memory::Pool::kDistanceField,
                     2 * DistanceField::required_bytes(g) + Inserter::required_bytes(g, sensor) + options},
           std::pair{memory::Pool::kGuardianSnapshot, 2 * snapshot},
           std::pair{memory::Pool::kViewCandidates,
                     ViewChooser::required_bytes(g, sensor, config_.explore.candidates, 2,
                                                 config_.explore.certificate_samples)},
           std::pair{memory::Pool::kPlannerNodes, 2 * Planner::required_bytes()},  // ours and the chooser's
           std::pair{memory::Pool::kCalibrationViews, views * view + kWaySightsMax * way_sight},
           std::pair{memory::Pool::kApplication, sizeof(Workbench) + kViewRecordsMax * sizeof(MappingViewRecord)},
       }) {
    if (const Status status = account(pool, bytes); !status) return status;
  }
  const auto color_pixels =
      static_cast<std::size_t>(color_.intrinsics().width) * static_cast<std::size_t>(color_.intrinsics().height);
  const auto depth_pixels =
      static_cast<std::size_t>(depth_.intrinsics().width) * static_cast<std::size_t>(depth_.intrinsics().height);
  auto gray = memory::PoolBuffer<std::uint8_t>::make(memory::Pool::kColorFrames, color_pixels);
  if (!gray) return std::unexpected(gray.error());
  gray_ = std::move(*gray);
  if (planes_.color) {
    auto colors = memory::PoolBuffer<Rgb>::make(memory::Pool::kColorFrames, color_pixels);
    if (!colors) return std::unexpected(colors.error());
    colors_ = std::move(*colors);
  }
  auto raw = memory::PoolBuffer<std::uint16_t>::make(memory::Pool::kDepthFrames, depth_pixels);
  if (!raw) return std::unexpected(raw.error());
  depth_pixels_ = std::move(*raw);
  auto self = memory::PoolBuffer<float>::make(memory::Pool::kDistanceField, depth_pixels);
  if (!self) return std::unexpected(self.error());
  self_depth_ = std::move(*self);
  // Pictures of the first views that fit; the report shows the corners of the others without.
  const std::size_t pictures_fit = memory::budget_row(memory::Pool::kReportBuffers).bytes() / color_pixels;
  auto pictures = memory::PoolBuffer<std::uint8_t>::make(memory::Pool::kReportBuffers,
                                                         color_pixels * std::min(pictures_fit, stops_max()));
  if (!pictures) return std::unexpected(pictures.error());
  pictures_ = std::move(*pictures);
  return {};
}

const Body& Workbench::body_of(MotionPhase phase) const {
  if (phase == MotionPhase::kLinkUnknown) return searching_body_;
  return phase == MotionPhase::kMapping ? camera_body_ : envelope_body_;
}

FreeSpace Workbench::space_of(MotionPhase phase) const {
  FreeSpace space;
  space.field = phase == MotionPhase::kMapping ? &field_ : nullptr;
  space.zone = zone_cylinder_;
  space.revoked = any_revoked_ ? &revoked_field_ : nullptr;
  for (const Config::KeepOut& box : config_.keep_out) {
    space.keep_out_boxes.push_back({vector_of(box.low_m), vector_of(box.high_m)});
  }
  // Also where the safe zone would call it free.
  if (const GroundPlane ground = ground_of(config_); ground.tolerance_m > 0) {
    space.keep_out_planes.push_back({Eigen::Vector3d::UnitZ(), ground.top_m()});
  }
  return space;
}

std::array<Workbench::Pace, 3> Workbench::mapping_paces() const {
  const Clearance normal = mapping_terms_->clearance();
  const Clearance slow = slow_terms_.clearance();
  Clearance roomy = normal;
  roomy.voxels_m += kRoomToSpare_m;
  SpeedLimits slow_limits = limits_;
  slow_limits.body_speed_m_s = std::min(kSlowSpeed_m_s, limits_.body_speed_m_s);
  return {{{roomy, normal, limits_}, {normal, normal, limits_}, {slow, slow, slow_limits}}};
}

/// After the calibration is accepted: its clearance, the body with the camera where it is, and the zone to be mapped.
void Workbench::begin_mapping() {
  ClearanceInputs in = clearance_inputs(config_);
  in.sigma_hand_eye_m = hand_eye_->sigma_translation_m.maxCoeff();
  in.sigma_hand_eye_rad = hand_eye_->sigma_rotation_rad.maxCoeff();
  const Vector7d depth_camera = alignment_.depth_camera.mount.covariance.diagonal().cwiseSqrt();
  in.sigma_depth_camera_m = depth_camera.head<3>().maxCoeff();
  in.sigma_depth_camera_rad = depth_camera.segment<3>(3).maxCoeff();
  in.sigma_depth_scale = depth_camera[6];
  in.sigma_tracking_m = std::hypot(in.sigma_tracking_m, config_.map.pose_sigma_max_m);
  mapping_terms_ = required_clearance(in);
  in.speed_m_s = std::min(kSlowSpeed_m_s, in.speed_m_s);
  slow_terms_ = required_clearance(in);
  clearance_in_force_ = mapping_terms_->clearance();
  camera_body_ = body_with_camera(arm_, hand_eye_->flange_T_camera);
  mark_reach_zone(map_.geometry(), arm_, camera_body_.capsules, kZoneMargin_m, config_.map.low_m[2], zone_);
  unknown_before_ = unknown_at_view_ = zone_counts().unknown;
  rebuild_free_space(last_stamp_s_);
}

VoxelCounts Workbench::zone_counts() const {
  VoxelCounts counts;
  for (std::size_t i = 0; i < zone_.size(); ++i) {
    if (zone_[i] == 0) continue;
    switch (map_.voxel_class(i)) {
      case VoxelClass::kUnknown:
        ++counts.unknown;
        break;
      case VoxelClass::kFree:
        ++counts.free;
        break;
      case VoxelClass::kOccupied:
        ++counts.occupied;
        break;
    }
  }
  return counts;
}

void Workbench::rebuild_free_space(double now_s) {
  if (mapping_terms_) revoke_zone();
  map_.free_mask(now_s, config_.map.free_max_age_s, free_mask_);
  field_.update(free_mask_);
  if (!mapping_terms_) return;
  mapping_space_ = space_of(MotionPhase::kMapping);
  for (std::size_t i = 0; i < free_mask_.size(); ++i) {
    if (free_mask_[i] == 0 && map_.zone_revoked(i)) free_mask_[i] = PublishedSpace::kRevokedVoxel;
    if (map_.voxel_class(i) != VoxelClass::kUnknown) free_mask_[i] |= PublishedSpace::kKnownVoxel;
  }
  published_.publish(mapping_space_, camera_body_,
                     guardian_clearance(mapping_terms_->clearance(), mapping_terms_->stopping_m), free_mask_);
}

/// The guardian holds motions to what they are planned with: here the envelopes in the safe zone. They contain the
/// camera, but not all of the capsules that stand for the camera once its place is known.
void Workbench::publish_blind(double now_s, MotionPhase phase) {
  map_.free_mask(now_s, config_.map.free_max_age_s, free_mask_);
  published_.publish(space_of(phase), body_of(phase),
                     guardian_clearance(blind_terms_.clearance(), blind_terms_.stopping_m), free_mask_);
}

void Workbench::forget_known_free() {
  map_.forget_known_free();
  chooser_.gain().forget_futile();
  rebuild_free_space(last_stamp_s_);
}

/// After hits inside the safe zone: the zone counts only away from them. Voxels that its cylinder cuts through have no
/// flag of their own; there an occupied one takes the zone away.
void Workbench::revoke_zone() {
  const GridGeometry& g = map_.geometry();
  const double half_diagonal = 0.5 * std::sqrt(3.0) * g.resolution_m;
  for (std::size_t i = 0; i < free_mask_.size(); ++i) {
    const bool taken = (map_.zone_revoked(i) || map_.voxel_class(i) == VoxelClass::kOccupied) &&
                       !map_.is_fixed_body(i) && zone_cylinder_.depth_m(g.center_m(g.voxel_at(i))) > -half_diagonal;
    free_mask_[i] = taken ? 0 : 1;
    any_revoked_ = any_revoked_ || taken;
  }
  if (any_revoked_) revoked_field_.update(free_mask_);
}

ViewContext Workbench::context(const Clearance& clearance) const {
  const double max_age_s = config_.map.free_max_age_s;
  return {arm_,
          camera_body_,
          mapping_space_,
          clearance,
          map_,
          zone_,
          hand_eye_->flange_T_camera * camera_T_depth(),
          last_stamp_s_ + kFreshShareOfAge * max_age_s,
          max_age_s,
          prior_ ? &*prior_ : nullptr};
}

void Workbench::take_prior(VoxelMap prior) {
  prior_ = std::move(prior);
  chooser_.gain().allow_prior();
}

std::optional<MapChange> Workbench::change_since_prior() const {
  if (!prior_) return std::nullopt;
  return compare_maps(*prior_, map_, zone_);
}

}  // namespace firstlook
