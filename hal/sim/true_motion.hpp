/// How the true body moves, as simulated cameras and the grader need it, and the hand that leads it.
#pragma once

#include <optional>

#include "platform/core/joint_vector.hpp"
#include "platform/core/time.hpp"
#include "platform/core/transform.hpp"

namespace firstlook::sim {

inline constexpr Instant kNeverDue{INT64_MAX / 2};

/// Told where the true body moved between two reports; lives on the loop thread and must not allocate.
class BodyWatcher {
 public:
  virtual ~BodyWatcher() = default;
  /// The body went from one set of true joint angles to the other. Returns true when it is in contact with the scene.
  virtual bool body_moved(Instant stamp, const JointVector& from_rad, const JointVector& to_rad) = 0;
  /// A person moves the body by hand, or it stands where a person left it: what it meets there is not the program's
  /// doing. What comes next is judged afresh.
  virtual void body_led() = 0;
};

/// All calls but true_flange from the loop thread.
class TrueMotion {
 public:
  virtual ~TrueMotion() = default;
  /// Lets everything happen up to `now`.
  virtual void advance(Instant now) = 0;
  /// Up to when true_joints is known after that: `now`, or less where the joints come from afar.
  [[nodiscard]] virtual Instant known_until() const = 0;
  /// Where the joints truly are or were.
  [[nodiscard]] virtual JointVector true_joints(Instant stamp) const = 0;
  /// Where the flange truly is for true joint angles: the arm's own kinematics and its deviation from them. Any thread.
  [[nodiscard]] virtual Transform<Base, Flange> true_flange(const JointVector& true_joints_rad) const = 0;
  /// A person takes the arm by hand, in freedrive, straight to these joints. Returns how long that takes (s); empty
  /// while the arm moves. Until the program's next motion the body's is that person's.
  [[nodiscard]] virtual std::optional<double> lead(const JointVector& to_rad, double speed_rad_s,
                                                   double acceleration_rad_s2, Instant now) = 0;
};

}  // namespace firstlook::sim
