/// What moves: the arm's capsules with all that it carries, and the room that its own base may take.
#pragma once

#include <cstdint>

#include "algorithms/kinematics/arm_model.hpp"
#include "algorithms/kinematics/self_collision.hpp"
#include "algorithms/kinematics/twist.hpp"

namespace firstlook {

/// Upright cylinder about axis 1 inside which links 0 and 1 are exempt: they are bolted there whatever the map says.
struct BaseAllowance {
  double radius_m = 0.30;
  double z_low_m = -0.10;
  double z_high_m = 0.25;
};

/// The capsules that certificate, guardian, self filter and grading share. Made by the functions below, which keep the
/// derived parts in step with the capsules.
struct Body {
  Capsules capsules;  ///< in link frames; the arm's own come first
  BaseAllowance allowance;

  SelfPairs self_pairs;                            ///< with kSelfClearance_m
  FixedVector<LeverArms, kCapsulesMax> levers;     ///< one for each capsule
  FixedVector<std::uint8_t, kCapsulesMax> exempt;  ///< 1: inside the allowance for every angle, not checked
};

inline constexpr double kSelfClearance_m = 0.005;  ///< between parts of the body: joint angles are exact, radii padded

/// A camera on the flange as two capsules: its housing along camera x, and the bracket from the flange to it.
struct CameraBody {
  double half_length_m = 0.10;  ///< from the centre of the housing to the centre of an end cap (Kinect: 0.28 m wide)
  double radius_m = 0.05;
  double bracket_radius_m = 0.03;
  double cable_allowance_m = 0.03;  ///< added to both radii, except against the arm itself, which the cable may touch
};

/// The allowance of DESIGN rule 3, raised where the arm's own links 0 and 1 need more than the default.
[[nodiscard]] BaseAllowance base_allowance(const ArmModel& arm);

/// The arm alone.
[[nodiscard]] Body bare_body(const ArmModel& arm);

/// The arm with a sphere about the origin of `link` (default: the flange) that contains a camera whose mount is not
/// known yet. The sphere swallows the wrist, so it is held apart only from links four or more before its own.
[[nodiscard]] Body body_with_envelope(const ArmModel& arm, double radius_m = 0.20, int link = -1);

/// The arm with such a sphere about the origin of each link that moves: any of them may carry the camera. Joint 1 turns
/// the sphere of link 1 onto itself, and its part below the arm's foot holds no camera: the allowance is raised to
/// contain it, so the safe zone must be free around the shoulder, as it is by what the operator vouches for.
[[nodiscard]] Body body_with_envelopes(const ArmModel& arm, double radius_m = 0.20);

/// The arm with a camera whose mount is known (calibration validated).
[[nodiscard]] Body body_with_camera(const ArmModel& arm, const Transform<Flange, Camera>& flange_T_camera,
                                    const CameraBody& camera = {});

/// Adds a capsule that the arm carries, held apart from the links `links_apart` or more before its own. `slack_m` is
/// the part of its radius that may touch the arm itself.
void attach(Body& body, const ArmModel& arm, const Capsule& capsule, int links_apart, double slack_m = 0);

/// Adds the sphere of `body_with_envelope` to a body that exists, e.g. for a further link that may carry the camera.
void add_envelope(Body& body, const ArmModel& arm, double radius_m, int link);

}  // namespace firstlook
