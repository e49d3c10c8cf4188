/// Jobs of the map: a depth frame goes in, and at the end what remains unknown is named.
#include <algorithm>

#include "algorithms/mapping/map_image.hpp"
#include "algorithms/mapping/remaining.hpp"
#include "algorithms/mapping/self_filter.hpp"
#include "app/jobs/workbench.hpp"
#include "platform/journal/journal.hpp"

namespace firstlook {
namespace {
constexpr double kSelfPadding_m = 0.02;  // the thesis's self filter
}

IntegrateResult Workbench::integrate(const IntegrateArguments& arguments) {
  IntegrateResult result;
  result.at_view = arguments.at_view;
  const CameraIntrinsics& camera = depth_.intrinsics();
  const ImageView<std::uint16_t> pixels{depth_pixels_.items().data(), camera.width, camera.height};
  const double stamp_s = arguments.frame.frame.stamp.seconds();
  const LinkFrames frames = forward(arm_, arguments.frame.at_rad);
  const auto base_T_depth = frames.flange() * hand_eye_->flange_T_camera * facts_.camera_T_depth;

  if (depth_.read(arguments.frame.frame, pixels) && !is_frozen(arguments.frame.frame, result)) {
    const Capsules body = place(camera_body_.capsules, frames);
    render_self_depth(std::span<const Capsule>(body.data(), body.size()), kSelfPadding_m, base_T_depth, camera,
                      self_depth_.items());
    const DepthImage depth{{pixels.data, pixels.width, pixels.height}, depth_.units_per_m()};
    if (inserter_.insert(map_, depth, base_T_depth, self_depth_.items(), stamp_s)) {
      result.used = true;
      ++frames_integrated_;
    }
  }
  if (!result.used) ++frames_dropped_;
  last_stamp_s_ = std::max(last_stamp_s_, arguments.now_s);
  rebuild_free_space(last_stamp_s_);
  result.path_free = route_is_certified(arguments.arm_rad, arguments.ahead);

  const VoxelCounts counts = zone_counts();
  result.unknown = counts.unknown;
  result.free = counts.free;
  result.occupied = counts.occupied;
  result.gained = unknown_before_ > counts.unknown ? unknown_before_ - counts.unknown : 0;
  unknown_before_ = counts.unknown;
  if (arguments.at_view) {
    chooser_.remember_look(context(clearance_in_force_), arguments.frame.at_rad);
    note_view(arguments, result.gained);
  }
  return result;
}

/// A camera that hangs may go on sending the last picture with new stamps. A picture without any return proves nothing.
bool Workbench::is_frozen(const hal::Frame& frame, IntegrateResult& result) {
  const std::span<const std::uint16_t> pixels = depth_pixels_.items();
  const std::uint64_t hash = [&] {
    Fnv1a sum;
    sum.add(std::as_bytes(pixels));
    return sum.value();
  }();
  const bool returns = std::any_of(pixels.begin(), pixels.end(), [](std::uint16_t z) { return z != 0; });
  result.frozen = returns && last_picture_ && last_picture_->second == hash && last_picture_->first != frame.sequence;
  last_picture_ = {frame.sequence, hash};
  return result.frozen;
}

void Workbench::note_view(const IntegrateArguments& arguments, std::uint64_t gained) {
  if (mapping_views_.size() == mapping_views_.capacity()) return;
  const VoxelCounts counts = zone_counts();
  MappingViewRecord r;
  r.phase = sweeping_ ? "sweep" : "explore";
  r.time_s = arguments.frame.frame.stamp.seconds();
  r.joints_rad = arguments.frame.at_rad;
  r.gain_expected = expected_gain_;
  r.gain_seen = gained;
  r.unknown = counts.unknown;
  r.free = counts.free;
  r.occupied = counts.occupied;
  expected_gain_ = 0;
  mapping_views_.push_back(std::move(r));
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

std::vector<Eigen::Vector3d> Workbench::view_positions() const {
  std::vector<Eigen::Vector3d> positions;
  if (!hand_eye_) return positions;
  for (const MappingViewRecord& view : mapping_views_) {
    positions.push_back((forward(arm_, view.joints_rad).flange() * hand_eye_->flange_T_camera).translation());
  }
  return positions;
}

std::vector<RgbPicture> Workbench::map_pictures() const {
  std::vector<RgbPicture> pictures;
  if (!mapped()) return pictures;
  const auto draw = [&pictures](std::string caption, int width, int height, auto paint) {
    RgbPicture picture;
    picture.caption = std::move(caption);
    picture.width = width;
    picture.height = height;
    picture.pixels.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 3);
    paint(RgbImage{picture.pixels.data(), width, height});
    pictures.push_back(std::move(picture));
  };
  const auto positions = view_positions();
  for (const double azimuth : {-2.2, 0.9}) {
    Viewpoint viewpoint;
    viewpoint.azimuth_rad = azimuth;
    draw("the map with the views in order, seen from " + std::string(azimuth < 0 ? "behind" : "the front"), 800, 600,
         [&](RgbImage image) { draw_map(map_, viewpoint, {}, positions, image); });
  }
  const VoxelMap swept = map_after_sweep();
  draw("after the sweep: what was still unknown in the reach of the arm (veil)", 800, 600,
       [&](RgbImage image) { draw_map(swept, {}, zone_, {}, image); });
  draw("at the end: what remains unknown in the reach of the arm (veil)", 800, 600,
       [&](RgbImage image) { draw_map(map_, {}, zone_, {}, image); });
  for (const double z : {0.0, 0.25, 0.5}) {
    draw(fmt::format("layer at {:.2f} m: occupied dark, free light, unknown grey", z), 420, 420,
         [&](RgbImage image) { draw_slice(map_, z, image); });
  }
  return pictures;
}

}  // namespace firstlook
