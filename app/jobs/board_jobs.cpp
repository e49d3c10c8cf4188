/// Jobs that look at the board: find where to look from, detect it, compare it.
#include <algorithm>
#include <cmath>

#include "algorithms/calibration/board_ambiguity.hpp"
#include "algorithms/calibration/camera_on_arm.hpp"
#include "algorithms/view_planning/identify.hpp"
#include "algorithms/view_planning/locate.hpp"
#include "algorithms/vision/detector_presets.hpp"
#include "algorithms/vision/target_detection.hpp"
#include "app/jobs/workbench.hpp"

namespace firstlook {
namespace {

ViewList list_of(const Result<Turns>& turns) {
  ViewList list;
  if (!turns) {
    list.fault = turns.error().fault;
    return list;
  }
  for (const JointVector& q : *turns) {
    if (!list.views_rad.full()) list.views_rad.push_back(q);
  }
  return list;
}

double horizontal_fov_rad(const CameraIntrinsics& camera) { return 2 * std::atan(camera.width / (2 * camera.fx)); }

}  // namespace

ViewList Workbench::locate_views(const FromHere& here) {
  if (here.step > 0 && !searches_inner_links_) return {};
  const MotionPhase phase = searching_phase();
  const double fov_rad = horizontal_fov_rad(color_.intrinsics());
  const Clearance clearance = blind_terms_.clearance();
  if (here.step == 0) {
    return list_of(firstlook::locate_views(arm_, body_of(phase), space_of(phase), clearance, here.at_rad, fov_rad));
  }
  return list_of(
      firstlook::locate_views_of_inner_links(arm_, body_of(phase), space_of(phase), clearance, here.at_rad, fov_rad));
}

ViewList Workbench::identify_motions(const FromHere& here) {
  const MotionPhase phase = searching_phase();
  return list_of(
      firstlook::identify_motions(arm_, body_of(phase), space_of(phase), blind_terms_.clearance(), here.at_rad));
}

Status Workbench::read_picture(const hal::Frame& frame) {
  if (color_.read_corners(frame, 0)) return {};
  const CameraIntrinsics& camera = color_.intrinsics();
  return color_.read(frame, {gray_.items().data(), camera.width, camera.height});
}

/// The pictures of the frames after number `f`, each in its place.
std::vector<Workbench::GrayPixels> Workbench::read_after(std::span<const PosedFrame> frames, std::size_t f) {
  std::vector<GrayPixels> pictures(frames.size());
  for (++f; f < frames.size(); ++f) {
    if (read_picture(frames[f].frame)) pictures[f].assign(gray_.items().begin(), gray_.items().end());
  }
  return pictures;
}

/// Of the picture that was read last.
Result<CornerSet> Workbench::corners_of(const hal::Frame& frame, int target) {
  const BoardSpec& board = this->board(target);
  if (const auto delivered = color_.read_corners(frame, target)) {
    CornerSet set;
    for (const auto& c : delivered->corners_px) set.corners_px.emplace_back(c[0], c[1]);
    if (static_cast<int>(set.corners_px.size()) != board.corners()) {
      return failure(Fault::kBoardNotFound, "the camera reports {} corners", set.corners_px.size());
    }
    return set;
  }
  const CameraIntrinsics& camera = color_.intrinsics();
  const std::string& detector =
      config_.boards.empty() ? config_.board.detector : config_.boards[static_cast<std::size_t>(target)].board.detector;
  const auto preset = find_detector_preset(detector).value_or(DetectorPreset{});
  return detect_target(GrayImage{gray_.items().data(), camera.width, camera.height}, board, preset.detection);
}

BoardSight Workbench::sight_of(const DetectArguments& arguments) {
  std::vector<std::vector<CornerSet>> found(boards_.size());
  std::vector<GrayPixels> ahead;  // read before their turn; empty ones are gone
  std::size_t gone = 0;
  for (std::size_t f = 0; f < arguments.frames.size(); ++f) {
    const hal::Frame& frame = arguments.frames[f].frame;
    if (ahead.empty() ? !read_picture(frame) : ahead[f].empty()) {
      ++gone;
      continue;
    }
    const bool first = ahead.empty();
    if (!first) std::ranges::copy(ahead[f], gray_.items().begin());
    for (std::size_t k = 0; k < boards_.size(); ++k) {
      // A board that is not in the first frame of a standing arm is not in the others.
      if (!first && found[k].empty()) continue;
      if (auto corners = corners_of(frame, static_cast<int>(k))) found[k].push_back(std::move(*corners));
    }
    if (std::ranges::all_of(found, &std::vector<CornerSet>::empty)) break;
    // To search a large picture takes longer than a camera holds the next ones.
    if (first) ahead = read_after(arguments.frames, f);
  }
  BoardSight sight;
  if (2 * gone > arguments.frames.size()) sight.still = false;  // it says nothing: look again
  for (std::size_t k = 0; k < boards_.size(); ++k) {
    if (found[k].empty() || found[k].size() * 2 < arguments.frames.size()) continue;  // not even half of the frames
    if (auto picture = judge_standing(found[k])) {
      sight.still = sight.still && picture->still;
      sight.moved_px = std::max(sight.moved_px, picture->moved_px);
      sight.targets.push_back({static_cast<int>(k), std::move(*picture), std::move(found[k])});
    } else {
      sight.still = false;
      sight.moved_px = std::max(sight.moved_px, kFramesAgree_px);  // at least: average_corners found no two alike
    }
  }
  if (!sight.still && arguments.looks < kLooksMax) sight.targets.clear();
  return sight;
}

/// The frame that was read last is the picture of this stop.
void Workbench::keep_picture(std::size_t stop) {
  const std::size_t pixels = gray_.size();
  if ((stop + 1) * pixels > pictures_.size()) return;
  const auto from = gray_.items();
  std::copy(from.begin(), from.end(), pictures_.items().begin() + static_cast<std::ptrdiff_t>(stop * pixels));
}

std::size_t Workbench::stops() const {
  return observations_.empty() ? 0 : static_cast<std::size_t>(observations_.back().view.station) + 1;
}

/// Which of the poses that each picture allows was true: the views taken so far tell it of each other.
void Workbench::settle_observations(BoardLook purpose) {
  std::vector<OpenView> open;
  for (const Observation& o : observations_) open.push_back(open_view(board(o.view.target), o.view, o.pose));
  const bool verifies = purpose == BoardLook::kVerify && facts_.stored;
  const auto choices = verifies ? settle_choices(open, facts_.stored->flange_T_camera) : settle_choices(open);
  for (std::size_t i = 0; i < open.size(); ++i) {
    const PoseChoice& choice = open[i].choices[choices[i]];
    Observation& o = observations_[i];
    adopt_choice(board(o.view.target), choice, o.pose);
    if (choice.reversed) std::reverse(o.view.corners_px.begin(), o.view.corners_px.end());
  }
}

void Workbench::observe(std::size_t stop, const DetectArguments& arguments, const BoardSight& sight,
                        const BoardSight::Target& seen, const BoardPose& pose) {
  const PosedFrame& last = arguments.frames.back();
  Observation o;
  o.joints_rad = last.at_rad;
  o.time_s = last.frame.stamp.seconds();
  o.view = {forward(arm_, last.at_rad).flange(), seen.picture.mean.corners_px, seen.picture.mean.ids, seen.target,
            static_cast<int>(stop)};
  o.pose = pose;
  o.residual_rms_px = pose.residual_rms_px;
  o.settling = {static_cast<int>(arguments.looks), sight.moved_px, seen.picture.scatter_px, sight.still};
  o.plane = plane_beside(arguments, seen.target, pose);
  o.frames = seen.frames;
  observations_.push_back(std::move(o));
}

DetectResult Workbench::detect_board(const DetectArguments& arguments) {
  DetectResult result;
  if (arguments.purpose == BoardLook::kVerify && arguments.looks == 1) ++verification_looks_;
  const BoardSight sight = sight_of(arguments);
  result.still = sight.still;
  result.moved_px = sight.moved_px;
  const bool first_sight = std::ranges::none_of(identify_reference_, [](const auto& pose) { return pose.has_value(); });
  const bool observes =
      (arguments.purpose == BoardLook::kCollect || arguments.purpose == BoardLook::kVerify) && stops() < stops_max();
  const std::size_t stop = stops();
  const PosedFrame& last = arguments.frames.back();
  for (const BoardSight::Target& seen : sight.targets) {
    const auto k = static_cast<std::size_t>(seen.target);
    const auto pose = estimate_board_pose(camera(), boards_[k], seen.picture.mean);
    if (!pose) continue;
    const bool compared = arguments.purpose == BoardLook::kIdentify && identify_reference_[k];
    // A board that was not there before says nothing of what a joint moves.
    if (arguments.purpose == BoardLook::kIdentify && !compared) continue;
    if (!result.found) {
      result.rms_px = pose->residual_rms_px;
      const Eigen::Vector3d p = pose->camera_T_board.translation();
      const Eigen::Quaterniond q = pose->camera_T_board.quaternion();
      result.camera_p_board_m = {p.x(), p.y(), p.z()};
      result.camera_q_board_xyzw = {q.x(), q.y(), q.z(), q.w()};
    }
    result.found = true;
    result.targets |= static_cast<TargetMask>(1U << k);
    if (arguments.purpose == BoardLook::kLocate) {
      if (first_sight) identify_reference_[k] = *pose;
      if (!located_[k]) located_[k] = LocatedTarget{forward(arm_, last.at_rad).flange(), pose->camera_T_board};
    }
    if (compared) {
      const auto change = compare_views(color_.intrinsics(), boards_[k], *identify_reference_[k], *pose);
      result.changed = result.changed || change.changed;
    }
    if (observes) observe(stop, arguments, sight, seen, *pose);
  }
  if (arguments.purpose == BoardLook::kCollect && (result.found || sight.still)) {
    note_collect_look(last.at_rad, result.targets);
  }
  if (!result.found) return result;
  last_stamp_s_ = std::max(last_stamp_s_, last.frame.stamp.seconds());
  if (observes) {
    keep_picture(stop);
    settle_observations(arguments.purpose);
  }
  return result;
}

void Workbench::note_collect_look(const JointVector& at_rad, TargetMask seen) {
  if (collect_looks_.full()) {
    std::rotate(collect_looks_.begin(), collect_looks_.begin() + 1, collect_looks_.end());
    collect_looks_.pop_back();
  }
  collect_looks_.push_back({at_rad, static_cast<TargetMask>(targets_expected_ | seen), seen});
}

CheckBoardResult Workbench::check_board(const DetectArguments& arguments) {
  CheckBoardResult result;
  if (!hand_eye_) return result;
  const BoardSight sight = sight_of(arguments);
  result.still = sight.still;
  result.moved_px = sight.moved_px;
  for (const BoardSight::Target& seen : sight.targets) {
    const auto k = static_cast<std::size_t>(seen.target);
    if (k >= hand_eye_->targets.size() || hand_eye_->targets[k].views == 0) continue;
    const auto pose = estimate_board_pose(camera(), boards_[k], seen.picture.mean);
    if (!pose) continue;
    const auto bit = static_cast<TargetMask>(1U << k);
    result.seen |= bit;
    const BoardShift shift = shift_of(seen.target, *pose, forward(arm_, arguments.frames.back().at_rad).flange());
    if (shift.shift_m > shift.limit_m) result.moved |= bit;
    if (result.limit_mm > 0 && 1000 * shift.shift_m - 1000 * shift.limit_m <= result.shift_mm - result.limit_mm)
      continue;
    result.shift_mm = 1000 * shift.shift_m;
    result.limit_mm = 1000 * shift.limit_m;
  }
  return result;
}

/// How far a target seems to have moved, and how far one that stands still may seem to, 3 sigma: the hand-eye and the
/// arm at the board's distance, and the pose estimate itself.
Workbench::BoardShift Workbench::shift_of(int target, const BoardPose& pose,
                                          const Transform<Base, Flange>& base_T_flange) const {
  const auto base_T_board = base_T_flange * hand_eye_->flange_T_camera * pose.camera_T_board;
  const Eigen::Vector3d middle = board(target).center();
  const auto& before = hand_eye_->targets[static_cast<std::size_t>(target)].base_T_board;
  const double distance = (pose.camera_T_board * middle).norm();
  const double hand_eye_sigma = point_sigma(hand_eye_->flange_T_camera, hand_eye_->covariance, distance);
  const double arm_sigma = std::hypot(hand_eye_->arm_sigma.translation_m, hand_eye_->arm_sigma.rotation_rad * distance);
  const double corner_sigma = std::max(hand_eye_->corner_sigma_px, 0.05);
  const Matrix6d look = corner_sigma * corner_sigma * pose.unit_covariance;
  const double look_sigma =
      std::sqrt(look.topLeftCorner<3, 3>().trace() + middle.squaredNorm() * look.bottomRightCorner<3, 3>().trace());
  const double sigma =
      std::sqrt(3 * (hand_eye_sigma * hand_eye_sigma + arm_sigma * arm_sigma) + look_sigma * look_sigma);
  return {(base_T_board * middle - before * middle).norm(), 3 * sigma};
}

/// Those whose place the calibration, or the test of a stored one, gave.
TargetMask Workbench::solved_targets() const {
  TargetMask mask = 0;
  for (std::size_t k = 0; hand_eye_ && k < hand_eye_->targets.size(); ++k) {
    if (hand_eye_->targets[k].views > 0) mask |= static_cast<TargetMask>(1U << k);
  }
  return mask;
}

}  // namespace firstlook
