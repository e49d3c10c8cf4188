#include "tests/unit/app/sample_record.hpp"

#include <algorithm>
#include <cmath>

#include "platform/core/random.hpp"

namespace firstlook {
namespace {

constexpr BoardSpec kBoard{9, 6, 0.03};
constexpr CameraIntrinsics kCamera{640, 480, 534.78, 534.10, 308.63, 226.92, 0, 0, 0, 0, 0};

Eigen::Vector2d project(const Pose& camera_T_board, const Eigen::Vector3d& point) {
  const Eigen::Vector3d p = camera_T_board * point;
  return {kCamera.fx * p.x() / p.z() + kCamera.cx, kCamera.fy * p.y() / p.z() + kCamera.cy};
}

/// Each pixel's ray meets the board's plane; what is there gives the grey.
GrayPicture picture_of(const Pose& camera_T_board, Random& random) {
  GrayPicture picture{kCamera.width, kCamera.height, {}};
  const Pose board_T_camera = camera_T_board.inverse(Eigen::Isometry);
  for (int v = 0; v < kCamera.height; ++v) {
    for (int u = 0; u < kCamera.width; ++u) {
      const Eigen::Vector3d ray((u - kCamera.cx) / kCamera.fx, (v - kCamera.cy) / kCamera.fy, 1);
      const Eigen::Vector3d direction = board_T_camera.linear() * ray;
      const Eigen::Vector3d origin = board_T_camera.translation();
      const Eigen::Vector3d p = origin - direction * (origin.z() / direction.z());
      const double x = p.x() / kBoard.square_size_m + 1, y = p.y() / kBoard.square_size_m + 1;
      double grey = 92 + 30.0 * v / kCamera.height;
      if (x > -0.6 && y > -0.6 && x < kBoard.inner_columns + 1.6 && y < kBoard.inner_rows + 1.6) grey = 222;
      const bool inside = x >= 0 && y >= 0 && x < kBoard.inner_columns + 1 && y < kBoard.inner_rows + 1;
      if (inside && (static_cast<int>(x) + static_cast<int>(y)) % 2 == 0) grey = 34;
      grey += 3 * random.normal();
      picture.pixels.push_back(static_cast<std::uint8_t>(std::clamp(grey, 0.0, 255.0)));
    }
  }
  return picture;
}

CalibrationViewRecord calibration_view(int number, Random& random) {
  CalibrationViewRecord view;
  view.time_s = 20 + 4.7 * number;
  view.joints_rad = JointVector{0.1 * number, -1.2, 1.4, -1.8, -1.57, 0.2 * number};
  view.base_T_flange = Transform<Base, Flange>(Eigen::Quaterniond::Identity(), {0.2, 0.02 * number, 0.6});
  view.used = number != 11;
  Pose camera_T_board = Pose::Identity();
  camera_T_board.linear() = (Eigen::AngleAxisd(0.5 * std::sin(1.1 * number), Eigen::Vector3d::UnitX()) *
                             Eigen::AngleAxisd(0.5 * std::cos(1.7 * number), Eigen::Vector3d::UnitY()) *
                             Eigen::AngleAxisd(0.6 * std::sin(2.3 * number), Eigen::Vector3d::UnitZ()))
                                .toRotationMatrix();
  camera_T_board.translation() = Eigen::Vector3d(0, 0, 0.55) - camera_T_board.linear() * kBoard.center();
  double sum = 0;
  for (int i = 0; i < kBoard.corners(); ++i) {
    const Eigen::Vector2d reprojected = project(camera_T_board, kBoard.corner(i));
    const Eigen::Vector2d error(0.09 * random.normal(), 0.09 * random.normal());
    view.reprojected_px.push_back(reprojected);
    view.detected_px.push_back(reprojected + error);
    sum += error.squaredNorm() / 2;
  }
  view.rms_px = std::sqrt(sum / kBoard.corners());
  if (view.used) view.holdout_px = 1.3 * view.rms_px;
  view.picture = picture_of(camera_T_board, random);
  return view;
}

HandEyeResult hand_eye() {
  HandEyeResult h;
  h.flange_T_camera = Transform<Flange, Camera>(
      Eigen::Quaterniond(Eigen::AngleAxisd(0.3, Eigen::Vector3d(0.1, -0.2, 0.97).normalized())),
      {0.0123, -0.0652, 0.0841});
  h.sigma_translation_m = {0.00011, 0.00013, 0.00019};
  h.sigma_rotation_rad = {0.00031, 0.00028, 0.00022};
  for (int i = 0; i < 3; ++i) {
    h.covariance(i, i) = std::pow(h.sigma_translation_m[i], 2);
    h.covariance(i + 3, i + 3) = std::pow(h.sigma_rotation_rad[i], 2);
  }
  h.reprojection_rms_px = 0.091;
  h.holdout_rms_px = 0.34;
  h.holdout_rms_m = 0.00041;
  h.subset_spread_m = 0.00012;
  h.subset_spread_rad = 0.0003;
  h.usable_distance_m = 4.1;
  h.corner_sigma_px = 0.09;
  h.arm_sigma = {0.00011, 0.0002};
  h.views = 16;
  h.fits.resize(16);
  h.verdict = Verdict::kAccepted;
  return h;
}

MappingRecord mapping() {
  MappingRecord m;
  m.resolution_m = 0.05;
  const double total = 46000;
  double known = 0;
  for (int i = 0; i < 24; ++i) {
    const double before = known;
    known = 0.93 * (1 - std::exp(-(i + 1) / 5.0));
    const auto seen = static_cast<std::uint64_t>((known - before) * total);
    const auto occupied = static_cast<std::uint64_t>(known * 0.12 * total);
    const auto free = static_cast<std::uint64_t>(known * 0.88 * total);
    m.views.push_back({i < 9 ? "sweep" : "explore", 110 + 6.3 * i,
                       JointVector{0.3 * i, -1.57, 1.5, -1.2, -1.57, 0.1 * i}, 1.2 * static_cast<double>(seen), seen,
                       static_cast<std::uint64_t>(total) - free - occupied, free, occupied});
  }
  m.voxels = {m.views.back().unknown, m.views.back().free, m.views.back().occupied};
  m.grid_voxels = {m.voxels.unknown + 20000, m.voxels.free + 50000, m.voxels.occupied + 1000};
  m.remaining = {{1850, "occluded", {0.9, 0.3, 0.2}},
                 {640, "out_of_range", {-0.2, 0.1, -0.1}},
                 {210, "occluded", {0.7, -0.6, 0.5}}};
  m.since_prior = MapChange{.still_occupied = 3900,
                            .newly_occupied = 120,
                            .gone = 75,
                            .still_free = 30000,
                            .unseen_occupied = 17,
                            .unseen_free = 230,
                            .first_known = 900};
  m.objects.objects = {
      {.id = 1,
       .shape = ObjectShape::kPlane,
       .bounds_room = true,
       .voxels = 1200,
       .box = {{0.9, 0, -0.2}, {1.2, 0.8, 0.1}, Eigen::Quaterniond::Identity()}},
      {.id = 2,
       .shape = ObjectShape::kBox,
       .bounds_room = false,
       .voxels = 340,
       .box = {{0.9, 0.1, 0}, {0.4, 0.3, 0.3}, Eigen::Quaterniond(Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitZ()))}}};
  m.objects.specks = 21;
  m.frames_integrated = 412;
  m.frames_refused[static_cast<std::size_t>(FrameFlaw::kPoseUnknown)] = 2;
  m.frames_refused[static_cast<std::size_t>(FrameFlaw::kPoseUncertain)] = 1;
  return m;
}

MapPicture map_picture(std::string caption, std::string group) {
  MapPicture p;
  RgbPicture& picture = p.picture;
  picture = {std::move(caption), 480, 360, {}};
  p.group = std::move(group);
  p.lines = {{"path", {{100, 100}, {200, 150}, {220, 250}}}};
  p.labels = {{"tick", "0.5", {50, 340}}};
  p.views = {{"sweep", {100, 100}, std::nullopt, 1}, {"explore", {200, 150}, Eigen::Vector2d(210, 150), 2}};
  p.heights_m = {-0.3, 1.5};
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x) {
      const bool wall = (x / 40 + y / 40) % 5 == 0;
      for (const int channel : {0, 1, 2})
        picture.pixels.push_back(static_cast<std::uint8_t>(wall ? 60 + 40 * channel : 235));
    }
  }
  return p;
}

SafetyRecord safety() {
  ClearanceTerms c;
  c.half_voxel_diagonal_m = 0.0433;
  c.sigma_hand_eye_m = 0.0006;
  c.sigma_depth_m = 0.0034;
  c.sigma_tracking_m = 0.0005;
  c.uncertainty_m = 0.0105;
  c.payload_sag_m = 0.001;
  c.stopping_m = 0.0165;
  c.voxels_m = 0.0713;
  c.surface_m = 0.019;
  return {c, 0.0214, 0.0312, {{151.2, "paused by the operator"}}};
}

AlignmentRecord alignment() {
  AlignmentRecord a;
  DepthToColor depth;
  depth.mount.camera_T_depth = Transform<Camera, Depth>(Eigen::Quaterniond::Identity(), {-0.0248, 0.0003, 0.0001});
  depth.mount.depth_scale = 1.002;
  depth.mount.covariance.diagonal() << 1e-8, 1e-8, 2e-8, 4e-8, 4e-8, 9e-8, 1e-6;
  depth.moved << 2e-4, 3e-4, 1e-4, 1e-3, -2e-3, 4e-4;
  depth.noise_at_1m = 0.0029;
  depth.offset_rms_m = 6e-5;
  depth.excess = {4e-4, 1e-3};
  depth.untold = {{"translation along x", 0.93}};
  depth.belief = {31.2, 6, 22.5};
  depth.stops.resize(16);
  depth.stops[3].used = false;
  a.depth_camera = {ValueSource::kEstimated, {}, Transform<Camera, Depth>(), depth.mount, 16, depth};
  TimeOffset offset;
  offset.offset_s = -0.0301;
  offset.sigma_s = 1e-4;
  offset.frames = 36;
  offset.motions = 14;
  offset.left_out = 2;
  offset.speed_max_m_s = 0.174;
  a.color_stamps = {ValueSource::kEstimated, {}, offset.offset_s, offset.sigma_s, offset};
  a.depth_stamps.reason = "too few frames <on the way>";
  return a;
}

RunRecord make_record() {
  RunRecord r;
  Random random(7, 1);
  r.outcome = Outcome::kDone;
  r.reason = "Calibrated from 16 views and mapped from 24; nothing more can be seen.";
  r.seed = 7;
  r.cell = "workshop";
  r.phases = {{"locate board", 0, 14.2}, {"identify link", 14.2, 19.8}, {"calibrate", 19.8, 104},
              {"sweep", 104, 168.3},     {"explore", 168.3, 263.1},     {"report", 263.1, 270}};
  r.decisions_hash = "9f3c2a7714d0be55";
  r.hand_eye = hand_eye();
  r.solver = "park-martin";
  r.intrinsics = kCamera;
  for (int i = 0; i < 16; ++i) r.calibration_views.push_back(calibration_view(i, random));
  r.mapping = mapping();
  r.map_pictures = {map_picture("before exploration", "Layer at 0.40 m"), map_picture("at the end", "Layer at 0.40 m"),
                    map_picture("seen from behind", "The map")};
  r.safety = safety();
  r.memory = MemoryRecord{256u << 20,
                          96u << 20,
                          0,
                          {{"map", 8u << 20, 7u << 20},
                           {"depth frames", 4u << 20, 4u << 20},
                           {"heap of jobs", 128u << 20, 128u << 20, true}}};
  r.faults = {{151.2, Fault::kProgramStopped, "program stopped on the pendant"}};
  r.provenance = {.version = "0.1.0",
                  .arm_model = "ur5",
                  .sensor = "full",
                  .config_yaml = "cell: workshop\n",
                  .journal_hash = "77aa01"};
  r.wall = {"2026-01-31T12:00:00Z",
            71.3,
            4.2,
            false,
            180u << 20,
            30u << 20,
            70u << 20,
            40u << 20,
            "runs/20260131-7",
            2,
            {{"choosing the next view", 48, 6.5, 0.3}}};
  r.alignment = alignment();
  r.truth = TruthRecord{0.21,
                        0.34,
                        4.7,
                        0.3,
                        0.4,
                        1e-5,
                        -3e-4,
                        0,
                        0,
                        0.972,
                        TruthRecord::Way{61.5, 12},
                        std::nullopt,
                        41,
                        0.003,
                        {{"behind_box", 500, 0.12, 0.93}}};
  return r;
}

}  // namespace

RunRecord sample_record() {
  static const RunRecord record = make_record();  // the pictures take a while
  return record;
}

}  // namespace firstlook
