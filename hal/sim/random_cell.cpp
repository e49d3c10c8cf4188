#include "hal/sim/random_cell.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "algorithms/motion/body.hpp"
#include "hal/sim/cell_file.hpp"
#include "hal/sim/renderer.hpp"
#include "platform/core/random.hpp"

namespace firstlook::sim {
namespace {

using Eigen::Vector3d;

constexpr double kPi = std::numbers::pi;
constexpr std::uint64_t kAssemblyStream = 5011, kLayoutStream = 5012, kViewsStream = 5013;
constexpr double kFloor_m = -0.85, kCartTop_m = -0.02;
constexpr double kZoneMargin_m = 0.05;  // between the safe zone and everything that is drawn
constexpr double kClearance_m = 0.05;   // of a view to the zone's surface: what a certificate asks for and some more
constexpr double kViewTiltMax_rad = 50 * kPi / 180, kViewTiltMin_rad = 10 * kPi / 180;
constexpr double kDiverse_rad = 20 * kPi / 180;
constexpr int kDrawsMax = 64, kPlaceTriesMax = 50, kViewTries = 30000;
constexpr int kLookSteps = 10;
constexpr double kLookTilt_rad = 25 * kPi / 180;
constexpr double kLookMargin_px = 15;

Solid box(const char* name, const Vector3d& center, const Vector3d& size, double yaw_rad) {
  Solid solid;
  solid.name = name;
  solid.shape = Box{0.5 * size};
  solid.base_T_solid.linear() = Eigen::AngleAxisd(yaw_rad, Vector3d::UnitZ()).toRotationMatrix();
  solid.base_T_solid.translation() = center;
  return solid;
}

Solid upright_cylinder(const char* name, const Vector3d& center, double radius, double height) {
  Solid solid;
  solid.name = name;
  solid.shape = Cylinder{radius, 0.5 * height};
  solid.base_T_solid.translation() = center;
  return solid;
}

/// Draws the parts of one cell, one after the other.
class Layout {
 public:
  Layout(std::uint64_t cell_seed, int draw)
      : random_(mix64(cell_seed), kLayoutStream + 1000 * static_cast<std::uint64_t>(draw)) {}

  Scene draw() {
    scene_.start_rad = default_start(scene_.arm);
    scene_.start_rad[0] = random_.uniform(-kPi, kPi);
    scene_.safe_zone.floor_m = kCartTop_m;
    scene_.mount = default_mount(6);
    room();
    const int tables = 1 + random_.below(2);
    for (int i = 0; i < tables; ++i) table();
    const int objects = 10 + random_.below(8);
    for (int i = 0; i < objects; ++i) object();
    mount();
    board();
    light();
    return scene_;
  }

 private:
  void room() {
    const Vector3d low(-random_.uniform(1.6, 2.6), -random_.uniform(1.6, 2.6), kFloor_m);
    const Vector3d high(random_.uniform(1.6, 2.6), random_.uniform(1.6, 2.6), kFloor_m + random_.uniform(2.4, 3.0));
    const Vector3d middle = 0.5 * (low + high), size = high - low;
    constexpr double t = 0.1;
    add(box("floor", {middle.x(), middle.y(), kFloor_m - 0.5 * t}, {size.x() + 2 * t, size.y() + 2 * t, t}, 0), 0.45F);
    for (const int side : {0, 1}) {
      const Vector3d& at = side == 0 ? low : high;
      const double out = side == 0 ? -0.5 * t : 0.5 * t;
      add(box("wall", {at.x() + out, middle.y(), middle.z()}, {t, size.y() + 2 * t, size.z()}, 0), 0.70F);
      add(box("wall", {middle.x(), at.y() + out, middle.z()}, {size.x(), t, size.z()}, 0), 0.66F);
    }
    if (random_.uniform() < 0.7) {
      add(box("ceiling", {middle.x(), middle.y(), high.z() + 0.5 * t}, {size.x() + 2 * t, size.y() + 2 * t, t}, 0),
          0.75F);
    }
    const double height = kCartTop_m - kFloor_m;
    add(box("cart", {0, 0, kCartTop_m - 0.5 * height}, {0.8, 0.6, height}, 0), 0.35F);
  }

  void add(Solid solid, float gray) {
    solid.surface.color = {gray, gray, gray};
    scene_.solids.push_back(std::move(solid));
  }

  [[nodiscard]] std::array<float, 3> color() {
    std::array<float, 3> c{};
    for (float& channel : c) channel = static_cast<float>(random_.uniform(0.2, 0.8));
    return c;
  }

  /// Keeps a group of solids when none reaches into the safe zone or its margin.
  bool place(std::vector<Solid> solids) {
    Scene group;
    group.safe_zone = scene_.safe_zone;
    group.safe_zone.radius_m += kZoneMargin_m;
    group.solids = solids;
    group.boards.clear();
    if (!check_cell(group)) return false;
    const std::array<float, 3> c = color();
    for (Solid& solid : solids) {
      solid.surface.color = c;
      scene_.solids.push_back(std::move(solid));
    }
    return true;
  }

  [[nodiscard]] Vector3d around(double radius_low, double radius_high) {
    const double angle = random_.uniform(-kPi, kPi), radius = random_.uniform(radius_low, radius_high);
    return {radius * std::cos(angle), radius * std::sin(angle), 0};
  }

  void table() {
    for (int attempt = 0; attempt < kPlaceTriesMax; ++attempt) {
      const Vector3d size(random_.uniform(0.6, 1.1), random_.uniform(0.4, 0.8), 0.04);
      const double top = random_.uniform(-0.25, 0.05), yaw = random_.uniform(-kPi, kPi);
      const Vector3d at = around(0.8, 1.4);
      const double leg_height = top - size.z() - kFloor_m;
      std::vector<Solid> parts{box("table", {at.x(), at.y(), top - 0.5 * size.z()}, size, yaw)};
      for (const double side : {-1.0, 1.0}) {
        const Vector3d leg =
            at + Eigen::AngleAxisd(yaw, Vector3d::UnitZ()) * Vector3d(side * (0.5 * size.x() - 0.03), 0, 0);
        parts.push_back(box("table side", {leg.x(), leg.y(), kFloor_m + 0.5 * leg_height},
                            {0.04, size.y() - 0.1, leg_height}, yaw));
      }
      if (!place(parts)) continue;
      tables_.push_back({{at.x(), at.y(), top}, size, yaw});
      return;
    }
  }

  void object() {
    for (int attempt = 0; attempt < kPlaceTriesMax; ++attempt) {
      const bool on_table = !tables_.empty() && random_.uniform() < 0.5;
      const double height = on_table ? random_.uniform(0.08, 0.40) : random_.uniform(0.3, 1.5);
      const double width = on_table ? random_.uniform(0.05, 0.25) : random_.uniform(0.1, 0.5);
      const double depth = random_.uniform(0.4, 1.0) * width, yaw = random_.uniform(-kPi, kPi);
      Vector3d foot = around(0.65, 1.6) + Vector3d(0, 0, kFloor_m);
      if (on_table) foot = on_a_table();
      const Vector3d center = foot + Vector3d(0, 0, 0.5 * height);
      const bool round = random_.uniform() < 0.35;
      if (place({round ? upright_cylinder("cylinder", center, 0.5 * width, height)
                       : box("box", center, {width, depth, height}, yaw)})) {
        return;
      }
    }
  }

  [[nodiscard]] Vector3d on_a_table() {
    const Table& table = tables_[static_cast<std::size_t>(random_.below(static_cast<int>(tables_.size())))];
    const Vector3d within(random_.uniform(-0.4, 0.4) * table.size.x(), random_.uniform(-0.4, 0.4) * table.size.y(), 0);
    return table.top + Eigen::AngleAxisd(table.yaw_rad, Vector3d::UnitZ()) * within;
  }

  /// Brackets differ by centimetres and degrees from cart to cart.
  void mount() {
    Pose& pose = scene_.mount.link_T_camera;
    for (int axis = 0; axis < 3; ++axis) pose.translation()[axis] += random_.uniform(-0.015, 0.015);
    pose.rotate(Eigen::AngleAxisd(random_.uniform(0, 8 * kPi / 180), random_.direction()));
  }

  /// Near the arm, its front roughly towards the space above the arm, on a thin post.
  void board() {
    const Vector3d at = around(0.85, 1.05) + Vector3d(0, 0, random_.uniform(0.20, 0.60));
    const Vector3d toward = Vector3d(0, 0, random_.uniform(0.35, 0.75)) + 0.12 * random_.normal3();
    Pose pose = Pose::Identity();
    const Vector3d z = (at - toward).normalized();
    const Vector3d x = z.cross(Vector3d::UnitZ()).normalized();
    pose.linear() << x, z.cross(x), z;
    pose.rotate(Eigen::AngleAxisd(random_.uniform(-0.5, 0.5), Vector3d::UnitZ()));
    pose.translation() = at;
    const Vector3d post = pose * Vector3d(0, 0, 0.05);
    const double height = post.z() - kFloor_m;
    scene_.solids.push_back(
        upright_cylinder("board's post", {post.x(), post.y(), kFloor_m + 0.5 * height}, 0.015, height));
    BoardPlacement& placed = scene_.boards.front();
    pose.translate(-placed.spec.center());
    placed.base_T_board = Transform<Base, Board>(pose);
    placed.solid = scene_.solids.size();
    scene_.solids.push_back(board_panel(placed));
  }

  void light() {
    scene_.light.toward = Vector3d(random_.uniform(-0.4, 0.4), random_.uniform(-0.4, 0.4), 1).normalized();
    scene_.light.directed = random_.uniform(0.3, 0.5);
    scene_.light.ambient = 1 - scene_.light.directed;
    scene_.light.gradient_per_m = Vector3d(random_.uniform(-0.05, 0.05), random_.uniform(-0.05, 0.05), 0);
  }

  struct Table {
    Vector3d top, size;
    double yaw_rad;
  };
  Random random_;
  Scene scene_;
  std::vector<Table> tables_;
};

/// Stands in the safe zone with the envelope of a camera whose mount is unknown, clear of itself.
bool stands_in_zone(const Body& body, const SafeZone& zone, const Capsules& placed) {
  for (std::size_t i = 0; i < placed.size(); ++i) {
    if (body.exempt[i] != 0) continue;
    const double needed = placed[i].radius_m + kClearance_m;
    if (zone.depth_m(placed[i].a) < needed || zone.depth_m(placed[i].b) < needed) return false;
  }
  return self_margin_m(placed, body.self_pairs) >= 0;
}

Transform<Base, Camera> camera_pose(const Scene& scene, const LinkFrames& frames) {
  const auto link = static_cast<std::size_t>(scene.mount.link);
  return Transform<Base, Camera>(frames.base_T_link[link] * scene.mount.link_T_camera);
}

/// Angle between the board's normal and the line of sight to its middle.
double view_tilt_rad(const Scene& scene, const Transform<Base, Camera>& base_T_camera) {
  const Transform<Base, Board>& board = scene.boards.front().base_T_board;
  const Vector3d sight = (board * scene.boards.front().spec.center() - base_T_camera.translation()).normalized();
  return std::acos(std::clamp(sight.dot(board.rotation().col(2)), -1.0, 1.0));
}

/// How many of the views have camera orientations that differ pairwise by 20 degrees, counted greedily.
int diverse_views(const Scene& scene, const ArmModel& arm, const std::vector<JointVector>& views) {
  std::vector<Eigen::Quaterniond> kept;
  for (const JointVector& q : views) {
    const Transform<Base, Camera> pose = camera_pose(scene, forward(arm, q));
    if (view_tilt_rad(scene, pose) < kViewTiltMin_rad) continue;
    const Eigen::Quaterniond turn = pose.quaternion();
    if (std::ranges::all_of(kept,
                            [&](const Eigen::Quaterniond& k) { return k.angularDistance(turn) > kDiverse_rad; })) {
      kept.push_back(turn);
    }
  }
  return static_cast<int>(kept.size());
}

/// A job begins by looking around: a tenth of a turn at a time, level and with the wrist tilted up and down. One of
/// these views must see the board whole.
bool is_found_by_turning(const Scene& scene, const ArmModel& arm, const Renderer& renderer) {
  const Body body = body_with_envelope(arm);
  const Capsules hiding = true_body(arm);
  for (const double tilt_rad : {0.0, kLookTilt_rad, -kLookTilt_rad}) {
    for (int step = 0; step < kLookSteps; ++step) {
      JointVector q = scene.start_rad;
      q[0] += 2 * kPi * step / kLookSteps;
      q[3] += tilt_rad;
      const LinkFrames frames = forward(arm, q);
      if (renderer.board_in_view(camera_pose(scene, frames), place(hiding, frames), kLookMargin_px) &&
          stands_in_zone(body, scene.safe_zone, place(body.capsules, frames))) {
        return true;
      }
    }
  }
  return false;
}

}  // namespace

Pose assembled(const Pose& nominal, std::uint64_t seed) {
  Random random(seed, kAssemblyStream);
  constexpr double kShift_m = 0.010, kTurn_rad = 3 * kPi / 180;
  Pose pose = nominal;
  for (int axis = 0; axis < 3; ++axis) pose.translation()[axis] += random.uniform(-kShift_m, kShift_m);
  for (int axis = 0; axis < 3; ++axis) {
    pose.rotate(Eigen::AngleAxisd(random.uniform(-kTurn_rad, kTurn_rad), Vector3d::Unit(axis)));
  }
  return pose;
}

std::vector<JointVector> board_views(const Scene& scene, int tries, std::uint64_t seed) {
  const ArmModel& arm = scene.arm;
  const Body body = body_with_envelope(arm);
  const Capsules hiding = true_body(arm);
  const Renderer renderer(scene);
  Random random(seed, kViewsStream);
  std::vector<JointVector> views;
  for (int i = 0; i < tries; ++i) {
    JointVector q = JointVector::zero(arm.joints);
    for (int joint = 0; joint < arm.joints; ++joint) q[joint] = random.uniform(-kPi, kPi);
    const LinkFrames frames = forward(arm, q);
    const Transform<Base, Camera> pose = camera_pose(scene, frames);
    if (view_tilt_rad(scene, pose) > kViewTiltMax_rad) continue;
    if (!stands_in_zone(body, scene.safe_zone, place(body.capsules, frames))) continue;
    if (renderer.board_in_view(pose, place(hiding, frames))) views.push_back(q);
  }
  return views;
}

Result<Scene> make_random_cell(std::uint64_t cell_seed, std::uint64_t seed) {
  for (int draw = 0; draw < kDrawsMax; ++draw) {
    Scene scene = Layout(cell_seed, draw).draw();
    scene.name = fmt::format("random:{}", cell_seed);
    scene.robot = cell_seed;
    scene.mount.link_T_camera = assembled(scene.mount.link_T_camera, seed);
    const ArmModel& arm = scene.arm;
    Scene with_margin = scene;
    with_margin.boards.clear();  // the board, too, stands outside
    if (!check_cell(with_margin)) continue;
    if (!is_found_by_turning(scene, arm, Renderer(scene))) continue;
    const std::vector<JointVector> views = board_views(scene, kViewTries, cell_seed);
    if (diverse_views(scene, arm, views) >= kDiverseViewsMin) return scene;
  }
  return failure(Fault::kCellInvalid, "random:{}: no draw of {} shows its board to the safe zone", cell_seed,
                 kDrawsMax);
}

}  // namespace firstlook::sim
