#include "algorithms/kinematics/arm_model.hpp"

#include <cmath>
#include <numbers>

#include "algorithms/kinematics/other_arms.hpp"
#include "platform/core/ensure.hpp"

namespace firstlook {
namespace {

constexpr double kPi = std::numbers::pi;

/// What a UR arm's size is beyond its DH table. Offsets from ur_description (kinematics and visual offsets of each
/// model); radii of the UR5 proved large enough in trials, the others scaled with the housings.
struct UrSize {
  std::string_view name;
  double d1, a2, a3, d4, d5, d6;           // standard DH, metres
  double shoulder_offset, forearm_offset;  // along the parallel axes 2 to 4
  double base_radius, upper_radius, elbow_radius, forearm_radius, wrist_radius;
  double housing_radius, upper_begin;  // sphere about joint 2's housing; where the upper arm's capsule takes over
  double base_speed_deg_s;             // joints 1 and 2; the others do 180
  double start_rad[5];                 // joints 2 to 6 of default_start
};

constexpr UrSize kSizes[] = {
    {"ur3",
     .1519,
     -.24365,
     -.21325,
     .11235,
     .08535,
     .0819,
     .1198,
     .0273,
     .065,
     .055,
     .052,
     .047,
     .045,
     .125,
     .10,
     180,
     {-1.98, 1.42, -2.34, -1.51, -.02}},
    {"ur5",
     .089159,
     -.425,
     -.39225,
     .10915,
     .09465,
     .0823,
     .136,
     .016,
     .075,
     .065,
     .060,
     .055,
     .050,
     .150,
     .12,
     180,
     {-2.23, 1.49, -2.71, .90, .20}},
    {"ur10",
     .1273,
     -.612,
     -.5723,
     .163941,
     .1157,
     .0922,
     .2209,
     .049,
     .095,
     .085,
     .080,
     .062,
     .060,
     .190,
     .15,
     120,
     {-2.12, 1.73, 2.49, .28, 1.02}},
    {"ur3e",
     .15185,
     -.24355,
     -.2132,
     .13105,
     .08535,
     .0921,
     .120,
     .027,
     .065,
     .055,
     .052,
     .047,
     .045,
     .125,
     .10,
     180,
     {-2.18, 1.55, -2.25, -1.21, -.09}},
    {"ur5e",
     .1625,
     -.425,
     -.3922,
     .1333,
     .0997,
     .0996,
     .138,
     .007,
     .075,
     .065,
     .060,
     .055,
     .050,
     .150,
     .12,
     180,
     {-2.23, 1.49, -2.72, .89, .20}},
    {"ur10e",
     .1807,
     -.6127,
     -.57155,
     .17415,
     .11985,
     .11655,
     .176,
     .039,
     .095,
     .085,
     .080,
     .062,
     .060,
     .190,
     .15,
     120,
     {-2.18, 1.51, 1.03, 1.08, 2.96}},
};

constexpr double kHandBegins = 0.6;   // of its radius beyond the wrist's end cap, which covers the hand's root
constexpr double kCartTop_m = -0.02;  // the base's capsule ends where the cart begins

Capsule capsule(int link, const Eigen::Vector3d& a, const Eigen::Vector3d& b, double radius_m) {
  return {.a = a, .b = b, .radius_m = radius_m, .link = link};
}

/// Frame 1 has z along joint 2's axis; frames 2 and 3 lie at the far ends of upper arm and forearm, x along them.
Capsules body_of(const UrSize& s) {
  const double so = s.shoulder_offset;
  const double fo = s.forearm_offset;
  Capsules body;
  body.push_back(capsule(0, {0, 0, kCartTop_m + s.base_radius}, {0, 0, s.d1}, s.base_radius));
  body.push_back(capsule(1, {0, 0, 0}, {0, 0, so}, s.upper_radius));
  body.push_back(capsule(1, {0, 0, so}, {0, 0, so}, s.housing_radius));
  body.push_back(capsule(2, {-s.a2 - s.upper_begin, 0, so}, {0, 0, so}, s.upper_radius));
  body.push_back(capsule(3, {-s.a3, 0, so}, {-s.a3, 0, fo}, s.elbow_radius));
  body.push_back(capsule(3, {-s.a3, 0, fo}, {0, 0, fo}, s.forearm_radius));
  body.push_back(capsule(4, {0, -(s.d4 - fo), 0}, {0, 0, 0}, s.wrist_radius));
  body.push_back(capsule(5, {0, s.d5, 0}, {0, 0, 0}, s.wrist_radius));
  body.push_back(capsule(6, {0, 0, kHandBegins * s.wrist_radius - s.d6}, {0, 0, 0}, s.wrist_radius));
  return body;
}

Capsules true_body_of(const UrSize& s) {
  const double so = s.shoulder_offset;
  const double fo = s.forearm_offset;
  const double base = s.base_radius - kBodyPadding_m;
  const double upper = s.upper_radius - kBodyPadding_m;
  const double wrist = s.wrist_radius - kBodyPadding_m;
  Capsules body;
  body.push_back(capsule(0, {0, 0, base}, {0, 0, s.d1}, base));
  body.push_back(capsule(1, {0, 0, 0}, {0, 0, so}, upper));
  body.push_back(capsule(2, {-s.a2, 0, so}, {0, 0, so}, upper));
  body.push_back(capsule(3, {-s.a3, 0, so}, {-s.a3, 0, fo}, s.elbow_radius - kBodyPadding_m));
  body.push_back(capsule(3, {-s.a3, 0, fo}, {0, 0, fo}, s.forearm_radius - kBodyPadding_m));
  body.push_back(capsule(4, {0, -(s.d4 - fo), 0}, {0, 0, 0}, wrist));
  body.push_back(capsule(5, {0, s.d5, 0}, {0, 0, 0}, wrist));
  body.push_back(capsule(6, {0, 0, -s.d6}, {0, 0, -wrist}, wrist));  // the true arm ends at the flange's face
  return body;
}

const UrSize* find_size(std::string_view name) {
  for (const UrSize& size : kSizes) {
    if (size.name == name) return &size;
  }
  return nullptr;
}

struct CosSin {
  double c, s;
};

/// Exact for the right angles that nearly all arms have; beside them, where a factory's corrections are, by a few terms
/// of their series, which is several times as fast and as accurate: the next term is below 1e-17.
inline CosSin cos_sin(double angle_rad) {
  constexpr double kBeside_rad = 0.01;
  const double turn = std::abs(angle_rad) < kPi / 4 ? 0 : std::copysign(kPi / 2, angle_rad);
  const double x = angle_rad - turn, x2 = x * x;
  if (x2 > kBeside_rad * kBeside_rad) [[unlikely]]
    return {std::cos(angle_rad), std::sin(angle_rad)};
  const double cos_x = 1 - x2 / 2 * (1 - x2 / 12 * (1 - x2 / 30));
  const double sin_x = x * (1 - x2 / 6 * (1 - x2 / 20 * (1 - x2 / 42)));
  if (turn == 0) return {cos_x, sin_x};
  return turn > 0 ? CosSin{-sin_x, cos_x} : CosSin{sin_x, -cos_x};
}

/// Ry(beta) Rz(gamma), for rows that have them.
template <typename Columns>
void turn_further(const DhRow& row, Columns& to) {
  const auto [cb, sb] = cos_sin(row.beta_rad);
  const auto [cg, sg] = cos_sin(row.gamma_rad);
  const Eigen::Vector3d x = to.col(0) * cb - to.col(2) * sb;
  const Eigen::Vector3d y = to.col(1);
  to.col(2) = Eigen::Vector3d(to.col(2) * cb + to.col(0) * sb);
  to.col(0) = x * cg + y * sg;
  to.col(1) = y * cg - x * sg;
}

}  // namespace

std::optional<ArmModel> find_arm_model(std::string_view name) {
  const UrSize* s = find_size(name);
  if (s == nullptr) return find_other_arm(name);
  ArmModel arm;
  arm.name = s->name;
  arm.joints = 6;
  arm.dh = {DhRow{0, s->d1, 0, kPi / 2}, DhRow{0, 0, s->a2, 0},        DhRow{0, 0, s->a3, 0},
            DhRow{0, s->d4, 0, kPi / 2}, DhRow{0, s->d5, 0, -kPi / 2}, DhRow{0, s->d6, 0, 0}};
  for (std::size_t j = 0; j < 6; ++j) {
    const double range = j == 2 ? kPi : 2 * kPi;  // beyond it the forearm would pass through the upper arm
    arm.lower_rad[j] = -range;
    arm.upper_rad[j] = range;
    arm.speed_max_rad_s[j] = (j < 2 ? s->base_speed_deg_s : 180) * kPi / 180;
  }
  arm.acceleration_max_rad_s2 = kUsualAcceleration_rad_s2;
  arm.body = body_of(*s);
  return arm;
}

Capsules true_body(const ArmModel& arm) {
  if (const UrSize* s = find_size(arm.name)) return true_body_of(*s);
  Capsules body = arm.body;
  for (Capsule& c : body) {
    ENSURE(4001, c.radius_m > kBodyPadding_m);
    c.radius_m -= kBodyPadding_m;
  }
  return body;
}

JointVector default_start(const ArmModel& arm) {
  const UrSize* s = find_size(arm.name);
  if (s == nullptr) {
    ENSURE(4002, arm.start_rad.size() == arm.joints);
    return arm.start_rad;
  }
  JointVector q = JointVector::zero(6);
  for (int j = 1; j < 6; ++j) q[j] = s->start_rad[j - 1];
  return q;
}

LinkFrames forward(const ArmModel& arm, const JointVector& q_rad) {
  LinkFrames frames;
  frames.joints = arm.joints;
  frames.base_T_link[0] = arm.base_T_first;
  for (int j = 0; j < arm.joints; ++j) {
    const auto i = static_cast<std::size_t>(j);
    const DhRow& row = arm.dh[i];
    const auto from = frames.base_T_link[i].matrix().topRows<3>();
    auto to = frames.base_T_link[i + 1].matrix().topRows<3>();
    const double angle = q_rad[j] + row.theta_offset_rad;
    const double c = std::cos(angle);
    const double s = std::sin(angle);
    const auto [ca, sa] = cos_sin(row.alpha_rad);
    const Eigen::Vector3d turned_y = from.col(1) * c - from.col(0) * s;
    to.col(0) = from.col(0) * c + from.col(1) * s;
    to.col(1) = turned_y * ca + from.col(2) * sa;
    to.col(2) = from.col(2) * ca - turned_y * sa;
    to.col(3) = from.col(3) + from.col(2) * row.d_m + to.col(0) * row.a_m;
    if (!row.is_standard()) turn_further(row, to);
    frames.base_T_link[i + 1].makeAffine();
  }
  return frames;
}

Capsules place(const Capsules& body, const LinkFrames& frames) {
  Capsules placed = body;
  for (Capsule& c : placed) {
    const Pose& base_T_link = frames.base_T_link[static_cast<std::size_t>(c.link)];
    c.a = base_T_link * c.a;
    c.b = base_T_link * c.b;
  }
  return placed;
}

}  // namespace firstlook
