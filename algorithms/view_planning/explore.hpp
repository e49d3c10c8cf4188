/// The next best view: many configurations, filtered from cheap to dear, and a proof when none helps any more.
#pragma once

#include <vector>

#include "algorithms/mapping/remaining.hpp"
#include "algorithms/motion/planner.hpp"
#include "algorithms/view_planning/gain.hpp"
#include "platform/core/parallel.hpp"

namespace firstlook {

struct ExploreOptions {
  std::uint64_t seed = 1;
  std::uint32_t step = 0;                   ///< number of this choice: other candidates each time
  bool after_look = false;                  ///< the look at `current` is still to come: the view after it is chosen
  int tries_per_candidate = 40;             ///< random configurations drawn for one that is free
  std::uint32_t gain_min = 8;               ///< unknown voxels that make a view worth it (k of the certificate)
  std::uint32_t again_min = 100;            ///< or voxels that it makes usable for motion
  std::uint32_t again_few = 30;             ///< the same while such views still open the way to something unknown
  double again_per_m = 40;                  ///< and so many for each metre that the body could go in the view's time
  int refined = 16;                         ///< of the best candidates, each improved in small steps
  int refine_steps = 16;                    ///< tried for one of them
  int plans_max = 24;                       ///< candidates that the planner may try; twice as many for the certificate
  int plan_iterations_max = 400;            ///< for one of them
  std::span<const JointVector> trail = {};  ///< PlannerOptions::trail
  int certificate_samples = 1000;           ///< random configurations, as many around the views taken, as many aimed
  ViewTiming timing;
};

/// Why exploration ends: every sampled view that can be reached sees fewer than `gain_min` unknown voxels along rays
/// that are not known to go where nothing returns.
struct TerminationCertificate {
  int random_samples = 0;  ///< free configurations drawn at random
  int nearby_samples = 0;  ///< drawn around where the arm is and has been
  int aimed_samples = 0;   ///< free configurations aimed at frontier voxels
  std::uint32_t gain_min = 0;
  std::uint32_t gain_best = 0;  ///< of all samples that can be reached
  int unreached = 0;            ///< samples that would see enough, but none of the plans tried leads there
  int clusters = 0;             ///< unknown clusters that touch free space
};

struct ViewChoice {
  enum class Outcome : std::uint8_t {
    kChosen,
    kComplete,         ///< the certificate holds
    kNothingReachable  ///< the arm cannot move: no free configuration was found that it can get to
  };
  Outcome outcome = Outcome::kNothingReachable;
  JointVector target;
  Path path;                 ///< certified, from the current configuration
  ViewGain gain;             ///< expected
  double utility_per_s = 0;  ///< gain weight for each second of move, settling and looking
  int considered = 0;        ///< configurations looked at
  int free = 0;              ///< of them inside known free space with margin
  int worthwhile = 0;        ///< of them with enough gain, as far as that was found out
  int planned = 0;           ///< handed to the planner
  TerminationCertificate certificate;
};

/// Chooses views. All memory but the planner's answer is taken at construction.
class ViewChooser {
 public:
  /// @param candidates_max  free configurations to score for one choice (150 are clearly better than 20: notes)
  /// @param workers_max     the highest worker number that run_parallel will pass, plus 1
  /// @param certificate_samples_max  upper limit of ExploreOptions::certificate_samples
  ViewChooser(const GridGeometry& geometry, const DepthSensor& sensor, int candidates_max = 320, int workers_max = 2,
              int certificate_samples_max = 1000, const GainSampling& sampling = {});
  [[nodiscard]] static std::size_t required_bytes(const GridGeometry& geometry, const DepthSensor& sensor,
                                                  int candidates_max = 320, int workers_max = 2,
                                                  int certificate_samples_max = 1000,
                                                  const GainSampling& sampling = {});

  /// The view with the highest gain for each second that a certified path leads to; the same calls give the same
  /// choices with any number of workers. With `after_look` it says kNothingReachable where it cannot foresee the look,
  /// and counts for nothing until adopt(). Errors: kStartBlocked when `current` is not free.
  [[nodiscard]] Result<ViewChoice> choose(const ViewContext& context, const JointVector& current,
                                          const ExploreOptions& options, RunParallel run_parallel);

  /// The arm goes for a view that was chosen before the latest look.
  /// @param unknown  voxels of the zone that are unknown now
  void adopt(const ViewGain& gain, std::size_t unknown, std::uint32_t gain_min);

  /// Tells what a look brought: call it after each look (sweep too) was integrated into the map.
  void remember_look(const ViewContext& context, const JointVector& q_rad);

  [[nodiscard]] GainModel& gain() { return gain_; }
  [[nodiscard]] const GainModel& gain() const { return gain_; }
  [[nodiscard]] GainWorker& first_worker() { return workers_.front(); }
  [[nodiscard]] Planner& planner() { return planner_; }

 private:
  /// What is left at the end is small and far apart, and few candidates find it: they are not forgotten.
  static constexpr std::size_t kKeptMax = 128;
  static constexpr int kSources = 3;  ///< of candidates, which take turns: random, nearby, aimed
  struct Candidate {
    JointVector q;
    ViewGain gain;
    double utility_per_s = 0;  ///< for the straight move, which no path is expected to beat; 0: not worth a view
    int tries = 0;
    bool free = false;
    bool exact = false;  ///< else the utility is an upper bound, which costs a fraction
  };
  /// One choice while it is made.
  struct Task {
    const ViewContext& context;
    const JointVector& current;
    const ExploreOptions& options;
    Transform<Depth, Flange> depth_T_flange;
    std::uint32_t again_min = 0;  ///< voxels made usable for motion that are worth a view now
    bool certificate = false;     ///< the large sample
    int samples = 0;              ///< in all; of each source for the certificate
    int kept = 0;                 ///< candidates of earlier choices, after those that are drawn
    [[nodiscard]] int drawn() const { return certificate ? kSources * samples : samples; }
    [[nodiscard]] int candidates() const { return drawn() + kept; }
  };

  [[nodiscard]] JointVector draw_random(const Task& task, Random& random) const;
  [[nodiscard]] JointVector draw_nearby(const Task& task, Random& random) const;
  void find_eyes(const Task& task, RunParallel run_parallel);
  [[nodiscard]] bool draw_aimed(const Task& task, int index, Random& random, JointVector& q_rad) const;
  void find_candidate(const Task& task, int index, Candidate& out) const;
  void estimate(const Task& task, Candidate& candidate, GainWorker& worker) const;
  void make_exact(const Task& task, Candidate& candidate, GainWorker& worker) const;
  void score(const Task& task, RunParallel run_parallel);
  void refine(const Task& task, RunParallel run_parallel);
  void note_progress(std::size_t unknown, std::uint32_t gain_min);
  void keep_good(const Task& task, const ViewChoice& choice, std::vector<JointVector>& kept);
  [[nodiscard]] Result<ViewChoice> search(const ViewContext& context, const JointVector& current,
                                          const ExploreOptions& options, RunParallel run_parallel);
  [[nodiscard]] static bool worthwhile(const Task& task, const Candidate& candidate);
  [[nodiscard]] static double utility_per_s(const Task& task, const ViewGain& gain, double move_s);
  [[nodiscard]] bool is_worse(int a, int b) const;
  void rank(const Task& task);
  [[nodiscard]] const Candidate* next_best(const Task& task);
  [[nodiscard]] Status plan_best(const Task& task, ViewChoice& choice);
  [[nodiscard]] bool beside_unreached(const Task& task, const JointVector& q_rad) const;
  [[nodiscard]] bool can_move(const Task& task) const;
  void certify_end(const Task& task, ViewChoice& choice) const;

  GainModel gain_;
  std::size_t unknown_ = 0;      ///< voxels that count, at the latest choice
  bool made_room_only_ = false;  ///< the latest view chosen promised nothing but usable voxels
  int in_vain_ = 0;              ///< such views in a row after which no more was known
  std::vector<GainWorker> workers_;
  std::vector<Candidate> candidates_;    ///< room for the certificate's samples
  std::vector<int> order_;               ///< a heap: the best utility, or upper bound of one, is on top
  std::vector<int> best_;                ///< those that are refined
  std::vector<int> unreached_;           ///< candidates that the planner failed on
  std::vector<JointVector> kept_;        ///< good candidates of the latest choice, which stand for the next one, too
  std::vector<JointVector> kept_ahead_;  ///< those of a choice with `after_look`, until adopt()
  std::vector<Eigen::Vector3d> eyes_m_;  ///< from which aimed candidates look
  int candidates_max_;
  Planner planner_;
  FixedVector<JointVector, 32> visited_;  ///< the latest looks
};

}  // namespace firstlook
