/// The next pose from which to look at the board, or at several: the one after which the hand-eye transform is known
/// best.
#pragma once

#include <span>

#include "algorithms/calibration/view_design.hpp"
#include "algorithms/calibration/view_spread.hpp"
#include "algorithms/motion/planner.hpp"
#include "algorithms/view_planning/base_turns.hpp"
#include "algorithms/view_planning/board_sights.hpp"

namespace firstlook {

/// References to things that must outlive the call.
struct CalibrationViewInputs {
  const ArmModel& arm;
  const Body& body;        ///< with the envelope of an unknown camera
  const FreeSpace& space;  ///< the safe zone
  const Clearance& clearance;
  std::span<const ViewDesignModel> models;  ///< of each target whose place is known; a rough hand-eye and pose will do
  Eigen::MatrixXd information;              ///< joint_prior_information() plus joint_view_information() of each view
  std::span<const JointVector> taken;       ///< configurations of the views taken
  std::span<const BoardLookOutcome> looks = {};  ///< what came of earlier views
};

enum class DesignCriterion : std::uint8_t {
  kCost,    ///< design_cost: the transform as exact as can be
  kVolume,  ///< design_volume: for the first views, which leave some direction open
};

struct CalibrationViewOptions {
  std::uint64_t seed = 1;
  std::uint32_t step = 0;        ///< number of this choice: other candidates each time
  int random_draws = 3000;       ///< uniform configurations: 1 in 1000 sees the board
  int nearby_draws = 1000;       ///< around the views taken
  int aimed_draws = 6000;        ///< camera poses that look at the board: 4 % better bounds than with 1500, in 60 ms
  ViewLimits limits;             ///< margin, tilt and distance at which the whole board must be seen
  double distance_min_m = 0.35;  ///< of aimed poses: from near by corners tell most (FACTS 2)
  double distance_max_m = 0.8;
  double tilt_max_rad = 0.785;                      ///< of aimed poses: 45 degrees
  double different_min_rad = kSharedDeviation_rad;  ///< joint distance to every view taken
  DesignCriterion criterion = DesignCriterion::kCost;
  /// Bit mask of targets (models[k]: bit k) of which a view must show one, to place them as exactly as can be; the
  /// criterion is then that of their poses. 0: whatever serves the transform.
  std::uint32_t wanted = 0;
  double cost_lever_m = 1.0;     ///< design_cost: rotation counts as displacement at this distance
  double cost_drop_min = 0.005;  ///< a view must be expected to lower the cost by this share
  /// Of settling and looking: views go by how much they lower the cost for each second of the straight move and the
  /// stop. 0: moves take no time, and the view is the one that lowers the cost most.
  double stop_s = 0;
  int plans_max = 12;  ///< best candidates that the planner may try
  int plan_iterations_max = 600;
  SpeedLimits speed;  ///< for the path's duration
};

struct CalibrationViewChoice {
  enum class Outcome : std::uint8_t {
    kChosen,
    kNoneFeasible,  ///< no free configuration that sees the whole board can be reached
    kNoneHelps,     ///< such views exist, but they would add next to nothing
  };
  Outcome outcome = Outcome::kNoneFeasible;
  JointVector target;
  std::uint32_t shown = 0;             ///< bit mask of the targets that it shows
  Path path;                           ///< certified, from the current configuration
  Matrix6d before = Matrix6d::Zero();  ///< predicted covariance of flange_T_camera from the views taken
  Matrix6d after = Matrix6d::Zero();   ///< and with this view
  int considered = 0;                  ///< configurations looked at
  int feasible = 0;                    ///< of them free, with a whole board in view, not hidden by the arm
};

/// Square root of the trace of the translation part (m) and of the rotation part (rad): norms over the axes.
struct PredictedSigma {
  double translation_m = 0;
  double rotation_rad = 0;
};
[[nodiscard]] PredictedSigma predicted_sigma(const Matrix6d& covariance);

/// The reachable view with the smallest cost by `options.criterion`. The same arguments give the same choice.
/// Errors: kStartBlocked when `current` is not free.
[[nodiscard]] Result<CalibrationViewChoice> next_calibration_view(const CalibrationViewInputs& inputs, Planner& planner,
                                                                  const JointVector& current,
                                                                  const CalibrationViewOptions& options = {});

/// Whether the arm comes between the camera and one of the board's outer corners. Capsules that contain the camera (its
/// housing, the envelope) do not count.
[[nodiscard]] bool hides_board(const ViewDesignModel& model, const Capsules& body_in_base,
                               const Transform<Base, Flange>& base_T_flange);

/// The first views, while nothing is known of the hand-eye transform: small turns of the outer joints about different
/// axes around `at`, where the board was seen whole. Straight moves from `at` are certified; others are left out.
/// Errors: kStartBlocked when `at` is not free.
[[nodiscard]] Result<Turns> bootstrap_views(const ArmModel& arm, const Body& body, const FreeSpace& space,
                                            const Clearance& clearance, const JointVector& at);

}  // namespace firstlook
