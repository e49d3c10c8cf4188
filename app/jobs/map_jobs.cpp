/// Jobs of the map: a depth frame goes in, and at the end what remains unknown is named.
#include <algorithm>

#include "algorithms/kinematics/sight_uncertainty.hpp"
#include "algorithms/mapping/remaining.hpp"
#include "algorithms/mapping/self_filter.hpp"
#include "app/jobs/workbench.hpp"

namespace firstlook {
namespace {

constexpr double kPoseRange_m = 1.5;      // where the uncertainty of a pose is asked for, as in the clearance of rule 5
constexpr std::uint8_t kDepthSensor = 1;  // of the plane "sensor": there is one
// The arm stands: joints at the colour frame and at the depth frame differ by less, half a pixel 1.5 m ahead.
constexpr double kStanding_rad = 5e-4;

}  // namespace

IntegrateResult Workbench::integrate(const IntegrateArguments& arguments) {
  IntegrateResult result;
  result.at_view = arguments.at_view;
  const std::optional<FrameFlaw> flaw = insert_frame(arguments.frame);
  result.used = !flaw;
  result.frozen = flaw == FrameFlaw::kFrozen;
  if (flaw) {
    ++frames_refused_[static_cast<std::size_t>(*flaw)];
  } else {
    ++frames_integrated_;
  }
  if (config_.map.occupied_max_age_s > 0) {
    occupied_forgotten_ += map_.forget_old_occupied(arguments.now_s, config_.map.occupied_max_age_s);
  }
  last_stamp_s_ = std::max(last_stamp_s_, arguments.now_s);
  rebuild_free_space(last_stamp_s_);
  result.path_free = route_is_certified(arguments.arm_rad, arguments.ahead);

  const VoxelCounts counts = zone_counts();
  result.unknown = counts.unknown;
  result.free = counts.free;
  result.occupied = counts.occupied;
  result.gained = unknown_before_ > counts.unknown ? unknown_before_ - counts.unknown : 0;
  unknown_before_ = counts.unknown;
  if (arguments.at_view && result.used) chooser_.remember_look(context(clearance_in_force_), arguments.frame.at_rad);
  note_frame(arguments, counts);
  return result;
}

/// Puts a frame into the map, or says why not.
std::optional<FrameFlaw> Workbench::insert_frame(const PosedFrame& posed) {
  const CameraIntrinsics& camera = depth_.intrinsics();
  const DepthSensor& sensor = inserter_.sensor();
  if (camera.width != sensor.intrinsics.width || camera.height != sensor.intrinsics.height)
    return FrameFlaw::kWrongSize;
  const ImageView<std::uint16_t> pixels{depth_pixels_.items().data(), camera.width, camera.height};
  inserted_.reset();
  if (!depth_.read(posed.frame, pixels)) return FrameFlaw::kUnreadable;
  const LinkFrames frames = forward(arm_, posed.at_rad);
  const auto base_T_depth = frames.flange() * hand_eye_->flange_T_camera * camera_T_depth();
  const double stamp_s = posed.frame.stamp.seconds();
  const double units_per_m = depth_.units_per_m() * alignment_.depth_camera.mount.depth_scale;
  if (const auto flaw = gate_.inspect(pixels, units_per_m, base_T_depth, stamp_s)) return flaw;
  if (last_picture_.repeats(posed.frame.sequence, depth_pixels_.items())) return FrameFlaw::kFrozen;
  if (pose_sigma_m(posed, frames) > config_.map.pose_sigma_max_m) return FrameFlaw::kPoseUncertain;

  const Capsules body = place(camera_body_.capsules, frames);
  render_self_depth(std::span<const Capsule>(body.data(), body.size()), kSelfPadding_m, base_T_depth, camera,
                    self_depth_.items());
  const DepthImage depth{{pixels.data, pixels.width, pixels.height}, units_per_m};
  chooser_.gain().learn_returns(depth, base_T_depth, self_depth_.items());
  if (open_rays_) open_rays_->look(depth, self_depth_.items());
  if (plane_fit_) pixels_fitted_ += plane_fit_->apply(pixels, units_per_m);
  if (filter_) {
    const DepthFilterResult left_out = filter_->apply(pixels, units_per_m, base_T_depth);
    pixels_left_out_ += left_out.pixels_cropped + left_out.pixels_thinned;
  }
  // What is left to refuse is a pose farther away than any arm reaches.
  if (!inserter_.insert(map_, depth, base_T_depth, self_depth_.items(), stamp_s)) return FrameFlaw::kBadPose;
  if (planes_.sensor) planes_.sensor->note(inserter_.missed(), inserter_.hit(), kDepthSensor);
  inserted_ = {posed.frame.sequence, base_T_depth, units_per_m};
  if (fine_map_ && !fine_inserter_->insert(*fine_map_, depth, base_T_depth, self_depth_.items(), stamp_s))
    return FrameFlaw::kBadPose;
  if (open_rays_) {
    const OpenRaysResult open = open_rays_->clear(map_, base_T_depth, {inserter_.missed(), inserter_.hit()}, stamp_s,
                                                  config_.map.free_max_age_s);
    holes_record_.pixels_open += open.pixels_open;
    holes_record_.voxels_cleared += open.voxels_cleared;
  }
  return std::nullopt;
}

/// Each camera is where the arm was at its own frame.
ColorResult Workbench::color_look(const ColorArguments& arguments) {
  ColorResult result;
  const bool stands = (arguments.color.at_rad - arguments.depth.at_rad).max_abs() < kStanding_rad;
  if (!color_registration_ || !inserted_ || inserted_->sequence != arguments.depth.frame.sequence || !stands)
    return result;
  const CameraIntrinsics& depth = inserter_.sensor().intrinsics;
  const ImageView<Rgb> colors{colors_.items().data(), color_.intrinsics().width, color_.intrinsics().height};
  if (!color_.read_color(arguments.color.frame, colors)) return result;
  const auto base_T_camera = forward(arm_, arguments.color.at_rad).flange() * hand_eye_->flange_T_camera;
  result.points = color_registration_->add(
      *planes_.color, {{depth_pixels_.items().data(), depth.width, depth.height}, inserted_->units_per_m},
      inserted_->base_T_depth, self_depth_.items(), {camera(), base_T_camera.inverse() * inserted_->base_T_depth},
      {colors.data, colors.width, colors.height}, inserter_.hit());
  ++looks_colored_;
  return result;
}

double Workbench::pose_sigma_m(const PosedFrame& posed, const LinkFrames& frames) const {
  const auto flange_T_depth = hand_eye_->flange_T_camera * camera_T_depth();
  return sight_sigma_m(
      frames, flange_T_depth * Eigen::Vector3d(0, 0, kPoseRange_m),
      {posed.velocity_rad_s, posed.reports_apart_s, alignment_.depth_stamps.sigma_s, config_.arm.acceleration_rad_s2});
}

/// A look becomes a row of the record; of frames on the way the last one waits to become the row "end".
void Workbench::note_frame(const IntegrateArguments& arguments, const VoxelCounts& counts) {
  if (arguments.at_view && mapping_views_.size() == mapping_views_.capacity()) return;
  MappingViewRecord r;
  r.phase = !arguments.at_view ? "end" : sweeping_ ? "sweep" : "explore";
  r.time_s = arguments.frame.frame.stamp.seconds();
  r.joints_rad = arguments.frame.at_rad;
  r.gain_expected = arguments.at_view ? expected_gain_ : 0;
  r.gain_seen = unknown_at_view_ > counts.unknown ? unknown_at_view_ - counts.unknown : 0;
  r.unknown = counts.unknown;
  r.free = counts.free;
  r.occupied = counts.occupied;
  if (arguments.at_view) {
    expected_gain_ = 0;
    unknown_at_view_ = counts.unknown;
    mapping_views_.push_back(std::move(r));
    after_views_.reset();
  } else {
    after_views_ = std::move(r);
  }
}

SummarizeResult Workbench::summarize() {
  SummarizeResult result;
  if (!mapped() || !hand_eye_) return result;
  const auto clusters = find_remaining(map_, zone_, static_cast<std::size_t>(config_.explore.cluster_voxels_min));
  ReasonOptions options;
  options.seed = static_cast<std::uint64_t>(config_.seed);
  const ViewContext view_context = context(clearance_in_force_);
  chooser_.gain().prepare(view_context);
  for (const RemainingEntry& entry : explain_remaining(view_context, chooser_.gain(), clusters, options)) {
    remaining_.push_back({entry.voxels, std::string(to_string(entry.reason)), entry.center_m});
  }
  result.clusters = static_cast<std::uint32_t>(remaining_.size());
  return result;
}

VoxelMap Workbench::map_after_sweep() const {
  VoxelMap swept(map_.geometry(), VoxelMap::Planes::kLogOddsOnly);
  for (std::size_t i = 0; i < swept_log_odds_.size(); ++i) swept.set(i, classify(swept_log_odds_[i]), 0);
  return swept;
}

std::vector<MappingViewRecord> Workbench::mapping_views() const {
  std::vector<MappingViewRecord> views = mapping_views_;
  if (after_views_) views.push_back(*after_views_);
  return views;
}

std::vector<CameraPlace> Workbench::camera_places() const {
  std::vector<CameraPlace> places;
  if (!hand_eye_) return places;
  for (const MappingViewRecord& view : mapping_views()) {
    const auto base_T_camera = forward(arm_, view.joints_rad).flange() * hand_eye_->flange_T_camera;
    places.push_back({view.phase, base_T_camera.translation(), base_T_camera.rotation().col(2)});
  }
  return places;
}

std::vector<std::array<Eigen::Vector3d, 4>> Workbench::board_outlines_m() const {
  std::vector<std::array<Eigen::Vector3d, 4>> outlines;
  for (std::size_t k = 0; hand_eye_ && k < hand_eye_->targets.size(); ++k) {
    if (hand_eye_->targets[k].views == 0) continue;
    const BoardSpec& board = boards_[k];
    const double s = board.square_size_m;
    const double width = (board.inner_columns - 1) * s, height = (board.inner_rows - 1) * s;
    // The printed squares reach one square beyond the inner corners.
    std::array<Eigen::Vector3d, 4> corners = {
        {{-s, -s, 0}, {width + s, -s, 0}, {width + s, height + s, 0}, {-s, height + s, 0}}};
    for (Eigen::Vector3d& corner : corners) corner = hand_eye_->targets[k].base_T_board * corner;
    outlines.push_back(corners);
  }
  return outlines;
}

}  // namespace firstlook
