/// The hand that leads the arm's tip onto the board when the pendant asks for it.
#pragma once

#include <optional>
#include <string_view>

#include "hal/api/operator_devices.hpp"
#include "hal/sim/faults.hpp"
#include "hal/sim/scene.hpp"
#include "hal/sim/true_motion.hpp"
#include "platform/core/fixed_vector.hpp"
#include "platform/core/random.hpp"

namespace firstlook::sim {

/// A person who reads the pendant's lines ("touch 3 of 12: lead the tip onto column 4, row 0, then confirm", "bring the
/// arm back ...") and does what they say: leads the arm by hand so that the tip truly stands on the true corner but for
/// an unsteady hand, each time tilted otherwise, and presses Confirm. A corner that the arm does not reach is not
/// touched, and nothing is confirmed. The arm goes the straight way in joint space, without regard to what is in it.
class TouchingHand {
 public:
  /// Both must outlive it.
  /// @param model  the true one
  TouchingHand(const Scene& scene, const ArmModel& model, const Faults& faults, std::uint64_t seed, TrueMotion& arm);

  void read(std::string_view line);
  [[nodiscard]] std::optional<hal::OperatorEvent> poll(Instant now);
  [[nodiscard]] Instant next_due() const { return due_; }

 private:
  enum class Doing : std::uint8_t { kNothing, kAsked, kReading, kLeading };
  enum class Asked : std::uint8_t { kNothing, kTouch, kBringBack };

  /// The one that the pendant's lines are about: the first of those that the job looks for.
  [[nodiscard]] const BoardPlacement& board() const { return scene_.boards.front(); }
  [[nodiscard]] std::optional<JointVector> joints_on(int point);
  [[nodiscard]] std::optional<JointVector> reach(const Pose& base_T_flange) const;
  void begin(Instant now);

  const Scene& scene_;
  const ArmModel model_;
  const Faults faults_;
  TrueMotion& arm_;
  Random random_;
  Doing doing_ = Doing::kNothing;
  Asked asked_ = Asked::kNothing;
  int point_ = 0;
  int touched_ = 0;
  std::optional<JointVector> home_rad_;  ///< where the arm stood when the first corner was asked for
  Instant due_ = kNeverDue;
};

}  // namespace firstlook::sim
