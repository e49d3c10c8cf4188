#include "hal/sim/touching_hand.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>

#include "algorithms/kinematics/numeric_inverse.hpp"
#include "algorithms/vision/rotation.hpp"
#include "hal/sim/random_streams.hpp"
#include "platform/memory/allocation_guard.hpp"

namespace firstlook::sim {
namespace {

constexpr double kHandSigma_m = 2e-4;  // for each axis: a tip set onto a corner by eye, with a magnifying glass
constexpr double kTilt_rad = 0.35;     // about two axes across the tool, either way
constexpr double kLeadSpeed_rad_s = 0.8;
constexpr double kLeadAcceleration_rad_s2 = 2;
constexpr double kReads_s = 1.0, kLooksTwice_s = 1.0;
constexpr int kTurns = 24;  // about the tool's axis, to find a way to hold the arm

/// The number behind a word of a line, e.g. "row 3".
std::optional<int> number_after(std::string_view line, std::string_view word) {
  const std::size_t at = line.find(word);
  if (at == std::string_view::npos) return std::nullopt;
  int value = 0;
  const char* const first = line.data() + at + word.size();
  const auto [end, error] = std::from_chars(first, line.data() + line.size(), value);
  return error == std::errc{} ? std::optional(value) : std::nullopt;
}

std::optional<int> point_named(std::string_view line, const BoardSpec& board) {
  const auto column = number_after(line, "column "), row = number_after(line, "row ");
  if (column && row) return *row * board.inner_columns + *column;
  return number_after(line, "point ");
}

}  // namespace

TouchingHand::TouchingHand(const Scene& scene, const ArmModel& model, const Faults& faults, std::uint64_t seed,
                           TrueMotion& arm)
    : scene_(scene), model_(model), faults_(faults), arm_(arm), random_(seed, kTouchStream) {}

void TouchingHand::read(std::string_view line) {
  const bool back = line.starts_with("bring the arm back");
  if (!back && !line.starts_with("touch ")) return;
  const auto point = point_named(line, board().spec);
  if (!back && (!point || *point < 0 || *point >= board().spec.corners())) return;
  asked_ = back ? Asked::kBringBack : Asked::kTouch;
  point_ = point.value_or(0);
  doing_ = Doing::kAsked;
  due_ = Instant{};  // at once: nobody says here what time it is
}

std::optional<hal::OperatorEvent> TouchingHand::poll(Instant now) {
  const memory::SimulationScope simulation;
  if (now < due_) return std::nullopt;
  switch (doing_) {
    case Doing::kNothing:
      break;
    case Doing::kAsked:
      doing_ = Doing::kReading;
      due_ = now + seconds(kReads_s);
      break;
    case Doing::kReading:
      begin(now);
      break;
    case Doing::kLeading:
      doing_ = Doing::kNothing;
      due_ = kNeverDue;
      return hal::OperatorEvent{now, hal::OperatorAction::kConfirm};
  }
  return std::nullopt;
}

void TouchingHand::begin(Instant now) {
  doing_ = Doing::kNothing;
  due_ = kNeverDue;
  arm_.advance(now);
  if (!home_rad_) home_rad_ = arm_.true_joints(now);
  std::optional<JointVector> target = home_rad_;
  if (asked_ == Asked::kTouch) {
    ++touched_;
    if (touched_ == faults_.touch_mixed_up) point_ += point_ % board().spec.inner_columns == 0 ? 1 : -1;
    target = joints_on(point_);
  } else if (faults_.touch_left_there) {
    target = arm_.true_joints(now);
  }
  if (!target) return;
  const auto led_s = arm_.lead(*target, kLeadSpeed_rad_s, kLeadAcceleration_rad_s2, now);
  if (!led_s) return;
  doing_ = Doing::kLeading;
  due_ = now + seconds(*led_s + kLooksTwice_s);
}

/// Joint angles nearest to home that bring the true flange there: the model's inverse, corrected by the arm's own
/// deviation where that ends.
std::optional<JointVector> TouchingHand::reach(const Pose& base_T_flange) const {
  const auto nearest = [&](const Pose& pose, const JointVector& to) -> std::optional<JointVector> {
    std::optional<JointVector> best;
    for (const JointVector& q : inverse_of(model_, Transform<Base, Flange>(pose), to)) {
      if (!best || (q - to).max_abs() < (*best - to).max_abs()) best = q;
    }
    return best;
  };
  auto q = nearest(base_T_flange, *home_rad_);
  for (int round = 0; round < 3 && q; ++round) {
    const Pose deviation = forward(model_, *q).flange().pose().inverse(Eigen::Isometry) * arm_.true_flange(*q).pose();
    q = nearest(base_T_flange * deviation.inverse(Eigen::Isometry), *q);
  }
  return q;
}

std::optional<JointVector> TouchingHand::joints_on(int point) {
  const Pose& base_T_board = board().base_T_board.pose();
  const Eigen::Vector3d tip = base_T_board * board().spec.corner(point) + kHandSigma_m * random_.normal3();
  const Eigen::Vector3d tilt_rad(random_.uniform(-kTilt_rad, kTilt_rad), random_.uniform(-kTilt_rad, kTilt_rad), 0);
  for (const double part : {1.0, 0.5, 0.0}) {  // less where the arm does not reach otherwise
    std::optional<JointVector> best;
    for (int i = 0; i < kTurns; ++i) {
      Pose flange = Pose::Identity();
      flange.linear() = base_T_board.linear() * rotation_exp(part * tilt_rad) *
                        rotation_exp({0, 0, 2 * std::numbers::pi * i / kTurns});
      flange.translation() = tip - flange.linear() * scene_.flange_p_tip_m;
      const auto q = reach(flange);
      if (q && (!best || (*q - *home_rad_).max_abs() < (*best - *home_rad_).max_abs())) best = q;
    }
    if (best) return best;
  }
  return std::nullopt;
}

}  // namespace firstlook::sim
